//! Why a path ended.

use super::Lack;
use super::motion::MotionError;

/// Why the loop came to rest in a controlled way.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// The path came to its end.
    #[error("the path is done")]
    PathDone,
    /// The host asked for it.
    #[error("stopped as asked")]
    Asked,
    /// The queue was empty before the path was finished.
    #[error(
        "the path queue ran dry and all axes were stopped together; write further ahead, or \
         finish the path"
    )]
    RanDry,
    /// Whoever writes the path is gone.
    #[error("the program that writes the path has ended; all axes were stopped together")]
    HostGone,
    /// A point was outside the limits, although it had been checked.
    #[error("a point for axis {} of the path (counted from 1) is outside the limits; all axes were stopped", axis + 1)]
    PathRefused {
        /// Which axis, in the order of the engine's axes.
        axis: usize,
    },
    /// No trajectory leads to a target, although the target is within the limits.
    #[error(
        "no motion within the limits of speed, acceleration and jerk leads to the target; all axes \
         were stopped together"
    )]
    NoWay,
    /// The points belong to a path that an earlier stop had already ended.
    #[error(
        "an earlier stop had already ended this path; nothing of it was driven; begin another one"
    )]
    GivenUp,
    /// The computer was late by more than a period; what was queued is not replayed.
    #[error(
        "the loop was late by {} (the computer was held up): the queued path was dropped, all axes were \
         stopped together",
        units::Several(*periods, "period")
    )]
    Overrun {
        /// How many SYNCs were missed.
        periods: u32,
    },
    /// The correction cannot be known, and nothing may be done without it.
    #[error("the correction failed: {reason}; all axes were stopped together")]
    Correction {
        /// Why.
        reason: &'static str,
    },
    /// What the correction is computed from is lost, and nothing may be done without it.
    #[error("the correction failed: {lack}; all axes were stopped together")]
    CorrectionLost {
        /// What, and why.
        lack: Lack,
    },
}

impl Cause {
    /// Why a target was not gone to.
    pub(super) const fn of_refusal(error: &MotionError) -> Self {
        match error {
            MotionError::SoftLimit { axis, .. } => Self::PathRefused { axis: *axis },
            MotionError::NotPlanned { .. } => Self::NoWay,
        }
    }
}
