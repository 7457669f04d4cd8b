//! What is kept: [`machine::records`], and where the records of a machine lie.

#[cfg(test)]
mod golden_tests;
#[cfg(test)]
pub(crate) mod record_tests;
#[cfg(test)]
pub(crate) mod test_run;

pub use machine::records::{
    ActivePointer, AnyLog, CalibrationRecord, ClosureEntry, ConfigHash, Content, ContentKind,
    EnvironmentRecord, Glance, IdentityRecord, InstrumentRecord, Journal, JournalHeader, Lease,
    Log, ReadJournal, RecordHead, SCHEMA_VERSION, Store, StoreError, read_journal, short,
};
pub(crate) use machine::records::{first_difference, not_resumable};
