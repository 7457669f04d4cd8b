//! What is used from now on, in words: whoever has chosen it.

use machine::records::short;
use serde_json::json;

use crate::program::output::{Ended, Output};
use crate::runs::Choice;

/// What is used under one name of the store.
pub(crate) struct Used<'u> {
    pub(crate) pointer: &'u str,
    pub(crate) id: Option<&'u str>,
    /// Whether it was gone back to.
    pub(crate) is_earlier: bool,
}

impl Used<'_> {
    fn text(&self) -> String {
        let pointer = self.pointer;
        match (self.id.map(short), self.is_earlier) {
            (Some(id), true) => format!("axis {pointer}: back to {id}"),
            (Some(id), false) => format!("axis {pointer}: {id} is in use"),
            (None, _) => format!("axis {pointer}: nothing is in use"),
        }
    }
}

/// What came of `choice`.
pub(crate) fn told(choice: &Choice, all: &[Used<'_>], output: Output) -> Ended {
    let lines: Vec<_> = all.iter().map(Used::text).collect();
    let value = match (all, choice) {
        ([only], _) => json!({"axis": only.pointer, "active": only.id}),
        (all, choice) => {
            let name = match choice {
                Choice::Rollback(name) | Choice::Clear(name) => Some(name.as_str()),
                Choice::Activate(_) => all.first().map(|it| it.pointer),
            };
            let active = all.iter().map(|it| (it.pointer.to_owned(), json!(it.id)));
            json!({"axis": name, "active": active.collect::<serde_json::Map<_, _>>()})
        }
    };
    output.result(&lines.join("\n"), &value)
}
