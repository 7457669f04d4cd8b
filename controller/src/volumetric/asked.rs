//! Whoever keeps the machine asks for the lines of an interferometer.

use compensator::volumetric::{Axis, Point};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::failure::Failure;
use crate::runs::{DriveState, Person, Question};
use crate::volumetric::line::{LineOperator, LineOptics, LineTask};

/// Somebody who sets lines up.
pub(crate) struct Asking<'p>(pub(crate) &'p mut dyn Person);

impl LineOperator for Asking<'_> {
    fn ask_line(&mut self, task: &LineTask) -> Result<(), Failure> {
        let asked = json!(AskedLine::from(task));
        let question = Question::of_work(AskedLine::WHAT, task.text(), DriveState::Off, asked);
        self.0.ask(question)
    }

    fn is_set_up(&mut self) -> Result<bool, Failure> {
        Ok(self.0.answer()?.is_some())
    }

    fn pack_up(&mut self) -> Result<(), Failure> {
        self.0
            .tell("the interferometer is no longer needed and may be packed up");
        Ok(())
    }

    fn tell(&mut self, text: &str) {
        self.0.tell(text);
    }
}

/// A line as it is asked for, for programs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct AskedLine {
    optics: OpticsWord,
    /// The direction that straightness and angular optics see.
    side: Option<char>,
    start_mm: [f64; 3],
    end_mm: [f64; 3],
    tool_mm: [f64; 3],
    step: (usize, usize),
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum OpticsWord {
    Linear,
    Straightness,
    Angular,
}

impl AskedLine {
    /// What whoever keeps the machine calls it.
    pub(crate) const WHAT: &'static str = "set_up_line";

    /// The same as it is asked for at a terminal; `None` when nobody can see its side.
    #[cfg(feature = "program")]
    pub(crate) fn task(&self) -> Option<LineTask> {
        let side = || {
            let mut axes = Axis::ALL.into_iter();
            axes.find(|it| Some(letter(*it)) == self.side)
        };
        let point = |[x, y, z]: [f64; 3]| Point::from_mm(x, y, z);
        Some(LineTask {
            optics: match self.optics {
                OpticsWord::Linear => LineOptics::Linear,
                OpticsWord::Straightness => LineOptics::Straightness { across: side()? },
                OpticsWord::Angular => LineOptics::Angular { about: side()? },
            },
            start: point(self.start_mm),
            end: point(self.end_mm),
            tool: point(self.tool_mm),
            step: self.step,
        })
    }
}

impl From<&LineTask> for AskedLine {
    fn from(task: &LineTask) -> Self {
        let mm = |point: Point| [point.x, point.y, point.z].map(|it| it.mm());
        Self {
            optics: match task.optics {
                LineOptics::Linear => OpticsWord::Linear,
                LineOptics::Straightness { .. } => OpticsWord::Straightness,
                LineOptics::Angular { .. } => OpticsWord::Angular,
            },
            side: task.optics.side().map(letter),
            start_mm: mm(task.start),
            end_mm: mm(task.end),
            tool_mm: mm(task.tool),
            step: task.step,
        }
    }
}

const fn letter(axis: Axis) -> char {
    ['x', 'y', 'z'][axis.index()]
}

#[cfg(all(test, feature = "program"))]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_is_asked_for_by_way_of_a_service_is_the_same_one() {
        let task = LineTask {
            optics: LineOptics::Straightness { across: Axis::Z },
            start: Point::from_mm(0.0, 200.0, 150.0),
            end: Point::from_mm(500.0, 200.0, 150.0),
            tool: Point::from_mm(0.0, 0.0, -100.0),
            step: (3, 12),
        };
        let said = json!(AskedLine::from(&task)).to_string();
        assert!(said.contains("\"side\":\"z\""), "{said}");
        let heard: AskedLine = serde_json::from_str(&said).unwrap();
        assert_eq!(heard.task().unwrap().text(), task.text());
    }
}
