//! An image controller: a Cognex In-Sight vision system in Native Mode.
//!
//! Sources: those of [`wire::in_sight`]. A pose is asked for by `SW8` (take a picture,
//! judge it, answer when done) and read with `GV` from the one cell in which the job puts its
//! whole [`Inspection`].
//!
//! Answers carry no number, but the system answers in the order it was asked. So every pose
//! begins, and every exchange that failed ends, with a *fence*: the name of the active job is
//! asked for, and whatever comes before it is an old answer and is thrown away. And the
//! inspection carries the count of pictures: only that of the one picture that was asked for
//! is taken, so that neither a late answer nor somebody else's trigger becomes a measurement.
//! Each pose thus also proves that the job is still the one that the configuration names.
//!
//! Absent: loading jobs, reading images, logging in (a serial port asks for no user).

mod average;
mod question;
mod settings;

use std::collections::VecDeque;
use units::Time;
use wire::Input;
use wire::Payload;
use wire::in_sight::{COUNT_MAX, Command, Inspection, Status, TERMINATOR};

use self::average::Measurement;
use self::question::Question;
pub use self::settings::{CameraFrame, InSightSettings};
use super::serial_line::{AssembledLine, LineAssembler};
use super::{Alarm, Device, DeviceError, DeviceName, Identity, PoseInstrument, PoseReading, Seen};

const NAME: DeviceName = DeviceName::Serial("image controller");
/// A cell of text has at most 255 characters.
const LINE_MAX: usize = 255;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    Asked {
        question: Question,
        deadline: Time,
    },
    /// The result is asked for again then.
    Resting {
        until: Time,
    },
}

/// What the exchanges are for.
#[derive(Clone, Debug)]
enum Work {
    Nothing,
    Starting,
    Measuring(Measurement),
}

/// An image controller.
#[derive(Debug)]
pub struct InSight {
    settings: InSightSettings,
    state: State,
    work: Work,
    since: Time,
    failures: u32,
    /// The status that refused the question, should no better answer come.
    refusal: Option<Status>,
    /// Whether it has been started.
    started: bool,
    /// A picture was asked for and its result is not known.
    pending: bool,
    /// A fence stands behind the picture asked for: it has been taken, or never will be.
    fenced: bool,
    /// When the last picture was asked for.
    asked: Time,
    /// When the picture asked for is late.
    picture_due: Time,
    /// The picture before the one that is awaited.
    count: u32,
    /// How many targets the last picture showed.
    found: u32,
    lines: LineAssembler,
    garbage_in_a_row: u64,
    info: Vec<String>,
    pose: Option<PoseReading>,
    outbox: VecDeque<Payload>,
    alarms: VecDeque<Alarm>,
    outcome: Option<Result<(), DeviceError>>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    pictures: u64,
    late: u64,
    old_answers: u64,
    old_results: u64,
    strangers: u64,
    damaged: u64,
    refused: u64,
    echoes: u64,
}

impl InSight {
    /// An image controller that has not been started.
    pub fn new(settings: InSightSettings) -> Self {
        Self {
            settings,
            state: State::Idle,
            work: Work::Nothing,
            since: Time::ZERO,
            failures: 0,
            refusal: None,
            started: false,
            pending: false,
            fenced: false,
            asked: Time::ZERO,
            picture_due: Time::ZERO,
            count: 0,
            found: 0,
            lines: LineAssembler::new(TERMINATOR, LINE_MAX),
            garbage_in_a_row: 0,
            info: Vec::new(),
            pose: None,
            outbox: VecDeque::new(),
            alarms: VecDeque::new(),
            outcome: None,
            counts: Counts::default(),
        }
    }

    fn say(&mut self, line: &str) {
        let mut bytes = line.as_bytes().to_vec();
        bytes.push(TERMINATOR);
        self.outbox.push_back(Payload::Bytes(bytes));
    }

    fn ask(&mut self, now: Time, question: Question) {
        let command = question.command(self.settings.result_cell);
        self.say(&command.emit());
        let mut deadline = now + self.settings.answer_timeout;
        match question {
            Question::Info => {
                self.info.clear();
                self.say(&Command::GetFile.emit());
            }
            Question::Picture => {
                self.pending = true;
                self.fenced = false;
                self.asked = now;
                deadline = now + self.settings.inspection_timeout;
                self.picture_due = deadline;
            }
            Question::Job if matches!(self.work, Work::Starting) => {
                deadline = now + self.settings.start_period;
            }
            Question::Job | Question::Online | Question::Count | Question::Result => {}
        }
        self.refusal = None;
        self.state = State::Asked { question, deadline };
    }

    fn begin(&mut self, now: Time, work: Work) {
        self.outcome = None;
        self.pose = None;
        self.work = work;
        self.since = now;
        self.failures = 0;
        self.pending = false;
        self.ask(now, Question::Job);
    }

    fn finish(&mut self, result: Result<(), DeviceError>) {
        self.state = State::Idle;
        self.work = Work::Nothing;
        self.outcome = Some(result);
    }

    fn line(&mut self, now: Time, line: &[u8]) {
        let State::Asked { question, .. } = self.state else {
            self.counts.old_answers += 1;
            return;
        };
        let Ok(text) = core::str::from_utf8(line).map(str::trim) else {
            return self.damaged();
        };
        if let Some(status) = Status::parse(text) {
            self.status(now, question, status);
        } else if Command::parse(text).is_ok() {
            self.counts.echoes += 1;
        } else if !text.is_empty() {
            self.text(now, question, text);
        }
    }

    fn status(&mut self, now: Time, question: Question, status: Status) {
        match (question, status) {
            (Question::Online, Status::Done) => self.ask(now, Question::Count),
            (Question::Picture, Status::Done) => self.ask(now, Question::Result),
            // It announces the text that follows.
            (Question::Job | Question::Info | Question::Count | Question::Result, Status::Done) => {
            }
            // What it says before the fence may be about something older.
            (Question::Job, _) => self.refusal = Some(status),
            (_, _) => {
                self.counts.refused += 1;
                self.refuse(question, status);
            }
        }
    }

    fn refuse(&mut self, question: Question, status: Status) {
        self.finish(Err(DeviceError::Refused {
            device: NAME,
            step: question.step(),
            status,
        }));
    }

    fn text(&mut self, now: Time, question: Question, text: &str) {
        if let Some((_, value)) = text.split_once(": ") {
            match question {
                Question::Info => self.info.push(text.to_owned()),
                _ if value.is_empty() => self.damaged(),
                _ => self.counts.old_answers += 1,
            }
        } else if text.eq_ignore_ascii_case(&self.settings.job) {
            self.fence(now, question);
        } else {
            match (question, Inspection::parse(text)) {
                (Question::Count, Ok(picture)) => self.counted(now, picture.count),
                (Question::Result, Ok(picture)) => self.judge(now, &picture),
                (_, Ok(_)) => self.counts.old_answers += 1,
                (Question::Job | Question::Info, Err(_)) if is_job(text) => {
                    self.give_up("the active job that the configuration names");
                }
                (_, Err(_)) => self.damaged(),
            }
        }
    }

    /// The active job has been named: nothing older comes any more.
    fn fence(&mut self, now: Time, question: Question) {
        self.garbage_in_a_row = 0;
        match (question, &self.work) {
            (Question::Job, Work::Starting) => self.ask(now, Question::Info),
            (Question::Job, Work::Measuring(_)) if self.pending => {
                self.fenced = true;
                self.ask(now, Question::Result);
            }
            (Question::Job, Work::Measuring(_)) => self.ask(now, Question::Count),
            // Without information it is the answer to a question that was repeated.
            (Question::Info, _) if !self.info.is_empty() => self.check_serial(now),
            _ => self.counts.old_answers += 1,
        }
    }

    fn check_serial(&mut self, now: Time) {
        let is_right = |wanted: &str| self.said("Serial Number") == Some(wanted);
        let wanted = self.settings.serial_number.as_deref();
        if wanted.is_none_or(is_right) {
            self.ask(now, Question::Online);
        } else {
            self.give_up("the serial number that the configuration names");
        }
    }

    fn said(&self, name: &str) -> Option<&str> {
        let lines = self.info.iter().filter_map(|line| line.split_once(": "));
        let mut values = lines.filter(|(it, _)| it.eq_ignore_ascii_case(name));
        values.next().map(|(_, value)| value.trim())
    }

    fn counted(&mut self, now: Time, count: u32) {
        self.count = count;
        match self.work {
            Work::Starting => {
                self.started = true;
                self.finish(Ok(()));
            }
            Work::Measuring(_) => self.ask(now, Question::Picture),
            Work::Nothing => {}
        }
    }

    fn judge(&mut self, now: Time, picture: &Inspection) {
        self.garbage_in_a_row = 0;
        let expected = if self.count >= COUNT_MAX {
            0
        } else {
            self.count + 1
        };
        if picture.count == self.count {
            return self.still_the_old_one(now);
        }
        self.pending = false;
        self.count = picture.count;
        if picture.count != expected {
            // Somebody else triggers, or the job was loaded anew: which picture this is, and
            // when it was taken, nobody knows.
            self.counts.strangers += 1;
            return self.failed(
                now,
                Question::Result,
                "a picture that no other program triggers",
            );
        }
        self.counts.pictures += 1;
        self.found = picture.found;
        let Work::Measuring(measurement) = &mut self.work else {
            return;
        };
        match measurement.take(now, picture, &self.settings, NAME) {
            None => self.ask(now, Question::Picture),
            Some(Ok(pose)) => {
                self.pose = Some(pose);
                self.finish(Ok(()));
            }
            Some(Err(error)) => self.finish(Err(error)),
        }
    }

    /// The picture asked for is not there yet; behind a fence, it will never be.
    fn still_the_old_one(&mut self, now: Time) {
        self.counts.old_results += 1;
        if self.fenced || now >= self.picture_due {
            self.pending = false;
            return self.failed(now, Question::Picture, "a picture after the trigger");
        }
        let until = now + self.settings.result_period;
        self.state = State::Resting { until };
    }

    /// The answer that this was is missing; that is noticed when it is late.
    fn damaged(&mut self) {
        self.counts.damaged += 1;
        self.garbage_in_a_row += 1;
        if self.garbage_in_a_row == self.settings.garbage_lines_max {
            let lines = self.garbage_in_a_row;
            self.alarms.push_back(Alarm::Garbage { lines });
        }
    }

    /// An exchange failed: behind a new fence the work goes on. A start is tried until the
    /// system must have booted.
    fn failed(&mut self, now: Time, question: Question, awaited: &'static str) {
        self.failures += 1;
        let is_last = match self.work {
            Work::Starting => now.since(self.since) >= self.settings.start_timeout,
            Work::Measuring(_) | Work::Nothing => self.failures > self.settings.retries,
        };
        if is_last {
            return match self.refusal {
                Some(status) => self.refuse(question, status),
                None => self.finish(Err(DeviceError::Timeout {
                    device: NAME,
                    awaited,
                    waited: now.since(self.since),
                    seen: Seen::Nothing,
                })),
            };
        }
        self.lines.clear();
        self.ask(now, Question::Job);
    }

    /// What it is or does is not what is needed; it is not used until it is started again.
    fn give_up(&mut self, needs: &'static str) {
        self.started = false;
        self.impossible(needs);
    }

    fn impossible(&mut self, needs: &'static str) {
        self.finish(Err(DeviceError::NotPossible {
            device: NAME,
            step: "measuring",
            needs,
        }));
    }
}

impl Device for InSight {
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
            Input::Lost(_) => self.lines.skip_message(),
            // Whatever runs ends by its own time-outs.
            Input::Link(_) => self.lines.clear(),
            Input::Payload(Payload::Frame(_) | Payload::Control(_)) | Input::BusError(_) => {}
        }
    }

    fn handle_timeout(&mut self, now: Time) {
        match self.state {
            State::Asked { question, deadline } if deadline <= now => {
                self.counts.late += 1;
                self.failed(now, question, question.awaited());
            }
            State::Resting { until } if until <= now => self.ask(now, Question::Result),
            State::Idle | State::Asked { .. } | State::Resting { .. } => {}
        }
    }

    fn poll_timeout(&self) -> Time {
        match self.state {
            State::Idle => Time::NEVER,
            State::Asked { deadline, .. } => deadline,
            State::Resting { until } => until,
        }
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.started = false;
        self.garbage_in_a_row = 0;
        self.lines.clear();
        self.outbox.clear();
        // A command that someone left unfinished on the line would spoil ours.
        self.say("");
        self.begin(now, Work::Starting);
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        let version = self.said("Application Version").unwrap_or("unknown");
        let serial = self.said("Serial Number").unwrap_or("unknown");
        let job = &self.settings.job;
        self.started.then(|| Identity {
            name: format!("In-Sight {serial}, version {version}, job {job}"),
            ..Identity::default()
        })
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("pictures", self.counts.pictures),
            ("late_answers", self.counts.late),
            ("old_answers", self.counts.old_answers),
            ("old_results", self.counts.old_results),
            ("strange_triggers", self.counts.strangers),
            ("damaged_lines", self.counts.damaged),
            ("refused", self.counts.refused),
            ("echoes", self.counts.echoes),
        ]
    }
}

impl PoseInstrument for InSight {
    fn begin_pose(&mut self, now: Time, exposures: u32) {
        self.pose = None;
        if !self.started {
            self.impossible("a started image controller");
        } else if exposures == 0 {
            self.impossible("at least one exposure");
        } else {
            self.begin(now, Work::Measuring(Measurement::new(exposures)));
        }
    }

    fn pose(&self) -> Option<PoseReading> {
        self.pose
    }

    fn asked(&self) -> Time {
        self.asked
    }

    fn found(&self) -> u32 {
        self.found
    }
}

/// Jobs are files with this ending.
fn is_job(text: &str) -> bool {
    let lower = text.to_ascii_lowercase();
    lower.ends_with(".job") || lower.ends_with(".jobx")
}

#[cfg(test)]
mod tests;
