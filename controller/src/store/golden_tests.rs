//! Calibrations and journals of each kind of machine as programs before the second version of the
//! configuration's hash wrote them: `controller/golden`.

use std::path::{Path, PathBuf};

use machine::records::{AnyLog, ConfigHash};

use super::*;
use crate::Edit;
use crate::config::{Loaded, parse};
use crate::linear::{LinearContent, LinearLog};
use crate::platform::{PlatformLog, ScrewContent};
use crate::rotary::{PlateLog, RotaryContent};
use crate::volumetric::{BeamReferencesContent, GeometryContent, VolumeLog};

macro_rules! file {
    ($path:literal) => {
        include_str!(concat!("../../", $path))
    };
}

/// What one machine wrote, and with which configuration.
struct Golden {
    machine: &'static str,
    calibrations: &'static [(&'static str, Again)],
    calibrated: &'static str,
    other_runs: &'static [&'static str],
    write_again: fn(&Path, &Path) -> PathBuf,
    resume: fn(&Path, &JournalHeader, &ConfigHash) -> Result<(), StoreError>,
}

/// A calibration read and written again, and its head.
type Again = fn(&str) -> (Vec<u8>, RecordHead);

fn again<C: Content>(text: &str) -> (Vec<u8>, RecordHead) {
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

const EACH_KIND: [Golden; 4] = [
    Golden {
        machine: file!("../configs/machines/linear.toml"),
        calibrations: &[(file!("golden/linear.json"), again::<LinearContent>)],
        calibrated: file!("golden/linear_calibrate.jsonl"),
        other_runs: &[file!("golden/linear_zero.jsonl")],
        write_again: write_again::<LinearLog>,
        resume: resume::<LinearLog>,
    },
    Golden {
        machine: file!("../configs/machines/uvw.toml"),
        calibrations: &[(file!("golden/platform.json"), again::<ScrewContent>)],
        calibrated: file!("golden/platform_calibrate.jsonl"),
        other_runs: &[file!("golden/platform_verify.jsonl")],
        write_again: write_again::<PlatformLog>,
        resume: resume::<PlatformLog>,
    },
    Golden {
        machine: file!("../configs/machines/rotary.toml"),
        calibrations: &[(file!("golden/rotary.json"), again::<RotaryContent>)],
        calibrated: file!("golden/rotary_calibrate.jsonl"),
        other_runs: &[file!("golden/rotary_verify.jsonl")],
        write_again: write_again::<PlateLog>,
        resume: resume::<PlateLog>,
    },
    Golden {
        machine: file!("../configs/machines/volumetric.toml"),
        calibrations: &[
            (file!("golden/volumetric.json"), again::<GeometryContent>),
            (
                file!("golden/references.json"),
                again::<BeamReferencesContent>,
            ),
        ],
        calibrated: file!("golden/volumetric_calibrate.jsonl"),
        other_runs: &[file!("golden/volumetric_verify.jsonl")],
        write_again: write_again::<VolumeLog>,
        resume: resume::<VolumeLog>,
    },
];

impl Golden {
    fn loaded(&self) -> Loaded {
        parse(self.machine, "m").unwrap()
    }

    /// A stage with another serial number: everything is foreign to it.
    fn other(&self) -> Loaded {
        let serial = "stage_serial = \"";
        let other = format!("{serial}another ");
        parse(&self.machine.edit_first(serial, &other), "m").unwrap()
    }
}

/// What a machine wrote is read, and written again byte for byte.
#[test]
fn calibrations_of_each_kind_stay_as_they_are_written() {
    for (text, again) in EACH_KIND.iter().flat_map(|it| it.calibrations) {
        assert_eq!(String::from_utf8(again(text).0).unwrap(), **text);
    }
}

#[test]
fn journals_of_each_kind_stay_as_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    for golden in &EACH_KIND {
        for text in golden.other_runs.iter().chain([&golden.calibrated]) {
            let path = folder.path().join("earlier.jsonl");
            std::fs::write(&path, text).unwrap();
            let again = (golden.write_again)(&path, folder.path());
            assert_eq!(&std::fs::read_to_string(again).unwrap(), text);
        }
    }
}

#[test]
fn calibrations_of_each_kind_still_belong_to_their_machine() {
    for golden in &EACH_KIND {
        let (here, other) = (golden.loaded(), golden.other());
        for (text, again) in golden.calibrations {
            let (_, head) = again(text);
            assert_ne!(head.config_hash, here.hash.as_str(), "it is none of today");
            head.belongs_to("id", &head, &here.hash).unwrap();
            let error = head.belongs_to("id", &head, &other.hash).unwrap_err();
            assert!(
                error.to_string().contains("configuration's hash"),
                "{error}"
            );
        }
    }
}

#[test]
fn runs_of_each_kind_that_were_interrupted_are_continued() {
    let folder = tempfile::tempdir().unwrap();
    for golden in &EACH_KIND {
        let (here, other) = (golden.loaded(), golden.other());
        let (whole, _) = golden.calibrated.trim_end().rsplit_once('\n').unwrap();
        let path = folder.path().join("interrupted.jsonl");
        std::fs::write(&path, format!("{whole}\n")).unwrap();
        let before = read_journal::<AnyLog>(&path).unwrap();
        assert!(!before.complete);
        let header = |loaded: &Loaded| JournalHeader {
            config_hash: loaded.hash.as_str().to_owned(),
            ..before.header.clone()
        };
        let error = (golden.resume)(&path, &header(&other), &other.hash).unwrap_err();
        assert!(error.to_string().contains("configuration hash"), "{error}");
        (golden.resume)(&path, &header(&here), &here.hash).unwrap();
    }
}
