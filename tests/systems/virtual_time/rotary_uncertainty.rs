//! How often a table's true error lies within the uncertainty that its calibration states, on emulated tables of all
//! sorts: the errors of table and plate, how well the detector sees a line and how far the bearing strays is drawn.
//!
//! `SEEDS=1..200 cargo test -p tests --test systems coverage_of_turned_tables -- --ignored --nocapture` counts over a
//! range and prints it; `TELL=1` before it prints each table.

use core::f64::consts::TAU;

use tests::{Bench, Coverage, Edit, judged_of_each, random, seeds};
use truestage::{CalibrateOptions, Failure};
use units::Radians;

use super::rotary::{centred, hand_of, true_error};

const AXIS: &str = "c";
/// As in the shipped configuration, what a detector's noise lets one expect of a reading, and of a placement that is read
/// again at its end.
const NOISE_SHARE: f64 = 1.2;
const CLOSURE_SHARE: f64 = 2.0;

/// What is drawn of a table, its plate and its detector.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    table_arcsec: f64,
    plate_arcsec: f64,
    noise_arcsec: f64,
    bearing_arcsec: f64,
}

impl Drawn {
    fn new(seed: u64) -> Self {
        let mut state = seed ^ 0x7AB1_E000;
        let mut over = |low: f64, high: f64| low * (high / low).powf(random(&mut state));
        let noise_arcsec = over(0.01, 0.5);
        Self {
            table_arcsec: over(0.5, 20.0),
            plate_arcsec: over(1.0, 40.0),
            noise_arcsec,
            // What an emulated bearing does is the same in each placement, and so looks like the table's own error:
            // where it is no small part of the noise, no calibration can know it.
            bearing_arcsec: noise_arcsec * over(0.02, 0.2),
        }
    }

    fn bench(&self, seed: u64) -> Bench {
        let key = |key: &str, value: f64| format!("{key} = {value}");
        let emulated = |text: String| {
            text.edit_first(
                "error_peak_arcsec = 10.0",
                &key("error_peak_arcsec", self.table_arcsec),
            )
            .edit_first(
                "error_peak_arcsec = 30.0",
                &key("error_peak_arcsec", self.plate_arcsec),
            )
            .edit_first(
                "[plant.table.detector]\nnoise_arcsec = 0.05",
                &key("[plant.table.detector]\nnoise_arcsec", self.noise_arcsec),
            )
            .edit_first(
                "asynchronous_arcsec = 0.01",
                &key("asynchronous_arcsec", self.bearing_arcsec),
            )
        };
        let machine = |text: String| {
            let noise = key("reading_noise_arcsec", self.noise_arcsec * NOISE_SHARE);
            let closure = key("closure_limit_arcsec", self.noise_arcsec * CLOSURE_SHARE);
            text.edit_first("reading_noise_arcsec = 0.06", &noise)
                .edit_first("closure_limit_arcsec = 0.1", &closure)
        };
        Bench::rotary(seed, machine, emulated)
    }
}

/// (stated - true)/u of the table's error at each line, but for the zero of the scale.
fn judged(seed: u64) -> Result<Vec<f64>, Failure> {
    let drawn = Drawn::new(seed);
    let mut bench = drawn.bench(seed);
    let store = bench.store.clone();
    let mut hand = hand_of(&bench.emulated);
    let calibrated = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.rotary(AXIS)?.zero()?;
        let options = CalibrateOptions::default();
        machine.rotary(AXIS)?.calibrate(&store, &options, &mut hand)
    })?;
    let solution = &calibrated.solution;
    let stated = solution.standard_uncertainty();
    let stated = stated.expect("there are residuals");
    let lines = solution.table_error.len();
    let place = |at: usize| Radians(TAU * at as f64 / lines as f64);
    let errors = solution.table_error.iter().enumerate();
    let off = centred(errors.map(|(at, it)| it.arcsec() - true_error(&bench, place(at))));
    let by_stated: Vec<f64> = off
        .iter()
        .zip(&stated)
        .map(|(a, u)| a / u.arcsec())
        .collect();
    if std::env::var("TELL").is_ok() {
        println!("{seed}: {drawn:?}: {}", Coverage::new(by_stated.clone()));
    }
    Ok(by_stated)
}

fn count(seeds: impl Iterator<Item = u64> + Send) -> (usize, Coverage) {
    let all = judged_of_each(seeds, &judged);
    let tables = all.len();
    let count: Coverage = all.into_iter().flatten().collect();
    println!("{tables} tables, errors at lines {count}");
    (tables, count)
}

#[test]
fn the_errors_of_tables_of_all_sorts_are_within_what_is_stated() {
    let (tables, count) = count(8_001..=8_008);
    assert_eq!(tables, 8);
    count.judge_as(50.0 * 8.0);
}

#[test]
#[ignore = "many tables: for whoever wants the rates, over SEEDS=FIRST..LAST"]
fn coverage_of_turned_tables() {
    let (tables, count) = count(seeds("1..200"));
    // The errors of a table's 360 lines depend on each other, most of all those of its slow harmonics.
    count.judge_as(50.0 * tables as f64);
}
