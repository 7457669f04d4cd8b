//! Cyclic synchronous position: a set-point with every SYNC (CiA 402-2, mode 8).
//!
//! At SYNC the drive takes 0x607A + 0x60B0 and goes there in a straight line over one
//! interpolation period (0x60C2), which its servo is told in the steps of its own clock. The speed
//! is limited to 0x607F, positions to 0x607D; what the limited demand is short of counts as
//! following error. A drive that has waited for SYNC for too long (two periods and half a period of
//! grace, when nothing else is configured) faults. With 0x60C2 at 0, as at power-on, nothing is
//! interpolated, limited or watched: every set-point is a step.
//!
//! Absent: velocity and torque offsets (0x60B1, 0x60B2), 0x60C5, extrapolation when a set-point
//! is missing: the demand then stands at the last one.

use std::time::Duration;

use units::Time;
use units::portable::powi;
use wire::canopen::emcy::EmergencyCode;
use wire::cia402::Controlword;

use super::mechanism::Mechanism;
use super::motion::{Activity, After};
use super::power::Power;
use super::{CYCLIC_POSITION, Drive};
use crate::node::canopen_server::register;
use crate::node::profile::Profile;

/// "Sync controller" (CiA 402-2, error codes).
const SYNC_LOST: EmergencyCode = EmergencyCode(0x8700);

/// What the drive remembers from one SYNC to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cyclic {
    /// When a SYNC is missed for good.
    pub(super) sync_due: Time,
    /// What the demand, limited in speed, is short of the set-point.
    pub(super) shortfall: f64,
}

impl Cyclic {
    /// No set-point is followed.
    pub(super) const IDLE: Self = Self {
        sync_due: Time::NEVER,
        shortfall: 0.0,
    };
}

impl Drive {
    pub(super) fn on_sync(&mut self, now: Time, m: &mut impl Mechanism) {
        let enabled = self.power == Power::OperationEnabled && self.servo_on;
        let ramping = matches!(self.activity, Activity::Ramp(_));
        if !enabled || ramping || self.mode() != CYCLIC_POSITION || self.is_halted() {
            return;
        }
        let wanted = self.unwrapped(self.get(0x607A), m) + self.get(0x60B0) as f64;
        let from = self.demand(now).position;
        let target = match self.within_soft_limits(wanted) {
            outward if self.is_limited(outward - from, m) => from,
            target => target,
        };
        let period = self.interpolation_time();
        let reached = self.within_speed(from, target, period);
        self.internal_limit = target != wanted || reached != target;
        self.profile = Profile::interpolating(now, from, reached, period);
        self.activity = Activity::Cyclic;
        self.cyclic = Cyclic {
            sync_due: self.sync_due(now, period),
            shortfall: target - reached,
        };
        // The position loop has a clock of its own: told at both moments, which may lie a
        // microsecond apart, the servo would take one of them for a demand that stands. A round
        // that is due now is not put off either.
        let round = Duration::from_micros(self.config.servo_period_us.max(1));
        self.servo_due = self.servo_due.min(now + round);
    }

    fn is_halted(&self) -> bool {
        self.controlword.contains(Controlword::HALT)
    }

    /// How far towards `target` the speed limit lets the demand go in one period.
    fn within_speed(&self, from: f64, target: f64, period: Duration) -> f64 {
        if period.is_zero() {
            return target;
        }
        // A set-point is rounded to a count, so that a constant speed at the limit is one too.
        let reach = self.speed(0x607F, 0) * period.as_secs_f64() + 1.0;
        target.clamp(from - reach, from + reach)
    }

    /// 0x60C2: units · 10^exponent seconds.
    fn interpolation_time(&self) -> Duration {
        let units = self.server.get(0x60C2, 1) as f64;
        let exponent = self.server.get(0x60C2, 2) as i32;
        Duration::from_secs_f64(units * powi(10.0, exponent))
    }

    fn sync_due(&self, now: Time, period: Duration) -> Time {
        let seconds = period.as_secs_f64() * self.config.sync_lost_after_periods;
        match Duration::try_from_secs_f64(seconds) {
            Ok(span) if !span.is_zero() => now + span,
            _ => Time::NEVER,
        }
    }

    /// SYNC fails the drive only while it follows set-points.
    pub(super) fn watch_sync(&mut self, now: Time, m: &mut impl Mechanism) {
        if self.activity != Activity::Cyclic {
            self.cyclic = Cyclic::IDLE;
        } else if self.cyclic.sync_due <= now {
            self.cyclic = Cyclic::IDLE;
            self.fail(now, SYNC_LOST, register::COMMUNICATION, m);
        }
    }

    /// A new controlword in operation enabled: halt slows down, its end lets the next SYNC's
    /// set-point through.
    pub(super) fn control_cyclic(&mut self, now: Time, old: Controlword, new: Controlword) {
        let rose = new.contains(Controlword::HALT) && !old.contains(Controlword::HALT);
        if rose && self.is_moving_itself() {
            let option = self.get(0x605D);
            let deceleration = self.acceleration(if option == 2 { 0x6085 } else { 0x6084 });
            self.ramp(now, deceleration, After::Stay);
        }
    }
}
