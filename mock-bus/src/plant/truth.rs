//! What no device knows: for tests and reports that judge.

use units::{Approach, Celsius, Metres};

use super::stage::Stage;
use super::{Environment, Plant, Travel};

/// A look at the truth behind all sensors.
///
/// # Panics
/// The questions about a linear stage panic on a machine that has none: a test that took a missing
/// position for 0 would test nothing.
#[derive(Clone, Copy, Debug)]
pub struct Truth<'a> {
    pub(super) plant: &'a Plant,
}

impl<'a> Truth<'a> {
    pub(super) const fn new(plant: &'a Plant) -> Self {
        Self { plant }
    }

    /// The stage's true position; 0 is the true origin, where the undrifted Hall curves have
    /// their centre of symmetry.
    pub fn position(&self) -> Metres {
        self.stage();
        self.plant.true_position()
    }

    /// Where the scale is read, from its own zero, without quantisation.
    pub fn scale_position(&self) -> Metres {
        Metres(self.stage().scale_position_m(self.plant.now))
    }

    /// The scale position of the encoder's present count 0 (where it was last powered on).
    pub fn count_zero(&self) -> Metres {
        Metres(self.stage().count_zero_m())
    }

    /// True minus scale position at a scale position, reached in a direction: the systematic
    /// part, without the error of a single stop.
    pub fn deviation(&self, scale_position: Metres, approach: Approach) -> Metres {
        self.systematic(scale_position, approach.sign())
    }

    /// The same between both directions.
    pub fn mean_deviation(&self, scale_position: Metres) -> Metres {
        self.systematic(scale_position, 0.0)
    }

    fn systematic(&self, scale_position: Metres, sign: f64) -> Metres {
        let Celsius(stage_c) = self.environment().stage_temperature;
        let scale_m = scale_position.value();
        Metres(self.stage().systematic_deviation_m(scale_m, sign, stage_c))
    }

    /// The true motion of `axis`; `None` where there is no such axis.
    pub fn travel(&self, axis: usize) -> Option<Travel> {
        let actuator = self.plant.machine.actuator(axis)?;
        Some(actuator.train().travel(self.plant.now))
    }

    fn stage(&self) -> &Stage {
        let stage = self.plant.machine.of::<Stage>();
        stage.expect("the judged machine has a linear stage")
    }

    /// Air and machine as they are.
    pub fn environment(&self) -> Environment {
        self.plant.environment()
    }

    /// Path in air between optic and reflector when the stage is at its true origin.
    pub const fn dead_path(&self) -> Metres {
        self.plant.interferometer.dead_path()
    }
}
