//! python-canopen's `LocalNode`s, with the EDS of a real drive, follow our cyclic set-points.
//!
//! The EDS is looked for beside the project, or where `TRUESTAGE_EDS` says; without it nothing is
//! tested. It is read where it is.

use std::path::PathBuf;
use std::time::Duration;

use drivers::transport::clock::Clock;
use drivers::transport::live::{Live, SlcanSettings};
use machine::Patience;
use machine::engine::{Cause, Engine, NoCorrection};
use serde_json::{Value, json};
use tests::stream::{self, Watch, Writer, circle};
use tests::{Edit, INTERFACE, Rig, SlcanHub, VOLUMETRIC, left_out, not_run, shipped_config};
use truestage::Machine;
use truestage::config::Loaded;
use units::Metres;
use wire::Port;

use crate::peer::Peer;

const EDS: &str = "Pejman712-CRF--MaxonEPOS4.eds";
const AXES: [&str; 3] = ["x", "y", "z"];
/// From SYNC to SYNC: Python serves three drives in it on a busy computer.
const PERIOD_MS: u16 = 40;
/// What Python may be late by in everything but the SYNC period itself.
const PATIENCE: f64 = 5.0;
/// How often a run is begun anew when Python missed three SYNCs.
const TRIES: u32 = 3;
const COUNT: Metres = Metres(10e-9);

/// The folder's file, if there is one.
fn eds() -> Option<PathBuf> {
    let usual = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/eds");
    let folder = std::env::var_os("TRUESTAGE_EDS").map_or_else(|| usual.into(), PathBuf::from);
    let path = folder.join(EDS);
    path.exists().then_some(path)
}

/// The shipped three axes without the modules that see them, with drives as the EDS has them.
fn drives_only(text: String) -> String {
    let without = |text: String, from: &str, to: &str| {
        let begin = text.find(from).expect("the configuration has it");
        let end = begin + text[begin..].find(to).expect("the configuration has it");
        format!("{}{}", &text[..begin], &text[end..])
    };
    let text = without(text, "# Quadrants of the slide's", "[volumetric]");
    let text = without(text, "# Across x lie y and z", "[volumetric.compensation]");
    let text = text
        .edit(
            "sync_period_ms = 2.0",
            &format!("sync_period_ms = {PERIOD_MS}.0"),
        )
        .edit("vendor_id = 0x7FF", "vendor_id = 0xFB")
        .edit("product_code = 0x42_0001", "product_code = 0x6150_0000")
        .edit("revision = 0x1_0000", "revision = 0x0150_0000");
    ["1", "2", "3"].iter().fold(text, |text, node| {
        text.edit(
            &format!("serial_number = 400{node}"),
            &format!("serial_number = {node}"),
        )
    })
}

/// One machine and its peers. The bus goes after its users.
struct Talk {
    machine: Machine,
    peer: Peer,
    _hub: Option<SlcanHub>,
}

impl Talk {
    fn begin(rig: Rig, loaded: &Loaded, eds: &str) -> Self {
        let port = Port(0);
        let builder = Live::builder(Clock::real());
        let (builder, interface, channel, hub) = match rig {
            Rig::Vcan => (
                builder.socketcan(port, INTERFACE),
                "socketcan",
                INTERFACE.to_owned(),
                None,
            ),
            Rig::Pty | Rig::InProcess => {
                let hub = SlcanHub::new();
                let [ours, theirs] = hub.paths().map(|path| path.display().to_string());
                let settings = SlcanSettings::new(1_000_000);
                (
                    builder.slcan(port, ours, settings),
                    "slcan",
                    theirs,
                    Some(hub),
                )
            }
        };
        let live = builder.build().unwrap_or_else(|error| panic!("{error}"));
        let arguments = [interface, &channel, eds, "1", "2", "3"];
        let peer = Peer::start("csp_node.py", &arguments);
        let ready = peer.report();
        // The home offset and the position window are not in this EDS.
        let expected = json!({
            "ready": true, "product": "EPOS4 Module 50/5", "added": [0x607C, 0x6067, 0x6068],
        });
        assert_eq!(ready, expected);
        Self {
            machine: Machine::new(loaded, Box::new(live)),
            peer,
            _hub: hub,
        }
    }

    /// Follows the path; whether the engine came to its end.
    fn follow(&mut self, points: &[Vec<Metres>]) -> bool {
        let machine = &mut self.machine;
        let zeroed = machine.start().and_then(|()| machine.volumetric()?.zero());
        zeroed.unwrap_or_else(|failure| panic!("{failure}"));
        let (mut engine, desk) = Engine::new(machine, &AXES, Box::new(NoCorrection))
            .unwrap_or_else(|failure| panic!("{failure}"));
        engine.in_real_time();
        let writer = Writer::new(desk, points.to_vec());
        let (outcome, _) = stream::follow(
            machine,
            &mut engine,
            writer,
            &Watch::Nobody,
            |_| {},
            &mut |_| {},
        );
        println!("{outcome:?}\n{}", engine.timing());
        match outcome {
            Ok(Cause::PathDone) => {
                machine.shut_down().unwrap_or_else(|it| panic!("{it}"));
                true
            }
            Ok(Cause::Overrun { .. }) => {
                machine.make_safe();
                false
            }
            Ok(other) => panic!("nobody asked for that: {other}"),
            Err(failure) => {
                assert!(stream::is_lateness(&failure), "{failure}");
                machine.make_safe();
                false
            }
        }
    }
}

/// Three axes to and fro, in step with each other.
fn path() -> Vec<Vec<Metres>> {
    let period = Duration::from_millis(PERIOD_MS.into());
    let points = circle(period, 6.0, 1.0).into_iter();
    points
        .map(|it| vec![it[0] * 10.0, it[0] * 8.0 + it[2] * 2.0, it[0] * -1.0])
        .collect()
}

/// Without repetitions, where axes stand.
fn moving(mut points: Vec<Vec<i64>>) -> Vec<Vec<i64>> {
    points.dedup();
    points
}

fn check(seen: &Value, points: &[Vec<Metres>]) {
    let drives = seen["drives"].as_array().expect("a list of drives");
    assert_eq!(drives.len(), AXES.len());
    for drive in drives {
        // 0x60C2 as it was written: 40 times 10 to the -3 seconds.
        assert_eq!(drive["period"], json!([PERIOD_MS, -3]));
        // Only RPDO 1 is on, and it counts at the SYNC.
        assert_eq!(drive["rpdos"], json!({ "200": 1 }));
    }
    let syncs = drives[0]["targets"].as_array().map_or(0, Vec::len);
    let at_sync = |sync: usize| -> Option<Vec<i64>> {
        drives
            .iter()
            .map(|it| it["targets"][sync].as_i64())
            .collect()
    };
    // Each drive enters and leaves the mode by itself: what counts is when all are in it.
    let taken = moving((0..syncs).filter_map(at_sync).collect());
    let counts = |at: &Metres| (at.value() / COUNT.value()).round() as i64;
    let wanted = points
        .iter()
        .map(|point| point.iter().map(counts).collect());
    let wanted = moving(wanted.collect());
    assert!(wanted.len() > 100);
    assert_eq!(taken, wanted);
}

#[test]
fn python_canopen_drives_with_the_eds_of_a_real_one_follow_our_set_points() {
    let Some(eds) = eds() else {
        let why = format!("{EDS} is not beside the project, and TRUESTAGE_EDS names no folder");
        left_out("python-canopen's drives with the EDS of a real one", &why);
        return;
    };
    let points = path();
    for rig in crate::rigs() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let mut loaded = shipped_config(&VOLUMETRIC, folder.path(), drives_only);
        loaded.patience = Patience::with_clock(PATIENCE);
        let done = (0..TRIES).any(|_| {
            let mut talk = Talk::begin(rig, &loaded, &eds.display().to_string());
            let done = talk.follow(&points);
            let seen = talk.peer.finish();
            if done {
                check(&seen, &points);
            }
            done
        });
        if !done {
            let why = format!("{TRIES} times Python missed three SYNCs in a row ({rig:?})");
            not_run("python-canopen's drives follow our set-points", &why);
        }
    }
}
