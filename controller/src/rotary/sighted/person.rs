//! The person who reads the lines of a plate.

use core::time::Duration;

use compensator::rotary::Sighted;
use units::Radians;

use crate::failure::Failure;
use crate::rotary::operator::Operator;

/// What a question is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// The value of a line of the plate.
    Line {
        /// Which line.
        line: u32,
        /// What is to be read of it.
        value: Sighted,
        /// The table's angle at which it should be.
        nominal: Radians,
    },
    /// Whether a placement that was read shall be closed.
    Close,
}

/// What a person is asked.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// About what.
    pub asked: Asked,
    /// In words.
    pub text: String,
    /// Whether an answer makes the table turn.
    pub turns: bool,
    /// Whether his hands turn it: nothing else may move until he is no longer asked.
    pub by_hand: bool,
}

/// Who turns the plate and reads its lines. Whoever asks lives on meanwhile: he asks once, and then
/// repeatedly for the answer.
pub trait Person: Operator {
    /// Says something that needs no answer.
    fn tell(&mut self, text: &str);

    /// Asks.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn question(&mut self, question: &Question) -> Result<(), Failure>;

    /// The answer to the last question, one line of text; `None` while there is none.
    ///
    /// # Errors
    /// When there will not be one any more.
    fn answer(&mut self) -> Result<Option<String>, Failure>;

    /// Says why the answer was not taken; the question is asked again.
    ///
    /// # Errors
    /// When it would only be answered alike.
    fn refuse(&mut self, why: &str) -> Result<(), Failure>;

    /// Lets so much time pass at most, or less when something is typed.
    fn wait(&mut self, at_most: Duration);
}
