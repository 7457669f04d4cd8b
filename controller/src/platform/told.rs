//! What an alignment platform gave, in the words of the command line.

use crate::platform::calibrate::PlatformCalibrated;
use crate::platform::motion::PlatformMoved;
use crate::platform::verify::PlatformVerified;
use crate::platform::zero::PlatformZeroed;
use crate::runs::Told;

/// Who says it ([`Teller::of`](crate::runs::Teller::of)).
#[derive(Clone, Copy, Debug)]
pub struct PlatformTeller {
    /// A zero that was found.
    pub zeroed: fn(zeroed: &PlatformZeroed) -> Told,
    /// A calibration that was made.
    pub calibrated: fn(calibrated: &PlatformCalibrated) -> Told,
    /// A verification, with a calibration or without one.
    pub verified: fn(verified: &PlatformVerified, compensated: bool) -> Told,
    /// A move that was made.
    pub moved: fn(moved: &PlatformMoved) -> Told,
}
