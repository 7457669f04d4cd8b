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
//! (de)serialised, and a file from a newer program is refused. What a calibration says is a
//! [`Content`] of its kind, what a journal says a [`Log`] of its kind; nothing here knows any.
//!
//! # Example
//!
//! What is wrong with a stored file is told by its place.
//!
//! ```
//! use machine::records::{Store, StoreError};
//!
//! let folder = std::env::temp_dir().join("truestage-records-example");
//! let store = Store::new(&folder, "stage", &[]);
//! assert_eq!(store.list()?, Vec::<String>::new(), "a missing folder is an empty one");
//! let refused = store.resolve("0123");
//! assert!(matches!(refused, Err(StoreError::Unknown { .. })));
//! # Ok::<(), StoreError>(())
//! ```

mod atomic;
mod content;
mod copy;
mod difference;
mod disk;
mod disk_failure;
mod door;
mod failure;
pub mod files;
mod hash;
mod head;
mod interrupted;
mod journal;
mod journal_file;
mod journal_writer;
mod lease;
mod line;
mod name;
mod ordered;
mod pointer;
mod regular;
mod run_name;
pub mod sound;
mod store;
mod thermometers;

pub use atomic::{remove_durably, remove_file, replace_file, write_new_or_replace};
pub use content::{CalibrationRecord, Content, ContentKind, Glance};
pub use difference::{Difference, first_difference};
pub use disk::{Answer, DiskPace};
pub use disk_failure::DiskFailure;
pub use failure::{ModelError, StoreError};
pub use hash::ConfigHash;
pub use head::{
    CertificateRecord, EnvironmentRecord, IdentityRecord, InstrumentRecord, RecordHead,
};
pub use interrupted::InterruptedRun;
pub use journal::{
    AnyLog, ClosureEntry, JournalHeader, Log, ReadJournal, read_entries, read_journal,
};
pub use journal_writer::{Journal, not_resumable};
pub use lease::Lease;
pub use line::{opened, sealed};
pub use name::short;
pub(crate) use ordered::Asked;
pub use pointer::ActivePointer;
pub use regular::{JOURNAL_MAX, open_regular};
pub use store::Store;
pub use thermometers::ThermometersEntry;

use failure::{io_error, unsound};

#[cfg(test)]
mod disk_tests;
#[cfg(test)]
mod enumeration_tests;

/// The version of every file this program writes.
pub const SCHEMA_VERSION: u32 = 1;
