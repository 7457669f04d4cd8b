//! The demand: coordinates, ramps, what the motor is doing and why.

use units::Time;

use super::homing_run::HomingRun;
use super::mechanism::Mechanism;
use super::power::Power;
use super::{Drive, PROFILE_POSITION};
use crate::node::profile::{MotionState, Profile};
use crate::plant::Servo;

/// Why the demand is what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Activity {
    /// It rests.
    Standing,
    /// A set-point of profile position.
    Positioning,
    /// A homing run.
    Homing(HomingRun),
    /// It slows down.
    Ramp(After),
    /// Set-points of every SYNC.
    Cyclic,
    /// A constant speed.
    Velocity,
    /// The brake falls in; the torque goes then.
    Braking { until: Time, to: Power },
}

/// What comes at the end of a ramp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum After {
    /// The drive stays as it is.
    Stay,
    /// A failed homing has stopped.
    HomingError,
    /// The motor is switched off and the drive enters this state.
    Off(Power),
}

impl Drive {
    /// +1, or −1 where 0x607E inverts the position.
    pub(super) fn sign(&self) -> i64 {
        const INVERT_POSITION: i64 = 0x80;
        if self.get(0x607E) & INVERT_POSITION == 0 {
            1
        } else {
            -1
        }
    }

    /// The actual position in drive coordinates, before it is cut to 32 bits.
    pub(super) fn actual(&self, m: &impl Mechanism) -> i64 {
        self.position_of(m.counts())
    }

    /// 0x6064 at an encoder count.
    pub(super) fn position_of(&self, counts: i64) -> i64 {
        self.sign() * counts + self.offset
    }

    pub(super) fn demand(&self, now: Time) -> MotionState {
        self.profile.at(now)
    }

    /// Whether a ramp is needed before the drive does something else.
    pub(super) const fn is_moving_itself(&self) -> bool {
        match self.activity {
            Activity::Positioning | Activity::Homing(_) | Activity::Cyclic | Activity::Velocity => {
                true
            }
            Activity::Standing | Activity::Ramp(_) | Activity::Braking { .. } => false,
        }
    }

    /// Whether the servo rate is needed.
    pub(super) fn is_busy(&self, now: Time) -> bool {
        let arriving = self.power == Power::OperationEnabled
            && self.mode() == PROFILE_POSITION
            && !self.positioning.missed
            && !self.target_reached(now);
        let active = match self.activity {
            Activity::Standing | Activity::Cyclic => !self.profile.is_done(now),
            Activity::Positioning
            | Activity::Homing(_)
            | Activity::Ramp(_)
            | Activity::Braking { .. }
            | Activity::Velocity => true,
        };
        active || arriving || self.following_since.is_some()
    }

    /// Slows down from the present demand.
    pub(super) fn ramp(&mut self, now: Time, deceleration: f64, after: After) {
        self.profile = Profile::stopping(now, self.demand(now), deceleration);
        self.activity = Activity::Ramp(after);
        self.look_now();
    }

    /// No torque; the demand follows the actual position until the drive is enabled again.
    pub(super) fn switch_off(&mut self, m: &mut impl Mechanism) {
        self.servo_on = false;
        self.sent_demand = None;
        self.activity = Activity::Standing;
        self.profile = Profile::resting(self.actual(m) as f64);
        self.positioning.abandon();
        m.set_servo(Servo::Off);
    }

    /// The motor holds where it stands.
    pub(super) fn switch_on(&mut self, now: Time, m: &mut impl Mechanism) {
        let here = self.actual(m) as f64;
        self.profile = Profile::resting(here);
        self.activity = Activity::Standing;
        self.positioning.begin_at(here);
        self.servo_on = true;
        self.enabled_at = here;
        self.in_window_since = None;
        self.internal_limit = false;
        self.forget_acknowledge();
        self.run_at_speed(now);
        self.look_now();
        self.command_servo(now, m);
    }

    /// Gives the plant the demand, when it changed.
    pub(super) fn command_servo(&mut self, now: Time, m: &mut impl Mechanism) {
        if !self.servo_on {
            self.profile = Profile::resting(self.actual(m) as f64);
            return;
        }
        if matches!(self.activity, Activity::Braking { .. }) {
            return;
        }
        let demand = self.servo_demand(now, m);
        if self.sent_demand != Some(demand) {
            self.sent_demand = Some(demand);
            m.set_servo(Servo::Follow { demand });
        }
    }

    /// The demand in metres or radians, as the plant takes it.
    pub(super) fn servo_demand(&mut self, now: Time, m: &impl Mechanism) -> f64 {
        let mut position = self.demand(now).position;
        if self.config.quirks.direction_reversed {
            if position != self.enabled_at {
                self.server.count_delivery("direction_reversed");
            }
            position = 2.0 * self.enabled_at - position;
        }
        let counts = self.sign() as f64 * (position - self.offset as f64);
        counts * m.resolution()
    }

    /// What the demand's profile was for may be over.
    pub(super) fn proceed(&mut self, now: Time, m: &mut impl Mechanism) {
        match self.activity {
            Activity::Standing | Activity::Cyclic | Activity::Velocity => {}
            Activity::Homing(run) => self.home_on(now, run, m),
            Activity::Positioning if self.profile.is_done(now) => self.next_set_point(now, m),
            Activity::Ramp(after) if self.profile.is_done(now) => {
                self.activity = Activity::Standing;
                self.after_ramp(now, after, m);
            }
            Activity::Braking { until, to } if until <= now => {
                self.switch_off(m);
                self.power = to;
            }
            Activity::Positioning | Activity::Ramp(_) | Activity::Braking { .. } => {}
        }
    }

    fn after_ramp(&mut self, now: Time, after: After, m: &mut impl Mechanism) {
        match after {
            After::Stay => {}
            After::HomingError => self.homing_error_stopped(),
            After::Off(power) => self.release(now, power, m),
        }
    }

    /// Moves the zero of the coordinates: everything that is a position moves along.
    pub(super) fn shift(&mut self, counts: i64) {
        self.offset += counts;
        self.enabled_at += counts as f64;
        self.profile = self.profile.clone().shifted(counts as f64);
        self.positioning.begin_at(self.profile.end_position());
    }

    /// The nearest position inside the soft limits 0x607D. They count from the machine's zero,
    /// so they are in force only once it is known; an endless axis has none.
    pub(super) fn within_soft_limits(&self, target: f64) -> f64 {
        let low = self.server.get(0x607D, 1) as f64;
        let high = self.server.get(0x607D, 2) as f64;
        if self.homed && low < high && self.config.rotary.is_none() {
            target.clamp(low, high)
        } else {
            target
        }
    }
}
