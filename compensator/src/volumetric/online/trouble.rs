//! What can be wrong with what a machine sees of itself.

use core::num::NonZeroU32;
use core::time::Duration;

use units::{Metres, Volts};

use super::RollError;

/// What is wrong with a detector or channel at this moment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Trouble {
    /// Too little light.
    #[error("the beam is blocked: intensity {seen}, at least {limit} expected")]
    Blocked {
        /// Sum of the channels.
        seen: Volts,
        /// The least expected.
        limit: Volts,
    },
    /// Too much light, altogether or on one channel.
    #[error("the detector is saturated: {seen}, below {limit} expected")]
    Saturated {
        /// The channel or the sum.
        seen: Volts,
        /// The most expected.
        limit: Volts,
    },
    /// The converter of a channel cannot show more.
    #[error("a channel is at the end of its converter's range, {seen}")]
    AtEnd {
        /// What it shows.
        seen: Volts,
    },
    /// The same again and again, where noise must be.
    #[error("its input {} is stuck: exactly {seen:e} (SI units) {samples} times in a row",
        input + 1)]
    Stuck {
        /// Which of the detector's inputs, from 0.
        input: usize,
        /// What it shows, in SI units.
        seen: f64,
        /// How often in a row that is no coincidence.
        samples: NonZeroU32,
    },
    /// Nothing new for too long.
    #[error("the last sample is {:.3} s old, at most {:.3} s expected",
        seen.as_secs_f64(), limit.as_secs_f64())]
    Stale {
        /// Its age; the longest there is when there never was one.
        seen: Duration,
        /// The oldest accepted.
        limit: Duration,
    },
    /// The beam is beside the calibrated part of the detector.
    #[error(
        "the beam is outside the calibrated field: ratio {seen:.3}, calibrated from {low:.3} to \
         {high:.3}"
    )]
    Beside {
        /// Ratio of the channels.
        seen: f64,
        /// Lowest calibrated ratio.
        low: f64,
        /// Highest calibrated ratio.
        high: f64,
    },
    /// The camera found no spot that it accepts.
    #[error("the camera finds no spot in its picture: is the beam blocked, or beside the field?")]
    Unseen,
    /// The camera found more than the beam's spot.
    #[error(
        "the camera finds {spots} spots in its picture, and nothing says which one is the beam's: is there a \
         reflection beside it?"
    )]
    Several {
        /// How many.
        spots: u32,
    },
    /// The spot is beyond what the camera is used for.
    #[error(
        "the spot is outside the camera's field: {:.1} um, from {:.1} to {:.1} um expected",
        seen.um(), low.um(), high.um()
    )]
    BesideField {
        /// Where it is.
        seen: Metres,
        /// Where the field begins.
        low: Metres,
        /// Where it ends.
        high: Metres,
    },
    /// Changed faster than anything there can move.
    #[error("the value changed by {seen:e}, at most {limit:e} is possible in that time (SI units)")]
    Jumped {
        /// The change in SI units.
        seen: f64,
        /// The largest possible.
        limit: f64,
    },
    /// Outside what can be, or no number.
    #[error("a value of {seen:e} is not plausible, {low:e} to {high:e} expected (SI units)")]
    Implausible {
        /// The value in SI units, or NaN.
        seen: f64,
        /// The lowest expected.
        low: f64,
        /// The highest expected.
        high: f64,
    },
    /// Two readings that fit no roll.
    #[error(transparent)]
    Roll(#[from] RollError),
}
