//! The fault classes in each phase of a stage's life: which of them are named by their cause.
//!
//! The table is written to `target/fault_causes.txt`. `FAULT_MOMENTS=20 cargo test -p tests --test faults table` tries
//! twenty moments of each phase in place of one.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::thread;

use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::node::canopen_server::Manners;
use mock_bus::node::cia402_drive::DriveQuirks;
use truestage::Failure;

use crate::scene::{Phase, Played, Scene, with_drive};

/// The share of the cases with a wanted cause that is named by it, at least.
const NAMED_MIN: f64 = 0.95;
/// From one moment of a phase to the next, when several are tried: no multiple of the SYNC period.
const MOMENT_STEP_MS: u64 = 37;

/// A phase of the fault classes' document, the scene that plays it and when the fault comes.
struct Stretch {
    name: &'static str,
    phase: Phase,
    after_ms: u64,
}

const fn stretch(name: &'static str, phase: Phase, after_ms: u64) -> Stretch {
    Stretch {
        name,
        phase,
        after_ms,
    }
}

const STRETCHES: [Stretch; 8] = [
    stretch("scan", Phase::Scan, 0),
    stretch("init", Phase::Start, 0),
    stretch("home", Phase::Zero, 200),
    stretch("calibrate", Phase::Calibrate, 2_500),
    stretch("zero", Phase::Zero, 3_000),
    stretch("compensate", Phase::Move, 100),
    stretch("path", Phase::Follow, 1_700),
    stretch("verify", Phase::Verify, 2_500),
];

/// How a scene gets its fault.
type Injection = fn(Scene) -> Scene;

/// A kind of fault: its class, the phases in which it can occur, and the words of its cause.
struct Case {
    class: u8,
    name: &'static str,
    inject: Injection,
    phases: &'static [&'static str],
    /// The words of any of these are the cause, [`NOTHING`] where it does no harm.
    causes: &'static [&'static [&'static str]],
}

const ENABLED: &[&str] = &["home", "calibrate", "zero", "compensate", "path", "verify"];
const MEASURED: &[&str] = &["calibrate", "verify"];
const ON_BUS: &[&str] = &[
    "scan",
    "init",
    "home",
    "calibrate",
    "zero",
    "compensate",
    "path",
    "verify",
];
/// No failure.
const NOTHING: &[&str] = &["nothing"];
const CAN: &str = "can0";
const DRIVE: &str = "drive";
const MODULE: &str = "hall_adc";

fn can() -> String {
    CAN.into()
}

fn drive() -> String {
    DRIVE.into()
}

fn quirk(scene: Scene, set: fn(&mut DriveQuirks)) -> Scene {
    scene.deed(
        move |emulated| with_drive(emulated, |drive| set(drive.quirks_mut())),
        |_| true,
    )
}

fn manners(scene: Scene, manners: Manners) -> Scene {
    scene.deed(
        move |emulated| with_drive(emulated, |drive| *drive.manners_mut() = manners),
        |_| true,
    )
}

fn switch(positive: bool, pressed: bool) -> Fault {
    Fault::LimitSwitch {
        axis: 0,
        positive,
        pressed,
    }
}

macro_rules! case {
    ($class:literal, $name:literal, $inject:expr, $phases:expr, $causes:expr) => {
        Case {
            class: $class,
            name: $name,
            inject: $inject,
            phases: $phases,
            causes: $causes,
        }
    };
}

#[rustfmt::skip]
const CASES: &[Case] = &[
    case!(1, "TPDO 1 lost for good", |s| s.fault(Fault::Drop { port: can(), cob_id: Some(0x181) }), ENABLED, &[&["TPDO 1 of node 1 stays away"]]),
    case!(1, "three TPDO 1 lost", |s| s.inject(FaultConfig::times(Fault::Drop { port: can(), cob_id: Some(0x181) }, 3)), ENABLED, &[&["was not heard for", "frames were lost"]]),
    case!(1, "every frame lost", |s| s.fault(Fault::Drop { port: can(), cob_id: None }), ENABLED, &[&["no data from any device of can0"]]),
    case!(2, "every frame twice", |s| s.fault(Fault::Duplicate { port: can(), cob_id: Some(0x181) }), ENABLED, &[NOTHING]),
    case!(3, "frames change places", |s| s.fault(Fault::Reorder { port: can(), cob_id: Some(0x281) }), ENABLED, &[NOTHING]),
    case!(4, "payload corrupted", |s| s.fault(Fault::Corrupt { port: can(), cob_id: Some(0x181) }), ENABLED, &[&["position jumped"], &["unknown state"]]),
    case!(5, "bus-off", |s| s.fault(Fault::BusOff { port: can() }), ON_BUS, &[&["can0: bus-off"]]),
    case!(6, "interface down", |s| s.fault(Fault::LinkDown { port: can() }), ON_BUS, &[&["can0", "ENETDOWN"]]),
    case!(6, "adapter unplugged", |s| s.fault(Fault::LinkGone { port: can() }), ON_BUS, &[&["can0", "ENODEV"]]),
    case!(7, "transmit queue full", |s| s.full(0x201), ENABLED, &[&["transmit queue full", "txqueuelen"]]),
    case!(8, "babbling node", |s| s.fault(Fault::Babble { port: can(), cob_id: 0x010 }), ENABLED, &[&["can0: identifier 0x010 takes"]]),
    case!(8, "babbling as the drive", |s| s.fault(Fault::Babble { port: can(), cob_id: 0x181 }), ENABLED, &[&["can0: identifier 0x181 takes"]]),
    case!(9, "second master", |s| s.fault(Fault::ForeignSync { port: can(), period_ms: 7.0 }), &["init", "home", "calibrate", "zero", "compensate", "path", "verify"], &[&["can0", "another master"]]),
    case!(10, "two devices of one number", |s| s.inject(FaultConfig::times(Fault::DuplicateBootUp { port: can(), node_id: 1 }, 1)), ENABLED, &[&["node 1: a second device with this node number"]]),
    case!(12, "drive resets", |s| s.inject(FaultConfig::lasting(Fault::PowerLoss { node: drive() }, std::time::Duration::from_millis(30))), ENABLED, &[&["node 1", "restarted"]]),
    case!(12, "drive without power", |s| s.fault(Fault::PowerLoss { node: drive() }), ENABLED, &[&["x: no data from node 1 since", "power or cable"]]),
    case!(12, "drive mute", |s| s.fault(Fault::Mute { node: drive() }), ENABLED, &[&["x: no data from node 1 since", "power or cable"]]),
    case!(12, "module without power", |s| s.fault(Fault::PowerLoss { node: MODULE.into() }), &["zero"], &[&["hall: no data from node 2 since", "power or cable"]]),
    case!(13, "heartbeat stops", |s| s.fault(Fault::StopHeartbeat { node: drive() }), ENABLED, &[&["node 1 sends process data, but no heartbeat since"]]),
    case!(14, "process data stop", |s| s.fault(Fault::StopPdos { node: drive() }), ENABLED, &[&["node 1 lives, but sends no process data"]]),
    case!(14, "process data of a module stop", |s| s.fault(Fault::StopPdos { node: MODULE.into() }), &["zero"], &[&["node 2 lives, but sends no process data"]]),
    case!(15, "emergency", |s| s.inject(FaultConfig::times(Fault::Emergency { port: can(), node_id: 1, code: 0x4210, register: 9 }, 1)), ENABLED, &[&["0x4210", "temperature"]]),
    case!(16, "statusword stuck", |s| quirk(s, |quirks| quirks.statusword_stuck = true), &["compensate", "calibrate", "verify"], &[&["last saw"], NOTHING]),
    case!(16, "enabling refused", |s| quirk(s, |quirks| quirks.enable_refused = true).after_ms(0), &["home"], &[&["waited", "operation enabled", "switched on"]]),
    case!(17, "no answer to SDO", |s| manners(s, Manners { sdo_ignored_requests: 100_000, ..Manners::default() }), &["init"], &[&["node 1 answers nothing"]]),
    case!(17, "SDO busy", |s| manners(s, Manners { sdo_busy: 1_000, ..Manners::default() }), &["init"], &[&["0x08000022"]]),
    case!(18, "stray SDO answers", |s| manners(s, Manners { sdo_stray_replies: 1_000, ..Manners::default() }), &["init", "home"], &[NOTHING]),
    case!(19, "another drive", |s| s.machine("product_code = 0x00420001", "product_code = 0x00420009"), &["init"], &[&["product", "fit the right device"]]),
    case!(20, "mapping lies", |s| manners(s, Manners { mapping_lies: true, ..Manners::default() }), &["init"], &[&["comparing process data"]]),
    case!(21, "parameters are not taken", |s| manners(s, Manners { mapping_ignored_writes: 100, ..Manners::default() }), &["init"], &[&["1A00"]]),
    case!(22, "axis blocked", |s| s.fault(Fault::BlockedAxis { axis: 0 }), ENABLED, &[&["following error"], &["is it blocked"]]),
    case!(22, "positive limit switch sticks", |s| s.fault(switch(true, true)), ENABLED, &[&["limit switch"], &["positive limit"]]),
    case!(22, "negative limit switch sticks", |s| s.fault(switch(false, true)), ENABLED, &[&["limit switch"], NOTHING]),
    case!(22, "negative limit switch sticks from the start", |s| s.fault(switch(false, true)).after_ms(0), &["home"], &[&["limit switch", "stuck"]]),
    case!(22, "negative limit switch dead", |s| s.fault(switch(false, false)).after_ms(0), &["home"], &[&["limit switch", "dead"]]),
    case!(23, "safe torque off", |s| s.fault(Fault::SafeTorqueOff), ENABLED, &[&["torque"]]),
    case!(24, "wrong direction", |s| quirk(s, |quirks| quirks.direction_reversed = true).after_ms(0), &["home"], &[&["wrong direction"]]),
    case!(25, "beam blocked", |s| s.fault(Fault::BeamBlocked), MEASURED, &[&["laser", "beam lost"]]),
    case!(25, "beam weak", |s| s.fault(Fault::BeamWeak), MEASURED, &[&["laser", "beam too weak"]]),
    case!(26, "fringes jump", |s| s.fault(Fault::FringeJump { half_wavelengths: 30 }), MEASURED, &[&["fringe"], &["wavelength"]]),
    case!(27, "environment frozen", |s| s.fault(Fault::FrozenEnvironment), MEASURED, &[&["laser", "environment"], NOTHING]),
    case!(27, "environment impossible", |s| s.fault(Fault::ImpossibleEnvironment), MEASURED, &[&["temperature"], &["pressure"], &["humidity"]]),
    case!(28, "peak input at its rail", |s| s.fault(Fault::InputRail { channel: 0 }), &["home", "zero"], &[&["peak sensor", "saturated"]]),
    case!(28, "slope input at its rail", |s| s.fault(Fault::InputRail { channel: 1 }), &["home", "zero"], &[&["slope sensor", "saturated"]]),
    case!(28, "peak input open", |s| s.fault(Fault::InputOpen { channel: 0 }), &["home", "zero"], &[&["peak sensor", "open"]]),
    case!(28, "slope input open", |s| s.fault(Fault::InputOpen { channel: 1 }), &["home", "zero"], &[&["slope sensor", "open"]]),
    case!(28, "peak input stuck", |s| s.fault(Fault::InputStuck { channel: 0 }), &["home", "zero"], &[&["peak sensor", "stuck"], &["peak sensor stays"]]),
    case!(28, "slope input stuck", |s| s.fault(Fault::InputStuck { channel: 1 }), &["home", "zero"], &[&["slope sensor", "stuck"], &["slope sensor stays"]]),
    case!(29, "inputs exchanged", |s| s.fault(Fault::InputsSwapped), &["home", "zero"], &[&["swapped"]]),
    case!(29, "peak input inverted", |s| s.fault(Fault::InputInverted { channel: 0 }), &["home", "zero"], &[&["peak sensor", "inverted"]]),
    case!(29, "slope input inverted", |s| s.fault(Fault::InputInverted { channel: 1 }), &["home", "zero"], &[&["slope sensor", "inverted"]]),
    case!(32, "process data frozen", |s| s.fault(Fault::StaleData { node: drive() }), ENABLED, &[&["node 1 repeats the same process data"]]),
    case!(32, "module's data frozen", |s| s.fault(Fault::StaleData { node: MODULE.into() }), &["home", "zero"], &[&["node 2", "frozen"], &["stuck"]]),
    case!(33, "vibration", |s| s.fault(Fault::Vibration { amplitude_um: 20.0 }), &["calibrate"], &[&["vibrat"]]),
    case!(35, "garbage on the line", |s| s.fault(Fault::Garbage { port: "laser".into() }), MEASURED, &[&["baud rate"], &["laser"], NOTHING]),
    case!(37, "instrument's adapter unplugged", |s| s.fault(Fault::LinkGone { port: "laser".into() }), MEASURED, &[&["laser", "ENODEV"]]),
    case!(38, "instrument silent", |s| s.fault(Fault::Silence { port: "laser".into() }), MEASURED, &[&["laser", "check its cable and power"], &["interferometer: no sample"]]),
    case!(40, "program held up", |s| s.held_up(std::time::Duration::from_millis(300), |_, _| {}), ENABLED, &[&["kept from its buses"], &["held up"]]),
];

/// Where another cause is named, and why that is so.
const OPEN: &[(&str, &str)] = &[
    // A position that is off by less than a fast axis travels in a period is believed, and its reading compared.
    ("payload corrupted", "calibrate"),
    ("payload corrupted", "verify"),
];

/// How a case was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Told {
    /// By its cause, or rightly not at all.
    Right,
    /// By what it did, without a cause.
    Symptom,
    /// By another cause, or not at all.
    Misnamed,
}

struct Cell {
    case: usize,
    stretch: usize,
    told: Told,
    text: String,
}

fn judge(case: &Case, played: &Played) -> (Told, String) {
    let result = &played.result;
    let text = match result {
        Ok(()) => format!("nothing; warnings: {:?}", played.warnings()),
        Err(failure) => failure.to_string(),
    };
    let is_cause = |words: &&[&str]| words.iter().all(|word| text.contains(word));
    let is_right = case.causes.iter().any(is_cause);
    let is_symptom = matches!(
        result,
        Err(Failure::Machine(
            machine::Failure::Overdue { .. }
                | machine::Failure::Device { .. }
                | machine::Failure::Alarm { .. }
                | machine::Failure::Engine(_)
        ))
    );
    let is_symptom = is_symptom || text.ends_with("the axis does not move");
    let told = match (is_right, is_symptom) {
        (true, _) => Told::Right,
        (false, true) => Told::Symptom,
        (false, false) => Told::Misnamed,
    };
    (told, text)
}

fn play(at: usize, of: usize, moment: u64) -> Cell {
    let (case, stretch) = (&CASES[at], &STRETCHES[of]);
    let scene = Scene::during(stretch.phase).after_ms(stretch.after_ms + moment * MOMENT_STEP_MS);
    let played = (case.inject)(scene).play_on();
    let (told, text) = judge(case, &played);
    Cell {
        case: at,
        stretch: of,
        told,
        text,
    }
}

fn moments() -> u64 {
    let moments = std::env::var("FAULT_MOMENTS").ok();
    moments.map_or(1, |count| count.parse().expect("a number of moments"))
}

/// Every case in every phase in which it can occur, on two threads.
fn cells() -> Vec<Cell> {
    let mut wanted = Vec::new();
    for (at, case) in CASES.iter().enumerate() {
        for (of, stretch) in STRETCHES.iter().enumerate() {
            if case.phases.contains(&stretch.name) {
                wanted.extend((0..moments()).map(|moment| (at, of, moment)));
            }
        }
    }
    let half = |odd: usize| {
        let wanted = wanted.iter().skip(odd).step_by(2);
        wanted
            .map(|(at, of, moment)| play(*at, *of, *moment))
            .collect::<Vec<Cell>>()
    };
    thread::scope(|scope| {
        let others = scope.spawn(|| half(1));
        let mut cells = half(0);
        cells.extend(others.join().expect("the other half was played"));
        cells
    })
}

fn rendered(cells: &[Cell]) -> String {
    let mut text = String::from("class\tfault\tphase\ttold\ttext\n");
    for cell in cells {
        let (case, stretch) = (&CASES[cell.case], &STRETCHES[cell.stretch]);
        let told = match cell.told {
            Told::Right => "right",
            Told::Symptom => "symptom",
            Told::Misnamed => "MISNAMED",
        };
        let (class, name, phase) = (case.class, case.name, stretch.name);
        let _ = writeln!(text, "{class}\t{name}\t{phase}\t{told}\t{}", cell.text);
    }
    text
}

#[test]
fn faults_are_named_by_their_cause_in_every_phase() {
    let mut cells = cells();
    cells.sort_by_key(|cell| (cell.case, cell.stretch));
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/fault_causes.txt");
    std::fs::write(&path, rendered(&cells)).expect("the folder of the build can be written");
    let count = |told: Told| cells.iter().filter(|cell| cell.told == told).count();
    let (right, symptom, misnamed) = (
        count(Told::Right),
        count(Told::Symptom),
        count(Told::Misnamed),
    );
    println!(
        "{}: {right} right, {symptom} by their symptom, {misnamed} misnamed",
        path.display()
    );
    let is_open =
        |cell: &&Cell| OPEN.contains(&(CASES[cell.case].name, STRETCHES[cell.stretch].name));
    let wrong = cells.iter().filter(|cell| cell.told == Told::Misnamed);
    let texts: Vec<&str> = wrong
        .filter(|cell| !is_open(cell))
        .map(|cell| &*cell.text)
        .collect();
    assert!(texts.is_empty(), "{}: {texts:#?}", path.display());
    assert!(
        right as f64 >= NAMED_MIN * cells.len() as f64,
        "{right} of {}",
        cells.len()
    );
}
