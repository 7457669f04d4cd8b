//! One thread that waits for the same deadlines as SYNCs, by itself: what the computer lets it do.

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use drivers::transport::Histogram;
use drivers::transport::real_time::RealTime;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};

/// The thread; it ends when this is dropped.
pub(crate) struct Lone {
    lateness: Arc<Mutex<Histogram>>,
    over: Arc<AtomicBool>,
}

impl Lone {
    pub(crate) fn start(period: Duration) -> Self {
        let lateness = Arc::<Mutex<Histogram>>::default();
        let over = Arc::new(AtomicBool::new(false));
        let (noted, ended) = (Arc::clone(&lateness), Arc::clone(&over));
        thread::spawn(move || {
            let _real_time = RealTime::ask();
            let mut deadline = now();
            while !ended.load(Ordering::Relaxed) {
                deadline += period;
                let _ = clock_nanosleep(
                    ClockId::CLOCK_MONOTONIC,
                    ClockNanosleepFlags::TIMER_ABSTIME,
                    &TimeSpec::from(deadline),
                );
                let late = now().saturating_sub(deadline);
                noted
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .note(late);
                // What was missed is left out, as SYNCs are.
                deadline += period * u32::try_from(late.as_nanos() / period.as_nanos()).unwrap();
            }
        });
        Self { lateness, over }
    }

    /// All so far.
    pub(crate) fn lateness(&self) -> Histogram {
        let noted = self.lateness.lock().unwrap_or_else(PoisonError::into_inner);
        noted.clone()
    }
}

impl Drop for Lone {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

fn now() -> Duration {
    clock_gettime(ClockId::CLOCK_MONOTONIC).unwrap().into()
}
