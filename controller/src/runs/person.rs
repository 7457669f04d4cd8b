//! Whoever is asked while a procedure waits, and wherever he is.

use serde_json::Value;

use super::teller::Told;
use crate::failure::Failure;

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
    /// What is to be done, for programs.
    pub task: Value,
}

impl Question {
    /// What is done by hand: `done` when it is.
    pub(crate) fn of_work(what: &'static str, text: String, task: Value) -> Self {
        Self {
            what,
            text,
            answers: &["done"],
            takes_text: false,
            by_hand: true,
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
