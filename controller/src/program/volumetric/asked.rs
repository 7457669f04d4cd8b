//! What a person is asked of a line, when a service asks it.

use crate::program::answering::{Asked, entered, not_understood};
use crate::program::exchange::plain;
use crate::volumetric::AskedLine;

pub(crate) const ASKED: &[Asked] = &[Asked {
    what: AskedLine::WHAT,
    ask: |terminal, text, task| {
        let asked: Option<AskedLine> = serde_json::from_value(task.clone()).ok();
        let task = asked.and_then(|it| it.task());
        let task = task.ok_or_else(|| not_understood(AskedLine::WHAT))?;
        terminal.ask_for_line(&task, &plain(text))
    },
    answer: entered,
}];
