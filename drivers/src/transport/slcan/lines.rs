//! The line to the adapter, shared with the SYNC thread.

use nix::errno::Errno;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use units::Time;
use wire::canopen::sync::emit_sync;
use wire::slcan::Command;

use super::super::clock::Clock;
use super::super::serial::Outbox;
use super::super::sync_thread::SyncSink;

/// Lines that wait for a slow adapter: some twenty frames, as a CAN interface's queue.
const PENDING_MAX: usize = 512;
/// Unanswered commands that are kept in mind.
const ASKED_MAX: usize = 256;

/// What an answer will belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    Transmit,
    Status,
}

/// The line out: commands and what they still owe an answer for, in one order.
pub(super) struct Lines {
    clock: Clock,
    pub(super) outbox: Outbox,
    pub(super) asked: VecDeque<(Asked, Time)>,
    answers: bool,
    pub(super) open: bool,
}

impl Lines {
    fn new(clock: Clock, answers: bool) -> Self {
        Self {
            clock,
            outbox: Outbox::new(PENDING_MAX),
            asked: VecDeque::new(),
            answers,
            open: false,
        }
    }

    pub(super) fn send(&mut self, asked: Asked, line: &[u8]) -> Result<(), Errno> {
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
pub(super) struct SharedLines(Mutex<Lines>);

impl SharedLines {
    pub(super) fn new(clock: Clock, answers: bool) -> Self {
        Self(Mutex::new(Lines::new(clock, answers)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Lines> {
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
