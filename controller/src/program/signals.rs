//! Signals: the first one asks for a controlled stop, and only one that comes after the stop's time ends the program.
//!
//! `timeout` and a terminal that closes send two signals at once. The second of them must not leave
//! moving axes behind.

use core::time::Duration;
use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use machine::{LONGEST_STOP, StopRequest};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag::{register, register_conditional_shutdown, register_usize};
use signal_hook::low_level::pipe;

use crate::Failure;
use crate::program::streams;

/// Makes a write beyond the limit of a file's size fail (EFBIG), as on a full disk; the signal would end the program
/// with its axes moving.
pub(super) fn outlive_full_files() {
    // Without the handler the program is no worse than any other.
    let _ = register(SIGXFSZ, Arc::default());
}

/// Lets Ctrl-C, SIGTERM and SIGHUP ask for a stop.
pub(super) fn stop_on_signals(stop: &StopRequest) -> Result<(), Failure> {
    streams::limit_waits();
    stop_within(stop, LONGEST_STOP).map_err(|source| Failure::File {
        path: "signal handler".into(),
        source,
    })
}

/// The same: a signal that comes `limit` after the first one or later ends the program at once.
fn stop_within(stop: &StopRequest, limit: Duration) -> io::Result<()> {
    let is_overdue = Arc::new(AtomicBool::new(false));
    let (first, sent) = UnixStream::pair()?;
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        // A shell's exit code of a program that a signal has ended.
        register_conditional_shutdown(signal, 128 + signal, Arc::clone(&is_overdue))?;
        let number = usize::try_from(signal).unwrap_or_default();
        register_usize(signal, stop.signal(), number)?;
        register(signal, stop.flag())?;
        pipe::register(signal, sent.try_clone()?)?;
    }
    // It sleeps by the monotonic clock: a clock that is set changes nothing.
    let count = move || {
        if Read::read_exact(&mut &first, &mut [0]).is_ok() {
            thread::sleep(limit);
            is_overdue.store(true, Ordering::Relaxed);
        }
    };
    let thread = thread::Builder::new().name("signals".into());
    thread.spawn(count).map(drop)
}
