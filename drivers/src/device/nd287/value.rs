//! Values in metres, and which can follow one another.

use units::portable::powi;
use units::{Metres, MetresPerSecond, Time};
use wire::nd287::{MeasuredValue, Unit};

const METRES_PER_MILLIMETRE: f64 = 1e-3;
const METRES_PER_INCH: f64 = 25.4e-3;
/// A value that did not move may differ by its noise.
const JUMP_FREE: Metres = Metres(1e-6);

/// A value that can be believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Good {
    pub(super) asked: Time,
    pub(super) position: Metres,
    /// What its last digit is worth.
    digit: Metres,
}

impl Good {
    /// Of a length.
    pub(super) fn of(asked: Time, value: &MeasuredValue) -> Self {
        let unit_m = match value.unit {
            Unit::Inch => METRES_PER_INCH,
            Unit::Millimetre | Unit::Fault | Unit::Other(_) => METRES_PER_MILLIMETRE,
        };
        let digit = powi(10.0, -(value.decimals as i32));
        Self {
            asked,
            position: Metres(unit_m * value.value),
            digit: Metres(unit_m * digit),
        }
    }

    /// Whether a stage of that speed cannot have come here from `before`.
    pub(super) fn is_impossible_after(&self, before: &Self, speed_max: MetresPerSecond) -> bool {
        let seconds = self.asked.since(before.asked).as_secs_f64();
        let possible = speed_max.value() * seconds;
        let unsure = JUMP_FREE + self.digit * 2.0;
        (self.position - before.position).abs().value() > possible + unsure.value()
    }
}
