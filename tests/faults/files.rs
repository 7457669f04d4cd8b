//! Files that were cut, changed, interrupted, come from elsewhere or from another version, and
//! two programs at once (classes 43 to 46, 50).

use std::fs;

use machine::records::Lease;
use machine::records::Store;
use machine::records::{CalibrationRecord, StoreError};
use tests::{Bench, Edit};
use truestage::CalibrateOptions;
use truestage::linear::{LinearContent, LinearLog};
use truestage::rotary::RotaryContent;
use truestage::{Failure, Machine};

use crate::scene::shortened;

/// A started machine whose store holds two calibrations, the older and the newer one.
struct Shelf {
    bench: Bench,
    record: CalibrationRecord<LinearContent>,
    older: String,
    newer: String,
}

impl Shelf {
    fn new() -> Self {
        let mut bench = Bench::with(1, shortened, |text| text);
        let store = bench.store.clone();
        bench.machine.start().unwrap();
        bench.machine.linear("x").unwrap().zero(&store).unwrap();
        let options = CalibrateOptions::default();
        let older = bench
            .machine
            .linear("x")
            .unwrap()
            .calibrate(&store, &options)
            .unwrap()
            .id;
        let newer = bench
            .machine
            .linear("x")
            .unwrap()
            .calibrate(&store, &options)
            .unwrap();
        bench.machine.shut_down().unwrap();
        Self {
            bench,
            record: newer.record,
            older,
            newer: newer.id,
        }
    }

    fn load(&mut self) -> Result<Option<String>, Failure> {
        let store = self.bench.store.clone();
        self.bench.machine.linear("x")?.load_active(&store)
    }

    fn store(&self) -> &Store {
        &self.bench.store
    }

    /// Stores a changed record and makes it the active one.
    fn activate(&self, change: impl FnOnce(&mut CalibrationRecord<LinearContent>)) {
        let mut record = self.record.clone();
        change(&mut record);
        let id = self.store().save(&record).unwrap();
        // A record that this program would not activate: only the pointer changes.
        let path = self.store().root().join("active/x.json");
        let text = fs::read_to_string(&path).unwrap().edit(&self.newer, &id);
        fs::write(path, text).unwrap();
    }
}

#[test]
fn every_changed_byte_of_a_calibration_is_noticed_and_the_one_before_can_be_used() {
    let mut shelf = Shelf::new();
    let path = shelf.store().calibration_path(&shelf.newer);
    let whole = fs::read(&path).unwrap();
    for at in (0..whole.len()).step_by(7) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&path, &bytes).unwrap();
        let failure = shelf.load().unwrap_err();
        let damaged = matches!(failure, Failure::Store(StoreError::Damaged { .. }));
        assert!(damaged, "byte {at}: {failure:?}");
        assert!(failure.to_string().contains("roll back"), "{failure}");
    }
    let older = shelf.older.clone();
    assert_eq!(shelf.store().rollback("x").unwrap(), older);
    assert_eq!(shelf.load().unwrap(), Some(older));
}

#[test]
fn a_calibration_cut_anywhere_is_refused_whole() {
    let mut shelf = Shelf::new();
    let path = shelf.store().calibration_path(&shelf.newer);
    let whole = fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(13) {
        fs::write(&path, &whole[..length]).unwrap();
        let failure = shelf.load().unwrap_err();
        let damaged = matches!(failure, Failure::Store(StoreError::Damaged { .. }));
        assert!(damaged, "{length} bytes: {failure:?}");
    }
    fs::write(&path, &whole).unwrap();
    assert_eq!(shelf.load().unwrap(), Some(shelf.newer.clone()));
}

#[test]
fn a_pointer_changed_or_cut_anywhere_never_leads_to_a_wrong_table() {
    let mut shelf = Shelf::new();
    let path = shelf.store().root().join("active/x.json");
    let whole = fs::read(&path).unwrap();
    let known = [shelf.older.clone(), shelf.newer.clone()];
    let mut refused = 0;
    let mut judge = |shelf: &mut Shelf, bytes: &[u8], what: String| {
        fs::write(&path, bytes).unwrap();
        match shelf.load() {
            Ok(None) => panic!("{what}: silently without a calibration"),
            Ok(Some(id)) => assert!(known.contains(&id), "{what}: {id}"),
            Err(Failure::Store(_)) => refused += 1,
            Err(failure) => panic!("{what}: {failure}"),
        }
    };
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        judge(&mut shelf, &bytes, format!("byte {at}"));
    }
    for length in 0..whole.len() - 2 {
        judge(&mut shelf, &whole[..length], format!("{length} bytes"));
    }
    assert!(refused > whole.len(), "{refused} refused");
}

#[test]
fn a_save_interrupted_at_any_step_leaves_the_old_one_or_the_new_one() {
    let mut shelf = Shelf::new();
    let root = shelf.store().root().to_owned();
    let (calibrations, active) = (root.join("calibrations"), root.join("active"));
    let newest = fs::read(shelf.store().calibration_path(&shelf.newer)).unwrap();
    // Before the rename: a temporary file, whole or not.
    fs::write(
        calibrations.join(".new-a1b2c3"),
        &newest[..newest.len() / 2],
    )
    .unwrap();
    fs::write(active.join(".new-d4e5f6"), b"{\"schema_ver").unwrap();
    assert_eq!(shelf.load().unwrap(), Some(shelf.newer.clone()));
    assert_eq!(shelf.store().list().unwrap().len(), 2);
    // After the calibration's rename, before the pointer's: stored, and not in use.
    let mut record = shelf.record.clone();
    record.head.created = "2030-01-01T00:00:00Z".into();
    let stored = shelf.store().save(&record).unwrap();
    assert_eq!(shelf.load().unwrap(), Some(shelf.newer.clone()));
    shelf.store().activate("x", &stored).unwrap();
    assert_eq!(shelf.load().unwrap(), Some(stored));
}

#[test]
fn a_disk_that_takes_nothing_leaves_the_calibration_in_use() {
    let mut shelf = Shelf::new();
    let folder = shelf.store().root().join("calibrations");
    let hidden = shelf.store().root().join("hidden");
    fs::rename(&folder, &hidden).unwrap();
    // A file where the folder was: nothing can be created below it, whoever asks.
    fs::write(&folder, b"").unwrap();
    let mut record = shelf.record.clone();
    record.head.created = "2031-01-01T00:00:00Z".into();
    let error = shelf.store().save(&record).unwrap_err();
    assert!(matches!(error, StoreError::Io { .. }), "{error}");
    assert!(error.to_string().contains("untouched"), "{error}");
    fs::remove_file(&folder).unwrap();
    fs::rename(&hidden, &folder).unwrap();
    assert_eq!(shelf.load().unwrap(), Some(shelf.newer.clone()));
}

#[test]
fn a_run_whose_journal_cannot_be_written_is_not_begun() {
    let mut bench = Bench::with(1, shortened, |text| text);
    let store = bench.store.clone();
    bench.machine.start().unwrap();
    bench.machine.linear("x").unwrap().zero(&store).unwrap();
    let before = bench.true_position();
    let full = truestage::for_tests::store_in(&bench.folder.path().join("file"), "m");
    fs::write(bench.folder.path().join("file"), b"").unwrap();
    let options = CalibrateOptions::default();
    let failure = bench
        .machine
        .linear("x")
        .unwrap()
        .calibrate(&full, &options)
        .unwrap_err();
    assert!(
        matches!(failure, Failure::Store(StoreError::Io { .. })),
        "{failure:?}"
    );
    let moved = (bench.true_position() - before).abs();
    assert!(moved.nm() < 100.0, "moved by {} nm", moved.nm());
}

#[track_caller]
fn check_foreign(change: impl FnOnce(&mut CalibrationRecord<LinearContent>), words: &[&str]) {
    let mut shelf = Shelf::new();
    shelf.activate(change);
    let failure = shelf.load().unwrap_err();
    let foreign = matches!(failure, Failure::Store(StoreError::Foreign { .. }));
    assert!(foreign, "{failure:?}");
    let text = failure.to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

#[test]
fn a_calibration_of_another_stage_drive_scale_or_setup_is_refused_by_name() {
    check_foreign(
        |it| it.head.stage_serial = "TS-LIN-0002".into(),
        &["serial number", "TS-LIN-0002"],
    );
    check_foreign(|it| it.head.drive.serial = 77, &["the drive", "serial 77"]);
    check_foreign(
        |it| it.head.resolution_m = Some(2e-8),
        &["encoder count", "`20 nm`"],
    );
    check_foreign(
        |it| it.head.config_hash = "0000".into(),
        &["configuration", "0000"],
    );
    check_foreign(|it| it.head.axis = "y".into(), &["the axis", "`y`"]);
}

/// The smallest one that is sound.
fn a_rotary_table() -> RotaryContent {
    RotaryContent {
        lines: 2,
        offsets: vec![0, 1],
        table_error_rad: vec![0.0; 2],
        plate_error_rad: vec![Some(0.0); 2],
        noise_amplification: 1.0,
        ..RotaryContent::default()
    }
}

#[test]
fn a_file_of_a_newer_program_or_of_another_kind_is_refused_clearly() {
    let mut shelf = Shelf::new();
    shelf.activate(|record| record.head.schema_version = 2);
    let failure = shelf.load().unwrap_err();
    assert!(
        matches!(failure, Failure::Store(StoreError::Newer { seen: 2, .. })),
        "{failure:?}"
    );
    assert!(
        failure.to_string().contains("use a newer version"),
        "{failure}"
    );
    let mut shelf = Shelf::new();
    let other = CalibrationRecord {
        head: shelf.record.head.clone(),
        content: a_rotary_table(),
    };
    let id = shelf.store().save(&other).unwrap();
    shelf.store().activate("x", &id).unwrap();
    let failure = shelf.load().unwrap_err();
    let other = matches!(failure, Failure::Store(StoreError::OtherKind { .. }));
    assert!(other, "{failure:?}");
    assert!(
        failure.to_string().contains("rotary_error_table"),
        "{failure}"
    );
}

#[test]
fn two_programs_never_share_a_machine() {
    let bench = Bench::new(1);
    let first = Lease::take(&bench.store, "calibrate").unwrap();
    let second = Lease::take(&bench.store, "move").unwrap_err();
    assert!(
        second.to_string().contains("truestage calibrate, process"),
        "{second}"
    );
    drop(first);
    Lease::take(&bench.store, "move").unwrap();
}

#[test]
fn a_killed_run_goes_on_where_it_stopped() {
    let mut bench = Bench::with(1, shortened, |text| text);
    let store = bench.store.clone();
    let stop = bench.machine.stop_request();
    bench.machine.observe(Box::new(StopAt { left: 30, stop }));
    let run = |machine: &mut Machine, resume| {
        machine.start()?;
        machine.linear("x")?.zero(&store)?;
        let options = CalibrateOptions {
            resume,
            accept_drift: false,
            ..CalibrateOptions::default()
        };
        machine.linear("x")?.calibrate(&store, &options)
    };
    let failure = bench
        .machine
        .guarded(|machine| run(machine, None))
        .unwrap_err();
    assert!(
        matches!(failure, Failure::Machine(machine::Failure::Interrupted)),
        "{failure:?}"
    );
    let journal = store.newest_run("calibrate", "x").unwrap().unwrap();
    let before = machine::records::read_journal::<LinearLog>(&journal).unwrap();
    assert_eq!((before.log.points.len(), before.complete), (30, false));
    // Another process would have a flag of its own.
    bench
        .machine
        .share_stop_request(&machine::StopRequest::default());
    let made = bench
        .machine
        .guarded(|machine| run(machine, Some(journal.clone())))
        .unwrap();
    assert_eq!(made.journal, journal);
    let points = &made.measured.points;
    assert_eq!(
        points.len(),
        66,
        "three runs of eleven targets from both sides"
    );
    assert_eq!(
        points[..22],
        before.log.points[..22],
        "the whole run is kept"
    );
}

/// Asks to stop after so many measured points.
struct StopAt {
    left: u64,
    stop: machine::StopRequest,
}

impl machine::Observer for StopAt {
    fn progress(&mut self, stage: machine::Stage, _: &str, done: u64, _: u64) {
        if stage == machine::Stage::Calibrate && done == self.left {
            self.stop.stop();
        }
    }
}
