//! What the drive's power stage and encoder are wired to.

use crate::plant::{IndexPulse, Plant, Servo};

/// One axis, seen from its drive.
pub(super) trait Mechanism {
    /// Encoder counts since its power came on.
    fn counts(&self) -> i64;
    /// Counts per second.
    fn speed(&self) -> f64;
    /// Metres per count.
    fn resolution_m(&self) -> f64;
    /// The encoder's last index pulse since its power came on.
    fn index_pulse(&self) -> Option<IndexPulse>;
    /// Negative and positive limit switch.
    fn limit_switches(&self) -> (bool, bool);
    fn set_servo(&mut self, servo: Servo);
    fn encoder_power(&mut self, on: bool);
}

/// The plant's axis.
pub(super) struct PlantAxis<'a> {
    pub(super) plant: &'a mut Plant,
    pub(super) axis: usize,
}

impl Mechanism for PlantAxis<'_> {
    fn counts(&self) -> i64 {
        self.plant.encoder_counts(self.axis)
    }

    fn speed(&self) -> f64 {
        self.plant.encoder_speed(self.axis)
    }

    fn resolution_m(&self) -> f64 {
        self.plant.encoder_resolution_m(self.axis)
    }

    fn index_pulse(&self) -> Option<IndexPulse> {
        self.plant.index_pulse(self.axis)
    }

    fn limit_switches(&self) -> (bool, bool) {
        self.plant.limit_switches(self.axis)
    }

    fn set_servo(&mut self, servo: Servo) {
        self.plant.set_servo(self.axis, servo);
    }

    fn encoder_power(&mut self, on: bool) {
        self.plant.encoder_power(self.axis, on);
    }
}
