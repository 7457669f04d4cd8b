//! Lists of exchanges, each with what it must be answered and a text for a person.

use std::collections::{BTreeMap, VecDeque};

use units::Time;
use wire::copley::{Bank, Command, Parameter, Trajectory};

use crate::device::Urgency;

/// What an exchange must be answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    Ok,
    /// A value, which is kept.
    Value,
    /// This number.
    Exactly(i64),
}

/// One exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) command: Command,
    pub(super) wanted: Wanted,
    /// May be asked again when the answer is lost: it changes nothing the second time.
    pub(super) repeatable: bool,
    /// Amplifiers without the parameter will do.
    pub(super) optional: bool,
    pub(super) text: &'static str,
}

impl Step {
    const fn new(command: Command, wanted: Wanted, text: &'static str) -> Self {
        Self {
            command,
            wanted,
            repeatable: true,
            optional: false,
            text,
        }
    }

    pub(super) const fn read(bank: Bank, parameter: Parameter, text: &'static str) -> Self {
        Self::new(Command::Get { bank, parameter }, Wanted::Value, text)
    }

    pub(super) const fn write(parameter: Parameter, value: i64, text: &'static str) -> Self {
        let command = Command::Set {
            bank: Bank::Ram,
            parameter,
            value,
        };
        Self::new(command, Wanted::Ok, text)
    }

    /// Written and read back: no checksum guards the digits.
    pub(super) const fn check(parameter: Parameter, value: i64, text: &'static str) -> [Self; 2] {
        let command = Command::Get {
            bank: Bank::Ram,
            parameter,
        };
        [
            Self::write(parameter, value, text),
            Self::new(command, Wanted::Exactly(value), text),
        ]
    }

    pub(super) const fn abort(text: &'static str) -> Self {
        Self::new(Command::Trajectory(Trajectory::Abort), Wanted::Ok, text)
    }

    /// Begins motion: never sent twice.
    pub(super) const fn motion(trajectory: Trajectory, text: &'static str) -> Self {
        let mut step = Self::new(Command::Trajectory(trajectory), Wanted::Ok, text);
        step.repeatable = false;
        step
    }

    pub(super) const fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// Never sent twice.
    pub(super) const fn once(mut self) -> Self {
        self.repeatable = false;
        self
    }

    pub(super) const fn parameter(&self) -> Option<Parameter> {
        match self.command {
            Command::Set { parameter, .. } | Command::Get { parameter, .. } => Some(parameter),
            Command::Trajectory(_) | Command::Reset => None,
        }
    }
}

/// The exchanges that are left, and what was read.
#[derive(Clone, Debug)]
pub(super) struct Script {
    pub(super) steps: VecDeque<Step>,
    pub(super) urgency: Urgency,
    pub(super) since: Time,
    /// Answers to the first step that were lost or other than wanted.
    pub(super) failures: u32,
    values: BTreeMap<Parameter, String>,
}

impl Script {
    pub(super) const fn nothing() -> Self {
        Self {
            steps: VecDeque::new(),
            urgency: Urgency::Command,
            since: Time::ZERO,
            failures: 0,
            values: BTreeMap::new(),
        }
    }

    pub(super) fn new(steps: Vec<Step>, urgency: Urgency, since: Time) -> Self {
        Self {
            steps: steps.into(),
            urgency,
            since,
            ..Self::nothing()
        }
    }

    pub(super) fn keep(&mut self, parameter: Parameter, value: String) {
        self.values.insert(parameter, value);
    }

    pub(super) fn text(&self, parameter: Parameter) -> Option<&str> {
        self.values.get(&parameter).map(String::as_str)
    }

    pub(super) fn number(&self, parameter: Parameter) -> Option<i64> {
        let value = self.values.get(&parameter)?.clone();
        wire::copley::Reply::Value(value).number()
    }
}

/// Reading in RAM, of which there is much.
pub(super) const fn read(parameter: Parameter, text: &'static str) -> Step {
    Step::read(Bank::Ram, parameter, text)
}
