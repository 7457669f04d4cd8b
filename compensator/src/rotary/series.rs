//! What a rotary table reads of a plate's lines, for several placements of the plate on it.
//!
//! Line n of a placement with offset s is read at table position n + s, both counted in line
//! spacings and modulo the number of lines. A line that could not be read is missing: its row is
//! left out of the file, which is a good file all the same.

use core::error::Error;
use std::collections::{BTreeMap, BTreeSet};

use units::Radians;

use super::gcd;
use crate::data::{DataError, Fault, Format, Table};

/// More lines than any plate has; a number above it is a misprint.
const LINES_MAX: usize = 100_000;

/// So many lines of a placement may be missing whatever the plate; of a larger one a quarter.
const MISSING_ALWAYS: usize = 2;

const FORMAT: Format = Format {
    columns: &["offset", "line", "deviation_arcsec"],
    header: "offset,line,deviation_arcsec",
};
const OFFSET: usize = 0;
const LINE: usize = 1;
const DEVIATION: usize = 2;

/// How the plate was fixed for one turn of the table, and what was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// By how many lines the plate was turned against the table.
    pub offset: usize,
    /// For each line of the plate reading − nominal angle, `None` where it was not read.
    pub readings: Vec<Option<Radians>>,
}

/// Why placements do not form a series. Placements count from 0 in the order given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RotarySeriesError {
    /// A plate with too few or too many lines.
    #[error("a plate with {seen} lines; 2 to {LINES_MAX} are possible")]
    Lines {
        /// Its lines.
        seen: usize,
    },
    /// Fewer than two placements.
    #[error(
        "{seen} placement(s) of the plate; at least 2 are needed to separate the errors of table \
         and plate"
    )]
    Placements {
        /// How many.
        seen: usize,
    },
    /// A placement with another number of lines.
    #[error("placement {placement}: {seen} readings for a plate with {expected} lines")]
    Readings {
        /// Which placement.
        placement: usize,
        /// Its readings.
        seen: usize,
        /// The lines of the plate.
        expected: usize,
    },
    /// An offset of a whole turn or more.
    #[error("placement {placement}: offset {offset} is not one of 0 to {}", lines - 1)]
    OffsetRange {
        /// Which placement.
        placement: usize,
        /// Its offset.
        offset: usize,
        /// The lines of the plate.
        lines: usize,
    },
    /// An offset twice.
    #[error("placement {placement}: offset {offset} was used before; turn the plate further")]
    RepeatedOffset {
        /// Which placement.
        placement: usize,
        /// Its offset.
        offset: usize,
    },
    /// A NaN or an infinity.
    #[error("placement {placement}, line {line}: the reading is not finite")]
    NotFinite {
        /// Which placement.
        placement: usize,
        /// Which line.
        line: usize,
    },
}

/// What only a data file of a rotary table can have wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RotaryFault {
    /// Not a line or an offset.
    #[error("`{column}` is `{seen}`; write a whole number of lines: 0, 1, 2, …")]
    NotWhole {
        /// The column.
        column: &'static str,
        /// The cell.
        seen: String,
    },
    /// A number no plate has.
    #[error("`{column}` is {seen}; the plate has {lines} lines, so 0 to {} are possible", lines - 1)]
    TooLarge {
        /// The column.
        column: &'static str,
        /// The number.
        seen: usize,
        /// The lines of the plate.
        lines: usize,
    },
    /// The same line twice in one placement.
    #[error(
        "line {line} of the placement at offset {offset} is already in row {first} of the file; \
         each line is read once, and no offset is used twice"
    )]
    DuplicateLine {
        /// The placement.
        offset: usize,
        /// The line.
        line: usize,
        /// Where it stands in the file.
        first: usize,
    },
    /// Rows of one offset with others between them.
    #[error(
        "offset {offset} appears again after another one (it began in row {first} of the file): \
         use each offset once, and keep the rows of one placement together"
    )]
    RepeatedOffset {
        /// The offset.
        offset: usize,
        /// Where it began.
        first: usize,
    },
    /// Fewer than two placements.
    #[error(
        "all rows have offset {offset}: one placement cannot separate the errors of table and \
         plate; turn the plate by some lines and read it again"
    )]
    OnePlacement {
        /// The only offset.
        offset: usize,
    },
    /// All offsets differ by multiples of a number that divides the number of lines.
    #[error(
        "offset {offset} and those before it differ by multiples of {step} only, which divides the \
         {lines} lines: harmonic {harmonic} and its multiples look the same in every placement and \
         cannot be distinguished from errors of the plate; add a placement at another offset"
    )]
    CommonStep {
        /// The last offset.
        offset: usize,
        /// What all differ by.
        step: usize,
        /// The lines of the plate.
        lines: usize,
        /// The lowest harmonic lost.
        harmonic: usize,
    },
    /// A placement of which most is missing.
    #[error(
        "the placement at offset {offset} ends with {seen} of {lines} lines; at most a quarter may \
         be missing, so read the rest or leave the placement out"
    )]
    Sparse {
        /// The placement.
        offset: usize,
        /// Its readings.
        seen: usize,
        /// The lines of the plate.
        lines: usize,
    },
    /// The file does not say how many lines the plate has.
    #[error(
        "the number of lines of the plate is not given, and the file does not tell it: its largest \
         line is {largest}, so the plate has {} lines or more, as lines that were never read leave \
         no row; count the lines of the plate and give their number (`--lines`)",
        largest + 1
    )]
    UnknownLines {
        /// The largest line in the file.
        largest: usize,
    },
}

/// Readings of one plate in several placements: at least two, each at an offset of its own,
/// every reading finite.
///
/// # Example
///
/// ```
/// use compensator::rotary::RotarySeries;
///
/// let csv = "offset,line,deviation_arcsec\n0,0,8\n0,1,4\n0,2,3\n1,0,-2\n1,1,-3\n1,2,-1\n";
/// let series = RotarySeries::from_csv(csv, "table.csv", Some(3))?;
/// assert_eq!((series.lines(), series.offsets()), (3, vec![0, 1]));
/// let one_placement = "offset,line,deviation_arcsec\n0,0,8\n0,1,4\n0,2,3\n";
/// assert!(RotarySeries::from_csv(one_placement, "table.csv", Some(3)).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RotarySeries {
    lines: usize,
    placements: Vec<Placement>,
}

impl RotarySeries {
    /// Checks `placements` of a plate with `lines` lines, in the order they were read.
    ///
    /// # Errors
    /// The first placement or reading that cannot be used.
    pub fn new(lines: usize, placements: Vec<Placement>) -> Result<Self, RotarySeriesError> {
        if !(2..=LINES_MAX).contains(&lines) {
            return Err(RotarySeriesError::Lines { seen: lines });
        }
        if placements.len() < 2 {
            let seen = placements.len();
            return Err(RotarySeriesError::Placements { seen });
        }
        let mut offsets = BTreeSet::new();
        for (placement, it) in placements.iter().enumerate() {
            check_placement(lines, placement, it)?;
            if !offsets.insert(it.offset) {
                let offset = it.offset;
                return Err(RotarySeriesError::RepeatedOffset { placement, offset });
            }
        }
        Ok(Self { lines, placements })
    }

    /// The lines of the plate.
    pub fn lines(&self) -> usize {
        self.lines
    }

    /// Every placement, in the order read.
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// The offset of every placement, in the order read.
    pub fn offsets(&self) -> Vec<usize> {
        self.placements.iter().map(|it| it.offset).collect()
    }

    /// Reads the CSV format `offset,line,deviation_arcsec` (columns in any order, `#` comment
    /// lines, decimal points; the rows of one placement together, its lines in any order).
    ///
    /// `lines` is what the plate has. Nothing in a file proves it: were the last lines never read, a
    /// smaller plate would be evaluated, whose readings fit almost as well. So `None` is an error,
    /// which says how many lines there are at least.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(
        text: &str,
        source_name: &str,
        lines: Option<usize>,
    ) -> Result<Self, DataError<RotaryFault>> {
        let table = Table::read(text, source_name, &FORMAT)?;
        let blocks = read_blocks(&table)?;
        let lines = count_lines(&table, &blocks, lines)?;
        let mut placements = Vec::with_capacity(blocks.len());
        for block in &blocks {
            placements.push(block.placement(&table, lines)?);
        }
        check_step(&table, &blocks, lines)?;
        Ok(Self::new(lines, placements).expect("every rule was checked with its place"))
    }

    /// The series in the format [`Self::from_csv`] reads.
    pub fn to_csv(&self) -> String {
        let mut text = format!("{}\n", FORMAT.header);
        for Placement { offset, readings } in &self.placements {
            for (line, reading) in readings.iter().enumerate() {
                if let Some(reading) = reading {
                    text.push_str(&format!("{offset},{line},{}\n", reading.arcsec()));
                }
            }
        }
        text
    }
}

fn check_placement(
    lines: usize,
    placement: usize,
    it: &Placement,
) -> Result<(), RotarySeriesError> {
    let (offset, seen, expected) = (it.offset, it.readings.len(), lines);
    if seen != expected {
        return Err(RotarySeriesError::Readings {
            placement,
            seen,
            expected,
        });
    }
    if offset >= lines {
        return Err(RotarySeriesError::OffsetRange {
            placement,
            offset,
            lines,
        });
    }
    let bad = |reading: &Option<Radians>| reading.is_some_and(|it| !it.is_finite());
    match it.readings.iter().position(bad) {
        Some(line) => Err(RotarySeriesError::NotFinite { placement, line }),
        None => Ok(()),
    }
}

/// The rows of one placement: for each line its row and reading.
struct Block {
    offset: usize,
    first_row: usize,
    readings: BTreeMap<usize, (usize, Radians)>,
}

fn read_blocks(table: &Table<RotaryFault>) -> Result<Vec<Block>, DataError<RotaryFault>> {
    let mut blocks: Vec<Block> = Vec::new();
    for row in 0..table.rows() {
        let offset = whole(table, row, OFFSET)?;
        let line = whole(table, row, LINE)?;
        let deviation = Radians::from_arcsec(table.number(row, DEVIATION)?);
        if blocks.last().is_none_or(|block| block.offset != offset) {
            if let Some(earlier) = blocks.iter().find(|block| block.offset == offset) {
                let first = table.line(earlier.first_row);
                let fault = RotaryFault::RepeatedOffset { offset, first };
                return Err(table.fail(row, OFFSET, fault.into()));
            }
            blocks.push(Block {
                offset,
                first_row: row,
                readings: BTreeMap::new(),
            });
        }
        let block = blocks.last_mut().expect("one was pushed");
        if let Some((earlier, _)) = block.readings.insert(line, (row, deviation)) {
            let first = table.line(earlier);
            let fault = RotaryFault::DuplicateLine {
                offset,
                line,
                first,
            };
            return Err(table.fail(row, LINE, fault.into()));
        }
    }
    if let [only] = blocks.as_slice() {
        let fault = RotaryFault::OnePlacement {
            offset: only.offset,
        };
        return Err(table.fail(table.rows() - 1, OFFSET, fault.into()));
    }
    Ok(blocks)
}

/// How many lines the plate has, as `given`: all lines of the file must be among them.
fn count_lines(
    table: &Table<RotaryFault>,
    blocks: &[Block],
    given: Option<usize>,
) -> Result<usize, DataError<RotaryFault>> {
    let last = |block: &Block| {
        block
            .readings
            .last_key_value()
            .map(|(line, at)| (*line, at.0))
    };
    let ends = blocks.iter().filter_map(last);
    let (largest, row) = ends.max().expect("every block has a row");
    let fault = match given {
        Some(lines) if largest < lines => return Ok(lines),
        Some(lines) => RotaryFault::TooLarge {
            column: FORMAT.columns[LINE],
            seen: largest,
            lines,
        },
        None => RotaryFault::UnknownLines { largest },
    };
    Err(table.fail(row, LINE, fault.into()))
}

/// The rule of [`Design`](crate::rotary::Design), with the place of the last offset.
fn check_step(
    table: &Table<RotaryFault>,
    blocks: &[Block],
    lines: usize,
) -> Result<(), DataError<RotaryFault>> {
    let (first, last) = (&blocks[0], &blocks[blocks.len() - 1]);
    let apart = blocks.iter().map(|it| it.offset.abs_diff(first.offset));
    let step = apart.fold(lines, gcd);
    if step == 1 {
        return Ok(());
    }
    let fault = RotaryFault::CommonStep {
        offset: last.offset,
        step,
        lines,
        harmonic: lines / step,
    };
    Err(table.fail(last.first_row, OFFSET, fault.into()))
}

impl Block {
    fn placement(
        &self,
        table: &Table<RotaryFault>,
        lines: usize,
    ) -> Result<Placement, DataError<RotaryFault>> {
        let (offset, seen) = (self.offset, self.readings.len());
        if offset >= lines {
            let fault = RotaryFault::TooLarge {
                column: FORMAT.columns[OFFSET],
                seen: offset,
                lines,
            };
            return Err(table.fail(self.first_row, OFFSET, fault.into()));
        }
        if lines - seen > MISSING_ALWAYS.max(lines / 4) {
            let row = self.first_row + seen - 1;
            let fault = RotaryFault::Sparse {
                offset,
                seen,
                lines,
            };
            return Err(table.fail(row, OFFSET, fault.into()));
        }
        let mut readings = vec![None; lines];
        for (line, (_, reading)) in &self.readings {
            readings[*line] = Some(*reading);
        }
        Ok(Placement { offset, readings })
    }
}

/// A whole number below any that is a misprint.
pub(super) fn whole<K: Error + From<RotaryFault> + 'static>(
    table: &Table<K>,
    row: usize,
    column: usize,
) -> Result<usize, DataError<K>> {
    let (seen, name) = (table.text(row, column), table.column(column));
    let digits = !seen.is_empty() && seen.bytes().all(|byte| byte.is_ascii_digit());
    let number = seen.parse().ok().filter(|_| digits);
    let fault = match number {
        Some(number) if number < LINES_MAX => return Ok(number),
        Some(seen) => Fault::from(K::from(RotaryFault::TooLarge {
            column: name,
            seen,
            lines: LINES_MAX,
        })),
        None if seen.is_empty() => Fault::MissingValue { column: name },
        None => Fault::from(K::from(RotaryFault::NotWhole {
            column: name,
            seen: seen.to_owned(),
        })),
    };
    Err(table.fail(row, column, fault))
}

#[cfg(test)]
#[path = "series_tests.rs"]
mod tests;
