//! Calibrations and journals of each kind of machine as programs before the second version of the
//! configuration's hash wrote them: `controller/golden`.

use std::path::{Path, PathBuf};

use machine::records::{
    CalibrationRecord, ConfigHash, Content, Journal, JournalHeader, Log, RecordHead, StoreError,
    read_journal,
};

use crate::Edit;
use crate::config::{Loaded, parse};

/// What one machine wrote, and with which configuration.
pub(crate) struct Golden {
    pub(crate) machine: &'static str,
    /// What its calibrations depend on, in words.
    pub(crate) depends: Option<&'static str>,
    pub(crate) calibrations: &'static [(&'static str, Again)],
    /// By name; the calibrations were made from the first.
    pub(crate) journals: &'static [(&'static str, &'static str)],
    pub(super) write_again: fn(&Path, &Path) -> PathBuf,
    pub(super) resume: fn(&Path, &JournalHeader, &ConfigHash) -> Result<(), StoreError>,
}

/// The file of this name in `controller/golden`.
macro_rules! golden_file {
    ($name:literal) => {
        include_str!(concat!("../../golden/", $name))
    };
}
pub(crate) use golden_file;

/// The journal of this name in `controller/golden`, with its name.
macro_rules! golden_journal {
    ($name:literal) => {
        ($name, include_str!(concat!("../../golden/", $name)))
    };
}
pub(crate) use golden_journal;

/// A calibration read and written again, and its head.
pub(crate) type Again = fn(&str) -> (Vec<u8>, RecordHead);

pub(crate) fn again<C: Content>(text: &str) -> (Vec<u8>, RecordHead) {
    let record: CalibrationRecord<C> = serde_json::from_str(text).unwrap();
    (record.bytes(), record.head)
}

/// A journal whose log says what it was told, and is written again into `folder`.
#[derive(Debug, Default)]
struct Told<L: Log> {
    log: L,
    entries: Vec<serde_json::Value>,
}

impl<L: Log> Log for Told<L> {
    type Entry = L::Entry;

    const OPENED_BY: &'static [&'static str] = L::OPENED_BY;

    fn judge(&self, header: &JournalHeader, entry: &L::Entry) -> machine::records::sound::Judged {
        self.log.judge(header, entry)
    }

    fn take(&mut self, entry: L::Entry) {
        self.entries.push(serde_json::to_value(&entry).unwrap());
        self.log.take(entry);
    }

    fn keep_whole(&mut self, header: &JournalHeader) {
        self.log.keep_whole(header);
    }
}

fn write_again<L: Log>(path: &Path, folder: &Path) -> PathBuf {
    let read = read_journal::<Told<L>>(path).unwrap();
    let mut journal = Journal::<L>::create(folder, &read.header).unwrap();
    for entry in read.log.entries {
        journal
            .write(&serde_json::from_value(entry).unwrap())
            .unwrap();
    }
    if read.complete {
        journal.complete().unwrap();
    }
    journal.path().to_owned()
}

fn resume<L: Log>(
    path: &Path,
    header: &JournalHeader,
    hash: &ConfigHash,
) -> Result<(), StoreError> {
    Journal::<L>::resume(path, header, hash).map(drop)
}

impl Golden {
    /// What a machine of a kind whose journals are those of `L` wrote.
    pub(crate) const fn of<L: Log>(
        machine: &'static str,
        depends: Option<&'static str>,
        calibrations: &'static [(&'static str, Again)],
        journals: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self {
            machine,
            depends,
            calibrations,
            journals,
            write_again: write_again::<L>,
            resume: resume::<L>,
        }
    }

    pub(super) fn loaded(&self) -> Loaded {
        parse(self.machine, "m").unwrap()
    }

    /// A stage with another serial number: everything is foreign to it.
    pub(super) fn other(&self) -> Loaded {
        let serial = "stage_serial = \"";
        let other = format!("{serial}another ");
        parse(&self.machine.edit_first(serial, &other), "m").unwrap()
    }
}
