//! What the mechanics of any machine do, and how a configuration asks for them.

use core::any::Any;
use core::fmt::Debug;

use units::Time;

use super::config::InterferometerConfig;
use super::parts::actuator::Actuator;
use crate::config::error::ConfigError;

/// A list of actuators, each with its own servo, encoder and switches, and whatever they move
/// together. Drives know actuators by number, from 0.
pub(in crate::plant) trait Mechanics: Any + Debug + Send {
    fn advance(&mut self, now: Time);

    fn actuator(&self, number: usize) -> Option<&dyn Actuator>;

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator>;

    /// The mains is off: nobody holds the machine.
    fn power_cycle(&mut self);

    /// Another one in the same state.
    fn boxed(&self) -> Box<dyn Mechanics>;
}

/// The part of a configuration that puts another machine in place of the linear stage.
pub(in crate::plant) trait Section {
    /// What makes no such machine.
    ///
    /// # Errors
    /// Which number no such machine has.
    fn check(&self) -> Result<(), ConfigError>;

    /// Travel of one encoder count, where axes of the machine have one.
    fn resolution_nm(&self) -> Option<f64> {
        None
    }

    /// The machine, which the interferometer that stands beside it may look at.
    fn build(&self, interferometer: &InterferometerConfig, seed: u64) -> Box<dyn Mechanics>;
}
