//! The SYNC producer: threads of its own with absolute deadlines.
//!
//! They sleep by `clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME)`, so that lateness never
//! adds up, and ask for SCHED_FIFO; a refusal is reported, not fatal. A SYNC that would be
//! more than half a period late is left out and counted: drives take their set-points from
//! the spacing of SYNCs, and two in quick succession are worse than one missing.
//!
//! Where there are several processors, two threads wait for each deadline, on different ones, and
//! whichever runs first sends the SYNC: a kernel that is not preemptible keeps even a real-time thread
//! waiting while it serves somebody else on that thread's processor.

use core::sync::atomic::{AtomicUsize, Ordering};
use core::time::Duration;
use nix::errno::Errno;
use nix::sched::CpuSet;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::os;
use super::processors;
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
    /// How many threads still run.
    alive: AtomicUsize,
}

struct Plan {
    period: Duration,
    /// Of the next SYNC, CLOCK_MONOTONIC.
    deadline: Duration,
    running: bool,
    statistics: SyncStatistics,
}

impl SyncThread {
    /// Starts threads that send the first SYNC one (wall) period from now.
    ///
    /// # Errors
    /// When the system has no thread to give.
    pub fn start(sink: Arc<dyn SyncSink>, period: Duration) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::new(sink, period));
        let Some([some, others]) = processors::halves() else {
            shared.start_thread(None)?;
            return Ok(Self { shared });
        };
        shared.start_thread(Some(some))?;
        // The second one only makes lateness rarer.
        let _ = shared.start_thread(Some(others));
        Ok(Self { shared })
    }

    /// Changes the period, from the SYNC after the next one on.
    pub fn set_period(&self, period: Duration) {
        self.shared.plan().period = period;
    }

    /// Whether a thread still runs.
    pub fn is_running(&self) -> bool {
        self.shared.alive.load(Ordering::Acquire) > 0
    }

    /// What it has done so far.
    pub fn statistics(&self) -> SyncStatistics {
        self.shared.plan().statistics.clone()
    }
}

impl Drop for SyncThread {
    /// Does not wait for the threads; they send nothing more.
    fn drop(&mut self) {
        self.shared.plan().running = false;
    }
}

impl Shared {
    fn new(sink: Arc<dyn SyncSink>, period: Duration) -> Self {
        let plan = Plan {
            period,
            deadline: monotonic() + period,
            running: true,
            statistics: SyncStatistics::default(),
        };
        Self {
            sink,
            plan: Mutex::new(plan),
            alive: AtomicUsize::new(0),
        }
    }

    fn plan(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// On these processors, when there is a choice.
    fn start_thread(self: &Arc<Self>, on: Option<CpuSet>) -> std::io::Result<()> {
        let shared = Arc::clone(self);
        let thread = std::thread::Builder::new().name("sync".to_owned());
        self.alive.fetch_add(1, Ordering::Release);
        let started = thread.spawn(move || {
            if let Some(processors) = on {
                processors::keep_to(&processors);
            }
            shared.run();
            shared.alive.fetch_sub(1, Ordering::Release);
        });
        if started.is_err() {
            self.alive.fetch_sub(1, Ordering::Release);
        }
        started.map(drop)
    }

    fn run(&self) {
        let scheduling = Scheduling::ask();
        self.plan().statistics.scheduling = scheduling;
        let mut deadline = self.plan().deadline;
        while self.sleep_until(deadline) {
            let mut plan = self.plan();
            if !plan.running {
                break;
            }
            // Otherwise the other thread was first.
            if plan.deadline == deadline {
                plan.deadline = self.act(&mut plan, deadline, monotonic());
            }
            deadline = plan.deadline;
        }
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
        (Shared::new(sink, period), receiver)
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
        // The end of the last thread drops the sink and with it the sender.
        assert!(sent.recv().is_err());
    }

    /// Both threads wait for the same deadlines: none of them is met twice.
    #[test]
    fn each_deadline_is_met_once_whichever_thread_is_first() {
        let (sink, sent) = probe();
        let thread = SyncThread::start(sink, MS).unwrap();
        let times: Vec<_> = sent.iter().take(300).collect();
        let statistics = thread.statistics();
        let met = statistics.sent + statistics.skipped;
        let lived = (*times.last().unwrap() - times[0]).as_secs_f64();
        // A SYNC of each deadline, or none where it would have come too late.
        let deadlines = 300.0 + statistics.skipped as f64;
        assert!(lived * 1e3 + 2.0 > 300.0 - 1.0, "{lived} s, {statistics:?}");
        assert!(lived * 1e3 < deadlines + 2.0, "{lived} s, {statistics:?}");
        assert!(met >= 300, "{statistics:?}");
        let least = times.windows(2).map(|it| it[1] - it[0]).min().unwrap();
        // One that is late by just half a period is followed by a punctual one.
        assert!(least > MS * 2 / 5, "{least:?}, {statistics:?}");
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
