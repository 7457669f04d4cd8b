//! What is said of a calibration that was just made and is worse than what was before.

use units::Metres;

/// A calibration that is not used any more after its first verification.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "axis {axis}: THE NEW CALIBRATION {calibration} IS WORSE than what was before: A = {:.3} µm with it (tolerance \
     {:.3} µm), {:.3} µm {was}; {cause}. It was taken out of use; {then}",
    seen.um(), limit.um(), before.um()
)]
pub struct NewIsWorse {
    /// Which axis.
    pub(super) axis: String,
    /// The calibration, shortened.
    pub(super) calibration: String,
    /// The bidirectional accuracy with it.
    pub(super) seen: Metres,
    /// The tolerance of the configuration.
    pub(super) limit: Metres,
    /// The bidirectional accuracy before.
    pub(super) before: Metres,
    /// With what that was, in words.
    pub(super) was: String,
    /// What probably is wrong.
    pub(super) cause: String,
    /// What is used now.
    pub(super) then: String,
}
