//! Whether the numbers of a data file can be those of a stage at all: in another unit than their columns name, all of
//! them may agree with one another, and figures of them look like figures.
//!
//! The limits are such that sound data do not meet them: what is smaller than that is believed. A rack of more than 10 m may, and is
//! judged in parts: of its numbers alone it looks like a stage of some millimetres in µm.

use crate::Failure;

/// From the first to the last place of a linear axis, mm: the longest guides and interferometers there are.
const TRAVEL_MM: f64 = 100e3;
/// Beyond it somebody is asked to look.
const LONG_TRAVEL_MM: f64 = 10e3;
/// Deviations of a linear axis are nearer to the middle of all, mm: beyond that nobody calibrates, but mends.
const DEVIATION_MM: f64 = 5.0;
/// Deviations of the lines of one placement of a plate are nearer to their middle, arcsec.
const DEVIATION_ARCSEC: f64 = 7200.0;

/// A row of a file: where its last wanted cell stands, and what its wanted cells say.
struct Row {
    line: usize,
    column: usize,
    cells: Vec<f64>,
}

/// The rows of a file that was read and found sound, with the cells below these names.
fn rows(text: &str, names: &[&str]) -> Vec<Row> {
    let lines = text.lines().enumerate();
    let mut lines = lines.filter(|(_, it)| !it.trim().is_empty() && !it.trim().starts_with('#'));
    let header = lines.next().map_or("", |it| it.1);
    let places: Option<Vec<usize>> = names
        .iter()
        .map(|name| header.split(',').position(|it| it.trim() == *name))
        .collect();
    let places = places.unwrap_or_default();
    let row = |(at, line): (usize, &str)| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |place: &usize| cells.get(*place)?.trim().parse().ok();
        let last = *places.last()?;
        let before: usize = cells[..last.min(cells.len())]
            .iter()
            .map(|it| it.chars().count() + 1)
            .sum();
        Some(Row {
            line: at + 1,
            column: before + 1,
            cells: places.iter().map(number).collect::<Option<_>>()?,
        })
    };
    lines.filter_map(row).collect()
}

/// The middle of some numbers; 0 of none.
fn middle(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

/// The number that is farthest from the middle of all, and how far.
fn farthest(numbers: &[f64]) -> Option<(usize, f64)> {
    let middle = middle(numbers.to_vec());
    let off = numbers.iter().map(|it| (it - middle).abs());
    // Of several the first.
    let off: Vec<(usize, f64)> = off.enumerate().collect();
    off.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1))
}

fn refused(file: &str, row: &Row, seen: &str, expected: &str, help: &str) -> Failure {
    Failure::Usage {
        what: format!(
            "{file}:{}:{}: {seen}; expected {expected}",
            row.line, row.column
        ),
        help: help.into(),
    }
}

/// Judges places and what was measured there, in columns that name millimetres. What is doubtful is returned.
///
/// # Errors
/// When no stage has such a travel, or such deviations.
pub(crate) fn positions(
    text: &str,
    file: &str,
    [target, measured]: [&str; 2],
) -> Result<Option<String>, Failure> {
    let rows = rows(text, &[target, measured]);
    let help = "are both columns in µm, or in inches? Convert their values to mm; give a rack of more than 10 m in parts";
    let targets = || rows.iter().map(|it| it.cells[0]);
    let (low, high) = (targets().reduce(f64::min), targets().reduce(f64::max));
    let travel = high.unwrap_or(0.0) - low.unwrap_or(0.0);
    let far = rows.iter().find(|it| Some(it.cells[0]) == high);
    if let Some(row) = far.filter(|_| travel > TRAVEL_MM) {
        let seen = format!("the places lie {travel} mm apart");
        let expected = format!("a travel up to {} m", TRAVEL_MM / 1e3);
        return Err(refused(file, row, &seen, &expected, help));
    }
    let deviations: Vec<f64> = rows.iter().map(|it| it.cells[1] - it.cells[0]).collect();
    if let Some((at, off)) = farthest(&deviations).filter(|(_, off)| *off > DEVIATION_MM) {
        let seen = format!(
            "`{measured}` − `{target}` is {:.3} mm, {off:.3} mm from the middle of all",
            deviations[at]
        );
        let expected = format!("deviations within {DEVIATION_MM} mm of their middle");
        return Err(refused(file, &rows[at], &seen, &expected, help));
    }
    let doubt = (travel > LONG_TRAVEL_MM).then(|| {
        format!(
            "warning: {file}: its places lie {} m apart; {help}",
            travel / 1e3
        )
    });
    Ok(doubt)
}

/// Judges deviations of the lines of a plate, in a column that names seconds of arc.
///
/// # Errors
/// When no table and no plate have such.
pub(crate) fn plate(text: &str, file: &str) -> Result<(), Failure> {
    let rows = rows(text, &["offset", "deviation_arcsec"]);
    let mut placements = rows.chunk_by(|a, b| a.cells[0] == b.cells[0]);
    placements.try_for_each(|placement| {
        let deviations: Vec<f64> = placement.iter().map(|it| it.cells[1]).collect();
        match farthest(&deviations).filter(|(_, off)| *off > DEVIATION_ARCSEC) {
            None => Ok(()),
            Some((at, off)) => Err(refused(
                file,
                &placement[at],
                &format!(
                    "`deviation_arcsec` is {}, {off:.0}″ from the middle of its placement",
                    deviations[at]
                ),
                &format!("deviations within {DEVIATION_ARCSEC}″ of their middle"),
                "is the column in µrad, or in parts of a second? Convert its values to seconds of arc",
            )),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stage of 60 mm that is off by up to 10 µm, with columns in `per_mm` of a millimetre.
    fn file(per_mm: f64) -> String {
        let mut text = "# by hand\nrun,approach,target_mm,measured_mm\n".to_owned();
        for run in 1..=2 {
            for at in 0..=20 {
                let target = 3.0 * f64::from(at);
                let measured = target + 0.01 * (target / 6.0).sin();
                text += &format!("{run},+,{:.6},{:.6}\n", target * per_mm, measured * per_mm);
            }
        }
        text
    }

    fn judged(text: &str) -> Result<Option<String>, String> {
        let columns = ["target_mm", "measured_mm"];
        positions(text, "x.csv", columns).map_err(|it| it.to_string())
    }

    #[test]
    fn both_columns_in_another_unit_are_refused_with_their_place() {
        assert_eq!(judged(&file(1.0)), Ok(None));
        let said = judged(&file(1000.0)).unwrap_err();
        // Of 27 mm, the tenth row.
        for part in [
            "x.csv:12:18: ",
            "deviations within 5 mm",
            "Convert their values to mm",
        ] {
            assert!(said.contains(part), "{part}: {said}");
        }
        let said = judged(&file(1e6)).unwrap_err();
        assert!(said.contains("a travel up to 100 m"), "{said}");
        // Of a good stage nothing but the travel tells it.
        let good = "run,approach,target_mm,measured_mm\n1,+,0,0\n1,+,60000,60000.5\n";
        let said = judged(good).unwrap().unwrap();
        assert!(said.contains("lie 60 m apart"), "{said}");
    }

    #[test]
    fn what_sound_data_of_all_sorts_have_is_believed() {
        // A rack of 8 m, off by 0.3 mm on each metre; a reading that slipped by 4 mm; a datum far away.
        let head = "run,approach,target_mm,measured_mm\n";
        assert_eq!(
            judged(&format!("{head}1,+,0,0\n1,+,8000,8002.4\n")),
            Ok(None)
        );
        assert_eq!(
            judged(&format!("{head}1,+,0,0\n1,+,3,7.0\n1,+,6,6.0\n")),
            Ok(None)
        );
        assert_eq!(
            judged(&format!("{head}1,+,0,700\n1,+,3,703\n1,+,6,706.001\n")),
            Ok(None)
        );
    }

    #[test]
    fn deviations_of_lines_in_another_unit_are_refused_placement_by_placement() {
        let rows = |factor: f64| {
            let mut text = "offset,line,deviation_arcsec\n".to_owned();
            for offset in 0..2 {
                for line in 0..36 {
                    // Each placement has a middle of its own.
                    let own = 1e4 * f64::from(offset);
                    let deviation = own + factor * 7.5 * (f64::from(line) / 5.0).sin();
                    text += &format!("{offset},{line},{deviation}\n");
                }
            }
            text
        };
        assert!(plate(&rows(1.0), "p.csv").is_ok());
        let said = plate(&rows(3600.0), "p.csv").unwrap_err().to_string();
        assert!(said.contains("p.csv:26:6: `deviation_arcsec`"), "{said}");
    }
}
