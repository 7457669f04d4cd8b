//! A rotary table whose plate passes a photodiode at an analog input: judged by the plant's truth.

use mock_bus::fault::{Fault, FaultConfig};
use tests::{Bench, Edit, Hand, in_every_run, with_emulated_line_signal};
use truestage::for_tests::{RotaryCalibrated, with_line_signal};
use truestage::rotary::{RotaryFailure, SweepOptions};
use truestage::{CalibrateOptions, Failure};
use units::{Approach, RadiansPerSecond};

use super::rotary::{LIMIT_ARCSEC, check_tables, hand_of, residual, started};

const AXIS: &str = "c";
const LINES: u32 = 72;

/// A plate of 72 lines on a table without harmonics that these cannot see.
fn bench(seed: u64) -> Bench {
    Bench::rotary(
        seed,
        |text| with_line_signal(&text),
        with_emulated_line_signal,
    )
}

fn calibrate(bench: &mut Bench, hand: &mut Hand<'_>) -> Result<RotaryCalibrated, Failure> {
    let store = bench.store.clone();
    let options = CalibrateOptions::default();
    bench
        .machine
        .guarded(|machine| machine.rotary(AXIS)?.calibrate(&store, &options, hand))
}

fn inject(bench: &Bench, fault: Fault) {
    let fault = FaultConfig::permanent(fault);
    let injected = bench.emulated.simulation_mut().inject(fault);
    injected.expect("a fault of this machine");
}

#[test]
fn tables_read_by_a_photodiode_are_as_right_as_by_the_touch_probe_and_as_sure_as_they_say() {
    check_tables((in_every_run(3, 6), LINES), |seed| {
        let mut bench = bench(seed);
        started(&mut bench);
        let mut hand = hand_of(&bench.emulated);
        let it = calibrate(&mut bench, &mut hand)
            .unwrap_or_else(|failure| panic!("seed {seed}: {failure}"));
        (bench, it)
    });
}

#[test]
fn its_verification_is_within_tolerance_between_the_lines_and_a_smudged_line_is_no_harm() {
    let mut bench = bench(21);
    started(&mut bench);
    inject(&bench, Fault::LineSmudged { line: 17 });
    let mut hand = hand_of(&bench.emulated);
    calibrate(&mut bench, &mut hand).unwrap_or_else(|failure| panic!("{failure}"));
    let left = residual(&mut bench, LINES, 0.0);
    assert!(left <= LIMIT_ARCSEC, "{left}");
    let store = bench.store.clone();
    let verified = bench
        .machine
        .guarded(|machine| machine.rotary(AXIS)?.verify(&store, true, &mut hand));
    let it = verified.unwrap_or_else(|failure| panic!("{failure}"));
    assert!(it.is_within_tolerance());
}

#[test]
fn a_detector_that_shows_no_lines_is_told_with_what_it_shows() {
    let mut bench = bench(22);
    started(&mut bench);
    inject(&bench, Fault::DetectorDead);
    let mut hand = hand_of(&bench.emulated);
    let failure = calibrate(&mut bench, &mut hand).unwrap_err();
    let told = failure.to_string();
    assert!(
        matches!(
            failure.of_kind(),
            Some(RotaryFailure::NoSignal { lines: 72, .. })
        ),
        "{told}"
    );
    for part in ["input 2 of photo", "0.2", "never beyond 2.200 V"] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

/// However slow the turn and however seldom the module samples: no line lacks a part of its window, and no voltage goes
/// with another angle.
#[test]
fn a_slow_turn_and_a_module_that_leaves_syncs_out_see_every_line_and_a_fast_turn_is_refused() {
    for (every, deg_per_s) in [(1, 1.0), (2, 5.0)] {
        let machine = |text: String| {
            with_line_signal(&text)
                .edit("every_syncs = 1", &format!("every_syncs = {every}"))
                .edit(
                    "placement\nspeed_deg_per_s = 10.0",
                    "placement\nspeed_deg_per_s = 5.0",
                )
        };
        let mut bench = Bench::rotary(23, machine, with_emulated_line_signal);
        started(&mut bench);
        let mut sweep = |approach, deg: Option<f64>| {
            let options = SweepOptions {
                lines: LINES,
                approach,
                speed: deg.map(|it| RadiansPerSecond(it.to_radians())),
                phase: None,
            };
            bench
                .machine
                .guarded(|machine| machine.rotary(AXIS)?.sweep(&options))
        };
        for approach in [Approach::Forward, Approach::Reverse] {
            let it = sweep(approach, Some(deg_per_s)).unwrap_or_else(|failure| panic!("{failure}"));
            assert_eq!(it.read(), LINES as usize, "{approach:?}: {:?}", it.missing);
        }
        let failure = sweep(Approach::Forward, None).unwrap_err().to_string();
        assert!(failure.contains("30.000°/s is too fast"), "{failure}");
    }
}

/// What a turn came to, by positions.
struct Turned {
    missing: Vec<u32>,
    doubled: Vec<u32>,
    read: usize,
}

fn forward(bench: &mut Bench) -> Turned {
    let options = SweepOptions {
        lines: LINES,
        approach: Approach::Forward,
        speed: Some(RadiansPerSecond(10.0_f64.to_radians())),
        phase: None,
    };
    let swept = bench
        .machine
        .guarded(|machine| machine.rotary(AXIS)?.sweep(&options));
    let it = swept.unwrap_or_else(|failure| panic!("{failure}"));
    Turned {
        read: it.read(),
        missing: it.missing,
        doubled: it.doubled,
    }
}

#[test]
fn a_scratch_beside_a_line_is_told_and_the_line_is_not_taken() {
    let mut bench = bench(25);
    started(&mut bench);
    inject(&bench, Fault::LineScratched { line: 33 });
    let sweep = forward(&mut bench);
    assert_eq!((&sweep.doubled[..], sweep.missing.len()), (&[33][..], 0));
    assert_eq!(sweep.read, LINES as usize - 1);
}
