//! What a person is asked of a plate, when a service asks it.

use compensator::rotary::Sighted;
use serde_json::Value;
use units::Radians;

use crate::Failure;
use crate::program::answering::{Asked, entered, not_understood};
use crate::program::exchange::plain;
use crate::program::operator::Terminal;
use crate::rotary::PlateTask;
use crate::rotary::sighted::{self, Person as _, Question};

pub(crate) const ASKED: &[Asked] = &[
    Asked {
        what: PlateTask::WHAT,
        ask: |terminal, text, task| {
            let task: PlateTask = serde_json::from_value(task.clone())
                .map_err(|_| not_understood(PlateTask::WHAT))?;
            terminal.ask_for_plate(&task, &plain(text))
        },
        answer: entered,
    },
    Asked {
        what: sighted::READ_LINE,
        ask: read_line,
        answer: Terminal::answer,
    },
    Asked {
        what: sighted::CLOSE_PLACEMENT,
        ask: |terminal, text, _| put(terminal, sighted::Asked::Close, text, false),
        answer: |terminal| {
            let answer = terminal.answer()?;
            Ok(answer.map(|it| match it.trim() {
                "" => sighted::CLOSE.to_owned(),
                word => word.to_owned(),
            }))
        },
    },
];

fn read_line(terminal: &mut Terminal, text: &str, task: &Value) -> Result<(), Failure> {
    let line = task["line"].as_u64().and_then(|it| u32::try_from(it).ok());
    let nominal = task["nominal_deg"].as_f64().map(Radians::from_degrees);
    let value = match task["value"].as_str() {
        Some("to_line") => Some(Sighted::ToLine),
        Some("angle") => Some(Sighted::Angle),
        Some("deviation") => Some(Sighted::Deviation),
        _ => None,
    };
    let (Some(line), Some(nominal), Some(value)) = (line, nominal, value) else {
        return Err(not_understood(sighted::READ_LINE));
    };
    let asked = sighted::Asked::Line {
        line,
        value,
        nominal,
    };
    put(terminal, asked, text, value == Sighted::ToLine)
}

fn put(
    terminal: &mut Terminal,
    asked: sighted::Asked,
    text: &str,
    turns: bool,
) -> Result<(), Failure> {
    terminal.question(&Question {
        asked,
        text: plain(text),
        turns,
        by_hand: !turns,
    })
}
