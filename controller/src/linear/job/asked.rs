//! Whoever keeps the machine asks for what a job waits for.

use serde_json::json;

use crate::failure::Failure;
use crate::linear::job::{JobOperator, Reached};
use crate::runs::{DriveState, Person, Question, Told};

/// What whoever keeps the machine calls it.
pub(crate) const GO_ON: &str = "go_on";

/// Somebody who says when a job goes on, and is told of each point.
pub(crate) struct Asking<'p> {
    pub(crate) person: &'p mut dyn Person,
    /// How a point is told; `None` where nobody has the words.
    pub(crate) tells: Option<&'p dyn Fn(&Reached) -> Told>,
}

impl JobOperator for Asking<'_> {
    fn ask(&mut self, text: &str) -> Result<(), Failure> {
        let task = json!({"text": text, "axis_holds": true});
        let question = Question::of_work(GO_ON, text.to_owned(), DriveState::Holding, task);
        self.person.ask(question)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(self.person.answer()?.is_some())
    }

    fn reached(&mut self, point: &Reached) {
        if let Some(tells) = self.tells {
            self.person.reached(tells(point));
        }
    }
}
