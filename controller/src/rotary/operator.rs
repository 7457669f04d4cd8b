//! The person who turns the plate.

use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// What is to be done with the plate. Lines are those of the plate; a plate turned by some lines
/// is read so many line spacings later, at larger angles of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlateMove {
    /// Fix it, no matter how: this is the first placement.
    Fix,
    /// Fix it so that a person finds its lines where he is asked for them: line 0 at this table position,
    /// in line spacings.
    FixAt {
        /// In lines from the table's zero.
        offset: f64,
    },
    /// Turn it by so many lines from where it was read last.
    TurnBy(f64),
    /// Turn it by so many lines from where it lay at an offset; it is not known where it lies now.
    TurnFrom {
        /// In lines from the first placement.
        offset: f64,
        /// By how many lines.
        lines: f64,
    },
}

/// A placement that is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlateTask {
    /// The table's axis.
    pub axis: String,
    /// The plate's serial number.
    pub plate: String,
    /// Its lines.
    pub lines: u32,
    /// Which placement, from 1, of how many.
    pub step: (usize, usize),
    /// Where the plate shall lie, in lines from the first placement.
    pub offset: f64,
    /// What is to be done.
    pub by: PlateMove,
}

impl PlateTask {
    /// What whoever keeps the machine calls it.
    pub(crate) const WHAT: &'static str = "turn_plate";

    /// For the person.
    pub fn text(&self) -> String {
        let turn = |lines: f64, from: &str| {
            format!(
                "turn it on the table by {} lines ({:.4}°){from}, so that its lines are read at {} \
                 angles, and fix it again",
                lines.abs(),
                lines.abs() * 360.0 / f64::from(self.lines),
                if lines < 0.0 { "smaller" } else { "larger" },
            )
        };
        let what = match self.by {
            PlateMove::Fix => "fix it on the table, in any position".to_owned(),
            PlateMove::FixAt { offset } => format!(
                "fix it on the table so that its line 0 lies under the cross-hair at the table's angle \
                 {:.4}°, and its lines follow each other at growing angles",
                offset * 360.0 / f64::from(self.lines)
            ),
            PlateMove::TurnBy(lines) if lines.abs() < 1e-9 => "leave it where it is".to_owned(),
            PlateMove::TurnBy(lines) => turn(lines, ""),
            PlateMove::TurnFrom { offset, lines } => {
                turn(lines, &format!(" from where it lay at offset {offset}"))
            }
        };
        let (number, of) = self.step;
        format!(
            "axis {}, plate {}, placement {number} of {of}: {what}",
            self.axis, self.plate
        )
    }
}

/// Who turns the plate. The machine keeps running while it waits: it asks once, and then repeatedly
/// whether it has been done. The axis is switched off meanwhile, which is not a safe stop.
pub trait Operator {
    /// Asks for a placement.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure>;

    /// Whether it has been done.
    ///
    /// # Errors
    /// When it will not be done any more.
    fn is_done(&mut self) -> Result<bool, Failure>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(by: PlateMove, expected: &str) {
        let task = PlateTask {
            axis: "c".into(),
            plate: "A7".into(),
            lines: 360,
            step: (2, 4),
            offset: 73.0,
            by,
        };
        let text = task.text();
        assert!(text.starts_with("axis c, plate A7, placement 2 of 4: "));
        assert!(text.contains(expected), "{text}");
    }

    #[test]
    fn a_person_is_told_how_far_and_which_way() {
        check(PlateMove::Fix, "in any position");
        check(
            PlateMove::FixAt { offset: 5.0 },
            "line 0 lies under the cross-hair at the table's angle 5.0000°",
        );
        check(PlateMove::TurnBy(73.0), "by 73 lines (73.0000°)");
        check(PlateMove::TurnBy(73.0), "at larger angles");
        check(PlateMove::TurnBy(-31.5), "by 31.5 lines (31.5000°)");
        check(PlateMove::TurnBy(-31.5), "at smaller angles");
        check(PlateMove::TurnBy(0.0), "leave it where it is");
        let from = PlateMove::TurnFrom {
            offset: 73.0,
            lines: 89.0,
        };
        check(
            from,
            "by 89 lines (89.0000°) from where it lay at offset 73",
        );
    }
}
