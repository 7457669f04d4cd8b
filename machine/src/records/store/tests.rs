use super::super::head::RecordHead;
use super::super::sound::{self, Judged};
use super::*;
use crate::records::write_new_or_replace;
use serde::Serialize;
use std::fs;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Note {
    lines: usize,
}

impl Content for Note {
    const KIND: &'static str = "note";

    fn summary(&self) -> String {
        format!("{} lines", self.lines)
    }

    fn judge(&self) -> Judged {
        sound::counted("lines", self.lines, 1..=10)
    }
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Letter {}

impl Content for Letter {
    const KIND: &'static str = "letter";

    fn summary(&self) -> String {
        String::new()
    }

    fn judge(&self) -> Judged {
        Ok(())
    }
}

const KINDS: &[ContentKind] = &[ContentKind::of::<Note>()];

fn store() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path(), "m", KINDS);
    (folder, store)
}

fn record(serial: &str) -> CalibrationRecord<Note> {
    let head = RecordHead {
        schema_version: SCHEMA_VERSION,
        stage_serial: serial.into(),
        axis: "x".into(),
        ..RecordHead::default()
    };
    let content = Note { lines: 2 };
    CalibrationRecord { head, content }
}

#[test]
fn a_calibration_is_found_again_by_the_beginning_of_its_name() {
    let (_folder, store) = store();
    let id = store.save(&record("A")).unwrap();
    assert_eq!(store.resolve(&id[..6]).unwrap(), id);
    assert_eq!(store.load::<Note>(&id).unwrap(), record("A"));
    assert_eq!(store.glance(&id).unwrap().summary, "2 lines");
    assert!(matches!(
        store.resolve("zz"),
        Err(StoreError::Unknown { .. })
    ));
}

#[test]
fn any_flipped_byte_is_found() {
    let (_folder, store) = store();
    let id = store.save(&record("A")).unwrap();
    let path = store.calibration_path(&id);
    let good = fs::read(&path).unwrap();
    for at in 0..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 0x04;
        fs::write(&path, &bad).unwrap();
        assert!(
            matches!(store.load::<Note>(&id), Err(StoreError::Damaged { .. })),
            "byte {at}"
        );
    }
    fs::write(&path, &good[..good.len() / 2]).unwrap();
    assert!(matches!(
        store.load::<Note>(&id),
        Err(StoreError::Damaged { .. })
    ));
}

#[test]
fn rollback_returns_to_the_one_before() {
    let (_folder, store) = store();
    let first = store.save(&record("A")).unwrap();
    let second = store.save(&record("B")).unwrap();
    assert!(matches!(
        store.rollback("x"),
        Err(StoreError::NoEarlier { .. })
    ));
    store.activate("x", &first).unwrap();
    store.activate("x", &second).unwrap();
    assert_eq!(store.active("x").unwrap().current, Some(second));
    assert_eq!(store.rollback("x").unwrap(), first);
    assert_eq!(store.active("x").unwrap().current, Some(first));
}

#[test]
fn what_is_passed_over_when_one_is_retired_can_still_be_gone_back_to() {
    let (_folder, store) = store();
    let ids = ["A", "B", "C"].map(|serial| {
        let id = store.save(&record(serial)).unwrap();
        store.activate("x", &id).unwrap();
        id
    });
    assert_eq!(store.retire_to("x", |_| false).unwrap(), None);
    let pointer = store.active("x").unwrap();
    assert_eq!((pointer.current, &pointer.history[..]), (None, &ids[..2]));
    assert_eq!(store.rollback("x").unwrap(), ids[1]);
    store.activate("x", &ids[2]).unwrap();
    let oldest = store.retire_to("x", |id| id == ids[0]).unwrap();
    assert_eq!(oldest.as_ref(), Some(&ids[0]));
    let told = store.rollback("x").unwrap_err().to_string();
    assert!(
        told.contains("no earlier") && told.contains("cal activate"),
        "{told}"
    );
}

#[test]
fn only_a_failed_writing_says_that_what_is_stored_is_untouched() {
    let (folder, store) = store();
    let gone = store.glance("0123").unwrap_err().to_string();
    assert!(!gone.contains("untouched"), "{gone}");
    std::fs::write(folder.path().join("m"), b"").unwrap();
    let refused = store.save(&record("A")).unwrap_err().to_string();
    assert!(refused.contains("untouched"), "{refused}");
}

#[test]
fn hashes_that_differ_are_told_by_their_beginnings_with_what_to_do() {
    let hash = |digit: &str| digit.repeat(64);
    let foreign = |instead: Option<String>| {
        let error = StoreError::Foreign {
            id: "id".into(),
            what: "the configuration's hash",
            expected: hash("a").into(),
            seen: hash("b").into(),
            instead: instead.map(Into::into),
        };
        error.to_string()
    };
    let told = foreign(None);
    let hashes = format!("`{}` there, but `{}` here", "a".repeat(12), "b".repeat(12));
    assert!(
        told.contains(&hashes) && told.contains("`truestage cal list`"),
        "{told}"
    );
    let told = foreign(Some(hash("c")));
    assert!(
        told.contains("`truestage cal activate` with cccccccccccc"),
        "{told}"
    );
}

#[test]
fn a_file_from_a_newer_program_is_refused() {
    let (_folder, store) = store();
    let path = store.pointer_path("x");
    write_new_or_replace(&path, br#"{"schema_version":2,"future":1}"#).unwrap();
    assert!(matches!(
        store.active("x"),
        Err(StoreError::Newer { seen: 2, .. })
    ));
}

#[test]
fn a_kind_that_is_not_asked_for_or_not_known_is_refused() {
    let (_folder, store) = store();
    let id = store.save(&record("A")).unwrap();
    let refused = store.load::<Letter>(&id);
    assert!(matches!(refused, Err(StoreError::OtherKind { .. })));
    let letter = CalibrationRecord {
        head: record("A").head,
        content: Letter {},
    };
    let id = store.save(&letter).unwrap();
    let refused = store.activate("x", &id).unwrap_err().to_string();
    assert!(
        refused.contains("no kind of calibration is called `letter`"),
        "{refused}"
    );
}

#[test]
fn what_cannot_be_so_is_refused_whoever_asks() {
    let (_folder, store) = store();
    let mut bad = record("A");
    bad.content.lines = 11;
    let id = store.save(&bad).unwrap();
    let refused = [
        store.load::<Note>(&id).map(drop),
        store.glance(&id).map(drop),
        store.activate("x", &id),
    ];
    for refused in refused {
        assert!(matches!(refused, Err(StoreError::Unsound { .. })));
    }
}
