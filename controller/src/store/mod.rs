//! What is kept: calibrations, run journals, reports.
//!
//! Layout below the configuration's `data_dir`, one folder a machine:
//! ```text
//! MACHINE/calibrations/HASH.json   immutable, named by the BLAKE3 of its bytes
//! MACHINE/active/AXIS.json         which calibration is in use, and which were before
//! MACHINE/runs/TIME-VERB-AXIS.jsonl   one checksummed line for each measured point
//! MACHINE/reports/                 pages for people
//! ```
//! The structs of these files are their own and carry a version: model types are never
//! (de)serialised, and a file from a newer program is refused.

mod atomic;
mod calibration;
mod difference;
mod failure;
#[cfg(test)]
mod golden_tests;
mod journal;
mod lease;
mod name;
pub(crate) mod record;
mod sound;

pub use calibration::{ActivePointer, Store};
pub(crate) use difference::first_difference;
pub use failure::StoreError;
pub(crate) use journal::not_resumable;
pub use journal::{ClosureEntry, Entry, Journal, JournalHeader, ReadJournal, read_journal};
pub use lease::Lease;
pub use name::short;
pub use record::{
    CalibrationRecord, Content, EnvironmentRecord, IdentityRecord, InstrumentRecord, RecordHead,
};

pub(crate) use atomic::write_new_or_replace;
pub(crate) use failure::io_error;
use failure::unsound;

/// The version of every file this program writes.
pub const SCHEMA_VERSION: u32 = 1;
