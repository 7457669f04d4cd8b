//! A disk that is full, slow to flush, or hangs, while a machine measures (classes 43 to 46).

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use machine::records::files::{Call, OsFiles, Watch, WatchedFiles};
use machine::records::{DiskPace, Store, read_journal};
use tests::Bench;
use truestage::linear::LinearLog;
use truestage::{CalibrateOptions, Failure, Machine};
use units::Metres;

use crate::scene::shortened;

/// A call, and the part of a path that it is about.
#[derive(Clone, Copy, Debug)]
struct Part {
    call: Call,
    of_path: &'static str,
}

/// Which calls are refused.
#[derive(Clone, Debug, Default)]
struct Refused {
    part: Arc<Mutex<Option<Part>>>,
    was_asked: Arc<AtomicBool>,
}

impl Refused {
    fn set(&self, call: Call, of_path: &'static str) {
        *self.part.lock().unwrap() = Some(Part { call, of_path });
    }

    fn clear(&self) {
        *self.part.lock().unwrap() = None;
    }
}

impl Watch for Refused {
    fn begin_call(&self, call: Call, path: &Path) -> io::Result<()> {
        match *self.part.lock().unwrap() {
            Some(part) if part.call == call && path.to_string_lossy().contains(part.of_path) => {
                self.was_asked.store(true, Ordering::Relaxed);
                Err(io::Error::from_raw_os_error(28))
            }
            _ => Ok(()),
        }
    }
}

/// The operating system's files, of which some are refused.
type Refusing = WatchedFiles<OsFiles, Refused>;

/// A stage whose store is on a disk that refuses; ordered at `pace`.
fn bench_on_disk(pace: Option<DiskPace>) -> (Bench, Refusing, Store) {
    let bench = Bench::with(1, shortened, |text| text);
    let files = Refusing::default();
    let direct = bench.store.clone().in_files(Arc::new(files.clone()));
    let store = match pace {
        Some(pace) => direct.ordered(pace).unwrap(),
        None => direct,
    };
    (bench, files, store)
}

fn calibrated(
    machine: &mut Machine,
    store: &Store,
    resume: Option<PathBuf>,
) -> Result<String, Failure> {
    machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(store)?;
        let options = CalibrateOptions {
            resume,
            ..CalibrateOptions::default()
        };
        Ok(machine.linear("x")?.calibrate(store, &options)?.id)
    })
}

/// Calls of `part` are refused after the measurement: the run that goes on stores and uses what it measured.
#[track_caller]
fn check_goes_on(part: &'static str, pace: Option<DiskPace>) {
    let (mut bench, files, store) = bench_on_disk(pace);
    files.watch.set(Call::Create, part);
    let failure = calibrated(&mut bench.machine, &store, None).unwrap_err();
    assert!(files.watch.was_asked.load(Ordering::Relaxed), "{part}");
    assert!(matches!(failure, Failure::Store(_)), "{part}: {failure:?}");
    assert!(failure.to_string().contains("os error 28"), "{failure}");
    assert_eq!(failure.exit_code(), 2);
    assert_eq!(bench.store.active("x").unwrap().current, None, "{part}");
    let journal = bench.store.newest_run("calibrate", "x").unwrap().unwrap();
    let before = read_journal::<LinearLog>(&journal).unwrap();
    assert!(!before.complete, "{part}");
    assert_eq!(before.log.points.len(), 66, "{part}");
    files.watch.clear();
    let id = calibrated(&mut bench.machine, &store, Some(journal.clone())).unwrap();
    assert_eq!(bench.store.active("x").unwrap().current, Some(id), "{part}");
    let after = read_journal::<LinearLog>(&journal).unwrap();
    assert!(after.complete, "{part}");
    assert_eq!(after.log.points, before.log.points, "{part}");
}

#[test]
fn a_measurement_that_cannot_be_stored_is_stored_by_the_next_run() {
    for part in ["/calibrations/", "/active/"] {
        for pace in [None, Some(DiskPace::Shared), Some(DiskPace::Wall)] {
            check_goes_on(part, pace);
        }
    }
}

#[test]
fn a_disk_that_is_full_is_told_before_anything_moves() {
    for pace in [DiskPace::Shared, DiskPace::Wall] {
        let (mut bench, files, store) = bench_on_disk(Some(pace));
        files.watch.set(Call::Create, "");
        let truth = |bench: &Bench| bench.emulated.simulation().truth().position();
        let before = truth(&bench);
        let failure = calibrated(&mut bench.machine, &store, None).unwrap_err();
        assert!(matches!(failure, Failure::Store(_)), "{failure:?}");
        let moved = (truth(&bench) - before).abs();
        // A stage that is off trembles.
        assert!(moved < Metres(1e-9), "{moved:?}");
    }
}

#[test]
fn a_calibration_whose_pointer_is_not_flushed_is_in_use() {
    for pace in [None, Some(DiskPace::Shared), Some(DiskPace::Wall)] {
        let (mut bench, files, store) = bench_on_disk(pace);
        files.watch.set(Call::SyncFolder, "/active");
        let failure = calibrated(&mut bench.machine, &store, None).unwrap_err();
        let said = failure.to_string();
        assert!(said.contains("is in use"), "{said}");
        assert!(said.contains("may not outlast a power cut"), "{said}");
        assert_eq!(failure.exit_code(), 2);
        assert!(bench.store.active("x").unwrap().current.is_some());
        let mut stage = bench.machine.linear("x").unwrap();
        assert!(stage.compensation().is_some(), "{said}");
        files.watch.clear();
        stage.load_active(&store).unwrap();
    }
}
