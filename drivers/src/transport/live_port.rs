//! What every live port does for the thread that reads them all.

use std::os::fd::BorrowedFd;
use std::sync::Arc;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use units::Time;
use wire::{Input, Payload, Port};

use super::SendError;
use super::slcan::SlcanFailure;
use super::sync_thread::SyncSink;

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

    /// How its start went, once that has ended.
    fn start_result(&self) -> Option<Result<(), SlcanFailure>> {
        Some(Ok(()))
    }

    /// Goes on with its start; what comes in is kept.
    fn progress(&mut self, _now: Time, _ready: bool) {}

    /// How many frames or bytes it has sent so far.
    fn units_sent(&self) -> u64;

    /// Writes what waits for a slow line.
    fn flush(&mut self) {}

    /// Reads so many frames or bytes, which are known to be on their way; they came at `now`.
    fn take_in(&mut self, now: Time, units: usize);

    /// Where a SYNC thread may send; `None` for a serial line.
    fn sync_sink(&self) -> Option<Arc<dyn SyncSink>> {
        None
    }

    /// Counters for a person who looks for trouble.
    fn counters(&self) -> Vec<(&'static str, u64)>;
}

/// Waits for what is known to be on its way; `false` when it does not come.
pub(super) fn awaited(descriptor: BorrowedFd<'_>) -> bool {
    /// The kernel hands on what was written within microseconds, on a busy computer too.
    const LIMIT: TimeSpec = TimeSpec::new(10, 0);
    let mut descriptors = [PollFd::new(descriptor, PollFlags::POLLIN)];
    loop {
        match ppoll(&mut descriptors, Some(LIMIT), None) {
            Err(Errno::EINTR) => {}
            result => return result.is_ok_and(|count| count > 0),
        }
    }
}

/// Whether a write that failed so says that the device is not there any more.
pub(super) const fn is_gone(errno: Errno) -> bool {
    matches!(
        errno,
        Errno::EIO | Errno::ENODEV | Errno::ENXIO | Errno::EBADF | Errno::EPIPE
    )
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
