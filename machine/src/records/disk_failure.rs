//! Why a disk did not do what it was asked.

use core::time::Duration;

/// Why the thread of the records took or did nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiskFailure {
    /// It has done nothing for too long.
    #[error(
        "the disk of the records has not answered for {} s: what was measured last may not be kept. Check the disk, its \
         cable and its space, then go on with --resume", waited.as_secs()
    )]
    Silent {
        /// For how long.
        waited: Duration,
    },
    /// More waits to be written than is taken.
    #[error(
        "the disk of the records is too slow: {waiting} entries wait to be written, and no more are taken. Check the \
         disk and what else writes to it, then go on with --resume"
    )]
    Behind {
        /// How many.
        waiting: u64,
    },
}
