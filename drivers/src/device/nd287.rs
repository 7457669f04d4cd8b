//! The position display HEIDENHAIN ND 287 over the encoder of a comparator: it is asked for one value
//! after the other.
//!
//! Source: HEIDENHAIN, ND 287 user's manual, parts II-5 and II-6; the lines are [`wire::nd287`]'s. The display
//! stores its value at most 1 ms after it was asked and answers within 50 ms (ND 281 B manual, p. 42), so that a
//! value belongs to the moment of its request.
//!
//! Answers carry no number that says which request they answer, but a display answers in the order that it was
//! asked. So after every exchange that failed its identification is asked as a *fence*: whatever comes before
//! that is an old answer and is thrown away.
//!
//! The encoder counts; once its signals were faulty its number means nothing. Hence a fault, a display that is
//! set otherwise, an impossible jump and a display that fell silent void the datum: nothing is read until
//! [`DisplacementInstrument::set_datum`].
//!
//! Absent: whether the display shows a distance to go or a scaled value, which it does not say with its values;
//! weather sensors, which it has not.

mod alarms;
mod exchange;
mod settings;
mod value;

use core::time::Duration;
use std::collections::VecDeque;

use units::{Metres, Time};
use wire::nd287::{LF, MeasuredValue, Unit};
use wire::{Input, LinkState, Payload};

use self::alarms::{FAULTY, JUMPED, NAME, SET_OTHERWISE};
use self::exchange::{Answer, Exchange, Question};
pub use self::settings::Nd287Settings;
use self::value::Good;
use super::average::{Averaging, RunningAverage};
use super::serial_line::{AssembledLine, LineAssembler};
use super::{
    Alarm, Device, DeviceError, DisplacementInstrument, DisplacementReading, Environment, Identity,
    Seen,
};

/// Longer than any line of an answer.
const LINE_MAX: usize = 64;
/// How the displays of the family call themselves.
const FAMILY: &str = "ND-28";
/// Impossible jumps in a row that are no damaged digits any more.
const JUMPS_MAX: u32 = 3;

/// Whether the count means anything.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Count {
    /// The display was not started.
    Idle,
    /// Displacement counts from here.
    From(Metres),
    /// The next value becomes the datum.
    WantsDatum,
    /// It was lost.
    Lost,
}

/// How far the start is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// Each step may fail a few times.
    Starting { since: Time, failures: u32 },
    /// Asking for ever.
    Running,
}

/// A position display.
#[derive(Debug)]
pub struct Nd287 {
    settings: Nd287Settings,
    exchange: Exchange,
    progress: Progress,
    count: Count,
    lines: LineAssembler,
    newest: Option<Good>,
    /// What it showed when it was started: unit and input.
    set_to: Option<(Unit, u8)>,
    /// Whether it has said who it is since something went wrong.
    is_known: bool,
    /// Since when it owes a value.
    owes_since: Option<Time>,
    is_silent: bool,
    garbage_in_a_row: u64,
    jumps_in_a_row: u32,
    averaging: Averaging,
    identity: Option<Identity>,
    outcome: Option<Result<(), DeviceError>>,
    alarms: VecDeque<Alarm>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    values: u64,
    late: u64,
    damaged: u64,
    impossible_jumps: u64,
    counts_lost: u64,
}

impl Nd287 {
    /// A display that has not been started.
    pub fn new(settings: Nd287Settings) -> Self {
        Self {
            exchange: Exchange::new(settings.answer_timeout),
            settings,
            progress: Progress::Running,
            count: Count::Idle,
            lines: LineAssembler::new(LF, LINE_MAX),
            newest: None,
            set_to: None,
            is_known: false,
            owes_since: None,
            is_silent: false,
            garbage_in_a_row: 0,
            jumps_in_a_row: 0,
            averaging: Averaging::Never,
            identity: None,
            outcome: None,
            alarms: VecDeque::new(),
            counts: Counts::default(),
        }
    }

    fn line(&mut self, now: Time, line: &[u8]) {
        match self.exchange.take(now, line) {
            Answer::Old => {}
            Answer::Damaged => self.damaged(),
            Answer::TooEarly => self.ask(now),
            Answer::Identified(name) => self.identified(now, name),
            Answer::Value { asked, value } => self.value(now, asked, &value),
        }
    }

    /// The answer that this was is missing; that is noticed when it is late, so that garbage does not make
    /// us ask faster.
    fn damaged(&mut self) {
        self.counts.damaged += 1;
        self.garbage_in_a_row += 1;
        if self.garbage_in_a_row == self.settings.garbage_lines_max {
            let lines = self.garbage_in_a_row;
            self.raise(Alarm::Garbage { lines });
        }
    }

    fn identified(&mut self, now: Time, name: String) {
        if !name.starts_with(FAMILY) {
            self.exchange.rest(now, self.settings.period);
            return self.refuse(SET_OTHERWISE, "a display that identifies itself as ND-28…");
        }
        self.is_known = true;
        self.identity = Some(Identity {
            name,
            ..Identity::default()
        });
        self.ask(now);
    }

    /// A value; who it is first, where that is not known.
    fn ask(&mut self, now: Time) {
        // Only a value ends this: a display that says who it is and gives no value is silent, too.
        self.owes_since.get_or_insert(now);
        let question = if self.is_known {
            Question::Value
        } else {
            Question::Identification
        };
        self.exchange.ask(now, question);
    }

    fn value(&mut self, now: Time, asked: Time, value: &MeasuredValue) {
        self.owes_since = None;
        self.is_silent = false;
        self.garbage_in_a_row = 0;
        self.counts.values += 1;
        self.exchange.rest(now, self.settings.period);
        match value.unit {
            Unit::Millimetre | Unit::Inch => {}
            Unit::Fault => return self.refuse(FAULTY, "an encoder with good signals"),
            Unit::Other(_) => return self.refuse(SET_OTHERWISE, "millimetres or inches"),
        }
        // X1 and X2 are encoders; everything else is made of several values.
        if !b" 12".contains(&value.shown) {
            return self.refuse(SET_OTHERWISE, "the value of one input, without a series");
        }
        let shown = (value.unit, value.shown);
        if *self.set_to.get_or_insert(shown) != shown {
            return self.lose_count(SET_OTHERWISE);
        }
        let good = Good::of(asked, value);
        match self.newest {
            Some(before) if good.is_impossible_after(&before, self.settings.speed_max) => {
                self.impossible();
            }
            _ => self.good(good),
        }
    }

    /// What ends a start, and voids the count of a display in service.
    fn refuse(&mut self, alarm: Alarm, needs: &'static str) {
        match self.progress {
            Progress::Starting { .. } => self.give_up(needs),
            Progress::Running => self.lose_count(alarm),
        }
    }

    /// One may be a digit that was damaged on the way; several are not.
    fn impossible(&mut self) {
        self.counts.impossible_jumps += 1;
        self.jumps_in_a_row += 1;
        if self.jumps_in_a_row >= JUMPS_MAX {
            return self.lose_count(JUMPED);
        }
        if let Averaging::Running(average) = &mut self.averaging {
            average.lacking += 1;
            let lost = average.lacking;
            if lost > u64::from(JUMPS_MAX) {
                self.raise(Alarm::SamplesLost { lost });
            }
        }
    }

    fn good(&mut self, good: Good) {
        self.jumps_in_a_row = 0;
        self.newest = Some(good);
        if let Progress::Starting { .. } = self.progress {
            self.progress = Progress::Running;
            self.count = Count::From(good.position);
            self.outcome = Some(Ok(()));
        }
        match self.count {
            Count::Idle | Count::Lost => {}
            Count::WantsDatum => {
                self.count = Count::From(good.position);
                self.average(good.asked, Metres::ZERO);
            }
            Count::From(datum) => self.average(good.asked, self.displacement(good.position, datum)),
        }
    }

    fn average(&mut self, asked: Time, displacement: Metres) {
        if let Averaging::Running(average) = &mut self.averaging
            && let Some(reading) = average.add(asked, displacement)
        {
            self.averaging = Averaging::Done(reading);
            self.outcome = Some(Ok(()));
        }
    }

    fn displacement(&self, position: Metres, datum: Metres) -> Metres {
        (position - datum) * self.settings.direction.sign()
    }

    /// The count means nothing any more; told once.
    fn lose_count(&mut self, alarm: Alarm) {
        self.newest = None;
        self.jumps_in_a_row = 0;
        if let Count::From(_) | Count::WantsDatum = self.count {
            self.counts.counts_lost += 1;
            self.count = Count::Lost;
            self.raise(alarm);
        }
    }

    /// Reports, and ends what cannot go on.
    fn raise(&mut self, alarm: Alarm) {
        self.alarms.push_back(alarm);
        if let Averaging::Running(_) = self.averaging {
            self.averaging = Averaging::Never;
            self.outcome = Some(Err(DeviceError::Alarmed {
                device: NAME,
                step: "average",
                alarm,
            }));
        }
    }

    fn give_up(&mut self, needs: &'static str) {
        self.exchange.end();
        self.count = Count::Idle;
        self.outcome = Some(Err(DeviceError::NotPossible {
            device: NAME,
            step: "reading",
            needs,
        }));
    }

    /// An exchange failed: behind a new fence the next one begins.
    fn late(&mut self, now: Time, question: Question) {
        self.counts.late += 1;
        self.is_known = false;
        self.lines.clear();
        if let Progress::Starting { since, failures } = self.progress {
            let failures = failures + 1;
            self.progress = Progress::Starting { since, failures };
            if failures > self.settings.retries {
                return self.end_start(now, since, question);
            }
        }
        match question {
            Question::Value => self.ask(now),
            // Two fences would look alike: nothing is asked until the line has been quiet.
            Question::Identification => self.exchange.drain(now),
        }
    }

    fn end_start(&mut self, now: Time, since: Time, question: Question) {
        self.exchange.end();
        self.outcome = Some(Err(DeviceError::Timeout {
            device: NAME,
            awaited: question.awaited(),
            waited: now.since(since),
            seen: Seen::Nothing,
        }));
    }

    /// A display that was switched off and on again counts from elsewhere.
    fn silent(&mut self, now: Time) {
        if let Some(since) = self.silent_from()
            && since <= now
        {
            let waited = self.settings.silent_after + now.since(since);
            self.is_silent = true;
            self.lose_count(Alarm::StreamSilent { waited });
        }
    }

    /// When it will have owed a value for too long.
    fn silent_from(&self) -> Option<Time> {
        let owes = self.owes_since.filter(|_| self.watches_silence())?;
        Some(owes + self.settings.silent_after)
    }

    fn watches_silence(&self) -> bool {
        self.progress == Progress::Running && self.count != Count::Idle && !self.is_silent
    }

    fn link(&mut self, now: Time, state: LinkState) {
        self.lines.clear();
        if self.count == Count::Idle {
            return;
        }
        match state {
            LinkState::Up => {
                self.is_known = false;
                self.ask(now);
            }
            _ => {
                let waited = Duration::ZERO;
                self.lose_count(Alarm::StreamSilent { waited });
            }
        }
    }
}

impl Device for Nd287 {
    fn handle(&mut self, now: Time, input: &Input) {
        match input {
            Input::Payload(Payload::Bytes(bytes)) => {
                for byte in bytes {
                    match self.lines.push(*byte) {
                        None => {}
                        Some(AssembledLine::Overlong) => self.damaged(),
                        Some(AssembledLine::Whole(line)) => self.line(now, &line),
                    }
                }
            }
            Input::Link(state) => self.link(now, *state),
            Input::Lost(_) => self.lines.skip_message(),
            Input::Payload(Payload::Frame(_) | Payload::Control(_)) | Input::BusError(_) => {}
        }
    }

    fn handle_timeout(&mut self, now: Time) {
        self.silent(now);
        if let Some(question) = self.exchange.late(now) {
            self.late(now, question);
        } else if self.exchange.has_rested(now) {
            self.ask(now);
        }
    }

    fn poll_timeout(&self) -> Time {
        let silent = self.silent_from().unwrap_or(Time::NEVER);
        self.exchange.next().min(silent)
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.exchange.poll_transmit()
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.outcome = None;
        self.count = Count::Idle;
        self.averaging = Averaging::Never;
        self.newest = None;
        self.set_to = None;
        self.is_known = false;
        self.owes_since = None;
        self.is_silent = false;
        self.garbage_in_a_row = 0;
        self.jumps_in_a_row = 0;
        self.lines.clear();
        self.progress = Progress::Starting {
            since: now,
            failures: 0,
        };
        self.ask(now);
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        self.identity.clone()
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("values", self.counts.values),
            ("late_answers", self.counts.late),
            ("old_answers", self.exchange.old_answers()),
            ("damaged_lines", self.counts.damaged),
            ("impossible_jumps", self.counts.impossible_jumps),
            ("counts_lost", self.counts.counts_lost),
        ]
    }
}

impl DisplacementInstrument for Nd287 {
    fn begin_average(&mut self, now: Time, samples: u32) {
        self.outcome = None;
        let needs = match self.count {
            Count::From(_) | Count::WantsDatum if samples == 0 => "at least one sample",
            Count::From(_) | Count::WantsDatum if self.is_silent => "a display that answers",
            Count::From(_) | Count::WantsDatum => {
                self.averaging = Averaging::Running(RunningAverage::new(now, samples));
                return;
            }
            Count::Lost => "a new datum, since the count was lost",
            Count::Idle => "a started display",
        };
        self.averaging = Averaging::Never;
        self.outcome = Some(Err(DeviceError::NotPossible {
            device: NAME,
            step: "average",
            needs,
        }));
    }

    fn average(&self) -> Option<DisplacementReading> {
        self.averaging.reading()
    }

    fn latest(&self) -> Option<DisplacementReading> {
        let (Count::From(datum), Some(good)) = (self.count, self.newest) else {
            return None;
        };
        Some(DisplacementReading {
            at: good.asked,
            vacuum: self.displacement(good.position, datum),
            standard_deviation: Metres::ZERO,
            samples: 1,
        })
    }

    /// The last value may be older than the last motion: the next one becomes the datum.
    fn set_datum(&mut self, now: Time) {
        if self.count != Count::Idle {
            self.count = Count::WantsDatum;
            // One that is still silent is told of again.
            self.is_silent = false;
            self.owes_since = self.owes_since.map(|_| now);
            self.exchange.forget_asked();
        }
    }

    fn environment(&self) -> Environment {
        Environment::default()
    }
}

#[cfg(test)]
mod tests;
