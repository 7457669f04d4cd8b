//! The zero of the linear stage after power cycles with drifted Hall sensors.
//!
//! Judged by the plant's truth: where, on the scale, the drive's coordinate zero has come to
//! lie. The stage's own repeatability at a stop has no part in it.

use mock_bus::plant::DriftLimits;
use tests::{Bench, Rig, Setup, Stand};
use truestage::emulated::HallDrift;
use units::{Metres, Volts};

const CYCLES: u64 = 50;

/// One zero after another, each after a power cycle with fresh drift.
struct Zeros {
    /// Where the zero lies on the scale.
    refined: Vec<f64>,
    /// What the controller said of its uncertainty.
    stated: Vec<f64>,
    /// Where a single fixed threshold would have put it.
    single_threshold: Vec<f64>,
}

fn zeros(seed: u64, limits: DriftLimits) -> Zeros {
    let mut bench = Bench::new(seed);
    let store = bench.store.clone();
    let mut zeros = Zeros {
        refined: vec![],
        stated: vec![],
        single_threshold: vec![],
    };
    let mut threshold = None;
    for number in 0..=CYCLES {
        if number > 0 {
            bench.machine.shut_down().unwrap();
            bench.power_cycle(HallDrift::random(seed, number, limits));
            let back = bench.machine.now() + core::time::Duration::from_secs(1);
            bench.machine.run_until(back).unwrap();
        }
        let zeroed = bench
            .machine
            .guarded(|machine| {
                machine.start()?;
                machine.linear("x")?.zero(&store)
            })
            .unwrap_or_else(|failure| panic!("power cycle {number}: {failure}"));
        let voltage = *threshold.get_or_insert(zeroed.estimate.mid_voltage);
        let reading = bench.machine.reading("x").unwrap().unwrap();
        let scale = bench.emulated.simulation().truth().scale_position();
        let zero = scale - reading.position;
        zeros.refined.push(zero.value());
        zeros
            .stated
            .push(zeroed.estimate.standard_uncertainty.value());
        let single = zeroed.single_threshold(voltage);
        zeros
            .single_threshold
            .extend(single.map(|at| (at - zeroed.estimate.origin + zero).value()));
    }
    zeros
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn standard_deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values
        .iter()
        .map(|value| (value - mean) * (value - mean))
        .sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

const DRIFT: DriftLimits = DriftLimits {
    offset: Volts(0.1),
    gain: 0.03,
    gain_per_m: 0.0,
};

#[test]
fn fifty_power_cycles_with_drifted_sensors_repeat_the_zero_within_60_nm() {
    let zeros = zeros(11, DRIFT);
    let repeatability = standard_deviation(&zeros.refined);
    let single = standard_deviation(&zeros.single_threshold);
    println!(
        "zero: 1 sigma {:.1} nm, mean {:+.1} nm, stated {:.1} nm; single threshold 1 sigma {:.1} um ({} of {} found)",
        repeatability * 1e9,
        mean(&zeros.refined) * 1e9,
        mean(&zeros.stated) * 1e9,
        single * 1e6,
        zeros.single_threshold.len(),
        zeros.refined.len(),
    );
    assert!(repeatability <= 60e-9, "1 sigma {} nm", repeatability * 1e9);
    assert!(
        single >= 10e-6,
        "a single threshold drifts by only {} um?",
        single * 1e6
    );
}

#[test]
fn a_change_of_parallelism_moves_the_zero_by_less_than_300_nm() {
    let zeros = zeros(
        12,
        DriftLimits {
            gain_per_m: 0.1,
            ..DRIFT
        },
    );
    let centre = mean(&zeros.refined);
    let worst = zeros
        .refined
        .iter()
        .fold(0.0_f64, |worst, zero| worst.max((zero - centre).abs()));
    println!("zero with tilt: worst {:.1} nm from the mean", worst * 1e9);
    assert!(worst <= 300e-9, "worst {} nm", worst * 1e9);
}

#[test]
fn the_stated_uncertainty_of_the_zero_is_true() {
    let zeros = zeros(13, DRIFT);
    let seen = standard_deviation(&zeros.refined);
    let stated = mean(&zeros.stated);
    // 50 zeros know their own scatter to 10 %; the encoder's 10 nm come on top of the noise.
    assert!(
        (0.6..1.6).contains(&(seen / stated)),
        "seen {seen:e}, stated {stated:e}"
    );
}

#[test]
fn the_origin_is_where_the_undrifted_curves_have_their_centre() {
    let zeros = zeros(
        14,
        DriftLimits {
            offset: Volts(0.0),
            gain: 0.0,
            gain_per_m: 0.0,
        },
    );
    let centre = Metres(mean(&zeros.refined));
    assert!(centre.abs() <= Metres(50e-9), "{} nm", centre.nm());
}

#[test]
fn a_zero_is_found_whatever_the_sync_period() {
    for period in ["2.0", "10.0", "20.0"] {
        for seed in 1..=3 {
            let setup = Setup::new(seed).machine(
                "sync_period_ms = 5.0",
                &format!("sync_period_ms = {period}"),
            );
            let mut stand = Stand::new(Rig::InProcess, &setup);
            let store = stand.store.clone();
            let zeroed = stand.machine.guarded(|machine| {
                machine.start()?;
                machine.linear("x")?.zero(&store)
            });
            zeroed.unwrap_or_else(|failure| panic!("{period} ms, seed {seed}: {failure}"));
        }
    }
}
