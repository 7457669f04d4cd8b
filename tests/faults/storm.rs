//! Any fault at any moment of the whole cycle: nothing panics, the cause is a possible one, the
//! stage comes to rest, what is stored stays sound.
//!
//! `FAULT_SEED=17 cargo test -p tests --test faults storm` plays one seed again;
//! `FAULT_RUNS=2000` plays that many.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::rc::Rc;
use std::time::Duration;

use drivers::device::Alarm;
use machine::records::Store;
use machine::records::{StoreError, read_journal};
use mock_bus::fault::{FaultConfig, FaultId};
use mock_bus::random::Stream;
use tests::Bench;
use truestage::CalibrateOptions;
use truestage::linear::LinearLog;
use truestage::linear::VerifyOptions;
use truestage::{Failure, Machine};
use units::{Metres, Time};
use wire::cia402::PowerState;

use crate::scene::{power_state, shortened};
use crate::witness::{Testimony, Witnessed};

/// How many runs on each change.
const RUNS: u64 = 60;
/// One in so many is also repaired, and must work again.
const RECOVERIES: u64 = 6;
/// How many controllers are killed.
const KILLS: u64 = 12;
/// The whole cycle takes about this long.
const CYCLE_S: f64 = 34.0;

/// What may be blamed for a fault.
type Causes = fn(&Failure) -> bool;

fn drive_or_bus(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Machine(
            machine::Failure::Alarm { .. }
                | machine::Failure::Device { .. }
                | machine::Failure::Overdue { .. }
                | machine::Failure::Explained { .. }
                | machine::Failure::Babbling { .. }
                | machine::Failure::Send { .. }
        )
    )
}

fn link(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Machine(
            machine::Failure::Link { .. }
                | machine::Failure::BusOff { .. }
                | machine::Failure::Send { .. }
        )
    )
}

fn sensors(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Search { .. } | Failure::Refine { .. } | Failure::ZeroUncertain { .. }
    ) || drive_or_bus(failure)
}

fn optics(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Machine(
            machine::Failure::Alarm {
                alarm: Alarm::BeamLost
                    | Alarm::BeamWeak { .. }
                    | Alarm::SamplesLost { .. }
                    | Alarm::SlewError
                    | Alarm::StreamSilent { .. }
                    | Alarm::CountRestarted
                    | Alarm::Garbage { .. },
                ..
            } | machine::Failure::Device { .. }
                | machine::Failure::Overdue { .. }
        ) | Failure::FringeJump { .. }
            | Failure::DatumSlip { .. }
            | Failure::ScaleMismatch { .. }
            | Failure::Closure { .. }
            | Failure::Fit { .. }
            | Failure::StandsOff { .. }
            | Failure::Correction { .. }
            | Failure::MadeWorse { .. }
            | Failure::NewIsWorse(_)
            | Failure::Compensation { .. }
    )
}

fn nothing(_: &Failure) -> bool {
    false
}

/// A frame whose bits are wrong may say anything that the device could say, to the search too.
fn anything_said(failure: &Failure) -> bool {
    drive_or_bus(failure)
        || sensors(failure)
        || matches!(
            failure,
            Failure::Machine(machine::Failure::SecondMaster { .. })
        )
}

fn second_master(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Machine(machine::Failure::SecondMaster { .. })
    )
}

fn link_or_optics(failure: &Failure) -> bool {
    link(failure) || optics(failure)
}

/// Every kind of fault, as a configuration file writes it, with what may be blamed for it.
const KINDS: &[(&str, Causes)] = &[
    ("kind = 'mute', node = 'drive'", drive_or_bus),
    ("kind = 'mute', node = 'hall_adc'", drive_or_bus),
    ("kind = 'mute', node = 'interferometer'", optics),
    ("kind = 'stop_heartbeat', node = 'drive'", drive_or_bus),
    ("kind = 'stop_heartbeat', node = 'hall_adc'", drive_or_bus),
    ("kind = 'stop_pdos', node = 'drive'", drive_or_bus),
    ("kind = 'stop_pdos', node = 'hall_adc'", drive_or_bus),
    ("kind = 'power_loss', node = 'drive'", drive_or_bus),
    ("kind = 'power_loss', node = 'hall_adc'", drive_or_bus),
    ("kind = 'power_loss', node = 'interferometer'", optics),
    (
        "kind = 'babble', port = 'can0', cob_id = 0x010",
        drive_or_bus,
    ),
    ("kind = 'babble', port = 'can0', cob_id = 0x7F0", nothing),
    (
        "kind = 'foreign_sync', port = 'can0', period_ms = 10.0",
        second_master,
    ),
    (
        "kind = 'duplicate_boot_up', port = 'can0', node_id = 1",
        drive_or_bus,
    ),
    (
        "kind = 'duplicate_boot_up', port = 'can0', node_id = 2",
        drive_or_bus,
    ),
    (
        "kind = 'emergency', port = 'can0', node_id = 1, code = 0x2310, register = 3",
        drive_or_bus,
    ),
    ("kind = 'error_passive', port = 'can0'", nothing),
    ("kind = 'bus_off', port = 'can0'", link),
    ("kind = 'link_down', port = 'can0'", link),
    ("kind = 'link_gone', port = 'can0'", link),
    ("kind = 'link_gone', port = 'laser'", link_or_optics),
    ("kind = 'blocked_axis'", sensors),
    ("kind = 'safe_torque_off'", sensors),
    (
        "kind = 'limit_switch', positive = true, pressed = true",
        sensors,
    ),
    (
        "kind = 'limit_switch', positive = false, pressed = true",
        sensors,
    ),
    ("kind = 'beam_blocked'", optics),
    ("kind = 'beam_weak'", optics),
    ("kind = 'fringe_jump', half_wavelengths = 2", optics),
    ("kind = 'fringe_jump', half_wavelengths = 300", optics),
    ("kind = 'vibration', amplitude_um = 20.0", optics),
    ("kind = 'frozen_environment'", optics),
    ("kind = 'impossible_environment'", optics),
    ("kind = 'inputs_swapped'", sensors),
    ("kind = 'input_rail', channel = 0", sensors),
    ("kind = 'input_rail', channel = 1", sensors),
    ("kind = 'input_open', channel = 0", sensors),
    ("kind = 'input_open', channel = 1", sensors),
    ("kind = 'input_stuck', channel = 0", sensors),
    ("kind = 'input_stuck', channel = 1", sensors),
    ("kind = 'input_inverted', channel = 0", sensors),
    ("kind = 'input_inverted', channel = 1", sensors),
    ("kind = 'garbage', port = 'laser'", optics),
    ("kind = 'split', port = 'laser'", optics),
    ("kind = 'merge', port = 'laser'", optics),
    ("kind = 'silence', port = 'laser'", optics),
    (
        "kind = 'late_answer', port = 'laser', delay_ms = 30.0",
        optics,
    ),
    ("kind = 'corrupt', port = 'can0'", anything_said),
    ("kind = 'drop', port = 'can0'", anything_said),
    ("kind = 'duplicate', port = 'can0'", drive_or_bus),
    ("kind = 'reorder', port = 'can0'", drive_or_bus),
    (
        "kind = 'delay', port = 'can0', delay_ms = 4.0",
        anything_said,
    ),
];

/// A fault at a random moment, for a random time.
fn draw(seed: u64) -> (FaultConfig, Causes) {
    let mut chance = Stream::new(seed, "storm");
    // Every kind has its turn.
    let (kind, causes) = KINDS[(seed % KINDS.len() as u64) as usize];
    let text = format!("fault = {{ {kind} }}");
    let mut config: FaultConfig = toml::from_str(&text).expect(kind);
    config.from_s = chance.between(0.0, CYCLE_S);
    if chance.chance(0.5) {
        config.duration_s = Some(10_f64.powf(chance.between(-3.0, 0.7)));
    }
    if chance.chance(0.5) {
        config.probability = 10_f64.powf(chance.between(-3.0, 0.0));
    }
    (config, causes)
}

fn cycle(machine: &mut Machine, store: &Store) -> Result<(), Failure> {
    let options = |calibration: Option<String>| VerifyOptions {
        compensated: calibration.is_some(),
        calibration,
        resume: None,
    };
    machine.start()?;
    machine.linear("x")?.zero(store)?;
    machine.linear("x")?.verify(store, &options(None))?;
    let made = machine
        .linear("x")?
        .calibrate(store, &CalibrateOptions::default())?;
    machine
        .linear("x")?
        .verify(store, &options(Some(made.id)))?;
    machine.linear("x")?.move_to(Metres::from_mm(31.4))?;
    machine.shut_down()
}

struct Storm {
    bench: Bench,
    seen: Rc<RefCell<Testimony>>,
    id: FaultId,
    ended: Time,
    result: Result<(), Failure>,
}

fn witnessed(seed: u64) -> (Bench, Rc<RefCell<Testimony>>) {
    let seen = Rc::new(RefCell::new(Testimony::default()));
    let witness = Rc::clone(&seen);
    let bench = Bench::wrapped(
        seed,
        shortened,
        |text| text,
        |inner| Box::new(Witnessed::new(inner, witness)),
    );
    (bench, seen)
}

fn play(seed: u64, fault: &FaultConfig) -> Storm {
    let (mut bench, seen) = witnessed(seed);
    let id = bench.emulated.simulation_mut().inject(fault.clone());
    let id = id.expect("it names what is there");
    let store = bench.store.clone();
    let mut ended = Time::ZERO;
    let result = bench.machine.guarded(|machine| {
        let result = cycle(machine, &store);
        ended = machine.now();
        result
    });
    Storm {
        bench,
        seen,
        id,
        ended,
        result,
    }
}

/// What a drive said, where more is told of it because the axis had no zero yet.
fn said_by_device(failure: &Failure) -> &Failure {
    match failure {
        Failure::BeforeZero { source, .. } => source,
        failure => failure,
    }
}

/// What must hold whatever happened.
fn judge(storm: &Storm, fault: &FaultConfig, causes: Causes) {
    if let Err(failure) = &storm.result {
        let due = Time::from_seconds(fault.from_s);
        assert!(storm.ended >= due, "failed before the fault: {failure}");
        assert!(
            causes(said_by_device(failure)),
            "blamed: {failure}\n{failure:?}"
        );
        let simulation = storm.bench.emulated.simulation();
        let struck = simulation.fault_deliveries(storm.id);
        assert!(struck > 0, "failed without the fault: {failure}");
    }
    come_to_rest(&storm.bench);
    // Whatever went wrong, no later than the drive's own watch and a stop allow.
    let bound = storm.ended + Duration::from_millis(800);
    if let Some(moved) = storm.seen.borrow().moved_last(storm.ended) {
        assert!(
            moved <= bound,
            "moved until {moved}, failed at {}",
            storm.ended
        );
    }
    records_are_sound(&storm.bench);
}

fn records_are_sound(bench: &Bench) {
    let store = &bench.store;
    if let Some(id) = store.active("x").expect("the pointer is whole").current {
        let record = store.glance(&id).expect("the active calibration is whole");
        match record.head.belongs_to(
            &id,
            &bench.machine.this_machine("x"),
            bench.machine.config_hash(),
        ) {
            // A drive that is gone has told nobody who it is.
            Ok(())
            | Err(StoreError::Foreign {
                what: "the drive", ..
            }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    let runs = std::fs::read_dir(store.runs()).into_iter().flatten();
    for entry in runs {
        let path = entry.expect("the folder can be read").path();
        let read = read_journal::<LinearLog>(&path).expect("every journal is whole");
        assert!(
            read.log
                .points
                .iter()
                .all(|point| point.measured_m.is_finite())
        );
    }
}

/// Once the cause is gone, the machine works as before; a drive's fault is acknowledged.
fn recovers(storm: &mut Storm) {
    let mut simulation = storm.bench.emulated.simulation_mut();
    simulation.end_fault(storm.id);
    let later = simulation.now() + Duration::from_secs(1);
    simulation.advance(later);
    drop(simulation);
    take_up_work(&mut storm.bench.machine, &storm.bench.store)
        .unwrap_or_else(|failure| panic!("does not recover: {failure}\n{failure:?}"));
}

fn take_up_work(machine: &mut Machine, store: &Store) -> Result<(), Failure> {
    machine.guarded(|machine| {
        machine.start()?;
        machine.reset_fault("x")?;
        machine.linear("x")?.zero(store)?;
        machine.linear("x")?.move_to(Metres::from_mm(5.0))?;
        machine.shut_down()
    })
}

/// The stage stands one second after the end and then for ever, and nothing pushes it.
fn come_to_rest(bench: &Bench) {
    let mut simulation = bench.emulated.simulation_mut();
    let begin = simulation.now();
    let mut position_at = |s: f64| {
        simulation.advance(begin + Duration::from_secs_f64(s));
        simulation.truth().scale_position()
    };
    let stopped = position_at(1.0);
    let crept = (position_at(3.0) - stopped).abs();
    assert!(crept.um() < 0.5, "crept by {} µm after the end", crept.um());
    drop(simulation);
    let state = power_state(&bench.emulated);
    assert_ne!(
        state,
        PowerState::OperationEnabled,
        "the drive was left enabled"
    );
}

fn run(seed: u64) -> Result<String, String> {
    let (fault, causes) = draw(seed);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let mut storm = play(seed, &fault);
        judge(&storm, &fault, causes);
        if seed.is_multiple_of(RECOVERIES) {
            recovers(&mut storm);
        }
        match &storm.result {
            Ok(()) => "survived".to_owned(),
            Err(failure) => failure.to_string(),
        }
    }));
    outcome.map_err(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
            .unwrap_or_default();
        format!(
            "{text}\n  with {fault:?}\n  again: FAULT_SEED={seed} cargo test -p tests --test \
             faults storm"
        )
    })
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// `share` of 2: two tests that run beside each other.
fn storm(share: u64) {
    let seeds: Vec<u64> = match number("FAULT_SEED") {
        Some(seed) => vec![seed],
        None => (0..number("FAULT_RUNS").unwrap_or(RUNS)).collect(),
    };
    let mine = seeds.into_iter().filter(|seed| seed % 2 == share);
    let results: Vec<_> = mine.map(run).collect();
    let survived = results
        .iter()
        .filter(|it| it.as_deref() == Ok("survived"))
        .count();
    println!("{} runs, {survived} survived", results.len());
    let failures: Vec<_> = results.into_iter().filter_map(Result::err).collect();
    assert!(
        failures.is_empty(),
        "{} failed:\n{}",
        failures.len(),
        failures.join("\n\n")
    );
}

#[test]
fn any_fault_at_any_moment_leaves_a_safe_machine_and_sound_records() {
    storm(0);
}

#[test]
fn any_other_fault_does_so_too() {
    storm(1);
}

/// Kills the controller at a random moment of the cycle; another one takes over.
fn kill(seed: u64) {
    let (mut bench, seen) = witnessed(seed);
    let at = Time::from_seconds(Stream::new(seed, "kill").between(0.1, CYCLE_S));
    // As SIGKILL does: nothing is tidied up on the way out.
    seen.borrow_mut()
        .plan(at, Box::new(|_| resume_unwind(Box::new("killed"))));
    let store = bench.store.clone();
    let machine = &mut bench.machine;
    let ended = catch_unwind(AssertUnwindSafe(|| cycle(machine, &store)));
    if let Ok(result) = ended {
        result.unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        return;
    }
    come_to_rest(&bench);
    records_are_sound(&bench);
    let mut successor = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
    take_up_work(&mut successor, &store).unwrap_or_else(|failure| {
        panic!("seed {seed}, killed at {at}: the next one fails: {failure}\n{failure:?}")
    });
}

#[test]
fn a_controller_killed_at_any_moment_leaves_a_stage_that_stops_and_another_can_use() {
    match number("FAULT_SEED") {
        Some(seed) => kill(seed),
        None => (0..KILLS).for_each(kill),
    }
}
