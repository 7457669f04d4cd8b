//! What is kept: [`machine::records`], and where the records of a machine lie.

pub(crate) mod budget;
#[cfg(test)]
pub(crate) mod golden;
#[cfg(test)]
mod golden_tests;
#[cfg(test)]
pub(crate) mod record_tests;
#[cfg(test)]
pub(crate) mod test_run;

#[cfg(test)]
pub(crate) use machine::records::read_journal;
pub(crate) use machine::records::{
    CalibrationRecord, ClosureEntry, Content, EnvironmentRecord, IdentityRecord, InstrumentRecord,
    Journal, JournalHeader, Log, RecordHead, SCHEMA_VERSION, Store, StoreError, short,
};
pub(crate) use machine::records::{first_difference, not_resumable};
