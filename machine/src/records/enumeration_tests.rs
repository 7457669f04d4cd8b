//! Every call of a run's records fails in every way, then the program is killed or the power is cut: what counted as
//! kept is there, and nothing is there that was not made.

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::files::{Fault, Files, SimulatedFiles};
use super::sound::Judged;
use super::*;

#[derive(Clone, Debug, Default, PartialEq)]
struct Points(Vec<u32>);

#[derive(Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
enum Point {
    Point { number: u32 },
}

impl Log for Points {
    type Entry = Point;

    const OPENED_BY: &'static [&'static str] = &["point"];

    fn judge(&self, _: &JournalHeader, _: &Point) -> Judged {
        Ok(())
    }

    fn take(&mut self, Point::Point { number }: Point) {
        self.0.push(number);
    }

    fn keep_whole(&mut self, _: &JournalHeader) {}
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Table {
    points: Vec<u32>,
}

impl Content for Table {
    const KIND: &'static str = "table";

    fn summary(&self) -> String {
        format!("{} points", self.points.len())
    }

    fn judge(&self) -> Judged {
        Ok(())
    }
}

/// What a run was told of its records.
#[derive(Clone, Debug, Default)]
struct Kept {
    journal: Option<PathBuf>,
    written: u32,
    flushed: u32,
    is_used: bool,
    is_complete: bool,
    /// `None` while a note is written or removed, and where that failed.
    note: Option<bool>,
}

const POINTS: u32 = 3;

struct Story {
    files: SimulatedFiles,
    store: Store,
    old: String,
    kept: Kept,
}

fn record(points: Vec<u32>) -> CalibrationRecord<Table> {
    let head = RecordHead {
        schema_version: SCHEMA_VERSION,
        axis: "x".into(),
        ..RecordHead::default()
    };
    let content = Table { points };
    CalibrationRecord { head, content }
}

fn header() -> JournalHeader {
    JournalHeader {
        schema_version: SCHEMA_VERSION,
        verb: "calibrate".into(),
        axis: "x".into(),
        config_hash: "h".into(),
        started: "2026-01-01T00:00:00Z".into(),
        ..JournalHeader::default()
    }
}

impl Story {
    /// A machine that uses a calibration, and has a zero.
    fn begin() -> Self {
        let files = SimulatedFiles::new();
        let store = Store::new(
            "/data".as_ref(),
            "m",
            const { &[ContentKind::of::<Table>()] },
        );
        let store = store.in_files(Arc::new(files.clone()));
        let old = store.save(&record(vec![0])).unwrap();
        store.activate("x", &old).unwrap();
        store.write_zero_note("x", "a note".into()).unwrap();
        let kept = Kept {
            note: Some(true),
            ..Kept::default()
        };
        Self {
            files,
            store,
            old,
            kept,
        }
    }

    /// Measures what is not measured yet, and puts it into use.
    fn run(&mut self) -> Result<(), StoreError> {
        self.kept.note = None;
        let removed = self.store.remove_zero_note("x");
        removed.map_err(io_error("remove", "x".as_ref()))?;
        self.kept.note = Some(false);
        let (mut journal, earlier) = match &self.kept.journal {
            None => (self.store.create_journal::<Points>(&header())?, vec![]),
            Some(path) => {
                let hash = ConfigHash::recorded("h");
                let (journal, read) =
                    self.store
                        .resume_journal::<Points>(path, &header(), &hash)?;
                (journal, read.log.0)
            }
        };
        self.kept.journal = Some(journal.path().to_owned());
        let measured = self.measure(&mut journal, earlier);
        if let Err(failure) = &measured {
            let _ = journal.fail(failure.to_string());
        }
        measured?;
        self.kept.note = None;
        self.store.write_zero_note("x", "a note".into())?;
        self.kept.note = Some(true);
        Ok(())
    }

    fn measure(
        &mut self,
        journal: &mut Journal<Points>,
        mut points: Vec<u32>,
    ) -> Result<(), StoreError> {
        let next = points.last().copied().unwrap_or_default() + 1;
        for number in next..=POINTS {
            journal.write(&Point::Point { number })?;
            points.push(number);
            self.kept.written = self.kept.written.max(number);
            if number == 2 {
                journal.flush_to_disk()?;
                self.kept.flushed = self.kept.written;
            }
        }
        journal.flush_to_disk()?;
        self.kept.flushed = POINTS;
        let id = self.store.save(&record(points))?;
        self.store.activate("x", &id)?;
        self.kept.is_used = true;
        journal.complete()?;
        self.kept.is_complete = true;
        Ok(())
    }

    /// After a new start; `is_cut` when the power was cut before.
    fn check(&mut self, is_cut: bool, of: &str) {
        let Kept {
            written, flushed, ..
        } = self.kept;
        let promised = if is_cut { flushed } else { written };
        let newest = self.store.newest_run("calibrate", "x").unwrap();
        let mut complete = false;
        if let Some(path) = &self.kept.journal {
            assert_eq!(newest.as_ref(), Some(path), "{of}");
        }
        if let Some(path) = &newest {
            // One that was not told of may have no whole header yet.
            let read = self.store.read_journal::<Points>(path);
            assert!(
                read.is_ok() || self.kept.journal.is_none(),
                "{of}: {read:?}"
            );
            if let Ok(read) = read {
                let points = read.log.0;
                let expected: Vec<u32> = (1..).take(points.len()).collect();
                assert_eq!(points, expected, "{of}");
                assert!(points.len() >= promised as usize, "{of}: {points:?}");
                complete = read.complete;
            }
        }
        let used = self
            .store
            .active("x")
            .unwrap()
            .current
            .expect("one is in use");
        let table = self.store.load::<Table>(&used).unwrap().content.points;
        let is_new = table == [1, 2, 3];
        assert!(is_new || used == self.old, "{of}: {table:?}");
        assert!(is_new || !(self.kept.is_used || complete), "{of}");
        assert!(complete || !self.kept.is_complete, "{of}");
        let note = self.store.read_zero_note("x");
        assert!(note.is_none() || note.as_deref() == Some("a note"), "{of}");
        if let Some(noted) = self.kept.note {
            assert_eq!(note.is_some(), noted, "{of}");
        }
    }
}

fn dice(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(1);
    move || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        f64::from(state >> 24) / 128.0 - 0.5
    }
}

/// How a program ends: killed, or the power was cut with this seed.
const CUTS: u32 = 12;

#[test]
fn what_counted_as_kept_is_there_after_any_fault() {
    let mut whole = Story::begin();
    let first = whole.files.calls();
    whole.run().unwrap();
    let calls = whole.files.calls();
    let faults = [
        Fault::Error(28),
        Fault::Error(5),
        Fault::Partly(28),
        Fault::End,
    ];
    let mut histories = 0;
    for call in first..calls {
        for fault in faults {
            for seed in 0..=CUTS {
                // The run that goes on fails, too, at each of its calls, and is gone on with again.
                let mut again = 0;
                loop {
                    let mut story = Story::begin();
                    story.files.fail(call, fault);
                    let of = format!("call {call} {fault:?} seed {seed}, then {again}");
                    let begun = story.run();
                    assert!(begun.is_err() || fault == Fault::Partly(28), "{of}");
                    end(&mut story, seed, &of);
                    if story.kept.is_complete
                        || resumed_is_over(&mut story, again, fault, seed, &of)
                    {
                        histories += 1;
                        break;
                    }
                    histories += 1;
                    again += 1;
                }
            }
        }
    }
    println!("{} calls, {histories} histories", calls - first);
    assert!(histories > 10_000, "{histories}");
}

fn end(story: &mut Story, seed: u32, of: &str) {
    match seed {
        0 => story.files.restart(),
        seed => story.files.cut_power(dice(seed)),
    }
    story.check(seed > 0, of);
}

/// Goes on with its call number `again` failing; whether it has no such call, and was done.
fn resumed_is_over(story: &mut Story, again: usize, fault: Fault, seed: u32, of: &str) -> bool {
    if story.kept.journal.as_ref().is_some_and(|path| {
        story
            .store
            .read_journal::<Points>(path)
            .is_ok_and(|read| read.complete)
    }) {
        return true;
    }
    let before = story.files.calls();
    story.files.fail(before + again, fault);
    let done = story.run();
    let is_over = story.files.calls() <= before + again;
    end(story, seed, of);
    if is_over {
        assert!(done.is_ok(), "{of}: {done:?}");
        assert!(story.kept.is_complete, "{of}");
    }
    is_over
}

#[test]
fn a_full_disk_refuses_a_run_and_a_later_one_goes_on() {
    let story = Story::begin();
    let next = story.files.calls();
    // The folder, its flush, the file, then its first line.
    story.files.fail(next + 3, Fault::Partly(28));
    let refused = story.store.create_journal::<Points>(&header()).unwrap_err();
    assert!(refused.to_string().contains("os error 28"), "{refused}");
    let runs = story.files.list(&story.store.runs()).unwrap();
    assert!(runs.is_empty(), "{runs:?}");
    story.store.create_journal::<Points>(&header()).unwrap();
}

#[test]
fn a_pointer_that_is_not_flushed_is_in_use() {
    let story = Story::begin();
    let id = story.store.save(&record(vec![1])).unwrap();
    let next = story.files.calls();
    let mut synced = next;
    let probe = Story::begin();
    probe.store.save(&record(vec![1])).unwrap();
    probe.store.activate("x", &id).unwrap();
    // Its last call.
    synced += probe.files.calls() - next - 1;
    story.files.fail(synced, Fault::Error(5));
    let failed = story.store.activate("x", &id).unwrap_err();
    assert!(matches!(failed, StoreError::UseUnsynced { .. }), "{failed}");
    assert!(failed.to_string().contains("is in use"), "{failed}");
    assert!(!failed.to_string().contains("untouched"), "{failed}");
    assert_eq!(story.store.active("x").unwrap().current, Some(id));
}
