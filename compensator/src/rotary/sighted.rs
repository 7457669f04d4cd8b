//! What was read of a plate's lines by sighting them, as a file of one placement.
//!
//! A person (or a program of his) looks at the lines through a microscope, a camera or an
//! autocollimator, and types or exports what he sees: of each line one value in each pass, in the
//! same passes that a detector makes. Whatever is wrong with a value is said where it stands.
//!
//! Source: step 2 of the patent, without a word on how a line is read.
//!
//! Absent: asking for values, storage.

use std::collections::BTreeMap;

use units::{Approach, Radians};

use super::series::{RotaryFault, whole};
use crate::data::{DataError, Format, Table};
use crate::uncertainty::median;

/// So many lines of a pass may be missing whatever the plate; of a larger one a quarter.
const MISSING_ALWAYS: usize = 2;

const OFFSET: usize = 0;
const PASS: usize = 1;
const APPROACH: usize = 2;
const SIGHTED_LINE: usize = 3;
const VALUE: usize = 4;

/// What a value says of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sighted {
    /// The table stands at the line's nominal angle by its own reading; the value is by how much it
    /// would have to turn on, towards larger angles, for the line to lie under the cross-hair.
    ToLine,
    /// The table was turned until the line lay under the cross-hair; the value is its reading.
    Angle,
    /// The same reading less the line's nominal angle.
    Deviation,
}

impl Sighted {
    /// The header of a file of such values.
    pub const fn header(self) -> &'static str {
        self.format().header
    }

    const fn format(self) -> &'static Format {
        match self {
            Self::ToLine => &Format {
                columns: &["offset", "pass", "approach", "line", "to_line_arcsec"],
                header: "offset,pass,approach,line,to_line_arcsec",
            },
            Self::Angle => &Format {
                columns: &["offset", "pass", "approach", "line", "angle_deg"],
                header: "offset,pass,approach,line,angle_deg",
            },
            Self::Deviation => &Format {
                columns: &["offset", "pass", "approach", "line", "deviation_arcsec"],
                header: "offset,pass,approach,line,deviation_arcsec",
            },
        }
    }

    const fn in_file(self, number: f64) -> Radians {
        match self {
            Self::ToLine | Self::Deviation => Radians::from_arcsec(number),
            Self::Angle => Radians(number.to_radians()),
        }
    }

    /// Reading − nominal angle of a line, from its value. Angles may count on over the turns.
    pub fn deviation(self, value: Radians, nominal: Radians) -> Radians {
        match self {
            Self::ToLine | Self::Deviation => value,
            Self::Angle => {
                let away = value - nominal;
                away - away.whole_turns()
            }
        }
    }
}

/// How the plate lies, and in which passes it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightedPlan {
    /// By how many lines it is turned against the table; a part of a line shows the places between.
    pub offset: f64,
    /// Its lines.
    pub lines: usize,
    /// Passes in each direction; the first is repeated at the end.
    pub passes: u32,
    /// How far a line may be from where the lines of its placement lie together.
    pub range: Radians,
}

/// One value of a file, as a deviation from the nominal angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightedReading {
    /// In which pass of its direction, from 1.
    pub pass: u32,
    /// In which direction.
    pub approach: Approach,
    /// Which line of the plate.
    pub line: usize,
    /// Reading − nominal angle.
    pub deviation: Radians,
}

/// What only a file of such values can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SightedFault {
    /// A number that is none of a line or a pass.
    #[error(transparent)]
    Number(#[from] RotaryFault),
    /// Another placement than the one that is due.
    #[error(
        "`offset` is {seen}, and the placement that is due is the one at offset {due}: give the file \
         of that one"
    )]
    OtherPlacement {
        /// The cell.
        seen: String,
        /// Which placement is due.
        due: String,
    },
    /// A pass that is not made.
    #[error("pass {seen} is none of those that are made; the passes of a placement are {expected}")]
    UnknownPass {
        /// Pass and approach.
        seen: String,
        /// All of them.
        expected: String,
    },
    /// The same line twice in one pass.
    #[error("line {line} of pass {pass} is already in row {first} of the file; keep one of them")]
    ReadTwice {
        /// Pass and approach.
        pass: String,
        /// The line.
        line: usize,
        /// Where it stands in the file.
        first: usize,
    },
    /// A pass of which much is missing.
    #[error(
        "pass {pass} has {seen} of {lines} lines, at least {needed} are needed; a file holds all passes \
         of its placement"
    )]
    SparsePass {
        /// Pass and approach.
        pass: String,
        /// Its readings.
        seen: usize,
        /// The lines of the plate.
        lines: usize,
        /// How many must have been read.
        needed: usize,
    },
    /// A value that cannot be that of its line.
    #[error(transparent)]
    Implausible(#[from] Implausible),
}

/// Why a value cannot be that of its line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Implausible {
    /// Nearer to another line.
    #[error(
        "this line would be {seen:+.3} arcsec from its nominal angle, and half the line spacing is \
         {half:.3} arcsec: is it another line, or another unit?"
    )]
    OtherLine {
        /// Its deviation, arcseconds.
        seen: f64,
        /// Half the line spacing, arcseconds.
        half: f64,
    },
    /// Far from where the others are.
    #[error(
        "this line would be {seen:+.3} arcsec from its nominal angle, the other readings of this \
         placement are around {others:+.3} arcsec, and {range:.3} arcsec away from them is the limit \
         (range_arcsec): a slip of the pen, or another sign?"
    )]
    FarFromOthers {
        /// Its deviation, arcseconds.
        seen: f64,
        /// The median of the others, arcseconds.
        others: f64,
        /// The limit, arcseconds.
        range: f64,
    },
}

impl SightedPlan {
    /// The angle between two lines.
    pub fn spacing(&self) -> Radians {
        Radians::TURN / self.lines.max(1) as f64
    }

    /// The table's angle at which a line should be; it counts on over the turn.
    pub fn nominal(&self, line: usize) -> Radians {
        self.spacing() * (line as f64 + self.offset)
    }

    /// The passes in their order: forward, reverse, and in the end the first once more.
    pub fn passes(&self) -> impl Iterator<Item = (u32, Approach)> + use<> {
        (0..2 * self.passes + 1).map(|number| {
            let approach = match number % 2 {
                0 => Approach::Forward,
                _ => Approach::Reverse,
            };
            (number / 2 + 1, approach)
        })
    }

    /// How many lines of a pass must have been read.
    pub fn lines_needed(&self) -> usize {
        self.lines - MISSING_ALWAYS.max(self.lines / 4).min(self.lines)
    }

    /// Whether a line can be there, by what `others` of its placement are.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn judge(&self, deviation: Radians, others: &[f64]) -> Result<(), Implausible> {
        let half = self.spacing() / 2.0;
        if deviation.abs() > half {
            return Err(Implausible::OtherLine {
                seen: deviation.arcsec(),
                half: half.arcsec(),
            });
        }
        match median(others).map(Radians) {
            Some(middle) if (deviation - middle).abs() > self.range => {
                Err(Implausible::FarFromOthers {
                    seen: deviation.arcsec(),
                    others: middle.arcsec(),
                    range: self.range.arcsec(),
                })
            }
            _ => Ok(()),
        }
    }

    /// Reads the file of one placement: a row for each line and pass. A line that could not be read
    /// has no row.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(
        &self,
        text: &str,
        source_name: &str,
        value: Sighted,
    ) -> Result<Vec<SightedReading>, DataError<SightedFault>> {
        let table = Table::read(text, source_name, value.format())?;
        let mut readings = Vec::with_capacity(table.rows());
        let mut rows = BTreeMap::new();
        for row in 0..table.rows() {
            let it = self.reading(&table, row, value)?;
            let name = (it.pass, it.approach.symbol(), it.line);
            if let Some(earlier) = rows.insert(name, row) {
                let fault = SightedFault::ReadTwice {
                    pass: pass_name(it.pass, it.approach),
                    line: it.line,
                    first: table.line(earlier),
                };
                return Err(table.fail(row, SIGHTED_LINE, fault.into()));
            }
            readings.push(it);
        }
        self.check_passes(&table, &readings)?;
        let all: Vec<f64> = readings.iter().map(|it| it.deviation.value()).collect();
        for (row, it) in readings.iter().enumerate() {
            let judged = self.judge(it.deviation, &all);
            judged.map_err(|why| table.fail(row, VALUE, SightedFault::from(why).into()))?;
        }
        Ok(readings)
    }

    fn reading(
        &self,
        table: &Table<SightedFault>,
        row: usize,
        value: Sighted,
    ) -> Result<SightedReading, DataError<SightedFault>> {
        let offset = table.number(row, OFFSET)?;
        if (offset - self.offset).abs() > 1e-9 {
            let (seen, due) = (offset.to_string(), self.offset.to_string());
            let fault = SightedFault::OtherPlacement { seen, due };
            return Err(table.fail(row, OFFSET, fault.into()));
        }
        let (pass, approach) = (whole(table, row, PASS)?, table.approach(row, APPROACH)?);
        let pass = u32::try_from(pass).unwrap_or(u32::MAX);
        if !self.passes().any(|it| it == (pass, approach)) {
            let expected: Vec<_> = self.passes().map(|it| pass_name(it.0, it.1)).collect();
            let fault = SightedFault::UnknownPass {
                seen: pass_name(pass, approach),
                expected: expected.join(", "),
            };
            return Err(table.fail(row, PASS, fault.into()));
        }
        let (line, lines) = (whole(table, row, SIGHTED_LINE)?, self.lines);
        if line >= lines {
            let (column, seen) = ("line", line);
            let fault = SightedFault::from(RotaryFault::TooLarge {
                column,
                seen,
                lines,
            });
            return Err(table.fail(row, SIGHTED_LINE, fault.into()));
        }
        let number = value.in_file(table.number(row, VALUE)?);
        Ok(SightedReading {
            pass,
            approach,
            line,
            deviation: value.deviation(number, self.nominal(line)),
        })
    }

    fn check_passes(
        &self,
        table: &Table<SightedFault>,
        readings: &[SightedReading],
    ) -> Result<(), DataError<SightedFault>> {
        for (pass, approach) in self.passes() {
            let own = |it: &&SightedReading| (it.pass, it.approach) == (pass, approach);
            let (seen, needed) = (readings.iter().filter(own).count(), self.lines_needed());
            if seen < needed {
                let fault = SightedFault::SparsePass {
                    pass: pass_name(pass, approach),
                    seen,
                    lines: self.lines,
                    needed,
                };
                return Err(table.fail(table.rows() - 1, PASS, fault.into()));
            }
        }
        Ok(())
    }
}

/// A pass as people write it: `1+`, `1-`, `2+`.
pub fn pass_name(pass: u32, approach: Approach) -> String {
    format!("{pass}{}", approach.symbol())
}

#[cfg(test)]
#[path = "sighted_tests.rs"]
mod tests;
