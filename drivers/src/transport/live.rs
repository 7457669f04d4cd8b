//! Live ports: SocketCAN interfaces, SLCAN adapters and serial lines, in one thread.
//!
//! All ports are read without waiting; only when none has anything does the thread wait, in
//! one `ppoll` over all of them until the caller's deadline. No reader threads and no
//! channels stand between a frame and its reader. `ppoll` and not an executor, because it
//! takes deadlines in nanoseconds and costs one system call: a tokio timer is a millisecond
//! late at the median and reads the clock several times per turn.

use core::cell::Cell;
use core::time::Duration;
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_nanosleep};
use std::collections::BTreeMap;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::sync::Arc;
use units::Time;

use super::clock::Clock;
pub use super::serial::{Parity, SerialSettings, StopBits};
use super::serial::{SerialError, SerialLine};
use super::slcan::SlcanPort;
pub use super::slcan::{SlcanFailure, SlcanSettings};
use super::socketcan::{self, CanPort};
use super::sync_thread::{SyncSink, SyncStatistics, SyncThread, monotonic};
use super::{Arrival, Input, Payload, Port, SendError, Transport};

/// Until the clock has been read, a wait is no longer than this, or half of what is left.
const COARSE_WAIT: Duration = Duration::from_millis(1);
/// Ports that can be waited for without memory being asked for: the cyclic engine waits here.
const WAITED_MAX: usize = 16;
/// The longest single wait, so that a deadline of "never" needs no special case.
const WAIT_MAX: Duration = Duration::from_secs(3_600);

/// One port that this thread reads.
pub(super) trait LivePort: Send {
    /// What to wait on; `None` while the port is gone.
    fn descriptor(&self) -> Option<BorrowedFd<'_>>;

    /// Whether to wait for room to write, too.
    fn wants_write(&self) -> bool {
        false
    }

    /// When to be polled even if nothing is readable.
    fn next_event(&self) -> Time;

    /// The next input, without waiting. `ready`: the descriptor can be read (or written).
    /// It is `known` or a little later; who needs it better reads the clock.
    fn poll(&mut self, known: Time, ready: bool) -> Option<(Time, Input)>;

    /// Sends without waiting.
    fn send(&mut self, payload: &Payload) -> Result<(), SendError>;

    /// Where a SYNC thread may send; `None` for a serial line.
    fn sync_sink(&self) -> Option<Arc<dyn SyncSink>> {
        None
    }

    /// Counters for a person who looks for trouble.
    fn counters(&self) -> Vec<(&'static str, u64)>;
}

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// No network interface of that name.
    #[error(
        "CAN interface {interface}: does not exist; `ip link` lists what there is, \
         `ip link add dev {interface} type vcan && ip link set {interface} up` makes a \
         virtual one"
    )]
    NoInterface {
        /// Its name.
        interface: String,
    },
    /// The kernel was built without CAN.
    #[error(
        "CAN interface {interface}: this kernel has no CAN sockets; try `modprobe can_raw`, \
         or use an SLCAN adapter"
    )]
    NoCan {
        /// Its name.
        interface: String,
    },
    /// Opening or setting up the CAN socket failed otherwise.
    #[error("CAN interface {interface}: {source}")]
    Can {
        /// Its name.
        interface: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The serial port could not be opened.
    #[error("{path}: {source}; {help}")]
    Serial {
        /// The device's path.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do about it.
        help: &'static str,
    },
    /// The CAN adapter has no code for the bit rate.
    #[error(
        "{path}: SLCAN knows no bit rate of {bitrate} bit/s; it has 10, 20, 50, 100, 125, \
         250, 500, 800 and 1000 kbit/s"
    )]
    Bitrate {
        /// The device's path.
        path: String,
        /// The bit rate asked for.
        bitrate: u32,
    },
    /// The SLCAN adapter did not do what it was told.
    #[error("{path}: SLCAN adapter {failure}")]
    Slcan {
        /// The device's path.
        path: String,
        /// What went wrong.
        failure: SlcanFailure,
    },
    /// More ports than one thread waits for.
    #[error("more than {limit} CAN buses and serial lines: give some to another process")]
    TooManyPorts {
        /// How many there may be.
        limit: usize,
    },
    /// Two ports have the same number.
    #[error("port {}: given twice", port.0)]
    DuplicatePort {
        /// The number.
        port: Port,
    },
}

impl OpenError {
    pub(super) fn serial(path: &str, error: SerialError) -> Self {
        Self::Serial {
            path: path.to_owned(),
            source: error.source,
            help: error.help,
        }
    }
}

enum Plan {
    SocketCan(String),
    Slcan(String, SlcanSettings),
    Serial(String, SerialSettings),
}

/// What to open; see [`Live::builder`].
pub struct LiveBuilder {
    clock: Clock,
    plans: Vec<(Port, Plan)>,
}

impl LiveBuilder {
    /// A CAN interface of the kernel, such as `can0` or `vcan0`.
    #[must_use]
    pub fn socketcan(mut self, port: Port, interface: &str) -> Self {
        self.plans
            .push((port, Plan::SocketCan(interface.to_owned())));
        self
    }

    /// A CAN adapter that speaks SLCAN over a serial line or pty.
    #[must_use]
    pub fn slcan(mut self, port: Port, path: impl AsRef<Path>, settings: SlcanSettings) -> Self {
        self.plans.push((port, Plan::Slcan(text(path), settings)));
        self
    }

    /// A serial line.
    #[must_use]
    pub fn serial(mut self, port: Port, path: impl AsRef<Path>, settings: SerialSettings) -> Self {
        self.plans.push((port, Plan::Serial(text(path), settings)));
        self
    }

    /// Opens all of them.
    ///
    /// # Errors
    /// The first port that cannot be opened, its cause and what to do.
    pub fn build(self) -> Result<Live, OpenError> {
        let mut ports = Vec::with_capacity(self.plans.len());
        let mut index = BTreeMap::new();
        for (port, plan) in self.plans {
            if ports.len() == WAITED_MAX {
                return Err(OpenError::TooManyPorts { limit: WAITED_MAX });
            }
            if index.insert(port, ports.len()).is_some() {
                return Err(OpenError::DuplicatePort { port });
            }
            let live = open(self.clock, port, plan)?;
            ports.push(Slot {
                port,
                live,
                ready: false,
                sync: None,
            });
        }
        Ok(Live {
            clock: self.clock,
            known: Cell::new(self.clock.now()),
            ports,
            index,
        })
    }
}

fn text(path: impl AsRef<Path>) -> String {
    path.as_ref().to_string_lossy().into_owned()
}

fn open(clock: Clock, port: Port, plan: Plan) -> Result<Box<dyn LivePort>, OpenError> {
    Ok(match plan {
        Plan::SocketCan(interface) => Box::new(
            CanPort::open(clock, port, &interface)
                .map_err(|error| socketcan::open_error(interface, error))?,
        ),
        Plan::Slcan(path, settings) => {
            let mut slcan = SlcanPort::open(clock, port, &path, settings)?;
            wait_for_handshake(clock, &mut slcan)
                .map_err(|failure| OpenError::Slcan { path, failure })?;
            Box::new(slcan)
        }
        Plan::Serial(path, settings) => Box::new(
            SerialLine::open(clock, port, &path, settings)
                .map_err(|error| OpenError::serial(&path, error))?,
        ),
    })
}

/// Lets an adapter finish its start; ends because every step of it has a deadline.
fn wait_for_handshake(clock: Clock, slcan: &mut SlcanPort) -> Result<(), SlcanFailure> {
    loop {
        if let Some(result) = slcan.handshake_result() {
            return result;
        }
        let ready = wait_one(clock, slcan);
        let now = clock.now();
        // Frames cannot come before the channel is open; link reports can wait.
        slcan.progress(now, ready);
    }
}

fn wait_one(clock: Clock, port: &dyn LivePort) -> bool {
    let Some(descriptor) = port.descriptor() else {
        return false;
    };
    let mut descriptors = [PollFd::new(descriptor, interest(port))];
    let timeout = clock.until(port.next_event()).min(WAIT_MAX);
    matches!(
        ppoll(&mut descriptors, Some(TimeSpec::from(timeout)), None),
        Ok(count) if count > 0
    )
}

fn interest(port: &dyn LivePort) -> PollFlags {
    if port.wants_write() {
        PollFlags::POLLIN | PollFlags::POLLOUT
    } else {
        PollFlags::POLLIN
    }
}

struct Slot {
    port: Port,
    live: Box<dyn LivePort>,
    /// The last `ppoll` said so, and it has not been read since.
    ready: bool,
    sync: Option<SyncThread>,
}

/// Live ports and their clock.
pub struct Live {
    clock: Clock,
    /// When the clock was read last, or something arrived since.
    known: Cell<Time>,
    ports: Vec<Slot>,
    index: BTreeMap<Port, usize>,
}

impl Live {
    /// Begins the list of ports to open.
    pub const fn builder(clock: Clock) -> LiveBuilder {
        LiveBuilder {
            clock,
            plans: Vec::new(),
        }
    }

    /// The clock.
    pub const fn clock(&self) -> Clock {
        self.clock
    }

    /// What the SYNC thread of `port` has done, `None` when it has none.
    pub fn sync_statistics(&self, port: Port) -> Option<SyncStatistics> {
        let slot = self.slot(port)?;
        slot.sync.as_ref().map(SyncThread::statistics)
    }

    /// Counters of `port` for a person who looks for trouble; empty for an unknown port.
    pub fn counters(&self, port: Port) -> Vec<(&'static str, u64)> {
        self.slot(port)
            .map_or_else(Vec::new, |slot| slot.live.counters())
    }

    fn slot(&self, port: Port) -> Option<&Slot> {
        self.ports.get(*self.index.get(&port)?)
    }

    fn slot_mut(&mut self, port: Port) -> Result<&mut Slot, SendError> {
        let wrong = SendError::WrongKind { port };
        let at = *self.index.get(&port).ok_or(wrong)?;
        self.ports.get_mut(at).ok_or(wrong)
    }

    /// Polls each port that is ready or has something due; each gives at most one input per
    /// `ppoll`, so that a babbling bus cannot starve the others.
    fn poll_ports(&mut self) -> Option<Arrival> {
        let known = self.known.get();
        for slot in &mut self.ports {
            let ready = core::mem::take(&mut slot.ready);
            if !ready && slot.live.next_event() > known {
                continue;
            }
            if let Some((at, input)) = slot.live.poll(known, ready) {
                self.known.set(known.max(at));
                let port = slot.port;
                return Some(Arrival { port, at, input });
            }
        }
        None
    }

    /// When something is to be done although nothing arrives.
    fn next_event(&self) -> Time {
        let events = self.ports.iter().map(|slot| slot.live.next_event());
        events.min().unwrap_or(Time::NEVER)
    }

    /// Waits until a port is ready, and marks the ready ones; whether there are any.
    fn wait(&mut self, timeout: Duration) -> bool {
        let limit = Some(TimeSpec::from(timeout));
        let mut waited = [0; WAITED_MAX];
        let mut ready = [false; WAITED_MAX];
        let mut open = self.ports.iter().enumerate().filter_map(|(at, slot)| {
            let descriptor = slot.live.descriptor()?;
            Some((at, descriptor, interest(&*slot.live)))
        });
        let Some((at, first, interest)) = open.next() else {
            let _ = ppoll(&mut [], limit, None);
            return false;
        };
        waited[0] = at;
        let mut descriptors: [PollFd; WAITED_MAX] =
            core::array::from_fn(|_| PollFd::new(first, interest));
        let mut count = 1;
        for (at, descriptor, interest) in open {
            waited[count] = at;
            descriptors[count] = PollFd::new(descriptor, interest);
            count += 1;
        }
        // A signal ends the wait early, as if nothing had come.
        if !matches!(ppoll(&mut descriptors[..count], limit, None), Ok(1..)) {
            return false;
        }
        for (ready, descriptor) in ready.iter_mut().zip(&descriptors[..count]) {
            *ready = descriptor.any().unwrap_or(true);
        }
        for (at, ready) in waited[..count].iter().zip(ready) {
            self.ports[*at].ready = ready;
        }
        true
    }
}

impl Transport for Live {
    fn now(&self) -> Time {
        let now = self.clock.now().max(self.known.get());
        self.known.set(now);
        now
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.slot_mut(port)?.live.send(payload)
    }

    /// Reads the clock only when nothing comes in the first half of the wait: where that is a
    /// system call (virtual machines), it would take as long as the frame; so would a timer
    /// set for every frame before the kernel's next tick. A caller that last read the clock
    /// longer ago than half of what it now waits may get that much more than it asked for,
    /// or a millisecond.
    fn receive(&mut self, until: Time) -> Option<Arrival> {
        let mut fresh = false;
        loop {
            if let Some(arrival) = self.poll_ports() {
                return Some(arrival);
            }
            let target = until.min(self.next_event());
            let timeout = self.clock.wall_span(target.since(self.known.get()));
            let was_over = self.known.get() >= until;
            let longest = if fresh {
                WAIT_MAX
            } else {
                COARSE_WAIT.max(timeout / 2)
            };
            if self.wait(timeout.min(longest).min(WAIT_MAX))
                && let Some(arrival) = self.poll_ports()
            {
                return Some(arrival);
            }
            if was_over {
                return None;
            }
            self.now();
            fresh = true;
        }
    }

    fn sleep_until(&mut self, until: Time) {
        let deadline = monotonic() + self.clock.until(until);
        while monotonic() < deadline {
            // EINTR ends the sleep early; the loop then sleeps on.
            let _ = clock_nanosleep(
                ClockId::CLOCK_MONOTONIC,
                ClockNanosleepFlags::TIMER_ABSTIME,
                &TimeSpec::from(deadline),
            );
        }
        self.now();
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        let clock = self.clock;
        let slot = self.slot_mut(port)?;
        let Some(period) = period else {
            slot.sync = None;
            return Ok(());
        };
        let sink = slot.live.sync_sink();
        let sink = sink.ok_or(SendError::WrongKind { port })?;
        let period = clock.wall_span(period);
        if period.is_zero() {
            return Err(system(port, Errno::EINVAL));
        }
        match &slot.sync {
            Some(thread) if thread.is_running() => thread.set_period(period),
            _ => {
                let thread =
                    SyncThread::start(sink, period).map_err(|_| system(port, Errno::EAGAIN))?;
                slot.sync = Some(thread);
            }
        }
        Ok(())
    }
}

/// The operating system's refusal as a [`SendError`].
pub(super) const fn system(port: Port, errno: Errno) -> SendError {
    match errno {
        Errno::ENOBUFS | Errno::EAGAIN => SendError::QueueFull { port },
        _ => SendError::System {
            port,
            errno: errno as i32,
        },
    }
}

#[cfg(test)]
#[path = "live_tests.rs"]
mod tests;
