//! Whoever keeps the machine asks for the plate, and for what is read of it.

use core::time::Duration;

use compensator::rotary::Sighted;
use serde_json::json;

use crate::failure::Failure;
use crate::rotary::operator::{Operator, PlateTask};
use crate::rotary::sighted::{self, Asked, CLOSE, CLOSE_PLACEMENT, READ_LINE};
use crate::runs::{DriveState, Person, Question};

/// Somebody who turns the plate, and reads its lines where no detector does.
pub(crate) struct Asking<'p>(pub(crate) &'p mut dyn Person);

impl Operator for Asking<'_> {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        let question =
            Question::of_work(PlateTask::WHAT, task.text(), DriveState::Off, json!(task));
        self.0.ask(question)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(self.0.answer()?.is_some())
    }
}

impl sighted::Person for Asking<'_> {
    fn tell(&mut self, text: &str) {
        self.0.tell(text);
    }

    fn question(&mut self, question: &sighted::Question) -> Result<(), Failure> {
        self.0.ask(asked(question))
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        let answer = self.0.answer()?;
        Ok(answer.map(|it| match it.trim() {
            CLOSE => String::new(),
            _ => it,
        }))
    }

    fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        // The question comes again, and begins with it.
        self.0.tell(&format!("not taken: {why}"));
        Ok(())
    }

    /// The machine lives on by its ticks.
    fn wait(&mut self, _at_most: Duration) {}
}

/// A question about what is read, for whoever asks it.
fn asked(question: &sighted::Question) -> Question {
    let (what, answers, task): (_, &[&str], _) = match question.asked {
        Asked::Line {
            line,
            value,
            nominal,
        } => (
            READ_LINE,
            &["none", "again", "stop"],
            json!({"line": line, "value": word(value), "nominal_deg": nominal.degrees()}),
        ),
        Asked::Close => (CLOSE_PLACEMENT, &[CLOSE, "discard", "stop"], json!({})),
    };
    Question {
        what,
        text: question.text.clone(),
        answers,
        takes_text: true,
        by_hand: question.by_hand,
        drives: question.turns.then_some(DriveState::Holding),
        task,
    }
}

const fn word(value: Sighted) -> &'static str {
    match value {
        Sighted::ToLine => "to_line",
        Sighted::Angle => "angle",
        Sighted::Deviation => "deviation",
    }
}
