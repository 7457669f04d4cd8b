//! What can go wrong with three axes beyond what can go wrong with each.

use compensator::volumetric::function::FunctionError;
use compensator::volumetric::model::{ChainError, ModelError};
use compensator::volumetric::online::RollError;
use compensator::volumetric::{Axis, VolumeError};
use units::{Metres, MetresPerSecond, Radians};

use crate::assemble::BeamDetectorError;
use crate::engine::Cause;

/// Why three axes are not corrected, or not zeroed.
#[derive(Debug, thiserror::Error)]
pub enum VolumetricFailure {
    /// The machine has no such thing.
    #[error("this machine has no work volume: its configuration has no [volumetric]")]
    None,
    /// A section of the configuration is missing.
    #[error("[volumetric.{section}] is missing in the configuration")]
    NotConfigured {
        /// Which section.
        section: &'static str,
    },
    /// A beam is watched, but nobody knows what its detectors read when the axis is right.
    #[error(
        "axis {axis}: its detectors have no references; calibrate the machine, or remove \
        [volumetric.beam.{axis}]"
    )]
    NoReference {
        /// Whose beam.
        axis: Axis,
    },
    /// The roll is watched, but has no reference.
    #[error("the roll detectors have no reference; calibrate, or remove [volumetric.roll]")]
    NoRollReference,
    /// Thermometers without the temperatures at the calibration.
    #[error("{seen} reference temperatures for {expected} thermometers; calibrate again")]
    Temperatures {
        /// How many there are.
        seen: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A detector that cannot be.
    #[error("axis {axis}: {source}")]
    Detector {
        /// Whose.
        axis: Axis,
        /// Why.
        source: BeamDetectorError,
    },
    /// The kinematic chain is none.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The work volume is none.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// An influence is no function.
    #[error("influence: {0}")]
    Influence(#[from] FunctionError),
    /// The roll optics are none.
    #[error(transparent)]
    Roll(#[from] RollError),
    /// The errors cannot be compensated.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// At the axes' full speed the correction would have to change too fast.
    #[error(
        "the correction may have to change faster than rate_limit_um_per_s above {:.1} mm/s, but \
         the axes together reach {:.1} mm/s; raise the limit or lower their speed_max_mm_per_s",
        seen.value() * 1e3, axes.value() * 1e3
    )]
    TooFast {
        /// The speed up to which it is proven not to.
        seen: MetresPerSecond,
        /// What the axes reach.
        axes: MetresPerSecond,
    },
    /// A line without a direction, or with optics that look along it.
    #[error(
        "this line has no direction, or its optics do not look across it; nothing was moved: give \
         it a length, and a direction across that is square to it"
    )]
    NotALine,
    /// A line is to be measured with something that is not there.
    #[error("there is no instrument `{instrument}`; add [instrument.{instrument}]")]
    NoInstrument {
        /// How it is called.
        instrument: String,
    },
    /// A line is to be measured with optics that nobody has described.
    #[error(
        "instrument {instrument}: `{key}` is missing in [instrument.{instrument}.optics]; nothing \
         was moved"
    )]
    NoOptics {
        /// Which instrument.
        instrument: String,
        /// What is missing.
        key: &'static str,
    },
    /// A line was set up, but the interferometer sees nothing.
    #[error(
        "instrument {instrument}: no beam comes back along the line that was set up; align \
         laser and optics, and begin again"
    )]
    NoLight {
        /// Which instrument.
        instrument: String,
    },
    /// A straight move ended elsewhere.
    #[error("the tool did not arrive: {cause}")]
    NotThere {
        /// Why it ended.
        cause: Cause,
    },
    /// A reading that is no error of the machine.
    #[error(
        "the line reads {:.1} um off, more than {:.1} um that a machine like this can be: check \
         the optics, `reverse`, and that the tool stays on the line", seen.um(), limit.um()
    )]
    ImpossibleReading {
        /// What was read.
        seen: Metres,
        /// What is possible.
        limit: Metres,
    },
    /// A tilt that is no error of the machine.
    #[error(
        "the line reads a tilt of {:.1} arcsec, more than {:.1} arcsec that a machine like this \
         can have: check the optics", seen.arcsec(), limit.arcsec()
    )]
    ImpossibleTilt {
        /// What was read.
        seen: Radians,
        /// What is possible.
        limit: Radians,
    },
}

impl VolumetricFailure {
    /// As [`crate::Failure::exit_code`].
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::None
            | Self::NotConfigured { .. }
            | Self::Detector { .. }
            | Self::NotALine
            | Self::NoInstrument { .. }
            | Self::NoOptics { .. }
            | Self::Chain(_)
            | Self::Volume(_)
            | Self::Influence(_)
            | Self::Roll(_) => 2,
            Self::NoReference { .. }
            | Self::NoRollReference
            | Self::Temperatures { .. }
            | Self::Model(_)
            | Self::TooFast { .. } => 3,
            Self::NoLight { .. }
            | Self::NotThere { .. }
            | Self::ImpossibleReading { .. }
            | Self::ImpossibleTilt { .. } => 4,
        }
    }
}
