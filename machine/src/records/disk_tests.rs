//! The thread of the records, on disks that hang and fail.

use core::time::Duration;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use units::Time;

use super::files::{Call, Fault, Files, SimulatedFiles, Watch, WatchedFiles};
use super::*;
use crate::{Machine, Parts, Patience, ask_disk, read_ahead, settle};

/// What calls wait for.
#[derive(Clone, Debug)]
struct Gate {
    is_open: Arc<(Mutex<bool>, Condvar)>,
    calls: Arc<AtomicUsize>,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            is_open: Arc::new((Mutex::new(true), Condvar::new())),
            calls: Arc::default(),
        }
    }
}

impl Gate {
    fn set_open(&self, is_open: bool) {
        *self.is_open.0.lock().unwrap() = is_open;
        self.is_open.1.notify_all();
    }
}

impl Watch for Gate {
    fn begin_call(&self, _: Call, _: &Path) -> io::Result<()> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        let open = self.is_open.0.lock().unwrap();
        drop(
            self.is_open
                .1
                .wait_while(open, |is_open| !*is_open)
                .unwrap(),
        );
        Ok(())
    }
}

/// A disk whose calls wait until it is let go.
type Hanging = WatchedFiles<SimulatedFiles, Gate>;

fn point() -> serde_json::Value {
    serde_json::json!({"entry": "point"})
}

fn header() -> JournalHeader {
    JournalHeader {
        schema_version: SCHEMA_VERSION,
        verb: "calibrate".into(),
        axis: "x".into(),
        started: "2026-01-01T00:00:00Z".into(),
        ..JournalHeader::default()
    }
}

fn machine() -> Machine {
    let parts = Parts {
        buses: vec![],
        lines: Default::default(),
        axes: vec![],
        rotaries: vec![],
        analogs: vec![],
        instruments: vec![],
        cameras: vec![],
        patience: Patience::NONE,
    };
    let nothing = drivers::transport::replay::Replay::parse("", &[]).unwrap();
    Machine::new(parts, Box::new(nothing))
}

fn ordered(files: Arc<dyn Files>) -> Store {
    let store = Store::new("/data".as_ref(), "m", &[]).in_files(files);
    store.ordered(DiskPace::Wall).unwrap()
}

#[test]
fn a_machine_lives_on_while_its_disk_hangs() {
    let files = Hanging::default();
    let store = ordered(Arc::new(files.clone()));
    files.watch.set_open(false);
    let mut machine = machine();
    let mut journal = store.create_journal::<AnyLog>(&header()).unwrap();
    journal.write(&point()).unwrap();
    let before = machine.now();
    let let_go = files.clone();
    // The replay's clock goes by ticks: it is let go after a second of them.
    crate::attend(
        &mut machine,
        Box::new(LetGo {
            files: let_go,
            at: before + Duration::from_secs(1),
        }),
    );
    settle(&mut machine, &store).unwrap().unwrap();
    assert!(machine.now() >= before + Duration::from_secs(1));
    assert!(
        store
            .direct()
            .read_journal::<AnyLog>(journal.path())
            .is_ok()
    );
}

struct LetGo {
    files: Hanging,
    at: Time,
}

impl crate::Attendant for LetGo {
    fn attend(&mut self, machine: &mut Machine) -> Result<(), crate::Failure> {
        if machine.now() >= self.at {
            self.files.watch.set_open(true);
        }
        Ok(())
    }
}

#[test]
fn a_stop_is_seen_while_the_disk_hangs() {
    let files = Hanging::default();
    let store = ordered(Arc::new(files.clone()));
    files.watch.set_open(false);
    let mut machine = machine();
    drop(store.create_journal::<AnyLog>(&header()).unwrap());
    machine.stop_request().stop();
    let stopped = settle(&mut machine, &store).unwrap_err();
    assert!(stopped.is_stop(), "{stopped}");
    files.watch.set_open(true);
}

#[test]
fn a_queue_that_is_full_names_the_disk() {
    let files = Hanging::default();
    let store = ordered(Arc::new(files.clone()));
    files.watch.set_open(false);
    let mut journal = store.create_journal::<AnyLog>(&header()).unwrap();
    let refused = (0..10_000).find_map(|_| journal.write(&point()).err());
    let refused = refused.expect("the queue has an end").to_string();
    assert!(refused.contains("disk"), "{refused}");
    files.watch.set_open(true);
}

#[test]
fn nothing_is_written_behind_what_failed() {
    let files = SimulatedFiles::new();
    let store = ordered(Arc::new(files.clone()));
    let mut machine = machine();
    let mut journal = store.create_journal::<AnyLog>(&header()).unwrap();
    settle(&mut machine, &store).unwrap().unwrap();
    files.fail(files.calls(), Fault::Error(28));
    let written = (0..3).try_for_each(|_| journal.write(&point()));
    let settled = settle(&mut machine, &store).unwrap();
    let failure = written.and(settled).unwrap_err();
    assert!(failure.to_string().contains("os error 28"), "{failure}");
    // Heard once; what comes then is done.
    journal.write(&point()).unwrap();
    settle(&mut machine, &store).unwrap().unwrap();
    let (read, entries) = {
        let path = journal.path().to_owned();
        let read = store.direct().read_journal::<AnyLog>(&path).unwrap();
        let text = String::from_utf8(files.read(&path).unwrap()).unwrap();
        (read, text.lines().count())
    };
    assert!(!read.torn);
    assert!((2..=4).contains(&entries), "{entries}");
}

#[test]
fn what_is_read_was_read_before() {
    let files = Hanging::default();
    let direct = Store::new("/data".as_ref(), "m", &[]).in_files(Arc::new(files.clone()));
    let mut journal = direct.create_journal::<AnyLog>(&header()).unwrap();
    journal.complete().unwrap();
    direct.write_zero_note("x", "noted".into()).unwrap();
    let store = direct.ordered(DiskPace::Wall).unwrap();
    let mut machine = machine();
    read_ahead(&mut machine, &store, journal.path().to_owned()).unwrap();
    let calls = files.watch.calls.load(Ordering::Relaxed);
    assert_eq!(store.active("x").unwrap().current, None);
    assert_eq!(store.read_zero_note("x").as_deref(), Some("noted"));
    let newest = store.newest_run("calibrate", "x").unwrap().unwrap();
    assert!(store.read_journal::<AnyLog>(&newest).unwrap().complete);
    assert_eq!(files.watch.calls.load(Ordering::Relaxed), calls);
    // A zero that is lost is not believed, whatever the disk does.
    store.hide_zero_note("x");
    assert_eq!(store.read_zero_note("x"), None);
    let answered = ask_disk(&mut machine, &store, |store| {
        store.remove_zero_note("x").is_ok()
    });
    assert!(answered.unwrap());
}
