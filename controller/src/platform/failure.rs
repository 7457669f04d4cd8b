//! What can go wrong with a platform beyond what can go wrong with its axes.

use core::fmt;

use compensator::platform::{ForwardError, OutOfReach, PathError};
use compensator::screw;
use units::Metres;

use crate::failure::Failure;
use crate::failure::of_kind::KindFailure;
use crate::platform::explanation::Explanation;

/// Why a platform did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum PlatformFailure {
    /// The machine has no platform.
    #[error("this machine is not a platform: its configuration has no [platform]")]
    None,
    /// A section of the configuration is missing.
    #[error("[platform.{section}] is missing in the configuration")]
    NotConfigured {
        /// Which section.
        section: &'static str,
    },
    /// No origin since the screws were last powered.
    #[error("platform: not zeroed since power-on; run `truestage zero` first")]
    NotZeroed,
    /// The pose is out of the actuators' reach.
    #[error("{0}; nothing was moved")]
    OutOfReach(#[from] OutOfReach),
    /// The pose is outside the work range.
    #[error(
        "platform: {what} = {seen:.6} {unit} is outside the work range of ±{limit} {unit}; nothing \
         was moved", limit = units::Short(*limit))]
    OutOfRange {
        /// Which coordinate.
        what: &'static str,
        /// Its value.
        seen: f64,
        /// Its unit.
        unit: &'static str,
        /// The largest magnitude allowed.
        limit: f64,
    },
    /// The way to the pose is out of reach.
    #[error("{0}; nothing was moved")]
    Path(#[from] PathError),
    /// A screw's stroke is outside what was calibrated.
    #[error("axis {axis}: {source}; nothing was moved")]
    OutOfCalibration {
        /// Which axis.
        axis: String,
        /// Where.
        source: screw::OutOfRange,
    },
    /// Strokes that belong to no pose.
    #[error(transparent)]
    Forward(#[from] ForwardError),
    /// Screws that stand, or would stand, where no pose has them together.
    #[error(
        "platform: the screws contradict each other by {:.3} µm, the limit is {:.3} µm; from the \
         pose that fits them best, {screws}{consequence}",
        seen.um(), limit.um()
    )]
    Contradiction {
        /// Each screw, and how far it is from the pose.
        screws: Contradiction,
        /// The largest of these.
        seen: Metres,
        /// The limit of the configuration.
        limit: Metres,
        /// What became of the move.
        consequence: &'static str,
    },
    /// The strokes measured give no model.
    #[error("axis {axis}: {source}; nothing was stored")]
    Fit {
        /// Which axis.
        axis: String,
        /// Why.
        source: screw::FitError,
    },
    /// The image does not agree after all moves allowed.
    #[error(
        "platform: after {moves} moves the image still differs by {:.3} µm, the tolerance is {:.3} µm",
        seen.um(), limit.um()
    )]
    NotAligned {
        /// How many moves were made.
        moves: u32,
        /// The largest error, angle at the edge included.
        seen: Metres,
        /// The tolerance.
        limit: Metres,
    },
    /// A pose verified is out of tolerance.
    #[error(
        "platform: largest error {:.3} µm, the tolerance is {:.3} µm",
        seen.um(), limit.um()
    )]
    OutOfTolerance {
        /// The largest error, angle at the edge included.
        seen: Metres,
        /// The tolerance.
        limit: Metres,
    },
    /// A screw's model cannot be computed.
    #[error("{place}: axis {axis}: {source}")]
    Screw {
        /// The data file and the line where the axis begins, or the run.
        place: String,
        /// Which axis.
        axis: String,
        /// Why.
        source: screw::FitError,
    },
    /// A screw's model cannot be applied.
    #[error("axis {axis}: {source}")]
    Compensation {
        /// Which axis.
        axis: String,
        /// Why.
        source: screw::ScrewError,
    },
    /// A platform whose readings contradict its configuration by far.
    #[error("platform: {explanation}; nothing was stored. {source}")]
    Misdescribed {
        /// What explains them, if anything.
        explanation: Box<Explanation>,
        /// What its calibration was refused for.
        source: Box<Failure>,
    },
}

/// Screws and how far each is from a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Contradiction(pub Vec<(String, Metres)>);

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, (axis, off)) in self.0.iter().enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            write!(f, "{comma}{axis} {:+.3} µm", off.um())?;
        }
        Ok(())
    }
}

impl KindFailure for PlatformFailure {
    fn exit_code(&self) -> u8 {
        match self {
            Self::None | Self::NotConfigured { .. } | Self::Screw { .. } => 2,
            Self::Misdescribed {
                explanation,
                source,
            } => {
                if explanation.names_a_cause() {
                    2
                } else {
                    source.exit_code()
                }
            }
            Self::NotZeroed
            | Self::OutOfReach(_)
            | Self::OutOfRange { .. }
            | Self::Path(_)
            | Self::Contradiction { .. }
            | Self::OutOfCalibration { .. }
            | Self::Compensation { .. } => 3,
            Self::Forward(_) => 4,
            Self::Fit { .. } | Self::NotAligned { .. } | Self::OutOfTolerance { .. } => 5,
        }
    }

    fn depends_on_time(&self) -> bool {
        matches!(self, Self::NotAligned { .. })
    }
}
