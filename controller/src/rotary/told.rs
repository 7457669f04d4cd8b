//! What a rotary table gave, in the words of the command line.

use crate::rotary::sighted::alone::Progress;
use crate::rotary::{RotaryCalibrated, RotaryMoved, RotaryVerified};
use crate::runs::Told;

/// Who says it ([`Teller::of`](crate::runs::Teller::of)).
#[derive(Clone, Copy, Debug)]
pub struct RotaryTeller {
    /// A zero that was found.
    pub zeroed: fn(axis: &str) -> Told,
    /// A calibration that was made.
    pub calibrated: fn(axis: &str, calibrated: &RotaryCalibrated) -> Told,
    /// How far a calibration of a plate that a person reads has come.
    pub(crate) progress: fn(axis: &str, progress: &Progress) -> Told,
    /// A verification.
    pub verified: fn(axis: &str, verified: &RotaryVerified) -> Told,
    /// A move, and the calibration that corrected it.
    pub moved: fn(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> Told,
}
