//! Ctrl-C, and a process that is killed, in the middle of a calibration.

use core::time::Duration;
use std::fs;
use std::path::{Path, PathBuf};

use drivers::transport::Transport;
use drivers::transport::live::{Live, SlcanSettings};
use machine::records::{ReadJournal, read_journal};
use nix::sys::signal::Signal;
use tests::Rig;
use truestage::for_tests::PointEntry;
use truestage::linear::LinearLog;
use wire::{Input, Payload, Port};

use crate::held::Steps;
use crate::programs::{Bench, Process, live_rigs};

/// The points of one run: 21 positions from both sides.
const RUN: usize = 42;

fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("a folder can be read").path());
    paths
        .flat_map(|path| {
            if path.is_dir() {
                files(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

/// The one journal of a calibration, as far as it is written.
fn journal(bench: &Bench) -> Option<ReadJournal<LinearLog>> {
    let runs = files(&bench.records().join("runs"));
    let path = runs
        .iter()
        .find(|path| path.to_string_lossy().contains("-calibrate-"))?;
    read_journal::<LinearLog>(path).ok()
}

fn points(bench: &Bench) -> Vec<PointEntry> {
    journal(bench).map_or_else(Vec::new, |journal| journal.log.points)
}

/// A calibration that has measured at least `count` points; time stands until the second is dropped.
fn calibrating(bench: &Bench, count: usize) -> (Process, Steps) {
    let mut process = bench.start(&["calibrate"]);
    let mut time = Steps::of(bench);
    time.until(&mut process, || points(bench).len() >= count);
    (process, time)
}

#[test]
fn ctrl_c_stops_in_a_controlled_way_and_the_run_is_resumed() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let (process, time) = calibrating(&bench, RUN + 3);
        let busy = bench.run(&["scan"]).with_code(3);
        assert!(
            busy["error"]
                .as_str()
                .is_some_and(|it| it.contains("in use")),
            "{busy}"
        );
        process.signal(Signal::SIGINT);
        drop(time);
        let ended = process.end();
        assert!(ended.said.contains("stopped on request"), "{ended:?}");
        assert!(ended.said.contains("--resume"), "{ended:?}");
        ended.with_code(130);
        let before = journal(&bench).expect("the points are kept");
        assert!(!before.complete);
        assert!(before.log.points.len() >= RUN + 3);
        let none = bench.run(&["cal", "list"]).with_code(0);
        assert_eq!(none["calibrations"], serde_json::json!([]));

        let resumed = bench.run(&["calibrate", "--resume"]).with_code(0);
        assert!(resumed["calibration"].is_string());
        let after = journal(&bench).expect("it is the same journal");
        assert!(after.complete);
        let first_run = |all: &[PointEntry]| -> Vec<PointEntry> {
            all.iter().filter(|point| point.run == 1).copied().collect()
        };
        assert_eq!(first_run(&after.log.points), first_run(&before.log.points));
        assert_eq!(first_run(&after.log.points).len(), RUN);
    }
}

#[test]
fn a_killed_process_leaves_a_stage_that_stops_by_itself_and_no_half_file() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let (process, time) = calibrating(&bench, 3);
        process.signal(Signal::SIGKILL);
        drop(time);
        assert_eq!(process.end().code, None);
        let torn = journal(&bench).expect("every point that was written can be read");
        assert!(torn.log.points.len() >= 3 && !torn.complete);
        drive_complains_of_a_silent_master(&bench);
        for path in files(&bench.records()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            assert!(!name.starts_with('.'), "{} was left behind", path.display());
        }
        bench.run(&["scan"]).with_code(0);
        bench.run(&["zero"]).with_code(0);
    }
}

/// The drive's emergency 0x8130: the heartbeat that it watches is missing, so it has stopped.
fn drive_complains_of_a_silent_master(bench: &Bench) {
    const EMERGENCY_OF_NODE_1: u16 = 0x081;
    const HEARTBEAT_ERROR: [u8; 2] = [0x30, 0x81];
    const CAN: Port = Port(0);
    // The drive watches for half a second.
    const SILENCE_MAX: Duration = Duration::from_secs(1);
    let builder = Live::builder(bench.clock("a listener"));
    let endpoint = bench.port("can0");
    let (_, place) = endpoint.split_once(':').expect("KIND:PLACE");
    let builder = match bench.rig() {
        Rig::Vcan => builder.socketcan(CAN, place),
        _ => builder.slcan(CAN, place, SlcanSettings::new(1_000_000)),
    };
    let mut bus = builder.build().unwrap_or_else(|error| panic!("{error}"));
    let until = bus.now() + SILENCE_MAX;
    loop {
        let arrival = bus.receive(until).expect("the drive does not complain");
        let Input::Payload(Payload::Frame(frame)) = arrival.input else {
            continue;
        };
        let from_drive = u32::from(EMERGENCY_OF_NODE_1) == frame.id().raw();
        if from_drive && frame.data().starts_with(&HEARTBEAT_ERROR) {
            return;
        }
    }
}
