//! A processor that does not fall asleep while two ends of a terminal wait for each other.
//!
//! The kernel hands what is written into a pseudo-terminal to its other end by a worker
//! (`tty_flip_buffer_push`), for which it likes an idle processor. Waking a sleeping one takes
//! longer than all the rest of an exchange: on a virtual machine of two processors a demonstration took
//! 4.7 s with one asleep and 2.7 s with both awake.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use super::os;

/// Keeps one processor awake until it is dropped, in time that nobody else wants (nice 19: the
/// scheduler then still puts it elsewhere than the two, which it does not with SCHED_IDLE).
#[derive(Debug)]
pub struct KeptAwake {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl KeptAwake {
    /// From now on. Where the system permits no such thread, nothing is kept awake: it costs
    /// speed only.
    ///
    /// ```
    /// let awake = drivers::transport::awake::KeptAwake::new();
    /// drop(awake); // its thread has ended
    /// ```
    pub fn new() -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&is_over);
        let thread = std::thread::Builder::new().name("awake".into());
        let thread = thread.spawn(move || stay_awake(&seen)).ok();
        Self { is_over, thread }
    }
}

impl Default for KeptAwake {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for KeptAwake {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing that could fail.
            let _ = thread.join();
        }
    }
}

fn stay_awake(is_over: &AtomicBool) {
    // With ordinary rights it would take time from the two.
    if os::give_way().is_err() {
        return;
    }
    // Not with a pause: many of them are what a hypervisor takes a virtual processor away for.
    while !is_over.load(Ordering::Relaxed) {
        core::hint::black_box(());
    }
}
