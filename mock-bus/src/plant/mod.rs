//! The physical truth, in SI units. It knows no bus and no protocol.

use units::Time;

/// How a servo drive acts on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Servo {
    /// No torque: the axis coasts to a stop by friction.
    Off,
    /// The position controller follows this demand (metres of encoder travel since power-on).
    Follow {
        /// Demanded encoder position in metres since the encoder was powered.
        demand_m: f64,
    },
}

/// Everything physical of one machine.
#[derive(Debug, Default)]
pub struct Plant {}

impl Plant {
    /// Lets the physics run up to `now`.
    pub fn advance(&mut self, _now: Time) {}

    /// What the drive does to axis `axis` from now on.
    pub fn set_servo(&mut self, _axis: usize, _servo: Servo) {}

    /// The encoder of `axis`: counts since its power came on.
    pub fn encoder_counts(&self, _axis: usize) -> i64 {
        0
    }

    /// Encoder speed of `axis` in counts per second.
    pub fn encoder_speed(&self, _axis: usize) -> f64 {
        0.0
    }

    /// Metres of encoder travel per count of `axis`.
    pub fn encoder_resolution_m(&self, _axis: usize) -> f64 {
        10e-9
    }

    /// Negative and positive limit switch of `axis`: true when pressed.
    pub fn limit_switches(&self, _axis: usize) -> (bool, bool) {
        (false, false)
    }

    /// The voltage at analog input `channel` now, noise included.
    pub fn analog_volts(&mut self, _channel: usize) -> f64 {
        0.0
    }

    /// The encoder of `axis` loses or gets power: its count starts again from 0.
    pub fn encoder_power(&mut self, _axis: usize, _on: bool) {}
}
