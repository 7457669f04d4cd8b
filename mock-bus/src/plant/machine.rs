//! Which machine stands here, and what its drives, faults and mains can do to it.

use core::any::Any;

use units::Time;

use super::config::PlantConfig;
use super::mechanics::Mechanics;
use super::parts::actuator::Actuator;
use super::stage::Stage;

/// The mechanics of one machine.
#[derive(Debug)]
pub(super) struct Machine(Box<dyn Mechanics>);

impl Clone for Machine {
    fn clone(&self) -> Self {
        Self(self.0.boxed())
    }
}

impl Machine {
    pub(super) fn new(config: &PlantConfig, seed: u64) -> Self {
        let other = config.others().into_iter().flatten().next();
        Self(match other {
            Some(section) => section.build(&config.interferometer, seed),
            None => Box::new(Stage::new(config.stage.clone(), seed)),
        })
    }

    pub(super) fn advance(&mut self, now: Time) {
        self.0.advance(now);
    }

    pub(super) fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        self.0.actuator(number)
    }

    pub(super) fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        self.0.actuator_mut(number)
    }

    /// One circuit takes the torque away from every actuator.
    pub(super) fn set_torque_off(&mut self, off: bool) {
        let mut number = 0;
        while let Some(actuator) = self.actuator_mut(number) {
            actuator.set_torque_off(off);
            number += 1;
        }
    }

    /// The mains is off: nobody holds the machine.
    pub(super) fn power_cycle(&mut self) {
        self.0.power_cycle();
    }

    /// The mechanics, where they are of that kind.
    pub(super) fn of<M: Mechanics>(&self) -> Option<&M> {
        let mechanics: &dyn Any = &*self.0;
        mechanics.downcast_ref()
    }

    /// The same, to be moved by hand and spoilt.
    pub(super) fn of_mut<M: Mechanics>(&mut self) -> Option<&mut M> {
        let mechanics: &mut dyn Any = &mut *self.0;
        mechanics.downcast_mut()
    }
}
