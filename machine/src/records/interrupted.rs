//! Runs that ended before they were complete, and can go on.

use std::path::PathBuf;

use super::journal::{AnyLog, JournalHeader};
use super::{Store, StoreError};

/// The newest journal of a verb on an axis, which is not complete.
#[derive(Clone, Debug, PartialEq)]
pub struct InterruptedRun {
    /// Where it is.
    pub journal: PathBuf,
    /// What it begins with.
    pub header: JournalHeader,
}

impl Store {
    /// The newest run of `verb` on `axis`, when that was interrupted; `None` when it is complete, or there was none.
    ///
    /// # Errors
    /// When the folder or the journal cannot be read.
    pub fn interrupted_run(
        &self,
        verb: &str,
        axis: &str,
    ) -> Result<Option<InterruptedRun>, StoreError> {
        let Some(journal) = self.newest_run(verb, axis)? else {
            return Ok(None);
        };
        let read = self.read_journal::<AnyLog>(&journal)?;
        Ok((!read.complete).then_some(InterruptedRun {
            journal,
            header: read.header,
        }))
    }
}
