//! Whether the sensors and the axis do what they should while the search goes on.

use units::{Metres, Time, Volts};

use super::Sample;
use crate::hall_zero::{Reason, Sensor, SensorFault, Settings};

/// Consecutive samples at a rail that stop the search at once.
const RAIL_SAMPLES: u32 = 3;
/// Bit-identical samples that are a stuck ADC when the axis moved [`STUCK_TRAVEL`] meanwhile.
const STUCK_SAMPLES_MOVING: u32 = 20;
const STUCK_TRAVEL: f64 = 100e-6;

/// Bit-identical values and rails of one sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    sensor: Sensor,
    last: f64,
    identical: u32,
    low: f64,
    high: f64,
    at_rail: u32,
}

impl Watch {
    pub(super) fn new(sensor: Sensor) -> Self {
        Self {
            sensor,
            last: f64::NAN,
            identical: 0,
            low: 0.0,
            high: 0.0,
            at_rail: 0,
        }
    }

    pub(super) fn observe(&mut self, v: f64, x: f64, settings: &Settings) -> Option<SensorFault> {
        if v == self.last {
            self.identical += 1;
            (self.low, self.high) = (self.low.min(x), self.high.max(x));
        } else {
            (self.last, self.identical, self.low, self.high) = (v, 1, x, x);
        }
        let rail = v <= settings.rail_low.value() || v >= settings.rail_high.value();
        self.at_rail = if rail { self.at_rail + 1 } else { 0 };
        let (sensor, voltage) = (self.sensor, Volts(v));
        if self.at_rail >= RAIL_SAMPLES {
            return Some(SensorFault::Saturated { sensor, voltage });
        }
        let moved = self.identical >= STUCK_SAMPLES_MOVING && self.high - self.low > STUCK_TRAVEL;
        let many =
            settings.noise > Volts::ZERO && self.identical as usize >= settings.stuck_samples;
        (moved || many).then_some(SensorFault::Stuck { sensor, voltage })
    }
}

/// A wished motion: its direction, and from where and when it is watched.
#[derive(Clone, Copy, Debug)]
struct Motion {
    direction: f64,
    from: Metres,
    since: Time,
}

/// Watches that wished motions happen, and in their direction.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionWatch(Option<Motion>);

impl MotionWatch {
    /// No motion is wished.
    pub(super) fn stand(&mut self) {
        self.0 = None;
    }

    /// What is wrong with the motion towards `to`, if anything.
    pub(super) fn observe(
        &mut self,
        sample: &Sample,
        to: Metres,
        settings: &Settings,
    ) -> Option<Reason> {
        let direction = (to - sample.position).value().signum();
        let fresh = Motion {
            direction,
            from: sample.position,
            since: sample.at,
        };
        let watched = match self.0 {
            Some(motion) if motion.direction == direction => motion,
            _ => *self.0.insert(fresh),
        };
        let moved = (sample.position - watched.from).value() * direction;
        if moved < -settings.wrong_way.value() {
            return Some(Reason::WrongDirection);
        }
        if moved > settings.arrival.value() {
            self.0 = Some(fresh);
        } else if sample.at.since(watched.since) > settings.stall_limit {
            return Some(Reason::NotMoving);
        }
        None
    }
}
