//! A request to stop the machine: by a person, a signal or another program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::failure::Failure;

/// The interrupt of a terminal (Ctrl-C), the number that POSIX gives it.
const SIGINT: u8 = 2;

/// Set from anywhere (a signal handler) to stop the machine in a controlled way.
///
/// # Example
///
/// ```
/// use machine::StopRequest;
/// use std::sync::atomic::Ordering;
///
/// let stop = StopRequest::default();
/// let handler = stop.clone();
/// // What the handler of SIGTERM does.
/// handler.signal().store(15, Ordering::Relaxed);
/// handler.stop();
/// assert!(stop.is_requested());
/// assert_eq!(stop.failure().exit_code(), 143, "128 and the signal's number");
/// ```
#[derive(Clone, Debug, Default)]
pub struct StopRequest {
    asked: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl StopRequest {
    /// Asks for the stop.
    pub fn stop(&self) {
        self.asked.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_requested(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// The flag itself, for a signal handler that sets it.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.asked)
    }

    /// Where a signal handler leaves the number of its signal, before it sets the flag.
    pub fn signal(&self) -> Arc<AtomicUsize> {
        Arc::clone(&self.signal)
    }

    /// What ends the procedure that is stopped.
    pub fn failure(&self) -> Failure {
        match u8::try_from(self.signal.load(Ordering::Relaxed)) {
            Ok(0 | SIGINT) | Err(_) => Failure::Interrupted,
            Ok(signal) => Failure::Terminated { signal },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(signal: usize, exit_code: u8) {
        let stop = StopRequest::default();
        stop.signal().store(signal, Ordering::Relaxed);
        assert_eq!(stop.failure().exit_code(), exit_code, "signal {signal}");
    }

    #[test]
    fn who_asked_for_the_stop_is_in_the_exit_code_as_shells_have_it() {
        check(0, 130);
        check(2, 130);
        check(15, 143);
        check(1, 129);
    }
}
