use serde::{Deserialize, Serialize};

use super::*;
use crate::records::sound::Judged;
use crate::records::{AnyLog, JOURNAL_MAX, SCHEMA_VERSION, read_entries, read_journal, sealed};
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;

/// Readings, of which a continued run keeps those that are even.
#[derive(Clone, Debug, Default, PartialEq)]
struct Readings {
    points: Vec<u32>,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
enum Reading {
    Point { run: u32 },
}

impl Log for Readings {
    type Entry = Reading;

    const OPENED_BY: &'static [&'static str] = &[];

    fn judge(&self, header: &JournalHeader, Reading::Point { run }: &Reading) -> Judged {
        header.judge_run(*run)
    }

    fn take(&mut self, Reading::Point { run }: Reading) {
        self.points.push(run);
    }

    fn keep_whole(&mut self, _: &JournalHeader) {
        self.points.retain(|it| it % 2 == 0);
    }
}

fn create(folder: &Path) -> Journal<Readings> {
    Journal::create(folder, &header()).unwrap()
}

fn read(path: &Path) -> Result<ReadJournal<Readings>, StoreError> {
    read_journal(path)
}

fn resume(path: &Path, header: &JournalHeader) -> Result<ReadJournal<Readings>, StoreError> {
    Ok(Journal::resume(path, header, &hash())?.1)
}

const fn point(run: u32) -> Reading {
    Reading::Point { run }
}

fn hash() -> ConfigHash {
    ConfigHash::recorded("h")
}

fn header() -> JournalHeader {
    JournalHeader {
        schema_version: SCHEMA_VERSION,
        verb: "calibrate".into(),
        config_hash: "h".into(),
        axis: "x".into(),
        started: "2026-01-01T00:00:00Z".into(),
        runs: 3,
        ..JournalHeader::default()
    }
}

#[test]
fn a_journal_cut_at_any_byte_loses_at_most_its_last_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    let first_line = fs::read(journal.path()).unwrap().len();
    for run in 1..=3 {
        journal.write(&point(run)).unwrap();
    }
    let whole = fs::read(journal.path()).unwrap();
    let cut = folder.path().join("cut.jsonl");
    for length in first_line..=whole.len() {
        fs::write(&cut, &whole[..length]).unwrap();
        let read = read(&cut).unwrap();
        let complete_lines = whole[..length]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        assert_eq!(read.log.points.len(), complete_lines - 1);
        assert!(!read.complete);
    }
}

/// 17 × 3 mm is 0.051000000000000004: a target read is the target written, to the last bit.
#[test]
fn any_target_is_the_same_target_when_a_run_is_continued() {
    let folder = tempfile::tempdir().unwrap();
    let mut header = header();
    header.targets_m = (0..=20).map(|at| f64::from(at * 3) * 1e-3).collect();
    let journal = Journal::<Readings>::create(folder.path(), &header).unwrap();
    resume(journal.path(), &header).unwrap();
}

#[test]
fn a_run_that_failed_says_why_until_it_is_continued() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    let cause = "the laser beam is blocked".to_owned();
    journal.fail(cause).unwrap();
    let path = journal.path().to_owned();
    let failure = || read(&path).unwrap().failure;
    assert_eq!(failure().as_deref(), Some("the laser beam is blocked"));
    resume(&path, &header()).unwrap();
    assert_eq!(failure(), None);
}

#[test]
fn a_run_that_is_complete_cannot_be_continued() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    journal.write(&point(1)).unwrap();
    journal.complete().unwrap();
    let error = resume(journal.path(), &header()).unwrap_err();
    assert!(error.to_string().contains("complete"), "{error}");
}

#[test]
fn a_damaged_line_in_the_middle_is_an_error_with_its_number() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    journal.write(&point(1)).unwrap();
    journal.write(&point(2)).unwrap();
    let path = journal.path().to_owned();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains("\"run\":1"));
    let text = text.replacen("\"run\":1", "\"run\":7", 1);
    fs::write(&path, text).unwrap();
    let error = read(&path).unwrap_err();
    assert!(
        matches!(error, StoreError::Format { line: 2, .. }),
        "{error}"
    );
}

#[test]
fn another_run_cannot_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let journal = create(folder.path());
    let mut other = header();
    other.stage_serial = "B".into();
    let error = resume(journal.path(), &other).unwrap_err();
    assert!(error.to_string().contains("stage serial"), "{error}");
    let mut other = header();
    other.instrument.air_corrected = true;
    let error = resume(journal.path(), &other).unwrap_err();
    assert!(error.to_string().contains("instrument"), "{error}");
}

#[test]
fn a_continued_run_loses_its_torn_line_and_what_is_not_whole() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    for run in 1..=3 {
        journal.write(&point(run)).unwrap();
    }
    let path = journal.path().to_owned();
    let mut bytes = fs::read(&path).unwrap();
    bytes.extend_from_slice(b"1234abcd {\"entry\":\"poi");
    fs::write(&path, &bytes).unwrap();
    let (mut journal, kept) = Journal::<Readings>::resume(&path, &header(), &hash()).unwrap();
    assert!(kept.torn);
    assert_eq!(kept.log.points, [2]);
    journal.write(&point(1)).unwrap();
    journal.complete().unwrap();
    let whole = read(&path).unwrap();
    assert_eq!(whole.log.points, [2, 1]);
    assert!(whole.complete && !whole.torn);
}

#[test]
fn a_journal_is_known_by_what_its_second_line_is_called() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    let opened_by = |path: &Path| read_journal::<AnyLog>(path).unwrap().log.opened_by;
    assert_eq!(opened_by(journal.path()), None);
    journal.write(&point(1)).unwrap();
    assert_eq!(opened_by(journal.path()).as_deref(), Some("point"));
}

#[test]
fn what_cannot_follow_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    journal.write(&point(1)).unwrap();
    journal.write(&point(4)).unwrap();
    let refused = read(journal.path()).unwrap_err();
    let line = matches!(refused, StoreError::Unsound { line: Some(3), .. });
    assert!(line, "{refused}");
}

/// A stranger has put it into the folder.
fn refusal_of(path: &Path) -> String {
    let refused = read(path).unwrap_err().to_string();
    let entries = read_entries(path).unwrap_err().to_string();
    assert_eq!(entries, refused);
    refused
}

#[test]
fn only_regular_files_of_bounded_size_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let journal = create(folder.path());
    let at = |name: &str| folder.path().join(name);
    nix::unistd::mkfifo(&at("fifo"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    assert!(refusal_of(&at("fifo")).contains("no regular file"));
    std::os::unix::fs::symlink(journal.path(), at("link")).unwrap();
    assert!(refusal_of(&at("link")).contains("symbolic link"));
    assert!(refusal_of(folder.path()).contains("no regular file"));
    let sparse = File::create(at("sparse")).unwrap();
    sparse.set_len(3 << 30).unwrap();
    assert!(refusal_of(&at("sparse")).contains("3221225472 bytes"));
    // Short enough, and one line of zeros, as a power cut leaves them.
    sparse.set_len(JOURNAL_MAX).unwrap();
    assert!(refusal_of(&at("sparse")).contains("the header line is missing"));
}

#[test]
fn a_last_line_whose_checksum_is_right_and_whose_json_is_not_is_torn() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = create(folder.path());
    journal.write(&Reading::Point { run: 1 }).unwrap();
    let path = journal.path().to_owned();
    let mut file = OpenOptions::new().append(true).open(&path).unwrap();
    let (_, whole) = read_entries(&path).unwrap();
    for wrong in [r#"{"entry":"point","run":}"#, r#"{"run":1}"#] {
        file.write_all(sealed(wrong).as_bytes()).unwrap();
        let (read, entries) = read_entries(&path).unwrap();
        assert!(read.torn, "{wrong}");
        assert_eq!(entries, whole, "{wrong}");
        file.set_len(read.valid_bytes).unwrap();
    }
}
