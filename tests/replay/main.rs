//! A recording takes the devices' place, and the machine does and finds the same again.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use drivers::transport::record::Recorder;
use drivers::transport::replay::{Replay, ReplayReport};
use drivers::transport::{SendError, Transport};
use machine::records::Store;
use tests::{Bench, Edit, machine_config};
use truestage::for_tests::{PointEntry, port_numbers};
use truestage::for_tests::{Verified, Zeroed};
use truestage::linear::VerifyOptions;
use truestage::{Failure, Machine};
use units::Time;
use wire::{Arrival, Payload, Port};

/// A verification of two points from both sides, twice.
fn short(text: String) -> String {
    text.edit("targets = 8\nruns = 5", "targets = 2\nruns = 2")
}

/// What a recorder writes and a test reads.
#[derive(Clone, Default)]
struct Shared(Rc<RefCell<Vec<u8>>>);

impl io::Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What the machine found, as bits.
#[derive(Debug, PartialEq, Eq)]
struct Found {
    origin: u64,
    uncertainty: u64,
    points: Vec<[u64; 6]>,
    ended: Time,
}

fn bits(point: &PointEntry) -> [u64; 6] {
    let PointEntry {
        target_m,
        set_point_m,
        encoder_m,
        measured_m,
        scatter_m,
        at_s,
        ..
    } = *point;
    [
        target_m,
        set_point_m,
        encoder_m,
        measured_m,
        scatter_m,
        at_s,
    ]
    .map(f64::to_bits)
}

/// Zero, and the points.
fn procedure(machine: &mut Machine, store: &Store) -> Result<(Zeroed, Verified), Failure> {
    machine.start()?;
    let zeroed = machine.linear("x")?.zero(store)?;
    let options = VerifyOptions {
        compensated: false,
        calibration: None,
        resume: None,
    };
    let verified = machine.linear("x")?.verify(store, &options)?;
    machine.shut_down()?;
    Ok((zeroed, verified))
}

#[track_caller]
fn run(machine: &mut Machine, store: &Store) -> Found {
    let result = machine.guarded(|machine| procedure(machine, store));
    let (zeroed, verified) = result.unwrap_or_else(|failure| panic!("{failure}"));
    Found {
        origin: zeroed.estimate.origin.value().to_bits(),
        uncertainty: zeroed.estimate.standard_uncertainty.value().to_bits(),
        points: verified.measured.points.iter().map(bits).collect(),
        ended: machine.now(),
    }
}

/// A short cycle in virtual time, and its recording.
fn recorded(seed: u64) -> (Found, String) {
    let log = Shared::default();
    let writer = log.clone();
    let mut bench = Bench::wrapped(
        seed,
        short,
        |text| text,
        |inner| {
            let config = machine_config("/".as_ref(), short).config;
            let ports = port_numbers(&config);
            let names: Vec<_> = ports.iter().map(|(name, port)| (*port, &**name)).collect();
            Box::new(Recorder::new(inner, writer, &names).expect("memory takes every byte"))
        },
    );
    let store = bench.store.clone();
    let found = run(&mut bench.machine, &store);
    drop(bench);
    (
        found,
        String::from_utf8(log.0.take()).expect("a recording is text"),
    )
}

/// A replay whose report is there afterwards.
struct Watched(Rc<RefCell<Replay>>);

impl Transport for Watched {
    fn now(&self) -> Time {
        self.0.borrow().now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        self.0.borrow_mut().send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.0.borrow_mut().receive(until)
    }

    fn sleep_until(&mut self, until: Time) {
        self.0.borrow_mut().sleep_until(until);
    }

    fn set_sync(
        &mut self,
        port: Port,
        period: Option<core::time::Duration>,
    ) -> Result<(), SendError> {
        self.0.borrow_mut().set_sync(port, period)
    }
}

/// The same procedure on a fresh machine that hears the recording.
fn replayed(recording: &str) -> (Found, ReplayReport) {
    let folder = tempfile::tempdir().unwrap();
    let loaded = machine_config(folder.path(), short);
    let ports = port_numbers(&loaded.config);
    let names: Vec<_> = ports.iter().map(|(name, port)| (*port, &**name)).collect();
    let replay = Replay::parse(recording, &names).unwrap_or_else(|error| panic!("{error}"));
    let replay = Rc::new(RefCell::new(replay));
    let mut machine = Machine::new(&loaded, Box::new(Watched(replay.clone())));
    let store = truestage::for_tests::store_in(folder.path(), &loaded.config.machine.name);
    let found = run(&mut machine, &store);
    let report = replay.borrow().report();
    (found, report)
}

#[test]
fn a_replayed_cycle_gives_the_same_results_bit_for_bit() {
    let (found, recording) = recorded(41);
    let (again, report) = replayed(&recording);
    println!(
        "{} lines, {} sendings",
        recording.lines().count(),
        report.matched
    );
    assert_eq!(again, found);
    assert_eq!(found.points.len(), 8);
    assert!(report.matched > 100, "{report:?}");
    assert_eq!(
        (report.mismatched, report.missing),
        (0, 0),
        "{:?}",
        report.mismatches.first()
    );
}

#[test]
fn a_recording_of_another_stage_gives_other_results() {
    let (found, _) = recorded(41);
    let (other, recording) = recorded(42);
    let (again, _) = replayed(&recording);
    assert_eq!(again, other);
    assert_ne!(again.origin, found.origin);
}

#[test]
fn a_recording_whose_drive_falls_silent_ends_with_the_reason() {
    let (_, recording) = recorded(41);
    let half: Vec<_> = recording
        .lines()
        .take(recording.lines().count() / 2)
        .collect();
    let silent = half.join("\n");
    let folder = tempfile::tempdir().unwrap();
    let loaded = machine_config(folder.path(), short);
    let replay = Replay::parse(&silent, &[]).unwrap();
    let mut machine = Machine::new(&loaded, Box::new(replay));
    let store = truestage::for_tests::store_in(folder.path(), &loaded.config.machine.name);
    let result = machine.guarded(|machine| procedure(machine, &store).map(drop));
    let failure = result.unwrap_err();
    assert!(
        matches!(
            failure,
            Failure::Machine(machine::Failure::Explained { .. })
        ),
        "{failure}"
    );
    assert_eq!(failure.exit_code(), 4);
}
