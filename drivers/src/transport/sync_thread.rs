//! The SYNC producer: a thread of its own with absolute deadlines.
//!
//! It sleeps by `clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME)`, so that lateness never
//! adds up, and asks for SCHED_FIFO; a refusal is reported, not fatal. A SYNC that would be
//! more than half a period late is left out and counted: drives take their set-points from
//! the spacing of SYNCs, and two in quick succession are worse than one missing.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use nix::errno::Errno;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::os;
pub use super::sync_statistics::{Scheduling, SyncStatistics};

/// Below the kernel's own threads (50), above everything ordinary.
const FIFO_PRIORITY: i32 = 40;
/// Longer sleeps are cut into these, so that a thread told to stop does.
const SLEEP_MAX: Duration = Duration::from_millis(50);

/// Where SYNCs go; shared with the port that reads.
pub trait SyncSink: Send + Sync {
    /// Sends one SYNC now or not at all.
    ///
    /// # Errors
    /// What the operating system said.
    fn send_sync(&self) -> Result<(), Errno>;
}

impl Scheduling {
    /// Asks for SCHED_FIFO for the calling thread.
    pub(super) fn ask() -> Self {
        match os::schedule_fifo(FIFO_PRIORITY) {
            Ok(()) => Self::RealTime,
            Err(errno) => Self::Ordinary {
                errno: errno as i32,
            },
        }
    }
}

/// A running SYNC producer; dropping it stops it.
pub struct SyncThread {
    shared: Arc<Shared>,
}

struct Shared {
    sink: Arc<dyn SyncSink>,
    /// Held while a SYNC is sent: once `stop` has returned, none follows.
    plan: Mutex<Plan>,
    ended: AtomicBool,
}

struct Plan {
    period: Duration,
    running: bool,
    statistics: SyncStatistics,
}

impl SyncThread {
    /// Starts a thread that sends the first SYNC one (wall) period from now.
    ///
    /// # Errors
    /// When the system has no thread to give.
    pub fn start(sink: Arc<dyn SyncSink>, period: Duration) -> std::io::Result<Self> {
        let plan = Plan {
            period,
            running: true,
            statistics: SyncStatistics::default(),
        };
        let shared = Arc::new(Shared {
            sink,
            plan: Mutex::new(plan),
            ended: AtomicBool::new(false),
        });
        let thread = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("sync".to_owned())
            .spawn(move || thread.run())?;
        Ok(Self { shared })
    }

    /// Changes the period, from the SYNC after the next one on.
    pub fn set_period(&self, period: Duration) {
        self.shared.plan().period = period;
    }

    /// Whether the thread still runs.
    pub fn is_running(&self) -> bool {
        !self.shared.ended.load(Ordering::Acquire)
    }

    /// What it has done so far.
    pub fn statistics(&self) -> SyncStatistics {
        self.shared.plan().statistics.clone()
    }
}

impl Drop for SyncThread {
    /// Does not wait for the thread; it sends nothing more.
    fn drop(&mut self) {
        self.shared.plan().running = false;
    }
}

impl Shared {
    fn plan(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self) {
        self.plan().statistics.scheduling = Scheduling::ask();
        let mut deadline = monotonic() + self.plan().period;
        while self.sleep_until(deadline) {
            let mut plan = self.plan();
            if !plan.running {
                break;
            }
            deadline = self.act(&mut plan, deadline, monotonic());
        }
        self.ended.store(true, Ordering::Release);
    }

    /// Sends or leaves out the SYNC of `deadline`; returns the next deadline.
    fn act(&self, plan: &mut Plan, deadline: Duration, now: Duration) -> Duration {
        let late = now.saturating_sub(deadline);
        let period = plan.period;
        plan.statistics.lateness.note(late);
        if late * 2 <= period {
            match self.sink.send_sync() {
                Ok(()) => plan.statistics.sent += 1,
                Err(_) => plan.statistics.refused += 1,
            }
            return deadline + period;
        }
        let missed = late.as_nanos() / period.as_nanos().max(1) + 1;
        plan.statistics.skipped += missed as u64;
        deadline + period * u32::try_from(missed).unwrap_or(u32::MAX)
    }

    /// `false` when told to stop meanwhile.
    fn sleep_until(&self, deadline: Duration) -> bool {
        loop {
            let now = monotonic();
            if now >= deadline {
                return true;
            }
            let wake = deadline.min(now + SLEEP_MAX);
            // EINTR ends the sleep early; the loop then sleeps on.
            let _ = clock_nanosleep(
                ClockId::CLOCK_MONOTONIC,
                ClockNanosleepFlags::TIMER_ABSTIME,
                &TimeSpec::from(wake),
            );
            if wake < deadline && !self.plan().running {
                return false;
            }
        }
    }
}

/// CLOCK_MONOTONIC.
pub(super) fn monotonic() -> Duration {
    clock_gettime(ClockId::CLOCK_MONOTONIC)
        .map(Duration::from)
        .expect("CLOCK_MONOTONIC exists on every Linux")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    struct Probe(Mutex<mpsc::Sender<Duration>>);

    impl SyncSink for Probe {
        fn send_sync(&self) -> Result<(), Errno> {
            let sender = self.0.lock().unwrap();
            sender.send(monotonic()).map_err(|_| Errno::EPIPE)
        }
    }

    fn probe() -> (Arc<Probe>, mpsc::Receiver<Duration>) {
        let (sender, receiver) = mpsc::channel();
        (Arc::new(Probe(Mutex::new(sender))), receiver)
    }

    fn shared(period: Duration) -> (Shared, mpsc::Receiver<Duration>) {
        let (sink, receiver) = probe();
        let plan = Plan {
            period,
            running: true,
            statistics: SyncStatistics::default(),
        };
        let shared = Shared {
            sink,
            plan: Mutex::new(plan),
            ended: AtomicBool::new(false),
        };
        (shared, receiver)
    }

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn lateness_of_one_syncs_never_moves_the_next_deadline() {
        let (shared, sent) = shared(2 * MS);
        let mut plan = shared.plan();
        let late = Duration::from_micros(300);
        let next = shared.act(&mut plan, 10 * MS, 10 * MS + late);
        assert_eq!(next, 12 * MS);
        assert_eq!(sent.try_iter().count(), 1);
        assert_eq!(plan.statistics.lateness.greatest(), late);
        assert_eq!(plan.statistics.lateness.total(), 1);
    }

    #[test]
    fn after_a_stall_missed_periods_are_left_out_and_counted() {
        let (shared, sent) = shared(2 * MS);
        let mut plan = shared.plan();
        let next = shared.act(&mut plan, 10 * MS, 19 * MS + MS / 2);
        assert_eq!(next, 20 * MS);
        assert_eq!(plan.statistics.skipped, 5);
        assert_eq!(sent.try_iter().count(), 0);
    }

    #[test]
    fn syncs_come_until_told_to_stop() {
        let (sink, sent) = probe();
        let thread = SyncThread::start(sink, MS).unwrap();
        let first = sent.recv().unwrap();
        thread.set_period(5 * MS);
        let rest: Vec<_> = sent.iter().take(4).collect();
        assert!(rest.iter().all(|at| *at > first));
        assert!(thread.statistics().sent >= 5);
        assert_ne!(thread.statistics().scheduling, Scheduling::Starting);
        drop(thread);
        let _ = sent.try_iter().count();
        // The thread's end drops the sink and with it the sender.
        assert!(sent.recv().is_err());
    }

    #[test]
    fn a_refused_sync_is_counted_and_the_next_one_tried() {
        let (sink, sent) = probe();
        drop(sent);
        let thread = SyncThread::start(sink, MS).unwrap();
        while thread.statistics().refused < 3 {
            std::thread::yield_now();
        }
        assert_eq!(thread.statistics().sent, 0);
        assert!(thread.is_running());
    }
}
