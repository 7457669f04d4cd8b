//! What can go wrong with a rotary table beyond what can go wrong with its drive.

use compensator::rotary::{
    Misplaced, NotAnAngle, PeriodicError, PlanError, RotarySeriesError, SolveError,
};
use units::Radians;

use crate::failure::in_use_text;
use crate::failure::of_kind::KindFailure;

/// Why a rotary table did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum RotaryFailure {
    /// Most of the plate cannot be seen.
    #[error(
        "axis {axis}: only {seen} of {lines} lines were read in one pass, at least {wanted} are \
         needed; {}",
        if *overwritten > 0 {
            format!("{overwritten} were lost before they were read: give computer and bus less to do; a touch \
                     probe loses fewer when the table turns slower (speed_deg_per_s)")
        } else {
            "clean the plate, focus the detector; a detector with a voltage also needs the `level_v` and \
             `width_arcsec` of its lines".to_owned()
        }
    )]
    TooFewLines {
        /// Which axis.
        axis: String,
        /// How many were read.
        seen: usize,
        /// How many must be.
        wanted: usize,
        /// How many were overwritten unread, where that is the cause.
        overwritten: usize,
        /// The lines of the plate.
        lines: u32,
    },
    /// The plate or the detector moved while a placement was read.
    #[error(
        "axis {axis}: the lines of the placement at offset {offset} moved by {:.3} arcsec while \
         they were read, the limit is {:.3} arcsec; fix plate and detector, let the temperature \
         settle; the readings of this placement are discarded, earlier placements are kept: \
         continue with --resume",
        seen.arcsec(), limit.arcsec(), offset = units::Short(*offset))]
    Slipped {
        /// Which axis.
        axis: String,
        /// The placement.
        offset: f64,
        /// By how much, in the worst eighth of the turn.
        seen: Radians,
        /// How much is allowed.
        limit: Radians,
    },
    /// The plate was turned differently from what was asked for.
    #[error(
        "axis {axis}: {source} Nothing was stored; continue with --resume, which asks for that \
         placement again and keeps the others"
    )]
    Misplaced {
        /// Which axis.
        axis: String,
        /// Which placement, and what it fits.
        source: Misplaced,
    },
    /// The plate was not turned between two placements.
    #[error(
        "axis {axis}: the plate was not turned: the placement at offset {offset} reads as the one at offset {like} does, to \
         {:.3} arcsec at each position of the table, and lies where that lay, so that the errors of the plate would be taken \
         for the table's. Nothing was stored; turn the plate by {} lines from where it lay at offset {like} (with --yes \
         something else must turn it), and continue with --resume, which asks for that placement again and keeps the \
         others",
        scatter.arcsec(), units::Short(offset - like), offset = units::Short(*offset), like = units::Short(*like)
    )]
    NotTurned {
        /// Which axis.
        axis: String,
        /// The placement that was read last.
        offset: f64,
        /// The one that it repeats.
        like: f64,
        /// By how much both differ at a position of the table.
        scatter: Radians,
    },
    /// The plate of a verification lies elsewhere.
    #[error(
        "axis {axis}: the plate does not lie at offset {expected} but at {seen} (the readings \
         differ by {:.3} arcsec rms from what the calibration predicts for the plate there, but by \
         {:.3} at the offset asked for); turn it by {} lines and verify again",
        residual.arcsec(), residual_expected.arcsec(), expected - seen,
        expected = units::Short(*expected), seen = units::Short(*seen))]
    LiesElsewhere {
        /// Which axis.
        axis: String,
        /// Where it was to lie, in lines.
        expected: f64,
        /// Where it lies.
        seen: f64,
        /// rms of reading − prediction there.
        residual: Radians,
        /// The same where it was to lie.
        residual_expected: Radians,
    },
    /// Another plate than that of the calibration.
    #[error(
        "axis {axis}: the calibration in use was made with plate `{expected}`, the configuration \
         names `{seen}`; verify with that one, whose lines are known, or calibrate with this one"
    )]
    OtherPlate {
        /// Which axis.
        axis: String,
        /// The calibration's.
        expected: String,
        /// The configuration's.
        seen: String,
    },
    /// The readings are worse than they can be.
    #[error(
        "axis {axis}: readings scatter by {:.4} arcsec {about}, {:.4} arcsec was expected \
         (reading_noise_arcsec); nothing was stored: look for vibration, a loose plate, a detector \
         out of focus or a plate turned differently from what was asked for, or set \
         reading_noise_arcsec to the real noise",
        seen.arcsec(), expected.arcsec()
    )]
    Noise {
        /// Which axis.
        axis: String,
        /// About what.
        about: &'static str,
        /// One pass over one line.
        seen: Radians,
        /// As stated in the configuration.
        expected: Radians,
    },
    /// Placements that do not form a series.
    #[error("axis {axis}: {source}")]
    Series {
        /// Which axis.
        axis: String,
        /// Why.
        source: RotarySeriesError,
    },
    /// The readings do not determine the table's error.
    #[error("axis {axis}: {source}; nothing was stored")]
    Estimate {
        /// Which axis.
        axis: String,
        /// Why.
        source: SolveError,
    },
    /// A target that is not an angle.
    #[error("axis {axis}: {source}; nothing was moved")]
    NotAnAngle {
        /// Which axis.
        axis: String,
        /// What it is.
        source: NotAnAngle,
    },
    /// With its calibration the table is worse than without; it is not used any more.
    #[error(
        "axis {axis}: CALIBRATION {calibration} MAKES THE TABLE WORSE: deviation {:.3} arcsec rms \
         with it, {:.3} without; {cause}, or the plate was turned the other way than was asked for, or the encoder was moved since. \
         It was taken out of use; {}",
        after.arcsec(), before.arcsec(), in_use_text(in_use.as_deref())
    )]
    MadeWorse {
        /// Which axis.
        axis: String,
        /// The calibration, shortened.
        calibration: String,
        /// Without it.
        before: Radians,
        /// With it.
        after: Radians,
        /// What probably is wrong with it.
        cause: String,
        /// The calibration that is used again.
        in_use: Option<String>,
    },
    /// A verification is out of tolerance.
    #[error(
        "axis {axis}: largest deviation {:.3} arcsec, the tolerance is {:.3} arcsec",
        seen.arcsec(), limit.arcsec()
    )]
    OutOfTolerance {
        /// Which axis.
        axis: String,
        /// The largest deviation.
        seen: Radians,
        /// The tolerance.
        limit: Radians,
    },
    /// A turn over a plate saw none of its lines.
    #[error(
        "axis {axis}: none of {lines} lines was seen in a whole turn; is the plate there, the \
         detector on and wired to the drive's touch probe?"
    )]
    NoLines {
        /// Which axis.
        axis: String,
        /// How many there should be.
        lines: u32,
    },
    /// A turn over a plate showed none of its lines as a voltage.
    #[error(
        "axis {axis}: none of {lines} lines was seen in a whole turn at {input}: it showed {showed}, and a line \
         should be {:.1} arcsec wide there; is the plate there, the detector on, and are `level_v` and \
         `width_arcsec` those of its lines?",
        .width.arcsec()
    )]
    NoSignal {
        /// Which axis.
        axis: String,
        /// How many there should be.
        lines: u32,
        /// Where the detector is wired to.
        input: String,
        /// Which voltages, and how wide what was beyond the level.
        showed: String,
        /// How wide lines should be there.
        width: Radians,
    },
    /// A turn in which lines would not be sampled often enough.
    #[error(
        "axis {axis}: {seen_deg_per_s:.3}°/s is too fast for each line to be sampled often enough, at most \
         {most_deg_per_s:.3}°/s fits (speed_deg_per_s)"
    )]
    TooFast {
        /// Which axis.
        axis: String,
        /// What was asked for.
        seen_deg_per_s: f64,
        /// What fits.
        most_deg_per_s: f64,
    },
    /// A rotary table's error cannot be computed.
    #[error("{place}: {source}")]
    Unsolved {
        /// The data file, or the run.
        place: String,
        /// Why.
        source: SolveError,
    },
    /// A plate was turned otherwise than was entered.
    #[error("{place}: {source}")]
    MisplacedInData {
        /// The data file, or the run.
        place: String,
        /// Which placement, and what it fits.
        source: Misplaced,
    },
    /// A rotary table's error cannot be applied.
    #[error("axis {axis}: {source}{}", advice(source))]
    Compensation {
        /// Which axis.
        axis: String,
        /// Why.
        source: PeriodicError,
    },
}

/// What to look for where a table is refused.
const fn advice(refused: &PeriodicError) -> &'static str {
    match refused {
        PeriodicError::TooLarge { .. } | PeriodicError::TooSteep { .. } => {
            ". Look for a plate that was read or entered wrongly, a line that is damaged, a plate off its centre, then \
             measure again"
        }
        PeriodicError::NotInvertible { .. }
        | PeriodicError::Limits { .. }
        | PeriodicError::TooFewLines { .. }
        | PeriodicError::Uncertainties { .. }
        | PeriodicError::NotFinite { .. } => "",
    }
}

impl KindFailure for RotaryFailure {
    fn tells_worse(&self) -> bool {
        matches!(self, Self::MadeWorse { .. })
    }

    fn exit_code(&self) -> u8 {
        match self {
            Self::OtherPlate { .. }
            | Self::Unsolved { .. }
            | Self::MisplacedInData { .. }
            | Self::TooFast { .. } => 2,
            Self::Misplaced { .. }
            | Self::NotTurned { .. }
            | Self::LiesElsewhere { .. }
            | Self::NotAnAngle { .. }
            | Self::Compensation { .. } => 3,
            Self::TooFewLines { .. } | Self::NoLines { .. } | Self::NoSignal { .. } => 4,
            Self::Slipped { .. }
            | Self::Noise { .. }
            | Self::Series { .. }
            | Self::Estimate { .. }
            | Self::MadeWorse { .. }
            | Self::OutOfTolerance { .. } => 5,
        }
    }
}

/// No offsets of a plate can be planned, or those given are of no use.
impl KindFailure for PlanError {
    fn exit_code(&self) -> u8 {
        2
    }
}
