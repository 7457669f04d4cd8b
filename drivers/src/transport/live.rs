//! Live ports: SocketCAN interfaces, SLCAN adapters and serial lines, in one thread.
//!
//! All ports are read without waiting; only when none has anything does the thread wait, in
//! one `ppoll` over all of them until the caller's deadline. No reader threads and no
//! channels stand between a frame and its reader. `ppoll` and not an executor, because it
//! takes deadlines in nanoseconds and costs one system call: a tokio timer is a millisecond
//! late at the median and reads the clock several times per turn.

mod in_lockstep;
mod opening;

use core::cell::Cell;
use core::time::Duration;
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_nanosleep};
use std::collections::BTreeMap;
use units::Time;
use wire::{Arrival, Input, Payload, Port, Ports};

use self::in_lockstep::InLockstep;
pub use self::opening::LiveBuilder;
use super::clock::Clock;
use super::live_port::{LivePort, system};
pub use super::open_error::OpenError;
pub use super::serial::{Parity, SerialSettings, StopBits};
pub use super::slcan::{SlcanFailure, SlcanSettings};
use super::sync_thread::{SyncStatistics, SyncThread, monotonic};
use super::{SendError, Transport};

/// Until the clock has been read, a wait is no longer than this, or half of what is left.
const COARSE_WAIT: Duration = Duration::from_millis(1);
/// Ports that can be waited for without memory being asked for: the cyclic engine waits here.
const WAITED_MAX: usize = 16;
/// The longest single wait, so that a deadline of "never" needs no special case.
const WAIT_MAX: Duration = Duration::from_secs(3_600);

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
    /// On a clock that both ends share.
    lockstep: Option<InLockstep>,
}

impl Live {
    /// The clock.
    pub const fn clock(&self) -> &Clock {
        &self.clock
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
    fn sync_statistics(&self, port: Port) -> Option<SyncStatistics> {
        let slot = self.slot(port)?;
        slot.sync.as_ref().map(SyncThread::statistics)
    }

    fn now(&self) -> Time {
        let now = self.clock.now().max(self.known.get());
        self.known.set(now);
        now
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        let sent = self.slot_mut(port)?.live.send(payload);
        self.note_sent(port, payload, sent)
    }

    /// Reads the clock only when nothing comes in the first half of the wait: where that is a
    /// system call (virtual machines), it would take as long as the frame; so would a timer
    /// set for every frame before the kernel's next tick. A caller that last read the clock
    /// longer ago than half of what it now waits may get that much more than it asked for,
    /// or a millisecond.
    fn receive(&mut self, until: Time) -> Option<Arrival> {
        if self.keeps_step() {
            return self.receive_in_lockstep(until, Ports::NONE);
        }
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

    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        if self.keeps_step() {
            return self.receive_in_lockstep(until, unhurried);
        }
        self.receive(until)
    }

    fn sleep_until(&mut self, until: Time) {
        while self.keeps_step() && self.now() < until {
            self.step(until, Ports::NONE);
        }
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
        let period = period.map(|period| self.clock.wall_span(period));
        let now = self.now();
        let slot = self.slot_mut(port)?;
        let Some(period) = period else {
            slot.sync = None;
            self.set_sync_in_lockstep(now, port, None);
            return Ok(());
        };
        let sink = slot.live.sync_sink();
        let sink = sink.ok_or(SendError::WrongKind { port })?;
        if period.is_zero() {
            return Err(system(port, Errno::EINVAL));
        }
        if self.set_sync_in_lockstep(now, port, Some(period)) {
            return Ok(());
        }
        let slot = self.slot_mut(port)?;
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

#[cfg(test)]
#[path = "live_tests.rs"]
mod tests;
