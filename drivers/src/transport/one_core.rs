//! Two threads that only wait for each other do so on one processor core.
//!
//! Waking a thread on another core takes several times as long as switching to it on the same
//! one, in a virtual machine above all. Which core that is stays the system's choice: now and
//! then both are let go for a moment, and meet where the system has put the one who asks.

use std::time::{Duration, Instant};

use nix::sched::{CpuSet, sched_getaffinity, sched_getcpu, sched_setaffinity};
use nix::unistd::Pid;

/// As often as a scheduler moves threads, about.
const STAY: Duration = Duration::from_millis(100);
/// So many times both wait for each other before they meet: the system has placed them then.
const WANDERING: u32 = 4;

/// The calling thread.
const OWN: Pid = Pid::from_raw(0);

/// Where the calling thread may compute, and where it does.
#[derive(Debug)]
pub(super) struct OneCore {
    /// What it was allowed before; `None` where there is nothing to choose.
    allowed: Option<CpuSet>,
    met: Option<Instant>,
    rounds: u32,
}

impl OneCore {
    /// For the calling thread.
    pub(super) fn new() -> Self {
        let allowed = sched_getaffinity(OWN).ok();
        let several = |set: &CpuSet| {
            let count = (0..CpuSet::count()).filter(|cpu| set.is_set(*cpu) == Ok(true));
            count.take(2).count() > 1
        };
        Self {
            allowed: allowed.filter(several),
            met: None,
            rounds: 0,
        }
    }

    /// Called each time before the thread waits: where the other one had better be from now on,
    /// when that changes (`None` inside: anywhere).
    pub(super) fn changed(&mut self) -> Option<Option<u32>> {
        let allowed = self.allowed?;
        self.rounds += 1;
        match self.met {
            // The clock is read seldom: that costs more than counting.
            Some(since) if self.rounds.is_multiple_of(64) && since.elapsed() > STAY => {
                self.met = None;
                self.rounds = 0;
                sched_setaffinity(OWN, &allowed).ok()?;
                Some(None)
            }
            None if self.rounds >= WANDERING => {
                let cpu = sched_getcpu().ok()?;
                self.met = Some(Instant::now());
                stay_on(cpu);
                Some(u32::try_from(cpu).ok())
            }
            Some(_) | None => None,
        }
    }
}

impl Drop for OneCore {
    fn drop(&mut self) {
        if let Some(allowed) = &self.allowed {
            // What it was allowed before is allowed still.
            let _ = sched_setaffinity(OWN, allowed);
        }
    }
}

fn stay_on(cpu: usize) {
    let mut only = CpuSet::new();
    if only.set(cpu).is_ok() {
        // A refusal costs speed only.
        let _ = sched_setaffinity(OWN, &only);
    }
}
