//! A CAN adapter that speaks SLCAN (Lawicel's ASCII protocol) over a serial line or pty.
//!
//! Source: see [`crate::wire::slcan`]. The adapter is stopped, set up and opened step by
//! step, without blocking the other ports. It answers each command in order, so that a BEL
//! is known to belong to a transmission; that frame did not go out, which is reported as a
//! transmit overflow. Its status flags are read now and then: they show lost frames and an
//! ailing bus, and their absence shows a dead adapter.

use core::fmt;
use core::time::Duration;
use nix::errno::Errno;
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use units::Time;

use super::clock::Clock;
use super::live::{LivePort, OpenError, system};
use super::serial::{self, BackOff, Outbox, Read, SerialSettings};
use super::stamps::AdapterStamps;
use super::sync_thread::SyncSink;
use super::{Input, LinkState, Payload, Port, SendError};
use crate::wire::can::{BusError, BusErrorClass, ControllerProblem};
use crate::wire::canopen::sync::emit_sync;
use crate::wire::slcan::{BitrateCode, BusState, Command, LineBuffer, Reply, StatusFlags};

/// Lines that wait for a slow adapter: some twenty frames, as a CAN interface's queue.
const PENDING_MAX: usize = 512;
/// Unanswered commands that are kept in mind.
const ASKED_MAX: usize = 256;
/// After something was heard, an adapter that does not know `V` gets no longer than this.
const VERSION_WAIT: Duration = Duration::from_millis(200);

/// How an SLCAN adapter is set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlcanSettings {
    /// The CAN bus's bit/s.
    pub bitrate: u32,
    /// The serial line.
    pub serial: SerialSettings,
    /// Ask for the adapter's millisecond time stamps; done without when it refuses.
    pub timestamps: bool,
    /// How often the status flags are read; `None` for never.
    pub status_interval: Option<Duration>,
    /// How long an answer may take (wall time).
    pub answer_timeout: Duration,
    /// `false` for adapters that answer nothing (some firmware does not): nothing can be
    /// checked then.
    pub answers: bool,
}

impl SlcanSettings {
    /// Usual settings for a bus of `bitrate` bit/s.
    pub const fn new(bitrate: u32) -> Self {
        Self {
            bitrate,
            serial: SerialSettings::new(115_200),
            timestamps: true,
            status_interval: Some(Duration::from_millis(500)),
            answer_timeout: Duration::from_secs(2),
            answers: true,
        }
    }
}

/// Why an adapter could not be brought to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlcanFailure {
    /// It answered nothing.
    Silent {
        /// To which step.
        step: &'static str,
        /// For how long (wall time).
        waited: Duration,
    },
    /// It refused a step.
    Refused {
        /// Which.
        step: &'static str,
    },
    /// Its device vanished meanwhile.
    Gone,
}

impl fmt::Display for SlcanFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent { step, waited } => write!(
                f,
                "did not answer to `{step}` within {waited:?}; is it an SLCAN adapter, is \
                 its baud rate right?"
            ),
            Self::Refused { step } => write!(f, "refused `{step}`; unplug it and try again"),
            Self::Gone => f.write_str("vanished while it was set up"),
        }
    }
}

/// The steps of the start, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Clears the adapter's line, closes the channel; `V` marks the end of old answers.
    Close,
    Bitrate,
    Timestamps,
    Open,
}

impl Step {
    const fn name(self) -> &'static str {
        match self {
            Self::Close => "C",
            Self::Bitrate => "S",
            Self::Timestamps => "Z",
            Self::Open => "O",
        }
    }

    const fn next(self) -> Option<Self> {
        match self {
            Self::Close => Some(Self::Bitrate),
            Self::Bitrate => Some(Self::Timestamps),
            Self::Timestamps => Some(Self::Open),
            Self::Open => None,
        }
    }

    fn lines(self, settings: &SlcanSettings, bitrate: BitrateCode) -> Vec<u8> {
        match self {
            Self::Close => [
                b"\r\r".as_slice(),
                &Command::Close.emit(),
                &Command::ReadVersion.emit(),
            ]
            .concat(),
            Self::Bitrate => Command::Bitrate(bitrate).emit(),
            Self::Timestamps => Command::Timestamps(settings.timestamps).emit(),
            Self::Open => Command::Open.emit(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Starting { step: Step, deadline: Time },
    Open,
    Failed(SlcanFailure),
    Gone,
}

/// What an answer will belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Transmit,
    Status,
}

/// The line out: commands and what they still owe an answer for, in one order.
struct Lines {
    clock: Clock,
    outbox: Outbox,
    asked: VecDeque<(Asked, Time)>,
    answers: bool,
    open: bool,
}

impl Lines {
    fn send(&mut self, asked: Asked, line: &[u8]) -> Result<(), Errno> {
        if !self.open {
            return Err(Errno::ENETDOWN);
        }
        if self.asked.len() >= ASKED_MAX {
            return Err(Errno::EAGAIN);
        }
        self.outbox.send(line)?;
        if self.answers {
            self.asked.push_back((asked, self.clock.now()));
        }
        Ok(())
    }
}

/// The writing side, shared with the SYNC thread: whole lines, one after the other.
struct SharedLines(Mutex<Lines>);

impl SharedLines {
    fn lock(&self) -> MutexGuard<'_, Lines> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SyncSink for SharedLines {
    fn send_sync(&self) -> Result<(), Errno> {
        let mut lines = self.lock();
        lines.outbox.flush()?;
        // A SYNC behind waiting lines would be late: rather none.
        if lines.outbox.is_pending() {
            return Err(Errno::EAGAIN);
        }
        lines.send(Asked::Transmit, &Command::Transmit(emit_sync(None)).emit())
    }
}

/// An SLCAN adapter.
pub(super) struct SlcanPort {
    port: Port,
    clock: Clock,
    path: String,
    settings: SlcanSettings,
    bitrate: BitrateCode,
    descriptor: Option<Arc<OwnedFd>>,
    lines: Arc<SharedLines>,
    buffer: LineBuffer,
    state: State,
    reported: LinkState,
    /// Something was heard in the present step.
    heard: bool,
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
    /// Opens the serial line and begins the start; [`SlcanPort::handshake_result`] tells how
    /// it went.
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
        let lines = Lines {
            clock,
            outbox: Outbox::new(PENDING_MAX),
            asked: VecDeque::new(),
            answers: settings.answers,
            open: false,
        };
        let mut slcan = Self {
            port,
            clock,
            path: path.to_owned(),
            settings,
            bitrate,
            descriptor: None,
            lines: Arc::new(SharedLines(Mutex::new(lines))),
            buffer: LineBuffer::default(),
            state: State::Gone,
            reported: LinkState::Up,
            heard: false,
            next_status: Time::NEVER,
            flags: StatusFlags::empty(),
            stamps: AdapterStamps::default(),
            back_off: BackOff::new(clock),
            queued: VecDeque::new(),
            counts: Counts::default(),
        };
        let now = clock.now();
        slcan
            .connect(now)
            .map_err(|error| OpenError::serial(path, error))?;
        Ok(slcan)
    }

    /// How the start went, once it has ended.
    pub(super) const fn handshake_result(&self) -> Option<Result<(), SlcanFailure>> {
        match self.state {
            State::Starting { .. } => None,
            State::Open => Some(Ok(())),
            State::Failed(failure) => Some(Err(failure)),
            State::Gone => Some(Err(SlcanFailure::Gone)),
        }
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

    /// An adapter that speaks but does not know `V` ends the step by falling silent.
    fn shorten(&mut self, now: Time, step: Step) {
        let deadline = now + self.wall(VERSION_WAIT.min(self.settings.answer_timeout));
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

    /// Reads what the adapter said, writes what waits, and acts on deadlines.
    pub(super) fn progress(&mut self, now: Time, ready: bool) {
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
            Read::Bytes(bytes) => {
                for byte in bytes {
                    if let Some(line) = self.buffer.push(byte) {
                        self.line(now, Reply::parse(&line));
                    }
                }
            }
            Read::Nothing => {}
            Read::Gone => return self.lose(now),
        }
        let flushed = self.lines.lock().outbox.flush();
        if flushed.is_err() {
            self.lose(now);
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
            Reply::BusState(state) => self.bus_state(now, state),
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
            self.controller_problem(now, ControllerProblem::TX_OVERFLOW);
            // The flags say why.
            self.next_status = now;
        }
    }

    fn controller_problem(&mut self, now: Time, controller: ControllerProblem) {
        let class = BusErrorClass::CONTROLLER;
        self.bus_error(now, class, controller);
    }

    fn bus_error(&mut self, now: Time, class: BusErrorClass, controller: ControllerProblem) {
        let error = BusError { class, controller };
        self.queued.push_back((now, Input::BusError(error)));
    }

    /// Events are reported each time, lasting states when they begin or end.
    fn status(&mut self, now: Time, flags: StatusFlags) {
        let before = core::mem::replace(&mut self.flags, flags);
        let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
        let warning = ControllerProblem::RX_WARNING | ControllerProblem::TX_WARNING;
        if flags.intersects(StatusFlags::RX_FULL | StatusFlags::OVERRUN) {
            // How many, the protocol does not say: at least one.
            self.queued.push_back((now, Input::Lost(1)));
        }
        if flags.contains(StatusFlags::TX_FULL) {
            self.controller_problem(now, ControllerProblem::TX_OVERFLOW);
        }
        if flags.contains(StatusFlags::BUS_ERROR) {
            self.bus_error(now, BusErrorClass::BUS_ERROR, ControllerProblem::empty());
        }
        let lasting = StatusFlags::PASSIVE | StatusFlags::WARNING;
        if (flags ^ before).intersects(lasting) {
            let controller = if flags.contains(StatusFlags::PASSIVE) {
                passive
            } else if flags.contains(StatusFlags::WARNING) {
                warning
            } else {
                ControllerProblem::ACTIVE
            };
            self.controller_problem(now, controller);
        }
    }

    fn bus_state(&mut self, now: Time, state: BusState) {
        match state {
            BusState::Active => self.controller_problem(now, ControllerProblem::ACTIVE),
            BusState::Warning => self.controller_problem(
                now,
                ControllerProblem::RX_WARNING | ControllerProblem::TX_WARNING,
            ),
            BusState::Passive => self.controller_problem(
                now,
                ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE,
            ),
            BusState::Off | BusState::Stopped => {
                self.bus_error(now, BusErrorClass::BUS_OFF, ControllerProblem::empty());
            }
        }
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
                Ok(()) | Err(Errno::EAGAIN) => {}
                Err(_) => self.lose(now),
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
                if errno == Errno::EAGAIN {
                    return Err(system(port, errno));
                }
                self.lose(self.clock.now());
                let state = LinkState::Gone;
                Err(SendError::Unusable { port, state })
            }
        }
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
