//! An error table in a file: positions, deviations and their uncertainties in columns.
//!
//! What was not measured has no column, and an uncertainty that is not known an empty cell. Every number is read back
//! to its last bit: only the decimal point of what is stored in metres moves, in the text.
//!
//! Absent: what else a calibration says; it stands in comments, which nobody reads back.

use units::{Approach, Metres};

use super::{ErrorTable, Node};
use crate::data::{DataError, Format, Table};

const BOTH: Format = Format {
    columns: &["position_mm", "forward_um", "reverse_um"],
    header: "position_mm,forward_um,reverse_um",
};
const BOTH_U: Format = Format {
    columns: &[
        "position_mm",
        "forward_um",
        "reverse_um",
        "u_forward_um",
        "u_reverse_um",
    ],
    header: "position_mm,forward_um,reverse_um,u_forward_um,u_reverse_um",
};
const FORWARD: Format = Format {
    columns: &["position_mm", "forward_um"],
    header: "position_mm,forward_um",
};
const FORWARD_U: Format = Format {
    columns: &["position_mm", "forward_um", "u_forward_um"],
    header: "position_mm,forward_um,u_forward_um",
};
const REVERSE: Format = Format {
    columns: &["position_mm", "reverse_um"],
    header: "position_mm,reverse_um",
};
const REVERSE_U: Format = Format {
    columns: &["position_mm", "reverse_um", "u_reverse_um"],
    header: "position_mm,reverse_um,u_reverse_um",
};

/// What only a table can have wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableFault {
    /// A position that is not beyond the one before it.
    #[error("position {} mm comes after {} mm; the positions must grow from row to row",
        units::Short(*seen_mm), units::Short(*previous_mm))]
    NotIncreasing {
        /// This row's position.
        seen_mm: f64,
        /// The one before it.
        previous_mm: f64,
    },
    /// An uncertainty below zero.
    #[error("a standard uncertainty of {} um; it cannot be negative", units::Short(*seen_um))]
    NegativeUncertainty {
        /// It.
        seen_um: f64,
    },
    /// One row.
    #[error("this is the only row; a table has at least two positions")]
    OnlyOne,
    /// Fewer than three numbers where a control expects them.
    #[error("the row has {seen} numbers; LinuxCNC reads three: nominal, forward, reverse")]
    NotThree {
        /// How many there are.
        seen: usize,
    },
    /// Rows that the control never reads.
    #[error(
        "LinuxCNC ends reading a COMP_FILE at line {ended}, the first that is no row: it would never read this one; \
         move comments and empty lines to the end of the file"
    )]
    NeverRead {
        /// The line at which it ends.
        ended: usize,
    },
    /// More rows than the control keeps.
    #[error("LinuxCNC keeps {max} rows for a joint, and this is one more; leave some out")]
    TooMany {
        /// The most.
        max: usize,
    },
    /// A correction that turns the axis back.
    #[error(
        "with its `{approach}` value this row sends the axis to {} mm, the row before it to {} mm: a control that does \
         that goes backwards; are the columns what --comp-file-type says, and the unit what --unit says?",
        units::Short(*seen_mm), units::Short(*previous_mm)
    )]
    TurnsBack {
        /// `+` or `-`.
        approach: char,
        /// Where this row's correction leads.
        seen_mm: f64,
        /// Where the one before it leads.
        previous_mm: f64,
    },
}

impl ErrorTable {
    /// The table in the format that [`Self::from_csv`] reads, to the last bit of every number.
    pub fn to_csv(&self) -> String {
        let (forward, reverse) = (self.knows(Approach::Forward), self.knows(Approach::Reverse));
        let with_u = (self.nodes().iter()).any(|it| it.u_forward.or(it.u_reverse).is_some());
        let format = format_of(forward, reverse, with_u);
        let mut text = format!("{}\n", format.header);
        for node in self.nodes() {
            let values = [node.forward, node.reverse, node.u_forward, node.u_reverse];
            let is_there = [forward, reverse, forward && with_u, reverse && with_u];
            let position = moved(node.position, MILLI);
            let cells = values
                .into_iter()
                .zip(is_there)
                .filter(|(_, is_there)| *is_there);
            let cells = cells.map(|(value, _)| value.map_or(String::new(), |it| moved(it, MICRO)));
            let row: Vec<String> = core::iter::once(position).chain(cells).collect();
            text += &format!("{}\n", row.join(","));
        }
        text
    }

    /// Reads `position_mm,forward_um,reverse_um,u_forward_um,u_reverse_um` (columns in any order, without those of an
    /// approach that was not measured and without uncertainties where none is known; `#` comment lines, decimal
    /// points). Deviations are actual − target.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::error_table::ErrorTable;
    /// use units::Metres;
    ///
    /// let table = ErrorTable::from_csv("# of another laser\nposition_mm,forward_um\n0,0\n60,4.2\n", "x.csv")?;
    /// assert_eq!(table.nodes()[1].forward, Some(Metres(4.2e-6)));
    /// assert_eq!(ErrorTable::from_csv(&table.to_csv(), "again.csv")?, table);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The first thing that is not as it should be, with `source_name`, line and column.
    pub fn from_csv(text: &str, source_name: &str) -> Result<Self, DataError<TableFault>> {
        let (forward, reverse, with_u) = named(text);
        let format = format_of(forward, reverse, with_u);
        let file = Table::read(text, source_name, format)?;
        let mut nodes = Vec::with_capacity(file.rows());
        for row in 0..file.rows() {
            let at = |name: &str| format.columns.iter().position(|it| *it == name);
            let deviation = |name| match at(name) {
                Some(column) => length(&file, (row, column), MICRO).map(Some),
                None => Ok(None),
            };
            let u = |name| match at(name) {
                Some(column) => uncertainty(&file, row, column),
                None => Ok(None),
            };
            nodes.push(Node {
                position: length(&file, (row, 0), MILLI)?,
                forward: deviation("forward_um")?,
                reverse: deviation("reverse_um")?,
                u_forward: u("u_forward_um")?,
                u_reverse: u("u_reverse_um")?,
            });
        }
        made(&file, nodes)
    }
}

/// What only the order of the rows shows.
fn made(file: &Table<TableFault>, nodes: Vec<Node>) -> Result<ErrorTable, DataError<TableFault>> {
    for (row, pair) in nodes.windows(2).enumerate() {
        let (previous, seen) = (pair[0].position, pair[1].position);
        if seen <= previous {
            let fault = TableFault::NotIncreasing {
                seen_mm: seen.mm(),
                previous_mm: previous.mm(),
            };
            return Err(file.fail(row + 1, 0, fault.into()));
        }
    }
    // Numbers, order and columns have been judged; what is left is how many rows there are.
    ErrorTable::new(nodes).map_err(|_| file.fail(0, 0, TableFault::OnlyOne.into()))
}

fn uncertainty(
    file: &Table<TableFault>,
    row: usize,
    column: usize,
) -> Result<Option<Metres>, DataError<TableFault>> {
    if file.text(row, column).is_empty() {
        return Ok(None);
    }
    let u = length(file, (row, column), MICRO)?;
    if u < Metres::ZERO {
        let fault = TableFault::NegativeUncertainty { seen_um: u.um() };
        return Err(file.fail(row, column, fault.into()));
    }
    Ok(Some(u))
}

/// Digits behind which the point of millimetres and micrometres stands in metres.
const MILLI: i32 = 3;
const MICRO: i32 = 6;

/// The shortest decimal of `length`, its point moved to the right by `digits`.
fn moved(length: Metres, digits: i32) -> String {
    if length == Metres::ZERO {
        return format!("{}", length.value());
    }
    let shortest = format!("{:e}", length.value());
    let (mantissa, exponent) = shortest.split_once('e').expect("it was written so");
    let (sign, mantissa) = match mantissa.strip_prefix('-') {
        Some(rest) => ("-", rest),
        None => ("", mantissa),
    };
    let all = mantissa.replace('.', "");
    let exponent: i32 = exponent.parse().expect("it was written so");
    let before = exponent + 1 + digits;
    match usize::try_from(before) {
        Ok(0) | Err(_) => format!(
            "{sign}0.{}{all}",
            "0".repeat(before.unsigned_abs() as usize)
        ),
        Ok(before) if before >= all.len() => {
            format!("{sign}{all}{}", "0".repeat(before - all.len()))
        }
        Ok(before) => format!("{sign}{}.{}", &all[..before], &all[before..]),
    }
}

/// The length in a cell of millimetres or micrometres, to its last bit.
fn length(
    file: &Table<TableFault>,
    (row, column): (usize, usize),
    digits: i32,
) -> Result<Metres, DataError<TableFault>> {
    let near = file.number(row, column)?;
    let text = file.text(row, column);
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let exponent: Option<i32> = exponent.parse().ok();
    let metres = exponent.and_then(|it| format!("{mantissa}e{}", it - digits).parse().ok());
    // An exponent that is no exponent of ours was of a number that is 0.
    Ok(Metres(metres.unwrap_or(near)))
}

/// Which approaches the header names, and whether it names uncertainties.
fn named(text: &str) -> (bool, bool, bool) {
    // The mark that spreadsheets begin with would hide that the first line is a comment.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let is_header = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let header = text.lines().find(is_header).unwrap_or_default();
    let has = |start: &str| header.split(',').any(|it| it.trim().starts_with(start));
    (has("forward"), has("reverse"), has("u_"))
}

fn format_of(forward: bool, reverse: bool, with_u: bool) -> &'static Format {
    match (forward, reverse, with_u) {
        (true, false, false) => &FORWARD,
        (true, false, true) => &FORWARD_U,
        (false, true, false) => &REVERSE,
        (false, true, true) => &REVERSE_U,
        (_, _, false) => &BOTH,
        (_, _, true) => &BOTH_U,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let failure = ErrorTable::from_csv(text, "t.csv").unwrap_err().to_string();
        assert!(failure.contains(expected), "{failure}");
    }

    #[test]
    fn a_byte_order_mark_before_a_comment_changes_nothing() {
        let text = "# a table\nposition_mm,forward_um,reverse_um,u_forward_um,u_reverse_um\n0,0,1,1,1\n9,2,3,1,1\n";
        let marked = ErrorTable::from_csv(&format!("\u{feff}{text}"), "t.csv");
        assert_eq!(marked, ErrorTable::from_csv(text, "t.csv"));
    }

    #[test]
    fn what_is_wrong_in_a_file_is_told_with_its_place() {
        check(
            "position_mm,forward_um\n0,1\n3,x\n",
            "t.csv:3:3: `forward_um` is `x`, not a number",
        );
        check(
            "position_mm,forward_um\n3,1\n3,2\n",
            "t.csv:3:1: position 3 mm comes after 3 mm",
        );
        check(
            "position_mm,forward_um\n3,1\n",
            "t.csv:2:1: this is the only row",
        );
        check(
            "position_mm,forward_mm\n3,1\n",
            "t.csv:1:13: column `forward_mm` is in the wrong unit",
        );
        check(
            "position_mm\n3\n",
            "column `forward_um` is missing; the header must be `position_mm,forward_um,reverse_um`",
        );
        check(
            "position_mm,reverse_um,u_reverse_um\n0,1,0.1\n3,1,-0.1\n",
            "t.csv:3:5: a standard uncertainty of -0.1 um",
        );
        check("position_mm,reverse_um\n0;1\n", "cells");
    }

    #[test]
    fn only_the_point_moves() {
        for (metres, expected) in [
            (0.0, "0"),
            (0.06, "60"),
            (-1.5e-9, "-0.0015"),
            (4.2e-6, "4.2"),
            (1e-6, "1"),
            (0.012_345_678, "12345.678"),
        ] {
            let digits = if metres == 0.06 { MILLI } else { MICRO };
            assert_eq!(moved(Metres(metres), digits), expected);
        }
    }

    proptest! {
        #[test]
        fn a_table_is_read_back_to_the_last_bit(
            steps in prop::collection::vec((1e-6..1e-2, -1e-3..1e-3, -1e-3..1e-3, 0.0..1e-6), 2..40),
            (forward, reverse) in prop_oneof![
                Just((true, true)), Just((true, false)), Just((false, true))
            ],
            with_u in any::<bool>(),
        ) {
            let mut position = -0.05;
            let nodes = steps.into_iter().enumerate().map(|(at, (step, f, r, u))| {
                position += step;
                // One of them is not known.
                let u = (with_u && at != 1).then_some(Metres(u));
                Node {
                    position: Metres(position),
                    forward: forward.then_some(Metres(f)),
                    reverse: reverse.then_some(Metres(r)),
                    u_forward: u.filter(|_| forward),
                    u_reverse: u.filter(|_| reverse),
                }
            });
            let table = ErrorTable::new(nodes.collect()).unwrap();
            let read = ErrorTable::from_csv(&table.to_csv(), "t.csv").unwrap();
            prop_assert_eq!(read, table);
        }
    }
}
