//! Whoever keeps the machine asks for what a job waits for.

use serde_json::json;

use crate::failure::Failure;
use crate::linear::job::JobOperator;
use crate::runs::{Person, Question};

/// What whoever keeps the machine calls it.
pub(crate) const GO_ON: &str = "go_on";

/// Somebody who says when a job goes on.
pub(crate) struct Asking<'p>(pub(crate) &'p mut dyn Person);

impl JobOperator for Asking<'_> {
    fn ask(&mut self, text: &str) -> Result<(), Failure> {
        let task = json!({"text": text, "axis_holds": true});
        let text = format!(
            "{text}\nThe axis holds its place under power, and moves as soon as this is answered: be out of its way first."
        );
        self.0.ask(Question::of_work(GO_ON, text, task))
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(self.0.answer()?.is_some())
    }
}
