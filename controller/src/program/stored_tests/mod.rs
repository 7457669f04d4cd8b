//! Calibrations and journals that somebody edited and gave right checksums: whatever stands in them,
//! they are shown or refused.
//!
//! `controller/golden` has those of demonstrations of each kind of machine; the many lines of three axes are thinned
//! so that each case is evaluated in milliseconds. A case is a seed: `MUTATIONS=20000 cargo test -p truestage --lib mutated --
//! --include-ignored` tries so many of each kind, and what fails names its seed.

mod mutation;

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Duration;

use mutation::{edit, edit_lines};
use nix::time::{ClockId, clock_gettime};
use serde_json::Value;

use crate::chance::Chance;
use crate::program::output::Output;
use crate::program::{cal, report};
use crate::store::golden::Golden;
use crate::{Failure, platform, rotary};
use machine::records::{Store, opened, sealed};

/// So many of each kind in every run.
pub(super) const QUICK: usize = 200;
/// A case may take so many times the processor time of the file as it was written, on the same
/// computer; several files become several times as long by being edited.
const WORK_MAX: u32 = 200;
/// Below it a processor's clock tells nothing.
const WORK_LEAST: Duration = Duration::from_millis(20);
/// A page or text is no longer than so many times that of the file as it was written.
const LENGTH_MAX: usize = 60;

/// A store on disk with the files of a machine.
struct Desk {
    folder: tempfile::TempDir,
    store: Store,
}

impl Desk {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let store = crate::stores::store_in(folder.path(), "m");
        for part in ["calibrations", "runs"] {
            fs::create_dir_all(store.root().join(part)).expect("there is room");
        }
        Self { folder, store }
    }

    /// As it lies there, with the name that its bytes have.
    fn put_calibration(&self, text: &str) -> String {
        let id = blake3::hash(text.as_bytes()).to_hex().to_string();
        fs::write(self.store.calibration_path(&id), text).expect("there is room");
        id
    }

    fn put_journal(&self, name: &str, lines: &[Value]) -> PathBuf {
        let text = lines.iter().map(|it| match it.is_object() {
            true => sealed(&it.to_string()),
            false => in_front(&it.to_string()),
        });
        let path = self.store.runs().join(name);
        fs::write(&path, text.collect::<String>()).expect("there is room");
        path
    }
}

/// As earlier programs wrote a line, whatever its value is.
fn in_front(json: &str) -> String {
    format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()))
}

/// Of three axes every other node and reading; of others all.
fn thinned(mut lines: Vec<Value>) -> Vec<Value> {
    if lines[1]["nodes_m"].is_null() {
        return lines;
    }
    for nodes in lines[1]["nodes_m"].as_array_mut().into_iter().flatten() {
        let nodes = nodes.as_array_mut().expect("a list");
        *nodes = nodes.iter().step_by(2).cloned().collect();
    }
    let mut number = 0;
    lines.retain(|line| {
        number = if line["entry"] == "line_reading" {
            number + 1
        } else {
            0
        };
        number % 2 == 1 || number == 0
    });
    lines
}

pub(crate) fn lines_of(journal: &str) -> Vec<Value> {
    let json = |line: &str| {
        let json = opened(line).expect("its checksum is right");
        serde_json::from_str(&json).expect("it is JSON")
    };
    journal.lines().map(json).collect()
}

/// What became of a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fate {
    Shown,
    Refused,
    Panicked,
    NoNumber,
    TooLong,
    TooMuchWork,
}

/// What shows or refuses a file says, how it was, and how long that took of the processor.
struct Seen {
    fate: Fate,
    length: usize,
    work: Duration,
}

fn processor() -> Duration {
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID)
        .expect("every system has it")
        .into()
}

fn look(show: impl FnOnce() -> Result<String, Failure>) -> Seen {
    let begun = processor();
    let shown = catch_unwind(AssertUnwindSafe(show));
    let work = processor() - begun;
    let (fate, length) = match shown {
        Err(_) => (Fate::Panicked, 0),
        Ok(Err(failure)) => match says_no_number(&failure.to_string()) {
            true => (Fate::NoNumber, 0),
            false => (Fate::Refused, 0),
        },
        Ok(Ok(text)) if says_no_number(&text) => (Fate::NoNumber, text.len()),
        Ok(Ok(text)) => (Fate::Shown, text.len()),
    };
    Seen { fate, length, work }
}

/// `NaN` or `inf`, not as a part of a word.
fn says_no_number(text: &str) -> bool {
    ["NaN", "inf"].iter().any(|word| {
        let is_letter = |it: Option<char>| it.is_some_and(char::is_alphanumeric);
        text.match_indices(word).any(|(at, _)| {
            let before = text[..at].chars().next_back();
            let after = text[at + word.len()..].chars().next();
            !is_letter(before) && !is_letter(after)
        })
    })
}

fn judged(seen: Seen, whole: &Seen) -> Fate {
    let work_max = whole.work.max(WORK_LEAST) * WORK_MAX;
    match seen.fate {
        Fate::Shown if seen.length > LENGTH_MAX * whole.length + 100_000 => Fate::TooLong,
        Fate::Shown | Fate::Refused if seen.work > work_max => Fate::TooMuchWork,
        fate => fate,
    }
}

/// Counts by fate, and the seeds of what must not be.
#[derive(Default)]
struct Tally {
    counts: BTreeMap<Fate, usize>,
    wrong: Vec<String>,
}

impl Tally {
    fn add(&mut self, seed: u64, what: &str, fate: Fate) {
        if !matches!(fate, Fate::Shown | Fate::Refused) {
            self.wrong.push(format!("seed {seed} of {what}: {fate:?}"));
        }
        *self.counts.entry(fate).or_default() += 1;
    }

    fn assert_good(&self, what: &str) {
        eprintln!("{what}: {:?}", self.counts);
        let first: Vec<_> = self.wrong.iter().take(20).collect();
        assert!(self.wrong.is_empty(), "{what}: {first:#?}");
    }
}

/// One calibration everywhere that it is shown: beside the one as it was written, in the list, alone,
/// on the page of the run that it was made from.
fn show_calibration(desk: &Desk, base: &str, id: &str, run: &Path) -> Result<String, Failure> {
    let store = &desk.store;
    let list = cal::listed(store)?.0;
    let text = cal::shown(store, id)?.0;
    let diff = cal::compared(store, base, id, Output::new(true, "test"));
    let diff = diff.map_or_else(|it| it.to_string(), |it| it.0);
    Ok([list, text, diff, report::html(run)?].concat())
}

fn edit_calibrations(golden: &Golden, count: usize) -> Tally {
    let mut tally = Tally::default();
    let desk = Desk::new();
    let (name, journal) = golden.journals[0];
    let run = desk.put_journal(name, &thinned(lines_of(journal)));
    for (text, _) in golden.calibrations {
        let base = desk.put_calibration(text);
        let whole = look(|| show_calibration(&desk, &base, &base, &run));
        assert_eq!(whole.fate, Fate::Shown, "as it was written");
        let value: Value = serde_json::from_str(text).expect("it is JSON");
        for seed in 0..(count / golden.calibrations.len()) as u64 {
            let mut chance = Chance(seed);
            let mut edited = value.clone();
            (0..=chance.below(3)).for_each(|_| edit(&mut edited, &mut chance));
            let id = desk.put_calibration(&edited.to_string());
            let seen = look(|| show_calibration(&desk, &base, &id, &run));
            tally.add(seed, "calibration", judged(seen, &whole));
            let _ = fs::remove_file(desk.store.calibration_path(&id));
            desk.put_calibration(text);
        }
    }
    tally
}

fn edit_journals(golden: &Golden, count: usize) -> Tally {
    let mut tally = Tally::default();
    let desk = Desk::new();
    for (text, _) in golden.calibrations {
        desk.put_calibration(text);
    }
    for (at, (name, text)) in golden.journals.iter().enumerate() {
        let lines = thinned(lines_of(text));
        let run = desk.put_journal(name, &lines);
        let whole = look(|| report::html(&run));
        assert_eq!(whole.fate, Fate::Shown, "{name} as it was written");
        // Calibrations are what most work goes into.
        let share = if at == 0 { 3 } else { 1 };
        for seed in 0..(count * share / 4) as u64 {
            let mut chance = Chance(seed);
            let mut edited = lines.clone();
            (0..=chance.below(3)).for_each(|_| edit_lines(&mut edited, &mut chance));
            let run = desk.put_journal(name, &edited);
            tally.add(seed, name, judged(look(|| report::html(&run)), &whole));
        }
        fs::remove_file(run).expect("it is there");
    }
    drop(desk.folder);
    tally
}

pub(super) fn check(golden: &Golden, count: usize) {
    let calibrations = edit_calibrations(golden, count);
    let journals = edit_journals(golden, count);
    // What is never shown was never tried.
    assert!(calibrations.counts.contains_key(&Fate::Shown));
    assert!(journals.counts.contains_key(&Fate::Shown));
    calibrations.assert_good("calibrations");
    journals.assert_good("journals");
}

pub(super) fn wanted() -> usize {
    let given = std::env::var("MUTATIONS").ok();
    given.and_then(|it| it.parse().ok()).unwrap_or(20_000)
}

/// What was found by hand first.
#[test]
fn what_is_refused_is_named_with_file_place_expectation_and_what_stands_there() {
    let desk = Desk::new();
    let mut screw: Value =
        serde_json::from_str(platform::KIND.golden.calibrations[0].0).expect("JSON");
    let covariance = screw["covariance_si"].as_array_mut().expect("a list");
    let before = covariance.len();
    covariance.pop();
    let id = desk.put_calibration(&screw.to_string());
    let refused = cal::shown(&desk.store, &id).expect_err("it is one short");
    let text = refused.to_string();
    for part in [
        &format!("{id}.json"),
        "covariance_si",
        &format!("{before} entries"),
        &format!("seen: {}", before - 1),
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let (name, journal) = rotary::KIND.golden.journals[0];
    let mut lines = lines_of(journal);
    lines[1]["lines"] = 4_000_000.into();
    let refused = report::html(&desk.put_journal(name, &lines)).expect_err("no such plate");
    let text = refused.to_string();
    for part in [name, "line 2", "lines", "2 to 1000000", "seen: 4000000"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}
