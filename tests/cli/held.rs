//! Whoever holds the machine's time back, so that a test is not late on a busy computer.

use core::time::Duration;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};

use drivers::transport::Transport;
use drivers::transport::live::Live;

use crate::programs::{Bench, Process};

/// Lets time pass step by step, and stand in between: what a test sees then is true until it lets more of it pass.
pub(crate) struct Steps(Live);

impl Steps {
    pub(crate) fn of(bench: &Bench) -> Self {
        let time = Live::builder(bench.clock("a watcher")).build();
        Self(time.expect("it has no port to open"))
    }

    pub(crate) fn pass(&mut self, span: Duration) {
        self.0.sleep_until(self.0.now() + span);
    }

    /// Lets time pass until `reached`.
    ///
    /// # Panics
    /// When `process` ends before.
    pub(crate) fn until(&mut self, process: &mut Process, reached: impl Fn() -> bool) {
        // Shorter than anything takes that a procedure writes down.
        const STEP: Duration = Duration::from_millis(100);
        while !reached() {
            process.goes_on();
            self.pass(STEP);
        }
    }

    /// From now on time passes slowly: what is said meanwhile is heard before much happens.
    pub(crate) fn slowly(self) -> Brake {
        Brake::by(self.0)
    }
}

/// Holds the machine's time back to a tenth of the wall's: who renews a dead-man of 200 ms has two seconds for it, on
/// however busy a computer.
pub(crate) struct Brake {
    release: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Brake {
    pub(crate) fn on(bench: &Bench) -> Self {
        Steps::of(bench).slowly()
    }

    fn by(mut time: Live) -> Self {
        const STEP: Duration = Duration::from_millis(5);
        const TIMES_SLOWER: u32 = 10;
        let (release, released) = channel();
        let thread = thread::spawn(move || {
            while released.recv_timeout(STEP * TIMES_SLOWER) == Err(RecvTimeoutError::Timeout) {
                time.sleep_until(time.now() + STEP);
            }
        });
        Self {
            release: Some(release),
            thread: Some(thread),
        }
    }
}

impl Drop for Brake {
    fn drop(&mut self) {
        self.release.take();
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(thread::panicking() || matches!(ended, Some(Ok(()))));
    }
}
