//! A CAN adapter that speaks SLCAN (Lawicel's ASCII protocol) over a serial line or pty.
//!
//! Source: see [`wire::slcan`]. The adapter is stopped, set up and opened step by
//! step, without blocking the other ports. It answers each command in order, so that a BEL
//! is known to belong to a transmission; that frame did not go out, which is reported as a
//! transmit overflow. Its status flags are read now and then: they show lost frames and an
//! ailing bus, and their absence shows a dead adapter.

mod failure;
mod health;
mod lines;
mod start;

use core::time::Duration;
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use units::Time;
use wire::slcan::{BitrateCode, Command, LineBuffer, Reply, StatusFlags};
use wire::{Input, LinkState, Payload, Port};

pub use self::failure::SlcanFailure;
use self::lines::{Asked, SharedLines};
pub use self::start::SlcanSettings;
use self::start::Step;
use super::SendError;
use super::clock::Clock;
use super::live_port::{LivePort, is_gone, system};
use super::open_error::OpenError;
use super::open_line::OpenLine;
use super::serial::{self, BackOff, Read};
use super::stamps::AdapterStamps;
use super::sync_thread::SyncSink;

/// After something was heard, an adapter that does not know `V` gets no longer than this.
const VERSION_WAIT: Duration = Duration::from_millis(200);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Starting { step: Step, deadline: Time },
    Open,
    Failed(SlcanFailure),
    Gone,
}

/// An SLCAN adapter.
pub(super) struct SlcanPort {
    port: Port,
    clock: Clock,
    path: String,
    settings: SlcanSettings,
    bitrate: BitrateCode,
    descriptor: Option<Arc<OpenLine>>,
    lines: Arc<SharedLines>,
    buffer: LineBuffer,
    state: State,
    reported: LinkState,
    /// Something was heard in the present step.
    heard: bool,
    /// When the present step ends, whatever is heard.
    step_ends: Time,
    next_status: Time,
    flags: StatusFlags,
    stamps: AdapterStamps,
    back_off: BackOff,
    queued: VecDeque<(Time, Input)>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    received: u64,
    sent: u64,
    refused_by_adapter: u64,
    refused: u64,
    unknown_lines: u64,
    unanswered: u64,
    reopened: u64,
}

impl SlcanPort {
    /// Opens the serial line and begins the start; [`LivePort::start_result`] tells how it
    /// went.
    pub(super) fn open(
        clock: Clock,
        port: Port,
        path: &str,
        settings: SlcanSettings,
    ) -> Result<Self, OpenError> {
        let bitrate = BitrateCode::new(settings.bitrate).ok_or_else(|| OpenError::Bitrate {
            path: path.to_owned(),
            bitrate: settings.bitrate,
        })?;
        let mut slcan = Self {
            port,
            back_off: BackOff::new(clock.clone()),
            clock: clock.clone(),
            path: path.to_owned(),
            settings,
            bitrate,
            descriptor: None,
            lines: Arc::new(SharedLines::new(clock.clone(), settings.answers)),
            buffer: LineBuffer::default(),
            state: State::Gone,
            reported: LinkState::Up,
            heard: false,
            step_ends: Time::NEVER,
            next_status: Time::NEVER,
            flags: StatusFlags::empty(),
            stamps: AdapterStamps::default(),
            queued: VecDeque::new(),
            counts: Counts::default(),
        };
        let now = clock.now();
        slcan
            .connect(now)
            .map_err(|error| OpenError::serial(path, error))?;
        Ok(slcan)
    }

    fn connect(&mut self, now: Time) -> Result<(), serial::SerialError> {
        let descriptor = Arc::new(serial::open(&self.path, &self.settings.serial)?);
        self.lines
            .lock()
            .outbox
            .connect(Some(Arc::clone(&descriptor)));
        self.descriptor = Some(descriptor);
        self.buffer = LineBuffer::default();
        self.stamps = AdapterStamps::default();
        self.flags = StatusFlags::empty();
        self.begin(now, Step::Close);
        Ok(())
    }

    fn begin(&mut self, now: Time, step: Step) {
        self.heard = false;
        let lines = step.lines(&self.settings, self.bitrate);
        if self.lines.lock().outbox.send(&lines).is_err() {
            self.lose(now);
            return;
        }
        let deadline = now + self.wall(self.settings.answer_timeout);
        self.step_ends = deadline;
        self.state = State::Starting { step, deadline };
        if !self.settings.answers {
            self.step_done(now, step);
        }
    }

    fn step_done(&mut self, now: Time, step: Step) {
        if let Some(next) = step.next() {
            self.begin(now, next);
            return;
        }
        self.state = State::Open;
        {
            let mut lines = self.lines.lock();
            lines.asked.clear();
            lines.open = true;
        }
        self.next_status = self.after_interval(now);
        self.report(now, LinkState::Up);
    }

    /// No step of the start is done by an answer other than its own.
    fn start_answer(&mut self, now: Time, step: Step, reply: Reply) {
        self.heard = true;
        match (step, reply) {
            (Step::Close, Reply::Version(_)) => self.step_done(now, step),
            // Old answers, and those to the empty lines and to `C`.
            (Step::Close, _) => self.shorten(now, step),
            (_, Reply::Done) | (Step::Timestamps, Reply::Refused) => self.step_done(now, step),
            (_, Reply::Refused) => {
                self.fail(now, SlcanFailure::Refused { step: step.name() });
            }
            _ => {}
        }
    }

    /// An adapter that speaks but does not know `V` ends the step by falling silent. One that
    /// never falls silent is none: some other device streams there.
    fn shorten(&mut self, now: Time, step: Step) {
        let deadline = (now + self.wall(VERSION_WAIT)).min(self.step_ends);
        self.state = State::Starting { step, deadline };
    }

    fn start_timeout(&mut self, now: Time, step: Step) {
        if step == Step::Close && self.heard {
            self.step_done(now, step);
            return;
        }
        let waited = self.settings.answer_timeout;
        let step = step.name();
        self.fail(now, SlcanFailure::Silent { step, waited });
    }

    fn fail(&mut self, now: Time, failure: SlcanFailure) {
        self.disconnect(now);
        self.state = State::Failed(failure);
    }

    fn lose(&mut self, now: Time) {
        self.disconnect(now);
        self.state = State::Gone;
        self.report(now, LinkState::Gone);
    }

    /// Lets go of the device; it is tried again by and by.
    fn disconnect(&mut self, now: Time) {
        let was_open = self.state == State::Open;
        self.descriptor = None;
        self.next_status = Time::NEVER;
        let mut lines = self.lines.lock();
        lines.open = false;
        lines.asked.clear();
        lines.outbox.connect(None);
        drop(lines);
        if was_open {
            self.back_off.begin(now);
        } else {
            self.back_off.again(now);
        }
    }

    fn report(&mut self, now: Time, link: LinkState) {
        if core::mem::replace(&mut self.reported, link) != link {
            self.queued.push_back((now, Input::Link(link)));
        }
    }

    fn wall(&self, span: Duration) -> Duration {
        self.clock.span_of_wall(span)
    }

    fn after_interval(&self, now: Time) -> Time {
        match self.settings.status_interval {
            Some(interval) if self.settings.answers => now + self.wall(interval),
            _ => Time::NEVER,
        }
    }

    fn try_again(&mut self, now: Time) {
        match self.connect(now) {
            Ok(()) => self.counts.reopened += 1,
            Err(_) => self.back_off.again(now),
        }
    }

    fn read(&mut self, now: Time) {
        let Some(descriptor) = &self.descriptor else {
            return;
        };
        match serial::read(descriptor) {
            Read::Bytes(bytes) => self.heard(now, &bytes),
            Read::Nothing => {}
            Read::Gone => return self.lose(now),
        }
        self.flush();
    }

    fn heard(&mut self, now: Time, bytes: &[u8]) {
        for byte in bytes {
            if let Some(line) = self.buffer.push(*byte) {
                self.line(now, Reply::parse(&line));
            }
        }
    }

    fn line(&mut self, now: Time, reply: Reply) {
        match self.state {
            State::Starting { step, .. } => self.start_answer(now, step, reply),
            State::Open => self.open_answer(now, reply),
            State::Gone | State::Failed(_) => {}
        }
    }

    fn open_answer(&mut self, now: Time, reply: Reply) {
        match reply {
            Reply::Received {
                frame,
                timestamp_ms,
            } => {
                self.counts.received += 1;
                let at = self.stamps.arrival(now, timestamp_ms);
                let input = Input::Payload(Payload::Frame(frame));
                self.queued.push_back((at, input));
            }
            Reply::Done | Reply::Queued => self.answered(Asked::Transmit),
            Reply::Refused => self.refused(now),
            Reply::Status(flags) => {
                self.answered(Asked::Status);
                self.status(now, flags);
            }
            Reply::BusState(state) => self.queued.push_back((now, health::of_state(state))),
            Reply::Version(_) | Reply::Serial(_) => {}
            Reply::Unknown(_) => {
                self.counts.unknown_lines += 1;
                return;
            }
        }
        self.report(now, LinkState::Up);
    }

    /// Strikes out what was answered, and what was asked before it: answers keep the order,
    /// so those were lost.
    fn answered(&mut self, kind: Asked) {
        let mut lines = self.lines.lock();
        if let Some(at) = lines.asked.iter().position(|(asked, _)| *asked == kind) {
            lines.asked.drain(..=at);
            self.counts.unanswered += at as u64;
        }
    }

    fn refused(&mut self, now: Time) {
        let asked = self.lines.lock().asked.pop_front();
        self.counts.refused_by_adapter += 1;
        if matches!(asked, Some((Asked::Transmit, _))) {
            self.queued.push_back((now, health::transmit_overflow()));
            // The flags say why.
            self.next_status = now;
        }
    }

    fn status(&mut self, now: Time, flags: StatusFlags) {
        let before = core::mem::replace(&mut self.flags, flags);
        let inputs = health::of_flags(before, flags);
        self.queued
            .extend(inputs.into_iter().map(|input| (now, input)));
    }

    /// Looks after answers that do not come, and asks for the status flags.
    fn watch(&mut self, now: Time) {
        let oldest = self.lines.lock().asked.front().copied();
        if let Some((asked, since)) = oldest
            && since + self.wall(self.settings.answer_timeout) <= now
        {
            self.unanswered(now, asked);
        }
        if self.next_status <= now {
            self.next_status = self.after_interval(now);
            let sent = self
                .lines
                .lock()
                .send(Asked::Status, &Command::ReadStatus.emit());
            match sent {
                Err(errno) if is_gone(errno) => self.lose(now),
                // What it does not take now it is asked again.
                Ok(()) | Err(_) => {}
            }
        }
    }

    /// One lost answer is asked after; an adapter that leaves that unanswered, too, is down.
    fn unanswered(&mut self, now: Time, asked: Asked) {
        let mut lines = self.lines.lock();
        self.counts.unanswered += lines.asked.len() as u64;
        lines.asked.clear();
        drop(lines);
        match asked {
            Asked::Transmit => self.next_status = now,
            Asked::Status => self.report(now, LinkState::Down),
        }
    }

    fn link(&self) -> LinkState {
        match self.state {
            State::Open => LinkState::Up,
            State::Starting { .. } => LinkState::Down,
            State::Gone | State::Failed(_) => LinkState::Gone,
        }
    }
}

impl LivePort for SlcanPort {
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.descriptor.as_ref().map(|open| open.as_fd())
    }

    fn wants_write(&self) -> bool {
        self.lines.lock().outbox.is_pending()
    }

    fn next_event(&self) -> Time {
        if !self.queued.is_empty() {
            return Time::ZERO;
        }
        match self.state {
            State::Starting { deadline, .. } => deadline,
            State::Gone | State::Failed(_) => self.back_off.at(),
            State::Open => {
                let timeout = self.wall(self.settings.answer_timeout);
                let asked = self.lines.lock().asked.front().copied();
                asked.map_or(self.next_status, |(_, since)| {
                    self.next_status.min(since + timeout)
                })
            }
        }
    }

    fn poll(&mut self, known: Time, ready: bool) -> Option<(Time, Input)> {
        if self.queued.is_empty() {
            let now = if ready { self.clock.now() } else { known };
            self.progress(now, ready);
        }
        self.queued.pop_front()
    }

    fn send(&mut self, payload: &Payload) -> Result<(), SendError> {
        let port = self.port;
        let Payload::Frame(frame) = payload else {
            return Err(SendError::WrongKind { port });
        };
        if self.state != State::Open {
            let state = self.link();
            return Err(SendError::Unusable { port, state });
        }
        let line = Command::Transmit(*frame).emit();
        let sent = self.lines.lock().send(Asked::Transmit, &line);
        match sent {
            Ok(()) => {
                self.counts.sent += 1;
                Ok(())
            }
            Err(errno) => {
                self.counts.refused += 1;
                if !is_gone(errno) {
                    return Err(system(port, errno));
                }
                self.lose(self.clock.now());
                let state = LinkState::Gone;
                Err(SendError::Unusable { port, state })
            }
        }
    }

    fn start_result(&self) -> Option<Result<(), SlcanFailure>> {
        match self.state {
            State::Starting { .. } => None,
            State::Open => Some(Ok(())),
            State::Failed(failure) => Some(Err(failure)),
            State::Gone => Some(Err(SlcanFailure::Gone)),
        }
    }

    /// Reads what the adapter said, writes what waits, and acts on deadlines.
    fn progress(&mut self, now: Time, ready: bool) {
        if ready {
            self.read(now);
        }
        match self.state {
            State::Starting { step, deadline } if deadline <= now => self.start_timeout(now, step),
            State::Open => self.watch(now),
            State::Gone | State::Failed(_) if self.back_off.at() <= now => self.try_again(now),
            State::Starting { .. } | State::Gone | State::Failed(_) => {}
        }
    }

    fn units_sent(&self) -> u64 {
        self.lines.lock().outbox.taken()
    }

    fn flush(&mut self) {
        let flushed = self.lines.lock().outbox.flush();
        if flushed.is_err() {
            self.lose(self.clock.now());
        }
    }

    fn take_in(&mut self, now: Time, units: usize) {
        let Some(descriptor) = &self.descriptor else {
            return;
        };
        let bytes = serial::read_exactly(descriptor, units);
        self.heard(now, &bytes);
    }

    fn sync_sink(&self) -> Option<Arc<dyn SyncSink>> {
        Some(Arc::clone(&self.lines) as Arc<dyn SyncSink>)
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("received", self.counts.received),
            ("sent", self.counts.sent),
            ("refused", self.counts.refused),
            ("refused_by_adapter", self.counts.refused_by_adapter),
            ("unknown_lines", self.counts.unknown_lines),
            ("overlong_lines", self.buffer.discarded()),
            ("unanswered", self.counts.unanswered),
            ("reopened", self.counts.reopened),
        ]
    }
}
