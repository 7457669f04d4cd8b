//! What a producer of SYNCs has done so far.

use super::histogram::Histogram;

/// How the SYNC thread is scheduled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheduling {
    /// Not known yet.
    #[default]
    Starting,
    /// SCHED_FIFO.
    RealTime,
    /// SCHED_FIFO was refused with this error number; allow it with `ulimit -r` or
    /// CAP_SYS_NICE.
    Ordinary {
        /// The operating system's error number.
        errno: i32,
    },
}

/// What the SYNC thread has done so far; lateness is in wall time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SyncStatistics {
    /// SYNCs sent.
    pub sent: u64,
    /// Periods left out because they were more than half a period late.
    pub skipped: u64,
    /// SYNCs that the port refused (queue full, interface down).
    pub refused: u64,
    /// How late each was, those left out too.
    pub lateness: Histogram,
    /// How the thread is scheduled.
    pub scheduling: Scheduling,
}

impl SyncStatistics {
    /// Takes over what another producer has done; how it was scheduled is no sum.
    pub fn add(&mut self, other: &Self) {
        self.sent += other.sent;
        self.skipped += other.skipped;
        self.refused += other.refused;
        self.lateness.add(&other.lateness);
    }
}
