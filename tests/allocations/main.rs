//! The cyclic loop asks for no memory: neither while it follows a path, nor with the correction of
//! three axes computed in it, nor when it plans a stop.
//!
//! The emulated machine lives in the same thread and asks for a lot: what it does, and what the
//! host of the test does, is not counted.

use std::alloc::System;

use machine::engine::{Cause, Correction, Engine, NoCorrection};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use tests::apart::{Apart, used_by_the_loop};
use tests::stream::{Writer, circle, diagonal, nothing_known};
use tests::{Rig, Setup, Stand};
use truestage::config::MachineConfig;
use truestage::for_tests::FirstPartCorrection;
use truestage::volumetric::{VolumetricCorrection, VolumetricFailure};

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn asked_for_memory() -> u64 {
    let stats = COUNTED.stats();
    (stats.allocations + stats.reallocations) as u64
}

/// In the middle of the path; queues have grown to what they need by then.
const FROM: u64 = 200;
const STOP: u64 = 1_200;

/// What corrects three axes.
#[derive(Clone, Copy)]
enum Part {
    Any,
    /// Their displacements are recorded.
    First,
}

fn of_a_volume(config: &MachineConfig, part: Part) -> Box<dyn Correction> {
    let known = nothing_known(config);
    let bad = |it: VolumetricFailure| -> ! { panic!("{it}") };
    match part {
        Part::Any => {
            Box::new(VolumetricCorrection::new(config, known).unwrap_or_else(|it| bad(it)))
        }
        Part::First => {
            let made = FirstPartCorrection::new(config, known);
            let (correction, recorder) = made.unwrap_or_else(|it| bad(it));
            recorder.listen();
            Box::new(correction)
        }
    }
}

#[track_caller]
fn check(setup: &Setup, axes: &[&str], part: Part) {
    let mut inside = None;
    let mut stand = Stand::wrapped(Rig::InProcess, setup, |inner| {
        let (apart, cell) = Apart::new(inner, asked_for_memory);
        inside = Some(cell);
        Box::new(apart)
    });
    let inside = inside.expect("it was wrapped");
    let store = stand.store.clone();
    let config = stand.emulator.loaded.config.clone();
    let machine = &mut stand.machine;
    machine.start().unwrap_or_else(|it| panic!("{it}"));
    let zeroed = if config.volumetric.is_some() {
        machine.volumetric().unwrap().zero()
    } else {
        machine.platform().unwrap().zero(&store).map(drop)
    };
    zeroed.unwrap_or_else(|it| panic!("{it}"));
    let correction: Box<dyn Correction> = match &config.volumetric {
        Some(_) => of_a_volume(&config, part),
        None => Box::new(NoCorrection),
    };
    let (mut engine, mut desk) =
        Engine::new(machine, axes, correction).unwrap_or_else(|it| panic!("{it}"));
    desk.correct(true).expect("it listens");
    let points = match config.volumetric {
        Some(_) => diagonal(engine.period(), 6.0),
        None => circle(engine.period(), 6.0, 4.0),
    };
    let writer = Writer::new(desk, points);
    let meter = (asked_for_memory as fn() -> u64, &*inside);
    let used = used_by_the_loop(machine, &mut engine, writer, meter, (FROM, STOP));
    let (cause, count, periods) = used.unwrap_or_else(|it| panic!("{it}"));
    assert_eq!(cause, Cause::Asked);
    assert!(periods > STOP - FROM, "the stop took no time");
    assert!(inside.get() > 0, "nothing is counted");
    assert_eq!(
        count, 0,
        "the loop asked for memory {count} times in {periods} periods"
    );
}

/// One after the other: what is counted is the whole process's.
#[test]
fn a_loop_along_a_path_and_to_a_stop_asks_for_no_memory() {
    check(
        &Setup::four_cyclic_axes(1),
        &["u", "v", "w", "r"],
        Part::Any,
    );
    for part in [Part::Any, Part::First] {
        check(&Setup::volumetric(1), &["x", "y", "z"], part);
    }
}
