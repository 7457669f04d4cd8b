//! The moving mass under its servo, along the encoder's scale.
//!
//! A second-order position loop sampled on a fixed grid: within one grid step the acceleration
//! is constant, so position and speed are smooth and do not depend on how often anybody looks.
//! A mass at rest costs nothing: the grid is skipped until the demand changes.
//!
//! Places are metres of a linear axis and radians of a rotary one; the loop knows no difference.
//!
//! Absent: cogging, cable force, amplifier current and its limits beyond one largest
//! acceleration. A servo with torque carries the weight.

use crate::random::Stream;
use units::Time;

use super::weight::Weight;
use crate::plant::config::MotionConfig;

/// How a servo drive acts on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Servo {
    /// No torque: the axis coasts to a stop by friction.
    Off,
    /// The position controller follows this demand.
    Follow {
        /// Demanded encoder travel since the encoder was powered, in metres or, of a rotary
        /// axis, radians.
        demand: f64,
    },
    /// The same, while the brake falls in.
    Brake {
        /// As above.
        demand: f64,
    },
}

impl Servo {
    const fn demand(self) -> Option<f64> {
        match self {
            Self::Off => None,
            Self::Follow { demand } | Self::Brake { demand } => Some(demand),
        }
    }
}

/// The servo samples and acts once in this time.
pub(in crate::plant) const GRID_NS: u64 = 250_000;
const GRID_S: f64 = GRID_NS as f64 * 1e-9;
/// A demand older than this is not extrapolated: its sender has stopped.
const DEMAND_STALE_NS: u64 = 20_000_000;

/// Mass, servo and mechanical ends, in metres or radians and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant) struct Dynamics {
    pub(in crate::plant) servo_bandwidth_hz: f64,
    pub(in crate::plant) servo_damping: f64,
    /// 1 follows a constant speed without error.
    pub(in crate::plant) feed_forward_fraction: f64,
    pub(in crate::plant) acceleration_max: f64,
    pub(in crate::plant) friction_deceleration: f64,
    /// Standard deviation of where the settled servo stands.
    pub(in crate::plant) rest_error: f64,
    /// Mechanical ends; `None` for what turns endlessly.
    pub(in crate::plant) hard_stops: Option<(f64, f64)>,
    /// Nearer and slower than this the loop is taken to have settled.
    pub(in crate::plant) settled: f64,
    pub(in crate::plant) settled_speed: f64,
    /// What pulls without torque.
    pub(in crate::plant) weight: Weight,
}

impl From<MotionConfig> for Dynamics {
    fn from(config: MotionConfig) -> Self {
        Self {
            servo_bandwidth_hz: config.servo_bandwidth_hz,
            servo_damping: config.servo_damping,
            feed_forward_fraction: config.feed_forward_fraction,
            acceleration_max: config.acceleration_max_m_per_s2,
            friction_deceleration: config.friction_deceleration_m_per_s2,
            rest_error: config.rest_error_nm * 1e-9,
            hard_stops: Some((
                config.hard_stop_min_mm * 1e-3,
                config.hard_stop_max_mm * 1e-3,
            )),
            settled: 1e-9,
            settled_speed: 2e-6,
            weight: config.weight.map_or(Weight::NONE, Weight::from),
        }
    }
}

/// What the drive asks for, and since when.
#[derive(Clone, Copy, Debug)]
struct Demand {
    servo: Servo,
    speed: f64,
    acceleration: f64,
    at: Time,
    period_s: f64,
}

impl Demand {
    /// Position, speed and acceleration `age_s` after the demand came. The speed of the last
    /// interval is that of its middle.
    fn ahead(&self, demand: f64, age_s: f64) -> (f64, f64, f64) {
        let age_s = age_s.min(self.period_s);
        let at_start = self.speed + self.acceleration * self.period_s / 2.0;
        let target = demand + at_start * age_s + self.acceleration * age_s * age_s / 2.0;
        let speed = at_start + self.acceleration * age_s;
        (target, speed, self.acceleration)
    }
}

/// Mass and servo. Positions are encoder travel; their zero is that of the scale as built.
#[derive(Clone, Debug)]
pub(in crate::plant) struct Mass {
    dynamics: Dynamics,
    natural_rad_per_s: f64,
    demand: Demand,
    position: f64,
    speed: f64,
    acceleration: f64,
    step: u64,
    resting: bool,
    blocked: bool,
    torque_off: bool,
    rest_jitter: Stream,
}

/// The motion of one grid step: from, to.
pub(in crate::plant) type Stroke = (f64, f64);

impl Mass {
    /// `rest_jitter` is where the settled servo's noise comes from.
    pub(in crate::plant) fn new(
        dynamics: impl Into<Dynamics>,
        position: f64,
        rest_jitter: Stream,
    ) -> Self {
        let dynamics = dynamics.into();
        Self {
            natural_rad_per_s: core::f64::consts::TAU * dynamics.servo_bandwidth_hz,
            dynamics,
            demand: Demand {
                servo: Servo::Off,
                speed: 0.0,
                acceleration: 0.0,
                at: Time::ZERO,
                period_s: 0.0,
            },
            position,
            speed: 0.0,
            acceleration: 0.0,
            step: 0,
            resting: true,
            blocked: false,
            torque_off: false,
            rest_jitter,
        }
    }

    pub(in crate::plant) const fn resting(&self) -> bool {
        self.resting
    }

    /// Puts the mass elsewhere, as a hand does while the power is off.
    pub(in crate::plant) fn push(&mut self, by: f64) {
        self.position += by;
        self.speed = 0.0;
        self.wake();
    }

    /// A blocked mass does not move, whatever pushes it.
    pub(in crate::plant) fn set_blocked(&mut self, blocked: bool) {
        self.blocked = blocked;
        self.wake();
    }

    /// Safe torque off: the servo has no effect.
    pub(in crate::plant) fn set_torque_off(&mut self, off: bool) {
        self.torque_off = off;
        self.wake();
    }

    pub(in crate::plant) const fn torque_off(&self) -> bool {
        self.torque_off
    }

    pub(in crate::plant) fn set_servo(&mut self, now: Time, servo: Servo) {
        let closed = !matches!(servo, Servo::Follow { .. });
        self.dynamics.weight.ask_brake(now, closed);
        if servo == self.demand.servo && now > self.demand.at && self.resting {
            self.demand.at = now;
            self.demand.speed = 0.0;
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
            speed: 0.0,
            acceleration: 0.0,
            at: now,
            period_s: 0.0,
        };
        let (Some(before), Some(after)) = (old.servo.demand(), servo.demand()) else {
            return standing;
        };
        if age == 0 {
            return Demand { servo, ..old };
        }
        if age > DEMAND_STALE_NS {
            return standing;
        }
        let period_s = age as f64 * 1e-9;
        let speed = (after - before) / period_s;
        Demand {
            speed,
            acceleration: (speed - old.speed) / period_s,
            period_s,
            ..standing
        }
    }

    fn wake(&mut self) {
        self.resting = false;
    }

    /// Jumps over the grid steps up to `now` while at rest.
    pub(in crate::plant) fn skip_to(&mut self, now: Time) {
        self.step = now.nanos() / GRID_NS;
    }

    /// Runs the next grid step if it ends by `now`; returns where it led from and to.
    /// `offset` is where the encoder's count 0 lies on its scale.
    pub(in crate::plant) fn step_until(&mut self, now: Time, offset: f64) -> Option<Stroke> {
        let end = (self.step + 1) * GRID_NS;
        if self.resting || end > now.nanos() {
            return None;
        }
        let from = self.position;
        self.position = from + self.speed * GRID_S + self.acceleration * GRID_S * GRID_S / 2.0;
        self.speed += self.acceleration * GRID_S;
        self.step += 1;
        self.stop_at_the_ends();
        self.control(Time(end), offset);
        Some((from, self.position))
    }

    fn stop_at_the_ends(&mut self) {
        let inside = match self.dynamics.hard_stops {
            Some((low, high)) => self.position.clamp(low, high),
            None => self.position,
        };
        if inside != self.position || self.blocked {
            self.position = inside;
            self.speed = 0.0;
        }
    }

    /// Chooses the acceleration of the step that begins `now`.
    fn control(&mut self, now: Time, offset: f64) {
        let servo = if self.torque_off {
            Servo::Off
        } else {
            self.demand.servo
        };
        let braked = self.dynamics.weight.is_braked(now);
        match servo {
            _ if braked => self.brake(matches!(servo, Servo::Follow { .. })),
            Servo::Off if self.dynamics.weight.acceleration != 0.0 => self.fall(),
            Servo::Off => self.coast(),
            Servo::Follow { demand } | Servo::Brake { demand } => {
                self.follow(now, demand + offset);
            }
        }
        if self.blocked {
            self.acceleration = 0.0;
        }
    }

    fn coast(&mut self) {
        let friction = self.dynamics.friction_deceleration;
        let lost = friction * GRID_S;
        if self.speed.abs() <= lost {
            self.speed = 0.0;
            self.acceleration = 0.0;
            self.resting = true;
        } else {
            self.acceleration = -friction * self.speed.signum();
        }
    }

    /// The brake holds, whatever the servo does; it will open again where that has torque.
    fn brake(&mut self, opens: bool) {
        let deceleration = self.dynamics.acceleration_max;
        if self.speed.abs() <= deceleration * GRID_S {
            self.speed = 0.0;
            self.acceleration = 0.0;
            self.resting = !opens;
        } else {
            self.acceleration = -deceleration * self.speed.signum();
        }
    }

    /// The weight against the friction. At an end it rests.
    fn fall(&mut self) {
        let weight = self.dynamics.weight.acceleration;
        let friction = self.dynamics.friction_deceleration;
        let at_end = self.dynamics.hard_stops.is_some_and(|(low, high)| {
            (weight < 0.0 && self.position <= low) || (weight > 0.0 && self.position >= high)
        });
        let slow = self.speed.abs() <= friction * GRID_S;
        if slow && (at_end || weight.abs() <= friction) {
            self.speed = 0.0;
            self.acceleration = 0.0;
            // A brake that still falls in has nothing to hold.
            self.resting = true;
            return;
        }
        let way = if slow { weight } else { self.speed };
        self.acceleration = weight - friction * way.signum();
    }

    fn follow(&mut self, now: Time, demand: f64) {
        let age_s = (now - self.demand.at).as_secs_f64();
        // Between two demands the servo interpolates on; a silent sender's demand stands still.
        let live = age_s <= 1.5 * self.demand.period_s;
        let (target, speed, acceleration) = if live {
            self.demand.ahead(demand, age_s)
        } else {
            (demand, 0.0, 0.0)
        };
        let error = target - self.position;
        let slow = self.speed.abs() < self.dynamics.settled_speed;
        if speed == 0.0 && slow && error.abs() < self.dynamics.settled {
            return self.settle(target);
        }
        let fed = self.dynamics.feed_forward_fraction;
        let w = self.natural_rad_per_s;
        let wanted = w * w * error
            + 2.0 * self.dynamics.servo_damping * w * (fed * speed - self.speed)
            + fed * acceleration;
        let limit = self.dynamics.acceleration_max;
        self.acceleration = wanted.clamp(-limit, limit);
    }

    /// At rest the integrator leaves the mass somewhere within about a count.
    fn settle(&mut self, target: f64) {
        let jitter = self.dynamics.rest_error * self.rest_jitter.gaussian();
        self.position = target + jitter;
        self.speed = 0.0;
        self.acceleration = 0.0;
        self.resting = true;
    }

    /// Where the mass is `now`, at most one grid step after the last one.
    pub(in crate::plant) fn position_at(&self, now: Time) -> f64 {
        if self.resting {
            return self.position;
        }
        let s = (now.nanos().saturating_sub(self.step * GRID_NS)) as f64 * 1e-9;
        self.position + self.speed * s + self.acceleration * s * s / 2.0
    }

    pub(in crate::plant) fn speed_at(&self, now: Time) -> f64 {
        if self.resting {
            return 0.0;
        }
        let s = (now.nanos().saturating_sub(self.step * GRID_NS)) as f64 * 1e-9;
        self.speed + self.acceleration * s
    }
}
