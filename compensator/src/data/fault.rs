//! What can be wrong with a data file, in words for the person who has to correct it.

use core::error::Error;

/// A data file that cannot be used: where, what was seen, what to do. `K` is what only data of its
/// kind can have wrong.
///
/// # Example
///
/// ```
/// use compensator::error_table::LinearSeries;
///
/// let csv = "run,approach,target_mm,measured_mm\n1,+,0,0.001\n1,up,3,3.002\n";
/// let error = LinearSeries::from_csv(csv, "x.csv").expect_err("`up` is no approach");
/// assert_eq!((error.line, error.column), (3, 3));
/// assert_eq!(
///     error.to_string(),
///     "x.csv:3:3: `approach` is `up`; write + (coordinates increase) or -"
/// );
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}:{column}: {fault}")]
pub struct DataError<K: Error + 'static> {
    /// Name of the source as given by the caller.
    pub file: String,
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub fault: Fault<K>,
}

/// What is wrong with a data file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault<K: Error + 'static> {
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
    /// Not the name of an axis.
    #[error("`axis` is `{seen}`; name it with letters, digits, `_` and `-` only")]
    NotAnAxis {
        /// The cell.
        seen: String,
    },
    /// Something that only data of this kind can have.
    #[error(transparent)]
    Own(#[from] K),
}
