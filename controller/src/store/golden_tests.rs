//! Calibrations and journals of each kind of machine as programs before the second version of the
//! configuration's hash wrote them: `controller/golden`.

use super::*;
use crate::Edit;
use crate::config::{Loaded, parse};

macro_rules! file {
    ($path:literal) => {
        include_str!(concat!("../../", $path))
    };
}

/// What one machine wrote, and with which configuration.
struct Golden {
    machine: &'static str,
    calibrations: &'static [&'static str],
    calibrated: &'static str,
    other_runs: &'static [&'static str],
}

const EACH_KIND: [Golden; 4] = [
    Golden {
        machine: file!("../configs/machines/linear.toml"),
        calibrations: &[file!("golden/linear.json")],
        calibrated: file!("golden/linear_calibrate.jsonl"),
        other_runs: &[file!("golden/linear_zero.jsonl")],
    },
    Golden {
        machine: file!("../configs/machines/uvw.toml"),
        calibrations: &[file!("golden/platform.json")],
        calibrated: file!("golden/platform_calibrate.jsonl"),
        other_runs: &[file!("golden/platform_verify.jsonl")],
    },
    Golden {
        machine: file!("../configs/machines/rotary.toml"),
        calibrations: &[file!("golden/rotary.json")],
        calibrated: file!("golden/rotary_calibrate.jsonl"),
        other_runs: &[file!("golden/rotary_verify.jsonl")],
    },
    Golden {
        machine: file!("../configs/machines/volumetric.toml"),
        calibrations: &[
            file!("golden/volumetric.json"),
            file!("golden/references.json"),
        ],
        calibrated: file!("golden/volumetric_calibrate.jsonl"),
        other_runs: &[file!("golden/volumetric_verify.jsonl")],
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
    for text in EACH_KIND.iter().flat_map(|it| it.calibrations) {
        let record: CalibrationRecord = serde_json::from_str(text).unwrap();
        assert_eq!(String::from_utf8(record.bytes()).unwrap(), **text);
    }
}

#[test]
fn journals_of_each_kind_stay_as_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    for golden in &EACH_KIND {
        for text in golden.other_runs.iter().chain([&golden.calibrated]) {
            let path = folder.path().join("earlier.jsonl");
            std::fs::write(&path, text).unwrap();
            let header = read_journal(&path).unwrap().header;
            let mut journal = Journal::create(folder.path(), &header).unwrap();
            for entry in journal::entries(text).skip(1) {
                journal.write(&entry).unwrap();
            }
            assert_eq!(&std::fs::read_to_string(journal.path()).unwrap(), text);
        }
    }
}

#[test]
fn calibrations_of_each_kind_still_belong_to_their_machine() {
    for golden in &EACH_KIND {
        let (here, other) = (golden.loaded(), golden.other());
        for text in golden.calibrations {
            let CalibrationRecord { head, .. } = serde_json::from_str(text).unwrap();
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
        let before = read_journal(&path).unwrap();
        assert!(!before.complete);
        let header = |loaded: &Loaded| JournalHeader {
            config_hash: loaded.hash.as_str().to_owned(),
            ..before.header.clone()
        };
        let error = Journal::resume(&path, &header(&other), &other.hash).unwrap_err();
        assert!(error.to_string().contains("configuration hash"), "{error}");
        Journal::resume(&path, &header(&here), &here.hash).unwrap();
    }
}
