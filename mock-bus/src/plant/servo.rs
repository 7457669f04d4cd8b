//! The moving mass under its servo, along the encoder's scale.
//!
//! A second-order position loop sampled on a fixed grid: within one grid step the acceleration
//! is constant, so position and speed are smooth and do not depend on how often anybody looks.
//! A mass at rest costs nothing: the grid is skipped until the demand changes.
//!
//! Absent: cogging, cable force, amplifier current and its limits beyond one largest
//! acceleration.

use crate::random::Stream;
use units::Time;

use super::Servo;
use super::config::MotionConfig;

/// The servo samples and acts once in this time.
pub(super) const GRID_NS: u64 = 250_000;
const GRID_S: f64 = GRID_NS as f64 * 1e-9;
/// A demand older than this is not extrapolated: its sender has stopped.
const DEMAND_STALE_NS: u64 = 20_000_000;
/// Nearer and slower than this the loop is taken to have settled.
const SETTLED_M: f64 = 1e-9;
const SETTLED_M_PER_S: f64 = 2e-6;

/// What the drive asks for, and since when.
#[derive(Clone, Copy, Debug)]
struct Demand {
    servo: Servo,
    speed_m_per_s: f64,
    acceleration: f64,
    at: Time,
    period_s: f64,
}

impl Demand {
    /// Position, speed and acceleration `age_s` after the demand came. The speed of the last
    /// interval is that of its middle.
    fn ahead(&self, demand_m: f64, age_s: f64) -> (f64, f64, f64) {
        let age_s = age_s.min(self.period_s);
        let at_start = self.speed_m_per_s + self.acceleration * self.period_s / 2.0;
        let target_m = demand_m + at_start * age_s + self.acceleration * age_s * age_s / 2.0;
        let speed = at_start + self.acceleration * age_s;
        (target_m, speed, self.acceleration)
    }
}

/// Mass and servo. Positions are encoder travel, 0 where the Hall zero was when built.
#[derive(Clone, Debug)]
pub(super) struct Mass {
    config: MotionConfig,
    natural_rad_per_s: f64,
    demand: Demand,
    position_m: f64,
    speed_m_per_s: f64,
    acceleration: f64,
    step: u64,
    resting: bool,
    blocked: bool,
    torque_off: bool,
    rest_jitter: Stream,
}

/// The motion of one grid step: from, to.
pub(super) type Stroke = (f64, f64);

impl Mass {
    /// `rest_jitter` is where the settled servo's noise comes from.
    pub(super) fn new(config: MotionConfig, position_m: f64, rest_jitter: Stream) -> Self {
        Self {
            natural_rad_per_s: core::f64::consts::TAU * config.servo_bandwidth_hz,
            config,
            demand: Demand {
                servo: Servo::Off,
                speed_m_per_s: 0.0,
                acceleration: 0.0,
                at: Time::ZERO,
                period_s: 0.0,
            },
            position_m,
            speed_m_per_s: 0.0,
            acceleration: 0.0,
            step: 0,
            resting: true,
            blocked: false,
            torque_off: false,
            rest_jitter,
        }
    }

    pub(super) const fn resting(&self) -> bool {
        self.resting
    }

    /// Puts the mass elsewhere, as a hand does while the power is off.
    pub(super) fn push(&mut self, by_m: f64) {
        self.position_m += by_m;
        self.speed_m_per_s = 0.0;
        self.wake();
    }

    /// A blocked mass does not move, whatever pushes it.
    pub(super) fn set_blocked(&mut self, blocked: bool) {
        self.blocked = blocked;
        self.wake();
    }

    /// Safe torque off: the servo has no effect.
    pub(super) fn set_torque_off(&mut self, off: bool) {
        self.torque_off = off;
        self.wake();
    }

    pub(super) const fn torque_off(&self) -> bool {
        self.torque_off
    }

    pub(super) fn set_servo(&mut self, now: Time, servo: Servo) {
        if servo == self.demand.servo && now > self.demand.at && self.resting {
            self.demand.at = now;
            self.demand.speed_m_per_s = 0.0;
            return;
        }
        self.demand = self.next_demand(now, servo);
        self.wake();
    }

    /// The demand's own speed and acceleration, from this and the last ones, are what the
    /// servo feeds forward.
    fn next_demand(&self, now: Time, servo: Servo) -> Demand {
        let old = self.demand;
        let age = now.nanos().saturating_sub(old.at.nanos());
        let standing = Demand {
            servo,
            speed_m_per_s: 0.0,
            acceleration: 0.0,
            at: now,
            period_s: 0.0,
        };
        let (Servo::Follow { demand_m: before }, Servo::Follow { demand_m: after }) =
            (old.servo, servo)
        else {
            return standing;
        };
        if age == 0 {
            return Demand { servo, ..old };
        }
        if age > DEMAND_STALE_NS {
            return standing;
        }
        let period_s = age as f64 * 1e-9;
        let speed_m_per_s = (after - before) / period_s;
        Demand {
            speed_m_per_s,
            acceleration: (speed_m_per_s - old.speed_m_per_s) / period_s,
            period_s,
            ..standing
        }
    }

    fn wake(&mut self) {
        self.resting = false;
    }

    /// Jumps over the grid steps up to `now` while at rest.
    pub(super) fn skip_to(&mut self, now: Time) {
        self.step = now.nanos() / GRID_NS;
    }

    /// Runs the next grid step if it ends by `now`; returns where it led from and to.
    /// `offset_m` is where the encoder's count 0 lies on its scale.
    pub(super) fn step_until(&mut self, now: Time, offset_m: f64) -> Option<Stroke> {
        let end = (self.step + 1) * GRID_NS;
        if self.resting || end > now.nanos() {
            return None;
        }
        let from = self.position_m;
        self.position_m =
            from + self.speed_m_per_s * GRID_S + self.acceleration * GRID_S * GRID_S / 2.0;
        self.speed_m_per_s += self.acceleration * GRID_S;
        self.step += 1;
        self.stop_at_the_ends();
        self.control(Time(end), offset_m);
        Some((from, self.position_m))
    }

    fn stop_at_the_ends(&mut self) {
        let inside = self.position_m.clamp(
            self.config.hard_stop_min_mm * 1e-3,
            self.config.hard_stop_max_mm * 1e-3,
        );
        if inside != self.position_m || self.blocked {
            self.position_m = inside;
            self.speed_m_per_s = 0.0;
        }
    }

    /// Chooses the acceleration of the step that begins `now`.
    fn control(&mut self, now: Time, offset_m: f64) {
        let servo = if self.torque_off {
            Servo::Off
        } else {
            self.demand.servo
        };
        match servo {
            Servo::Off => self.coast(),
            Servo::Follow { demand_m } => self.follow(now, demand_m + offset_m),
        }
        if self.blocked {
            self.acceleration = 0.0;
        }
    }

    fn coast(&mut self) {
        let friction = self.config.friction_deceleration_m_per_s2;
        let lost = friction * GRID_S;
        if self.speed_m_per_s.abs() <= lost {
            self.speed_m_per_s = 0.0;
            self.acceleration = 0.0;
            self.resting = true;
        } else {
            self.acceleration = -friction * self.speed_m_per_s.signum();
        }
    }

    fn follow(&mut self, now: Time, demand_m: f64) {
        let age_s = (now - self.demand.at).as_secs_f64();
        // Between two demands the servo interpolates on; a silent sender's demand stands still.
        let live = age_s <= 1.5 * self.demand.period_s;
        let (target_m, speed, acceleration) = if live {
            self.demand.ahead(demand_m, age_s)
        } else {
            (demand_m, 0.0, 0.0)
        };
        let error_m = target_m - self.position_m;
        let slow = self.speed_m_per_s.abs() < SETTLED_M_PER_S;
        if speed == 0.0 && slow && error_m.abs() < SETTLED_M {
            return self.settle(target_m);
        }
        let fed = self.config.feed_forward_fraction;
        let w = self.natural_rad_per_s;
        let wanted = w * w * error_m
            + 2.0 * self.config.servo_damping * w * (fed * speed - self.speed_m_per_s)
            + fed * acceleration;
        let limit = self.config.acceleration_max_m_per_s2;
        self.acceleration = wanted.clamp(-limit, limit);
    }

    /// At rest the integrator leaves the mass somewhere within about a count.
    fn settle(&mut self, target_m: f64) {
        let jitter_m = self.config.rest_error_nm * 1e-9 * self.rest_jitter.gaussian();
        self.position_m = target_m + jitter_m;
        self.speed_m_per_s = 0.0;
        self.acceleration = 0.0;
        self.resting = true;
    }

    /// Where the mass is `now`, at most one grid step after the last one.
    pub(super) fn position_at(&self, now: Time) -> f64 {
        if self.resting {
            return self.position_m;
        }
        let s = (now.nanos().saturating_sub(self.step * GRID_NS)) as f64 * 1e-9;
        self.position_m + self.speed_m_per_s * s + self.acceleration * s * s / 2.0
    }

    pub(super) fn speed_at(&self, now: Time) -> f64 {
        if self.resting {
            return 0.0;
        }
        let s = (now.nanos().saturating_sub(self.step * GRID_NS)) as f64 * 1e-9;
        self.speed_m_per_s + self.acceleration * s
    }
}
