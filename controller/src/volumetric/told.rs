//! What three axes gave, in the words of the command line.

use machine::engine::CsvPath;

use crate::runs::Told;
use crate::volumetric::moved::VolumetricMoved;
use crate::volumetric::path::PathFollowed;
use crate::volumetric::reference::VolumetricReferenced;
use crate::volumetric::verify::VolumetricVerified;
use crate::volumetric::{Remembered, VolumetricCalibrated};

/// Who says it ([`Teller::of`](crate::runs::Teller::of)).
#[derive(Clone, Copy, Debug)]
pub struct VolumetricTeller {
    /// Zeros that were found.
    pub zeroed: fn() -> Told,
    /// A calibration that was made.
    pub calibrated: fn(calibrated: &VolumetricCalibrated) -> Told,
    /// A verification.
    pub verified: fn(verified: &VolumetricVerified) -> Told,
    /// References that were taken.
    pub referenced: fn(referenced: &VolumetricReferenced) -> Told,
    /// A state that is kept.
    pub remembered: fn(kept: &Remembered) -> Told,
    /// A designed shape that is kept.
    pub designed: fn(kept: &Remembered) -> Told,
    /// A corrected move that was made.
    pub moved: fn(moved: &VolumetricMoved) -> Told,
    /// A path that was followed, what joined its rows, and what later parts are made with when it was the first.
    pub followed: fn(followed: &PathFollowed, path: &CsvPath, kept: Option<&Remembered>) -> Told,
}
