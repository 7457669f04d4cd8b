//! What a drive, a fault and the mains can do to one driven direction.

use units::Time;

use super::drive_train::DriveTrain;
use super::pulse::{IndexPulse, ProbeEdge};
use super::servo::Servo;

/// One driven direction as its drive is wired to it.
pub(in crate::plant) trait Actuator {
    fn train(&self) -> &DriveTrain;
    fn train_mut(&mut self) -> &mut DriveTrain;
    /// What the drive does to it from `now` on.
    fn set_servo(&mut self, now: Time, servo: Servo) {
        self.train_mut().set_servo(now, servo);
    }
    /// The encoder's counts since its power came on.
    fn counts(&self, now: Time) -> i64 {
        self.train().counts(now)
    }
    fn counts_per_s(&self, now: Time) -> f64 {
        self.train().counts_per_s(now)
    }
    /// Metres or radians of encoder travel per count.
    fn resolution(&self) -> f64 {
        self.train().encoder.resolution()
    }
    fn encoder_power(&mut self, on: bool) {
        self.train_mut().encoder_power(on);
    }
    /// The encoder's last index pulse since its power came on; `None` before, and where the
    /// encoder has no index.
    fn index_pulse(&self) -> Option<IndexPulse> {
        self.train().index_pulse()
    }
    /// The next edge at the drive's fast input by `now`; `None` also where nothing is wired to it.
    fn probe_edge(&mut self, _now: Time) -> Option<ProbeEdge> {
        None
    }
    /// Negative and positive limit switch: true when pressed.
    fn limit_switches(&self) -> (bool, bool) {
        self.train().limit_switches()
    }
    /// Holds a limit switch in a state, or (with `None`) leaves it to the mechanics.
    fn force_switch(&mut self, positive: bool, forced: Option<bool>) {
        self.train_mut().force_switch(positive, forced);
    }
    /// Holds it fast, or lets it go.
    fn set_blocked(&mut self, blocked: bool) {
        self.train_mut().mass.set_blocked(blocked);
    }
    fn set_torque_off(&mut self, off: bool) {
        self.train_mut().mass.set_torque_off(off);
    }
    fn torque_off(&self) -> bool {
        self.train().mass.torque_off()
    }
}
