//! Analog input modules of the ADAM-4000 and I-7000 families ("DCON" ASCII).
//!
//! Source: Advantech ADAM-4000 series manual, chapter 4; the lines are [`wire::dcon`]'s.
//!
//! Answers carry no number that says which question they answer. But a module answers in the
//! order it was asked, and the answers to `#AA` (`>…`) and to `$AAM` (`!AA…`) look different.
//! So after every exchange that failed (late, damaged or refused) the module's name is asked
//! as a *fence*: whatever comes before the name is an old answer and is thrown away. Thus a
//! late value is never taken for the present one, however late it is. Echoes of our own
//! lines (`#…`, `$…`) are recognised by their first character.
//! Absent: changing a module's configuration (`%AA…`), synchronised sampling (`#**`).

mod range;

use core::time::Duration;
use std::collections::VecDeque;
use units::{Time, Volts};
use wire::Payload;
use wire::dcon::{CHANNEL_CHARACTERS, CR, Command, Configuration, frame, parse_text, unframe};
use wire::{Input, LinkState};

pub use self::range::InputRange;
use self::range::parse_channels;
use super::serial_line::{AssembledLine, LineAssembler};
use super::{Alarm, AnalogInput, AnalogReading, Device, DeviceError, DeviceName, Identity, Seen};

const NAME: DeviceName = DeviceName::Serial("analog module");
/// `>`, eight channels, checksum; room for a module with sixteen.
const LINE_MAX: usize = 1 + 16 * CHANNEL_CHARACTERS + 2;

/// How a module is used.
#[derive(Clone, Debug, PartialEq)]
pub struct DconSettings {
    /// Its address on the line.
    pub address: u8,
    /// Whether lines carry a checksum.
    pub checksum: bool,
    /// Its input range.
    pub range: InputRange,
    /// Which of its channels are used, in this order.
    pub channels: Vec<u8>,
    /// What it must call itself; `None`: anything.
    pub name: Option<String>,
    /// From one reading to the next; slower if the module is.
    pub period: Duration,
    /// How long an answer may take.
    pub answer_timeout: Duration,
    /// How often a step of the start is asked again.
    pub retries: u32,
    /// This many damaged lines in a row raise an alarm.
    pub garbage_lines_max: u64,
    /// Without a good reading for this long an alarm is raised.
    pub stale_after: Duration,
}

impl DconSettings {
    /// Usual settings for a module at 9600 baud.
    pub const fn new(address: u8, range: InputRange, channels: Vec<u8>) -> Self {
        Self {
            address,
            checksum: false,
            range,
            channels,
            name: None,
            period: Duration::from_millis(100),
            answer_timeout: Duration::from_millis(200),
            retries: 3,
            garbage_lines_max: 5,
            stale_after: Duration::from_secs(1),
        }
    }
}

/// What is being asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    /// `$AAM`: who is it; also the fence behind which old answers end.
    Name,
    /// `$AA2`: how is it set.
    Configuration,
    /// `#AA`: all channels.
    Values,
}

impl Question {
    const fn awaited(self) -> &'static str {
        match self {
            Self::Name => "the answer to $AAM (name)",
            Self::Configuration => "the answer to $AA2 (configuration)",
            Self::Values => "the answer to #AA (values)",
        }
    }
}

/// What an answer looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Empty,
    Echo,
    Refusal,
    Name,
    /// No module is called by six hexadecimal digits, so this is no name.
    Configuration(Configuration),
    Values,
    Unknown,
}

impl Answer {
    fn of(text: &str) -> Self {
        match text.bytes().next() {
            None => Self::Empty,
            Some(b'#' | b'$') => Self::Echo,
            Some(b'?') => Self::Refusal,
            Some(b'!') => Configuration::parse(text).map_or(Self::Name, Self::Configuration),
            Some(b'>') => Self::Values,
            Some(_) => Self::Unknown,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Not started, or the start failed.
    Idle,
    /// Asked; `deadline` is when the answer is late.
    Asked { question: Question, deadline: Time },
    /// The next reading is due then.
    Resting { until: Time },
}

/// How far the start is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    /// Each step may fail a few times.
    Starting { since: Time, failures: u32 },
    /// Reading for ever.
    Running,
}

/// An analog input module.
///
/// ```
/// use drivers::device::{AnalogInput, Device, dcon::{Dcon, DconSettings, InputRange}};
/// use units::{Time, Volts};
/// use wire::{Input, Payload};
/// let mut module = Dcon::new(DconSettings::new(1, InputRange::V5, vec![0, 1]));
/// module.start(Time::ZERO);
/// for answer in ["!014117\r", "!01090600\r", ">+1.0000-2.5000\r"] {
///     let input = Input::Payload(Payload::Bytes(answer.into()));
///     module.handle(Time::from_seconds(0.005), &input);
/// }
/// let volts = module.reading().map(|it| it.volts.clone());
/// assert_eq!(volts, Some(vec![Volts(1.0), Volts(-2.5)]));
/// ```
#[derive(Debug)]
pub struct Dcon {
    settings: DconSettings,
    state: State,
    progress: Progress,
    configured: bool,
    lines: LineAssembler,
    /// When the last reading was due: the readings keep their period.
    due: Time,
    reading: Option<AnalogReading>,
    /// Since when there is no good reading.
    fresh: Time,
    is_stale: bool,
    garbage_in_a_row: u64,
    identity: Option<Identity>,
    outbox: VecDeque<Payload>,
    alarms: VecDeque<Alarm>,
    outcome: Option<Result<(), DeviceError>>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    readings: u64,
    late: u64,
    old_answers: u64,
    damaged: u64,
    refused: u64,
    echoes: u64,
}

impl Dcon {
    /// A module that has not been started.
    pub const fn new(settings: DconSettings) -> Self {
        Self {
            settings,
            state: State::Idle,
            progress: Progress::Running,
            configured: false,
            lines: LineAssembler::new(CR, LINE_MAX),
            due: Time::ZERO,
            reading: None,
            fresh: Time::ZERO,
            is_stale: false,
            garbage_in_a_row: 0,
            identity: None,
            outbox: VecDeque::new(),
            alarms: VecDeque::new(),
            outcome: None,
            counts: Counts {
                readings: 0,
                late: 0,
                old_answers: 0,
                damaged: 0,
                refused: 0,
                echoes: 0,
            },
        }
    }

    fn ask(&mut self, now: Time, question: Question) {
        let address = self.settings.address;
        let command = match question {
            Question::Name => Command::ReadName { address },
            Question::Configuration => Command::ReadConfiguration { address },
            Question::Values => Command::ReadAll { address },
        };
        let bytes = frame(&command.emit(), self.settings.checksum);
        self.outbox.push_back(Payload::Bytes(bytes));
        let deadline = now + self.settings.answer_timeout;
        self.state = State::Asked { question, deadline };
    }

    fn line(&mut self, now: Time, line: &[u8]) {
        let State::Asked { question, .. } = self.state else {
            self.counts.old_answers += 1;
            return;
        };
        let text = match unframe(line, self.settings.checksum) {
            Ok(text) => text,
            Err(_) => return self.damaged(),
        };
        match (question, Answer::of(text)) {
            // Some modules send line ends of their own.
            (_, Answer::Empty) => {}
            (_, Answer::Echo) => self.counts.echoes += 1,
            (_, Answer::Refusal) => self.counts.refused += 1,
            (Question::Name, Answer::Name) => self.name(now, text),
            (Question::Configuration, Answer::Configuration(seen)) => {
                self.configuration(now, seen);
            }
            (Question::Values, Answer::Values) => self.values(now, text),
            // The fence stands between these and what is asked now.
            (_, Answer::Name | Answer::Configuration(_) | Answer::Values) => {
                self.counts.old_answers += 1;
            }
            (_, Answer::Unknown) => self.damaged(),
        }
    }

    fn name(&mut self, now: Time, text: &str) {
        let Ok(name) = parse_text(text, self.settings.address) else {
            return self.damaged();
        };
        if !self.configured
            && self
                .settings
                .name
                .as_deref()
                .is_some_and(|want| want != name)
        {
            return self.give_up("the module that the configuration names");
        }
        self.garbage_in_a_row = 0;
        self.identity = Some(Identity {
            name: name.to_owned(),
            ..Identity::default()
        });
        let next = if self.configured {
            Question::Values
        } else {
            Question::Configuration
        };
        self.ask(now, next);
    }

    fn configuration(&mut self, now: Time, configuration: Configuration) {
        if !configuration.is_engineering() {
            return self.give_up("engineering units (data format 00 of %AANNTTCCFF)");
        }
        if configuration.has_checksum() != self.settings.checksum {
            return self.give_up("the checksum switched as the configuration says");
        }
        if configuration.range != self.settings.range.code() {
            return self.give_up("the input range that the configuration names");
        }
        self.garbage_in_a_row = 0;
        self.configured = true;
        self.due = now;
        self.ask(now, Question::Values);
    }

    fn values(&mut self, now: Time, text: &str) {
        let Ok(all) = parse_channels(text, self.settings.range) else {
            return self.damaged();
        };
        let used = self.settings.channels.iter();
        let used: Option<Vec<_>> = used.map(|at| all.get(usize::from(*at)).copied()).collect();
        let Some(used) = used else {
            return self.give_up("as many channels as the configuration uses");
        };
        self.counts.readings += 1;
        self.garbage_in_a_row = 0;
        self.fresh = now;
        self.is_stale = false;
        let (volts, saturated): (Vec<Volts>, Vec<bool>) = used.into_iter().unzip();
        self.reading = Some(AnalogReading {
            at: now,
            volts,
            saturated,
        });
        if let Progress::Starting { .. } = self.progress {
            self.progress = Progress::Running;
            self.outcome = Some(Ok(()));
        }
        self.rest(now);
    }

    /// Readings keep their grid; periods that a slow module missed are left out.
    fn rest(&mut self, now: Time) {
        self.due += self.settings.period;
        if self.due < now {
            self.due = now;
        }
        self.state = State::Resting { until: self.due };
    }

    /// The answer that this was is missing; that is noticed when it is late, so that
    /// neither garbage nor refusals make us ask faster.
    fn damaged(&mut self) {
        self.counts.damaged += 1;
        self.garbage_in_a_row += 1;
        if self.garbage_in_a_row == self.settings.garbage_lines_max {
            let lines = self.garbage_in_a_row;
            self.alarms.push_back(Alarm::Garbage { lines });
        }
    }

    /// An exchange failed: behind a new fence the next one begins.
    fn failed(&mut self, now: Time) {
        if let (Progress::Starting { since, failures }, State::Asked { question, .. }) =
            (self.progress, self.state)
        {
            let failures = failures + 1;
            self.progress = Progress::Starting { since, failures };
            if failures > self.settings.retries {
                return self.end_start(now, since, question);
            }
        }
        self.lines.clear();
        self.ask(now, Question::Name);
    }

    fn end_start(&mut self, now: Time, since: Time, question: Question) {
        self.state = State::Idle;
        self.outcome = Some(Err(DeviceError::Timeout {
            device: NAME,
            awaited: question.awaited(),
            waited: now.since(since),
            seen: Seen::Nothing,
        }));
    }

    fn give_up(&mut self, needs: &'static str) {
        self.state = State::Idle;
        self.outcome = Some(Err(DeviceError::NotPossible {
            device: NAME,
            step: "reading",
            needs,
        }));
    }

    /// A reading that is too old is worth an alarm, once; the reading itself stays, its age
    /// says enough.
    fn check_age(&mut self, now: Time) {
        let waited = now.since(self.fresh);
        if self.watches_age() && waited >= self.settings.stale_after {
            self.is_stale = true;
            self.alarms.push_back(Alarm::StaleSample { waited });
        }
    }

    fn watches_age(&self) -> bool {
        self.progress == Progress::Running && self.state != State::Idle && !self.is_stale
    }

    fn link(&mut self, now: Time, state: LinkState) {
        self.lines.clear();
        if state == LinkState::Up && self.state != State::Idle {
            // Another module may have been plugged in.
            self.configured = false;
            self.ask(now, Question::Name);
        }
    }
}

impl Device for Dcon {
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
        self.check_age(now);
        match self.state {
            State::Asked { deadline, .. } if deadline <= now => {
                self.counts.late += 1;
                self.failed(now);
            }
            State::Resting { until } if until <= now => self.ask(now, Question::Values),
            State::Idle | State::Asked { .. } | State::Resting { .. } => {}
        }
    }

    fn poll_timeout(&self) -> Time {
        let next = match self.state {
            State::Idle => return Time::NEVER,
            State::Asked { deadline, .. } => deadline,
            State::Resting { until } => until,
        };
        if self.watches_age() {
            next.min(self.fresh + self.settings.stale_after)
        } else {
            next
        }
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.outcome = None;
        self.configured = false;
        self.reading = None;
        self.is_stale = false;
        self.garbage_in_a_row = 0;
        self.lines.clear();
        self.outbox.clear();
        self.progress = Progress::Starting {
            since: now,
            failures: 0,
        };
        // A command that someone left unfinished on the line would spoil ours.
        self.outbox.push_back(Payload::Bytes(vec![CR]));
        self.ask(now, Question::Name);
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        self.identity.clone()
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("readings", self.counts.readings),
            ("late_answers", self.counts.late),
            ("old_answers", self.counts.old_answers),
            ("damaged_lines", self.counts.damaged),
            ("refused", self.counts.refused),
            ("echoes", self.counts.echoes),
        ]
    }
}

impl AnalogInput for Dcon {
    fn channels(&self) -> usize {
        self.settings.channels.len()
    }

    fn reading(&self) -> Option<&AnalogReading> {
        self.reading.as_ref()
    }
}

#[cfg(test)]
mod tests;
