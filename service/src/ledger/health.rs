//! Health of the disk, as far as the ledger knows.

use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::WRITE_LIMIT;

/// What is known of the disk. No lock here is held over I/O.
#[derive(Debug)]
pub(super) struct Health {
    epoch: Instant,
    /// When the write under way began, in milliseconds after `epoch`, and 1; 0 where there is none.
    writing_since: AtomicU64,
    /// Why nothing can be written.
    cause: Mutex<Option<String>>,
}

impl Health {
    pub(super) fn new() -> Self {
        Self {
            epoch: Instant::now(),
            writing_since: AtomicU64::new(0),
            cause: Mutex::default(),
        }
    }

    fn now(&self) -> u64 {
        let now = self.epoch.elapsed().as_millis();
        u64::try_from(now).unwrap_or(u64::MAX)
    }

    pub(super) fn begin_write(&self) {
        self.writing_since.store(self.now() + 1, Ordering::Release);
    }

    pub(super) fn end_write(&self, cause: Option<String>) {
        *self.cause.lock().unwrap_or_else(PoisonError::into_inner) = cause;
        self.writing_since.store(0, Ordering::Release);
    }

    /// # Errors
    /// Why nothing can be written now.
    pub(super) fn check(&self) -> Result<(), String> {
        let since = self.writing_since.load(Ordering::Acquire);
        let taken = (self.now() + 1).saturating_sub(since);
        if since > 0 && u128::from(taken) >= WRITE_LIMIT.as_millis() {
            let seconds = taken as f64 / 1e3;
            return Err(format!(
                "the disk hangs: a write to the ledger has not ended for {seconds:.1} s"
            ));
        }
        let cause = self.cause.lock().unwrap_or_else(PoisonError::into_inner);
        cause.clone().map_or(Ok(()), Err)
    }
}
