//! Serial lines: opening and settings by tokio-serial's port builder, bytes by the
//! descriptor, vanishing and coming back.

use core::time::Duration;
use nix::errno::Errno;
use nix::sys::termios::{BaudRate, SetArg, cfsetspeed, tcgetattr, tcsetattr};
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use units::Time;
use wire::LineControl;
use wire::{Input, LinkState, Payload, Port};

mod opening;

use super::SendError;
use super::clock::Clock;
use super::live_port::{LivePort, awaited, is_gone, system};
use super::open_line::OpenLine;
use super::os;
pub(super) use opening::{SerialError, open};

const READ_MAX: usize = 4_096;
/// What may wait for a slow line before a send is refused.
const PENDING_MAX: usize = 4_096;
const FIRST_RETRY: Duration = Duration::from_millis(100);
const RETRY_MAX: Duration = Duration::from_secs(2);

/// The parity bit of a serial line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Parity {
    #[default]
    None,
    Even,
    Odd,
}

/// The stop bits of a serial line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum StopBits {
    #[default]
    One,
    Two,
}

/// How a serial line is set up. Flow control is off: no device here uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialSettings {
    /// Bits per second.
    pub baud: u32,
    /// 5 to 8.
    pub data_bits: u8,
    /// Parity.
    pub parity: Parity,
    /// Stop bits.
    pub stop_bits: StopBits,
    /// Data terminal ready; `None` leaves it as it is. A pty has none, which is no error.
    pub dtr: Option<bool>,
    /// Request to send; as `dtr`.
    pub rts: Option<bool>,
}

impl SerialSettings {
    /// 8 data bits, no parity, 1 stop bit, DTR and RTS on.
    pub const fn new(baud: u32) -> Self {
        Self {
            baud,
            data_bits: 8,
            parity: Parity::None,
            stop_bits: StopBits::One,
            dtr: Some(true),
            rts: Some(true),
        }
    }
}

/// Another rate for a line that is open.
fn set_baud(descriptor: &OpenLine, baud: u32) -> Result<(), Errno> {
    let rate = match baud {
        4_800 => BaudRate::B4800,
        9_600 => BaudRate::B9600,
        19_200 => BaudRate::B19200,
        38_400 => BaudRate::B38400,
        57_600 => BaudRate::B57600,
        115_200 => BaudRate::B115200,
        230_400 => BaudRate::B230400,
        _ => return Err(Errno::EINVAL),
    };
    let mut settings = tcgetattr(descriptor)?;
    cfsetspeed(&mut settings, rate)?;
    tcsetattr(descriptor, SetArg::TCSANOW, &settings)
}

/// Bytes on their way out; what a slow line does not take at once is kept, in order.
#[derive(Debug)]
pub(super) struct Outbox {
    descriptor: Option<Arc<OpenLine>>,
    pending: VecDeque<u8>,
    limit: usize,
    /// Bytes that were written or kept so far.
    taken: u64,
}

impl Outbox {
    pub(super) const fn new(limit: usize) -> Self {
        Self {
            descriptor: None,
            pending: VecDeque::new(),
            limit,
            taken: 0,
        }
    }

    /// How many bytes were written or kept so far.
    pub(super) const fn taken(&self) -> u64 {
        self.taken
    }

    /// From now on to this descriptor; what was pending is forgotten.
    pub(super) fn connect(&mut self, descriptor: Option<Arc<OpenLine>>) {
        self.descriptor = descriptor;
        self.pending.clear();
    }

    pub(super) fn is_pending(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Writes or keeps all of `bytes`, or none: EAGAIN when too much is pending.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), Errno> {
        self.flush()?;
        if self.pending.len() + bytes.len() > self.limit {
            return Err(Errno::EAGAIN);
        }
        let written = if self.is_pending() {
            0
        } else {
            self.write(bytes)?
        };
        self.pending.extend(&bytes[written..]);
        self.taken += bytes.len() as u64;
        Ok(())
    }

    /// Writes of what is pending as much as the line takes now.
    pub(super) fn flush(&mut self) -> Result<(), Errno> {
        while self.is_pending() {
            let (front, _) = self.pending.as_slices();
            let written = self.write(front)?;
            if written == 0 {
                break;
            }
            self.pending.drain(..written);
        }
        Ok(())
    }

    /// How many bytes the line took; 0 when it takes none now.
    fn write(&self, bytes: &[u8]) -> Result<usize, Errno> {
        let descriptor = self.descriptor.as_ref().ok_or(Errno::ENODEV)?;
        match nix::unistd::write(descriptor, bytes) {
            Err(Errno::EAGAIN | Errno::EINTR) => Ok(0),
            result => result,
        }
    }
}

/// What a read gave.
pub(super) enum Read {
    Bytes(Vec<u8>),
    Nothing,
    /// The device vanished.
    Gone,
}

/// Reads what is there.
pub(super) fn read(descriptor: &OpenLine) -> Read {
    let mut buffer = [0; READ_MAX];
    match read_into(descriptor, &mut buffer) {
        None => Read::Gone,
        Some(0) => Read::Nothing,
        Some(count) => Read::Bytes(buffer[..count].to_vec()),
    }
}

/// Waits until `count` bytes have come, which are known to be on their way; fewer when the
/// device vanished or they do not come.
pub(super) fn read_exactly(descriptor: &OpenLine, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count];
    let mut filled = 0;
    while filled < count {
        match read_into(descriptor, &mut bytes[filled..]) {
            Some(0) if awaited(descriptor.as_fd()) => {}
            Some(0) | None => break,
            Some(more) => filled += more,
        }
    }
    bytes.truncate(filled);
    bytes
}

/// How many bytes were there; `None` when the device vanished.
fn read_into(descriptor: &OpenLine, buffer: &mut [u8]) -> Option<usize> {
    match nix::unistd::read(descriptor, buffer) {
        // A pty whose other side was closed reads as 0 bytes or EIO.
        Ok(0) => None,
        Ok(count) => Some(count),
        Err(Errno::EAGAIN | Errno::EINTR) => Some(0),
        Err(_) => None,
    }
}

/// Waits longer after each failure to open again.
#[derive(Debug)]
pub(super) struct BackOff {
    clock: Clock,
    wait: Duration,
    at: Time,
}

impl BackOff {
    pub(super) const fn new(clock: Clock) -> Self {
        Self {
            clock,
            wait: FIRST_RETRY,
            at: Time::ZERO,
        }
    }

    /// Begins anew: the first try comes soon.
    pub(super) fn begin(&mut self, now: Time) {
        self.wait = FIRST_RETRY;
        self.again(now);
    }

    /// A try failed: the next comes later.
    pub(super) fn again(&mut self, now: Time) {
        self.at = now + self.clock.span_of_wall(self.wait);
        self.wait = (self.wait * 2).min(RETRY_MAX);
    }

    /// When to try.
    pub(super) const fn at(&self) -> Time {
        self.at
    }
}

/// A serial line that carries plain bytes.
pub(super) struct SerialLine {
    port: Port,
    clock: Clock,
    path: String,
    settings: SerialSettings,
    descriptor: Option<Arc<OpenLine>>,
    outbox: Outbox,
    back_off: BackOff,
    queued: VecDeque<(Time, Input)>,
    reopened: u64,
    refused: u64,
}

impl SerialLine {
    pub(super) fn open(
        clock: Clock,
        port: Port,
        path: &str,
        settings: SerialSettings,
    ) -> Result<Self, SerialError> {
        let mut line = Self {
            port,
            back_off: BackOff::new(clock.clone()),
            clock,
            path: path.to_owned(),
            settings,
            descriptor: None,
            outbox: Outbox::new(PENDING_MAX),
            queued: VecDeque::new(),
            reopened: 0,
            refused: 0,
        };
        line.connect()?;
        Ok(line)
    }

    fn connect(&mut self) -> Result<(), SerialError> {
        let descriptor = Arc::new(open(&self.path, &self.settings)?);
        self.outbox.connect(Some(Arc::clone(&descriptor)));
        self.descriptor = Some(descriptor);
        Ok(())
    }

    fn lose(&mut self, now: Time) {
        if self.descriptor.take().is_some() {
            self.outbox.connect(None);
            self.back_off.begin(now);
            self.queued.push_back((now, Input::Link(LinkState::Gone)));
        }
    }

    fn try_again(&mut self, now: Time) {
        match self.connect() {
            Ok(()) => {
                self.reopened += 1;
                self.queued.push_back((now, Input::Link(LinkState::Up)));
            }
            Err(_) => self.back_off.again(now),
        }
    }

    /// Does not wait: whoever changes the rate has waited until what was sent has left. What
    /// still waits here is a queue that is full.
    fn control(&mut self, control: LineControl) -> Result<(), SendError> {
        let port = self.port;
        let Some(descriptor) = &self.descriptor else {
            let state = LinkState::Gone;
            return Err(SendError::Unusable { port, state });
        };
        if self.outbox.is_pending() {
            return Err(SendError::QueueFull { port });
        }
        let done = match control {
            LineControl::Baud(baud) => set_baud(descriptor, baud),
            LineControl::Break(on) => os::set_break(descriptor, on),
        };
        if let (Ok(()), LineControl::Baud(baud)) = (done, control) {
            // A line that is opened again goes on as it was.
            self.settings.baud = baud;
        }
        match done {
            // A pty has no line to hold low, some adapters cannot.
            Err(Errno::ENOTTY | Errno::EOPNOTSUPP) if matches!(control, LineControl::Break(_)) => {
                Ok(())
            }
            done => done.map_err(|errno| system(port, errno)),
        }
    }

    fn read(&mut self, now: Time) {
        let Some(descriptor) = &self.descriptor else {
            return;
        };
        match read(descriptor) {
            Read::Bytes(bytes) => {
                let input = Input::Payload(Payload::Bytes(bytes));
                self.queued.push_back((now, input));
            }
            Read::Nothing => {}
            Read::Gone => self.lose(now),
        }
        self.flush();
    }
}

impl LivePort for SerialLine {
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.descriptor.as_ref().map(|open| open.as_fd())
    }

    fn wants_write(&self) -> bool {
        self.outbox.is_pending()
    }

    fn next_event(&self) -> Time {
        if !self.queued.is_empty() {
            Time::ZERO
        } else if self.descriptor.is_none() {
            self.back_off.at()
        } else {
            Time::NEVER
        }
    }

    fn poll(&mut self, known: Time, ready: bool) -> Option<(Time, Input)> {
        if self.queued.is_empty() && ready {
            self.read(self.clock.now());
        } else if self.descriptor.is_none() && self.back_off.at() <= known {
            self.try_again(known);
        }
        self.queued.pop_front()
    }

    fn send(&mut self, payload: &Payload) -> Result<(), SendError> {
        let port = self.port;
        let bytes = match payload {
            Payload::Bytes(bytes) => bytes,
            Payload::Control(control) => return self.control(*control),
            Payload::Frame(_) => return Err(SendError::WrongKind { port }),
        };
        let state = LinkState::Gone;
        let gone = SendError::Unusable { port, state };
        if self.descriptor.is_none() {
            return Err(gone);
        }
        self.outbox.send(bytes).map_err(|errno| {
            self.refused += 1;
            if !is_gone(errno) {
                return system(port, errno);
            }
            self.lose(self.clock.now());
            gone
        })
    }

    fn units_sent(&self) -> u64 {
        self.outbox.taken()
    }

    fn flush(&mut self) {
        if self.outbox.flush().is_err() {
            self.lose(self.clock.now());
        }
    }

    fn take_in(&mut self, now: Time, units: usize) {
        let Some(descriptor) = &self.descriptor else {
            return;
        };
        let bytes = read_exactly(descriptor, units);
        if !bytes.is_empty() {
            let input = Input::Payload(Payload::Bytes(bytes));
            self.queued.push_back((now, input));
        }
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        vec![("reopened", self.reopened), ("refused", self.refused)]
    }
}
