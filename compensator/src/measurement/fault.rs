//! What can be wrong with a data file, told to whoever has to mend it.

use super::units_of::Unbelievable;

/// A data file that cannot be used: where, what was seen, what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}:{column}: {fault}")]
pub struct DataError {
    /// Name of the source as given by the caller.
    pub file: String,
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub fault: Fault,
}

/// What is wrong with a data file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// No header row.
    #[error("the file is empty; its first row must be the header `{expected}`")]
    Empty {
        /// The header wanted.
        expected: &'static str,
    },
    /// A header but no data row.
    #[error("there is no data row under the header")]
    NoRows,
    /// A column that does not belong to the format.
    #[error("unknown column `{seen}`; the header must be `{expected}`")]
    UnknownColumn {
        /// The name seen.
        seen: String,
        /// The header wanted.
        expected: &'static str,
    },
    /// The right quantity in another unit.
    #[error("column `{seen}` is in the wrong unit: convert its values and name it `{wanted}`")]
    WrongUnit {
        /// The name seen.
        seen: String,
        /// The name wanted.
        wanted: &'static str,
    },
    /// A column of the format is not there.
    #[error("column `{missing}` is missing; the header must be `{expected}`")]
    MissingColumn {
        /// The column.
        missing: &'static str,
        /// The header wanted.
        expected: &'static str,
    },
    /// A column twice.
    #[error("column `{seen}` appears twice; remove one")]
    DuplicateColumn {
        /// The name.
        seen: &'static str,
    },
    /// The header or a row is separated by something else than commas.
    #[error("the columns are separated by `{seen}`; save the file with commas between columns")]
    Separator {
        /// The separator seen.
        seen: char,
    },
    /// A row of another length than the header.
    #[error("the row has {seen} cells, the header {expected}{hint}",
        hint = if seen > expected { "; decimal commas? write decimal points" } else { "" })]
    CellCount {
        /// Cells in the row.
        seen: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// The quoting of the file cannot be read.
    #[error("the quotes in this row cannot be read; write numbers without quotes")]
    Quoting,
    /// An empty cell.
    #[error("`{column}` is empty; a value that was not measured must not be in the file")]
    MissingValue {
        /// The column.
        column: &'static str,
    },
    /// A number with a decimal comma.
    #[error("`{column}` is `{seen}`: write a decimal point, not a comma")]
    DecimalComma {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// A NaN, an infinity or a number too large.
    #[error("`{column}` is `{seen}`, not a finite number; measure the point again")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// Not a number.
    #[error("`{column}` is `{seen}`, not a number; write plain decimals without units")]
    NotANumber {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// Not a run number.
    #[error("`run` is `{seen}`; number the runs 0, 1, 2, …")]
    NotARun {
        /// The cell.
        seen: String,
    },
    /// Not an approach.
    #[error("`approach` is `{seen}`; write + (coordinates increase) or -")]
    NotAnApproach {
        /// The cell.
        seen: String,
    },
    /// The same point twice.
    #[error("target {} mm of run {run} ({approach}) is already in the file; keep one",
        units::Short(*target_mm))]
    Duplicate {
        /// Its run.
        run: u32,
        /// `+` or `-`.
        approach: char,
        /// Its target.
        target_mm: f64,
    },
    /// Runs out of order.
    #[error("run {seen} comes after run {previous}; keep the rows in the order measured")]
    RunOrder {
        /// This row's run.
        seen: u32,
        /// The row before's.
        previous: u32,
    },
    /// Targets against the approach.
    #[error(
        "target {} mm comes after {} mm, which is not approach `{approach}`; \
         keep the rows in the order measured",
        units::Short(*seen_mm), units::Short(*previous_mm)
    )]
    TargetOrder {
        /// `+` or `-`.
        approach: char,
        /// This row's target.
        seen_mm: f64,
        /// The target before it.
        previous_mm: f64,
    },
    /// Not the name of an axis.
    #[error("`axis` is `{seen}`; name it with letters, digits, `_` and `-` only")]
    NotAnAxis {
        /// The cell.
        seen: String,
    },
    /// Nothing can be said about a screw that made one stroke only.
    #[error(
        "axis {axis} has no other stroke than {} um; measure at least two different \
         strokes, better five and more", units::Short(*stroke_um)
    )]
    OneStroke {
        /// Which axis.
        axis: String,
        /// The only stroke.
        stroke_um: f64,
    },
    /// A stroke a thousand times shorter than the others.
    #[error(
        "axis {axis}: a stroke of {} um stands beside strokes from {} to {} um; \
         are micrometres and millimetres mixed?",
        units::Short(*stroke_um), units::Short(*least_um), units::Short(*most_um)
    )]
    MixedUnits {
        /// Which axis.
        axis: String,
        /// The stroke.
        stroke_um: f64,
        /// The shortest of the others.
        least_um: f64,
        /// The longest of the others.
        most_um: f64,
    },
    /// A deviation larger than any stroke of its axis.
    #[error(
        "axis {axis}: the deviation of {} um is larger than its longest stroke, \
         {} um; are micrometres and millimetres mixed?",
        units::Short(*deviation_um), units::Short(*stroke_um)
    )]
    Implausible {
        /// Which axis.
        axis: String,
        /// The deviation.
        deviation_um: f64,
        /// The longest stroke.
        stroke_um: f64,
    },
    /// Positions that grow otherwise than their targets, by more than any stage does.
    #[error(
        "`measured_mm` grows by {} mm for each millimetre of `target_mm`, which no stage does: {cause}",
        digits(*slope)
    )]
    OtherUnit {
        /// Measured over target.
        slope: f64,
        /// What it looks like.
        cause: &'static str,
    },
    /// Positions that do not follow their targets.
    #[error(
        "`measured_mm` lies {:.0} % of the range off a line with `target_mm`, which no stage does: are \
         the columns what their names say?", share * 100.0
    )]
    Scattered {
        /// The scatter about the line, as a share of the range.
        share: f64,
    },
    /// Something that only data of a rotary table can have.
    #[error(transparent)]
    Rotary(#[from] super::RotaryFault),
    /// Something that only data of three axes can have.
    #[error(transparent)]
    Volume(#[from] super::VolumeFault),
}

/// Three significant digits: a slope is a hint, not a result.
fn digits(value: f64) -> units::Short {
    units::Short(format!("{value:.2e}").parse().unwrap_or(value))
}

impl From<Unbelievable> for Fault {
    fn from(reason: Unbelievable) -> Self {
        match reason {
            Unbelievable::Slope { slope, cause } => Self::OtherUnit { slope, cause },
            Unbelievable::Scatter { share } => Self::Scattered { share },
        }
    }
}
