//! One question and its answer, and old answers told apart from it.

use core::time::Duration;
use std::collections::VecDeque;

use units::Time;
use wire::Payload;
use wire::nd287::{Command, Identification, MeasuredValue, NAK, STX, VALUE_CHARACTERS};

/// Lines of an identification.
const IDENTIFICATION_LINES: u8 = 3;

/// What is being asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Who is it; also the fence behind which old answers end.
    Identification,
    /// Its value.
    Value,
}

impl Question {
    pub(super) const fn awaited(self) -> &'static str {
        match self {
            Self::Identification => "the answer to ESC A0000 (identification)",
            Self::Value => "the answer to STX (measured value)",
        }
    }
}

/// What a line turned out to be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Answer {
    /// Nothing that is awaited now, or only a part of it.
    Old,
    /// No answer at all.
    Damaged,
    /// Who it is.
    Identified(String),
    /// A value from before it was said that only later ones count.
    TooEarly,
    /// The value that was asked for then.
    Value { asked: Time, value: MeasuredValue },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    Asked {
        question: Question,
        at: Time,
        deadline: Time,
    },
    /// Until the next question, or until the line has been quiet.
    Resting {
        until: Time,
        is_drain: bool,
    },
}

/// The exchanges with one display.
#[derive(Debug)]
pub(super) struct Exchange {
    answer_timeout: Duration,
    state: State,
    /// Of an identification that is under way: its first line, and how many have come.
    identification: Option<(String, u8)>,
    /// The answer that is under way was asked for too early to be used.
    is_forgotten: bool,
    outbox: VecDeque<Payload>,
    old_answers: u64,
}

impl Exchange {
    pub(super) const fn new(answer_timeout: Duration) -> Self {
        Self {
            answer_timeout,
            state: State::Idle,
            identification: None,
            is_forgotten: false,
            outbox: VecDeque::new(),
            old_answers: 0,
        }
    }

    pub(super) fn ask(&mut self, now: Time, question: Question) {
        let bytes = match question {
            Question::Identification => Command::Identification.emit(),
            Question::Value => vec![STX],
        };
        self.outbox.push_back(Payload::Bytes(bytes));
        self.identification = None;
        self.is_forgotten = false;
        self.state = State::Asked {
            question,
            at: now,
            deadline: now + self.answer_timeout,
        };
    }

    /// Asks nothing any more.
    pub(super) fn end(&mut self) {
        self.state = State::Idle;
        self.outbox.clear();
    }

    /// The next question is due a period after the last one, at once if that has passed.
    pub(super) fn rest(&mut self, now: Time, period: Duration) {
        let asked = match self.state {
            State::Asked { at, .. } => at,
            State::Idle | State::Resting { .. } => now,
        };
        let until = now.max(asked + period);
        let is_drain = false;
        self.state = State::Resting { until, is_drain };
    }

    /// Asks nothing until nothing has come for as long as an answer may take: then none is left that could
    /// be taken for the next one's.
    pub(super) fn drain(&mut self, now: Time) {
        let until = now + self.answer_timeout;
        let is_drain = true;
        self.state = State::Resting { until, is_drain };
    }

    /// What is under way is not used: what is asked from now on is.
    pub(super) fn forget_asked(&mut self) {
        self.is_forgotten = matches!(self.state, State::Asked { .. });
    }

    /// Takes a line without its LF.
    pub(super) fn take(&mut self, now: Time, line: &[u8]) -> Answer {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        // A refusal has no end of line; what comes next stands behind it.
        let refusals = line.iter().take_while(|byte| **byte == NAK).count();
        let line = &line[refusals..];
        let State::Asked { question, at, .. } = self.state else {
            if let State::Resting { is_drain: true, .. } = self.state {
                self.drain(now);
            }
            return self.old();
        };
        match question {
            Question::Identification => self.identification(line),
            Question::Value => match MeasuredValue::parse(line) {
                Ok(_) if self.is_forgotten => Answer::TooEarly,
                Ok(value) => Answer::Value { asked: at, value },
                // What is left of an identification that was asked twice.
                Err(_) if is_of_identification(line) => self.old(),
                Err(_) => Answer::Damaged,
            },
        }
    }

    fn identification(&mut self, line: &[u8]) -> Answer {
        if let Some(first) = line.strip_prefix(&[STX]) {
            let name = Identification::parse_line(first);
            self.identification = name.ok().map(|name| (name.to_owned(), 1));
            return self.under_way();
        }
        if line.len() == VALUE_CHARACTERS {
            // A value that came too late.
            return self.old();
        }
        let Some((name, lines)) = self.identification.take() else {
            return Answer::Damaged;
        };
        if Identification::parse_line(line).is_err() {
            return Answer::Damaged;
        }
        if lines + 1 == IDENTIFICATION_LINES {
            return Answer::Identified(name);
        }
        self.identification = Some((name, lines + 1));
        Answer::Old
    }

    fn under_way(&self) -> Answer {
        match self.identification {
            Some(_) => Answer::Old,
            None => Answer::Damaged,
        }
    }

    fn old(&mut self) -> Answer {
        self.old_answers += 1;
        Answer::Old
    }

    /// The question whose answer is late at `now`.
    pub(super) fn late(&self, now: Time) -> Option<Question> {
        match self.state {
            State::Asked {
                question, deadline, ..
            } if deadline <= now => Some(question),
            State::Idle | State::Asked { .. } | State::Resting { .. } => None,
        }
    }

    /// Whether the next question is due.
    pub(super) fn has_rested(&self, now: Time) -> bool {
        matches!(self.state, State::Resting { until, .. } if until <= now)
    }

    pub(super) const fn next(&self) -> Time {
        match self.state {
            State::Idle => Time::NEVER,
            State::Asked { deadline, .. } => deadline,
            State::Resting { until, .. } => until,
        }
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    pub(super) const fn old_answers(&self) -> u64 {
        self.old_answers
    }
}

fn is_of_identification(line: &[u8]) -> bool {
    let line = line.strip_prefix(&[STX]).unwrap_or(line);
    Identification::parse_line(line).is_ok()
}
