//! Questions that a run in a service asks, put to the person at this terminal.

use std::path::Path;

use serde_json::Value;

use crate::Failure;
use crate::program::exchange::plain;
use crate::program::operator::Terminal;
use crate::program::output::Output;
use crate::rotary::sighted::Person as _;

/// One sort of question: how it is put to a person, and what his answer is for the service.
pub(crate) struct Asked {
    /// What the service calls it.
    pub(crate) what: &'static str,
    /// Puts it, by its text and its task.
    pub(crate) ask: fn(&mut Terminal, &str, &Value) -> Result<(), Failure>,
    /// The answer, once there is one.
    pub(crate) answer: fn(&mut Terminal) -> Result<Option<String>, Failure>,
}

/// What is done by hand is done when Enter is pressed.
pub(crate) fn entered(terminal: &mut Terminal) -> Result<Option<String>, Failure> {
    Ok(terminal.has_entered()?.then(|| "done".to_owned()))
}

/// A task that a service of another version says otherwise.
pub(crate) fn not_understood(what: &str) -> Failure {
    Failure::Usage {
        what: format!("the service asks for something (`{what}`) that this program does not know"),
        help: "use the program of the service's version, or answer on its page".into(),
    }
}

/// The person at this end of a run.
pub(crate) struct Answering {
    terminal: Terminal,
    kinds: Vec<&'static Asked>,
    /// The question that was put last, and how its answer is had.
    put: Option<(u64, &'static Asked)>,
}

impl Answering {
    /// # Errors
    /// When nobody can answer.
    pub(crate) fn new(
        (yes, hand): (bool, Option<&Path>),
        kinds: Vec<&'static Asked>,
        output: Output,
    ) -> Result<Self, Failure> {
        Ok(Self {
            terminal: Terminal::new(yes, hand, output)?,
            kinds,
            put: None,
        })
    }

    /// Puts the `question` of a run where it is a new one; its number and its answer, once there is one.
    ///
    /// # Errors
    /// When there will not be one.
    pub(crate) fn look(&mut self, question: &Value) -> Result<Option<(u64, String)>, Failure> {
        let Some(number) = question["number"].as_u64() else {
            self.put = None;
            return Ok(None);
        };
        let asked = match self.put {
            Some((put, asked)) if put == number => asked,
            _ => self.put(number, question)?,
        };
        let answer = (asked.answer)(&mut self.terminal)?;
        Ok(answer.map(|it| (number, it)))
    }

    /// The answer was not taken: the question is put again.
    ///
    /// # Errors
    /// When nobody is there who could answer otherwise.
    pub(crate) fn refuse(&mut self, why: &str) -> Result<(), Failure> {
        self.put = None;
        self.terminal.refuse(&plain(why))
    }

    fn put(&mut self, number: u64, question: &Value) -> Result<&'static Asked, Failure> {
        let word = |name: &str| question[name].as_str().unwrap_or_default();
        let known = self.kinds.iter().find(|it| it.what == word("what"));
        let asked = *known.ok_or_else(|| not_understood(word("what")))?;
        (asked.ask)(&mut self.terminal, word("text"), &question["task"])?;
        self.put = Some((number, asked));
        Ok(asked)
    }
}
