//! What machines gave, in the words of the command line.

use core::any::Any;
use std::path::Path;

use serde_json::Value;

use crate::failure::Failure;

/// A result as the command line prints it.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// For people.
    pub text: String,
    /// For programs: what `--json` prints.
    pub value: Value,
}

impl Told {
    /// With the verification of what it tells of.
    pub(crate) fn append_verified(&mut self, then: Self) {
        self.text += &format!("\n{}", then.text);
        self.value["verified"] = then.value;
    }
}

/// What one kind has to say: a struct of functions of its own.
pub(crate) type Words = &'static (dyn Any + Send + Sync);

/// Who says it; [`Serving`](crate::Serving) brings one.
#[derive(Clone, Debug)]
pub struct Teller {
    /// What the devices have counted so far.
    pub counters: fn(machine: &machine::Machine) -> Value,
    /// The page of a run, made of its journal.
    pub page: fn(journal: &Path) -> Result<String, Failure>,
    /// The words of each kind.
    pub(crate) words: Vec<Words>,
}

impl Teller {
    /// The words of the kind whose they are.
    pub fn of<W: Any>(&self) -> Option<&'static W> {
        self.words.iter().find_map(|it| it.downcast_ref())
    }
}
