//! A run that the journals of all kinds are tried with.

use machine::records::ConfigHash;

use super::{JournalHeader, SCHEMA_VERSION};

pub(crate) fn hash() -> ConfigHash {
    ConfigHash::recorded("h")
}

pub(crate) fn header() -> JournalHeader {
    JournalHeader {
        schema_version: SCHEMA_VERSION,
        verb: "calibrate".into(),
        config_hash: "h".into(),
        started: "2026-01-01T00:00:00Z".into(),
        targets_m: vec![0.0, 0.003],
        runs: 3,
        ..JournalHeader::default()
    }
}
