//! Why a path of three axes is not begun.

use crate::volumetric::VolumetricFailure;
use machine::engine::PushError;

/// Why a path is not begun.
#[derive(Debug, thiserror::Error)]
pub enum PathRefusal {
    /// The axes cannot follow it: soft limits, speed, acceleration or jerk.
    #[error(transparent)]
    Point(#[from] PushError),
    /// It leaves the volume that is calibrated.
    #[error("at {at_s:.4} s: {source}")]
    Volume {
        /// When it does, in seconds from the path's beginning.
        at_s: f64,
        /// Where it is then, and what is calibrated.
        source: Box<VolumetricFailure>,
    },
}
