//! What each kind of machine wrote stays as it is, and belongs to the machine that wrote it.

use machine::records::{AnyLog, opened};

use super::*;
use crate::config::Loaded;
use crate::kinds::KINDS;

/// What a machine wrote is read, and written again byte for byte.
#[test]
fn calibrations_of_each_kind_stay_as_they_are_written() {
    for (text, again) in KINDS.iter().flat_map(|it| it.golden.calibrations) {
        assert_eq!(String::from_utf8(again(text).0).unwrap(), **text);
    }
}

/// What an earlier program wrote is read, and each entry is written again as it was: only the checksum has moved.
#[test]
fn journals_of_each_kind_stay_as_they_are_written() {
    let entries = |text: &str| -> Vec<String> {
        let opened = |line: &str| opened(line).expect("its checksum is right");
        text.lines().map(opened).collect()
    };
    let folder = tempfile::tempdir().unwrap();
    for golden in KINDS.iter().map(|it| &it.golden) {
        for (_, text) in golden.journals {
            let path = folder.path().join("earlier.jsonl");
            std::fs::write(&path, text).unwrap();
            let again = (golden.write_again)(&path, folder.path());
            let again = std::fs::read_to_string(again).unwrap();
            assert_eq!(entries(&again), entries(text));
            let is_object = |line: &str| serde_json::from_str::<serde_json::Value>(line).is_ok();
            assert!(again.lines().all(is_object));
        }
    }
}

#[test]
fn calibrations_of_each_kind_still_belong_to_their_machine() {
    for golden in KINDS.iter().map(|it| &it.golden) {
        let (here, other) = (golden.loaded(), golden.other());
        let of_today =
            |(text, again): &(&str, golden::Again)| again(text).1.config_hash == here.hash.as_str();
        assert!(!golden.calibrations.iter().all(of_today), "one is older");
        for (text, again) in golden.calibrations {
            let (_, head) = again(text);
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
    for golden in KINDS.iter().map(|it| &it.golden) {
        let (here, other) = (golden.loaded(), golden.other());
        let (_, calibrated) = golden.journals[0];
        let (whole, _) = calibrated.trim_end().rsplit_once('\n').unwrap();
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
