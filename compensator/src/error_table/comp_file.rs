//! LinuxCNC's `COMP_FILE` as an error table.
//!
//! Source: LinuxCNC, `src/emc/motion/usrmotintf.cc` (`usrmotLoadComp`: what a row is, and where reading ends),
//! `command.c` (`EMCMOT_SET_JOINT_COMP`: rows that grow, straight lines between them), `motion.c` (nothing but the
//! first and last value beyond them) and `control.c` (`compute_screw_comp`: looked up at the commanded position, by
//! the direction of motion; `output_to_hal`: added to it).
//!
//! | symbol | name here |
//! |---|---|
//! | nominal | where the axis shall go |
//! | trim | what is added to that to get what is commanded |
//!
//! A joint commanded to n + trim(n) is taken to be at n, so its deviation at the command n + trim(n) is −trim(n). The
//! deviation at a row's own place therefore belongs to a nominal a little beside it: that is found exactly, by the
//! straight lines that the control draws.

use units::{Approach, Metres};

use super::listed::TableFault;
use super::{ErrorTable, Node};
use crate::data::{DataError, Fault};

/// As many rows a joint can have (`EMCMOT_COMP_SIZE`).
pub const ROWS_MAX: usize = 256;

/// What the second and third number of a row are (`COMP_FILE_TYPE`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompFileType {
    /// 0: positions; the trim is nominal − position.
    Positions,
    /// 1: the trims themselves.
    Trims,
}

/// nominal, forward trim, reverse trim, in metres.
#[derive(Clone, Copy, Debug)]
struct Row {
    line: usize,
    nominal: f64,
    trims: [f64; 2],
}

/// The deviations of a joint that is corrected by the COMP_FILE `text`, whose numbers are in `unit`.
///
/// # Example
///
/// ```
/// use compensator::error_table::{CompFileType, comp_file};
/// use units::Metres;
///
/// // To be at 60 mm it is commanded to 59.990 mm, so it goes 10 µm too far.
/// let text = "0 0 0\n60 -0.010 -0.010\n";
/// let table = comp_file(text, "x.comp", CompFileType::Trims, Metres::from_mm(1.0))?;
/// let deviation = table.nodes()[1].forward.expect("both sides are there");
/// assert!((deviation.um() - 10.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The first thing that LinuxCNC would not read so, or no axis can do, with `source_name`, line and column.
pub fn comp_file(
    text: &str,
    source_name: &str,
    kind: CompFileType,
    unit: Metres,
) -> Result<ErrorTable, DataError<TableFault>> {
    let fail = |line, column, fault| DataError {
        file: source_name.to_owned(),
        line,
        column,
        fault,
    };
    let rows = rows(text, kind, unit).map_err(|(line, column, fault)| fail(line, column, fault))?;
    let mut sides = [Vec::new(), Vec::new()];
    for (side, approach) in [Approach::Forward, Approach::Reverse]
        .into_iter()
        .enumerate()
    {
        sides[side] = deviations(&rows, side, approach)
            .map_err(|(line, fault)| fail(line, side + 2, fault.into()))?;
    }
    let nodes = rows.iter().enumerate().map(|(at, row)| Node {
        position: Metres(row.nominal),
        forward: Some(Metres(sides[0][at])),
        reverse: Some(Metres(sides[1][at])),
        u_forward: None,
        u_reverse: None,
    });
    ErrorTable::new(nodes.collect()).map_err(|_| fail(1, 1, TableFault::OnlyOne.into()))
}

type At = (usize, usize, Fault<TableFault>);

fn rows(text: &str, kind: CompFileType, unit: Metres) -> Result<Vec<Row>, At> {
    let mut rows: Vec<Row> = Vec::new();
    let mut ended = None;
    for (index, text) in text.lines().enumerate() {
        let line = index + 1;
        let is_row = !matches!(text.trim_start().chars().next(), None | Some('#' | ';'));
        match (is_row, ended) {
            (false, None) => ended = Some(line),
            (false, Some(_)) => {}
            (true, Some(ended)) => return Err((line, 1, TableFault::NeverRead { ended }.into())),
            (true, None) => rows.push(row(line, text, kind, unit)?),
        }
        let [.., before, last] = rows.as_slice() else {
            continue;
        };
        if last.nominal <= before.nominal {
            let fault = TableFault::NotIncreasing {
                seen_mm: last.nominal * 1e3,
                previous_mm: before.nominal * 1e3,
            };
            return Err((last.line, 1, fault.into()));
        }
        if rows.len() > ROWS_MAX {
            return Err((line, 1, TableFault::TooMany { max: ROWS_MAX }.into()));
        }
    }
    match rows.is_empty() {
        true => Err((1, 1, Fault::NoRows)),
        false => Ok(rows),
    }
}

fn row(line: usize, text: &str, kind: CompFileType, unit: Metres) -> Result<Row, At> {
    const NAMES: [&str; 3] = ["nominal", "forward", "reverse"];
    let mut values = [0.0; 3];
    let mut words = text.split_whitespace();
    for (at, name) in NAMES.into_iter().enumerate() {
        let Some(seen) = words.next() else {
            let column = text.trim_end().chars().count() + 1;
            return Err((line, column, TableFault::NotThree { seen: at }.into()));
        };
        let place = || {
            1 + text[..seen.as_ptr() as usize - text.as_ptr() as usize]
                .chars()
                .count()
        };
        values[at] = number(name, seen).map_err(|fault| (line, place(), fault))?;
    }
    let [nominal, forward, reverse] = values.map(|it| it * unit.value());
    let trims = match kind {
        CompFileType::Positions => [nominal - forward, nominal - reverse],
        CompFileType::Trims => [forward, reverse],
    };
    Ok(Row {
        line,
        nominal,
        trims,
    })
}

fn number(column: &'static str, seen: &str) -> Result<f64, Fault<TableFault>> {
    let seen = seen.to_owned();
    match seen.parse::<f64>() {
        Ok(value) if value.is_finite() && value.abs() < 1e12 => Ok(value),
        Ok(_) => Err(Fault::NotFinite { column, seen }),
        Err(_) if seen.replace(',', ".").parse::<f64>().is_ok() => {
            Err(Fault::DecimalComma { column, seen })
        }
        Err(_) => Err(Fault::NotANumber { column, seen }),
    }
}

/// The deviation at each row's own place as a command.
fn deviations(
    rows: &[Row],
    side: usize,
    approach: Approach,
) -> Result<Vec<f64>, (usize, TableFault)> {
    let command = |row: &Row| row.nominal + row.trims[side];
    for pair in rows.windows(2) {
        let (previous, seen) = (command(&pair[0]), command(&pair[1]));
        if seen <= previous {
            let fault = TableFault::TurnsBack {
                approach: approach.symbol(),
                seen_mm: seen * 1e3,
                previous_mm: previous * 1e3,
            };
            return Err((pair[1].line, fault));
        }
    }
    let places = rows.iter().map(|it| it.nominal);
    Ok(places
        .map(|place| -trim_before(rows, side, place))
        .collect())
}

/// The trim of the nominal that is commanded to `place`.
fn trim_before(rows: &[Row], side: usize, place: f64) -> f64 {
    let command = |row: &Row| row.nominal + row.trims[side];
    let after = rows.partition_point(|row| command(row) <= place);
    let (Some(before), Some(after)) = (after.checked_sub(1).map(|it| &rows[it]), rows.get(after))
    else {
        let end = if after == 0 {
            &rows[0]
        } else {
            &rows[rows.len() - 1]
        };
        return end.trims[side];
    };
    let share = (place - command(before)) / (command(after) - command(before));
    before.trims[side] + share * (after.trims[side] - before.trims[side])
}

#[cfg(test)]
mod tests {
    use super::*;

    const MM: Metres = Metres(1e-3);

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let failure = comp_file(text, "x.comp", CompFileType::Trims, MM).unwrap_err();
        assert!(failure.to_string().contains(expected), "{failure}");
    }

    #[test]
    fn what_linuxcnc_would_read_otherwise_is_refused_with_its_place() {
        check("0 0 0\n1 0\n", "x.comp:2:4: the row has 2 numbers");
        check(
            "0 0 0\n\n1 0 0\n",
            "x.comp:3:1: LinuxCNC ends reading a COMP_FILE at line 2",
        );
        check(
            "# head\n0 0 0\n1 0 0\n",
            "x.comp:2:1: LinuxCNC ends reading a COMP_FILE at line 1",
        );
        check(
            "0 0 0\n0 0 0\n",
            "x.comp:2:1: position 0 mm comes after 0 mm",
        );
        check(
            "0 0 0\n1 0,1 0\n",
            "x.comp:2:3: `forward` is `0,1`: write a decimal point",
        );
        check(
            "0 0 0\n1 0 up\n",
            "x.comp:2:5: `reverse` is `up`, not a number",
        );
        check(
            "0 0 0\n1 0 nan\n",
            "x.comp:2:5: `reverse` is `nan`, not a finite number",
        );
        check(
            "0 0 0\n1 -2 0\n",
            "x.comp:2:2: with its `+` value this row sends the axis to -1 mm",
        );
        check("0 0 0\n", "x.comp:1:1: this is the only row");
        check("# nothing\n", "there is no data row");
        let rows: Vec<String> = (0..=ROWS_MAX).map(|it| format!("{it} 0 0")).collect();
        check(&rows.join("\n"), "x.comp:257:1: LinuxCNC keeps 256 rows");
    }

    #[test]
    fn positions_and_trims_are_two_ways_to_write_one_table() {
        // The example of usrmotLoadComp, in its units.
        let positions = "0.000000 0.000000 -0.001279\n0.100000 0.098742  0.051632\n0.200000 0.171529  0.194216\n";
        let trims = "0 0 0.001279\n0.1 0.001258 0.048368\n0.2 0.028471 0.005784\n";
        let read = |text, kind| comp_file(text, "x.comp", kind, MM).unwrap();
        let (first, second) = (
            read(positions, CompFileType::Positions),
            read(trims, CompFileType::Trims),
        );
        for (first, second) in first.nodes().iter().zip(second.nodes()) {
            for side in [Approach::Forward, Approach::Reverse] {
                let of = |it: &Node| it.deviation(side).unwrap().value();
                assert!((of(first) - of(second)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn inches_are_lengths_too() {
        let table = comp_file(
            "0 0 0\n1 0 0.001 # ok\n",
            "x",
            CompFileType::Trims,
            Metres(25.4e-3),
        )
        .unwrap();
        assert_eq!(table.nodes()[1].position, Metres(25.4e-3));
        let reverse = table.nodes()[1].reverse.unwrap();
        assert!((reverse.um() + 25.4).abs() < 0.03, "{}", reverse.um());
    }
}
