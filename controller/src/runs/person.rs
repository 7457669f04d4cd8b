//! Whoever is asked while a procedure waits, and wherever he is.

use serde_json::Value;

use super::teller::Told;
use crate::failure::Failure;

/// What the drives do while a person is asked, and as soon as the question is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveState {
    /// The run has switched its drives off.
    Off,
    /// The axis holds its place under power.
    Holding,
}

impl DriveState {
    /// What a person must know before he goes near; `answering` is how he answers, as in `you press Enter`.
    pub(crate) fn warning(self, answering: &str) -> String {
        match self {
            Self::Off => format!(
                "the drives of this run are switched off, which is not a safe stop: make the machine safe first; as \
                 soon as {answering} they may be switched on"
            ),
            Self::Holding => format!(
                "the axis holds its place under power and moves as soon as {answering}: be out of its way first"
            ),
        }
    }
}

/// What a person is asked.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// What it is about, for programs: `turn_plate`, `set_up_line`, …
    pub what: &'static str,
    /// For the person.
    pub text: String,
    /// The words that answer it.
    pub answers: &'static [&'static str],
    /// Whether any other line of text answers it, too: something that was read.
    pub takes_text: bool,
    /// Whether hands are in the machine until it is answered: nothing else moves then.
    pub by_hand: bool,
    /// What the drives do meanwhile, where a person must know it.
    pub(crate) drives: Option<DriveState>,
    /// What is to be done, for programs.
    pub task: Value,
}

impl Question {
    /// What the person must know of the drives first, where any are driven; `answering` is how he answers.
    pub fn warning(&self, answering: &str) -> Option<String> {
        self.drives.map(|drives| drives.warning(answering))
    }

    /// What is done by hand while the drives are as said: `done` when it is.
    pub(crate) fn of_work(
        what: &'static str,
        text: String,
        drives: DriveState,
        task: Value,
    ) -> Self {
        Self {
            what,
            text,
            answers: &["done"],
            takes_text: false,
            by_hand: true,
            drives: Some(drives),
            task,
        }
    }
}

/// Who is asked. The machine lives on meanwhile: a procedure asks once, and then again and again for the answer.
pub trait Person {
    /// Asks.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn ask(&mut self, question: Question) -> Result<(), Failure>;

    /// The answer to what was asked last: one of its words, or a line of text; `None` while there is none.
    ///
    /// # Errors
    /// When there will not be one any more.
    fn answer(&mut self) -> Result<Option<String>, Failure>;

    /// Says something that needs no answer.
    fn tell(&mut self, text: &str);

    /// Says, as soon as it is so, that a point of a job was reached. No question begins with it.
    fn reached(&mut self, point: Told);
}
