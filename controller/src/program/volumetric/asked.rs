//! What a person is asked of a line, when a service asks it.

use crate::program::answering::{Asked, entered, not_understood};
use crate::volumetric::{AskedLine, LineOperator as _};

pub(crate) const ASKED: &[Asked] = &[Asked {
    what: AskedLine::WHAT,
    ask: |terminal, _, task| {
        let asked: Option<AskedLine> = serde_json::from_value(task.clone()).ok();
        let task = asked.and_then(|it| it.task());
        terminal.ask_line(&task.ok_or_else(|| not_understood(AskedLine::WHAT))?)
    },
    answer: entered,
}];
