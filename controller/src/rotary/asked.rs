//! Whoever keeps the machine asks for the plate, and for what is read of it.

use core::time::Duration;

use compensator::rotary::Sighted;
use serde_json::json;

use crate::failure::Failure;
use crate::rotary::operator::{Operator, PlateTask};
use crate::rotary::sighted::{self, Asked, CLOSE, CLOSE_PLACEMENT, READ_LINE};
use crate::runs::{Person, Question};

/// Somebody who turns the plate, and reads its lines where no detector does.
pub(crate) struct Asking<'p> {
    person: &'p mut dyn Person,
    /// What was asked last of what is read.
    last: Option<Question>,
}

impl<'p> Asking<'p> {
    pub(crate) fn new(person: &'p mut dyn Person) -> Self {
        Self { person, last: None }
    }
}

impl Operator for Asking<'_> {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        let question = Question::of_work(PlateTask::WHAT, task.text(), json!(task));
        self.person.ask(question)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(self.person.answer()?.is_some())
    }
}

impl sighted::Person for Asking<'_> {
    fn tell(&mut self, text: &str) {
        self.person.tell(text);
    }

    fn question(&mut self, question: &sighted::Question) -> Result<(), Failure> {
        let question = asked(question);
        self.last = Some(question.clone());
        self.person.ask(question)
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        let answer = self.person.answer()?;
        Ok(answer.map(|it| match it.trim() {
            CLOSE => String::new(),
            _ => it,
        }))
    }

    fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        let Some(last) = &self.last else {
            return Ok(());
        };
        let text = format!("not taken: {why}\n{}", last.text);
        self.person.ask(Question {
            text,
            ..last.clone()
        })
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
