//! The drive's own brake sequence: the brake falls in before the torque goes.
//!
//! It runs at every end of operation that is in order: "disable operation", "shutdown", a quick stop
//! or a fault reaction that ends in an off state. "Disable voltage" and safe torque off take the
//! torque away at once; the brake falls in after that.

use std::time::Duration;

use units::Time;

use super::Drive;
use super::mechanism::Mechanism;
use super::motion::Activity;
use super::power::Power;
use crate::plant::Servo;

impl Drive {
    /// Takes the torque away in order, and enters `to`.
    pub(super) fn release(&mut self, now: Time, to: Power, m: &mut impl Mechanism) {
        let engages_in = Duration::from_millis(self.config.brake_engage_ms);
        if engages_in.is_zero() || !self.servo_on {
            self.switch_off(m);
            self.power = to;
            return;
        }
        let demand = self.servo_demand(now, m);
        m.set_servo(Servo::Brake { demand });
        // Whatever moves the demand again has to open the brake.
        self.sent_demand = None;
        let until = now + engages_in;
        self.activity = Activity::Braking { until, to };
        self.look_now();
    }

    /// "Enable" while the brake falls in: the drive stays enabled.
    pub(super) fn open_brake(&mut self, now: Time, m: &mut impl Mechanism) {
        self.activity = Activity::Standing;
        self.command_servo(now, m);
    }
}
