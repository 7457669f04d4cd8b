//! How long a rotary table's self-calibration takes to evaluate, and one corrected target.
//!
//! `rotary times` prints one JSON object: microseconds for a whole evaluation (design, transforms,
//! search for outliers, residuals, uncertainties; all readings present) as median and minimum of
//! the repetitions; milliseconds to plan offsets; nanoseconds per set-point of a table of 3600
//! lines.

use std::hint::black_box;
use std::time::Instant;

use compensator::rotary::{
    Criterion, PeriodicCompensation, PeriodicInterpolation, PeriodicLimits, PeriodicTable,
    SolveOptions, plan, solve,
};
use serde_json::{Value, json};
use tests::random;
use tests::specimens::plate::{series, table_arcsec};
use units::Radians;

const REPETITIONS: usize = 101;
const SIZES: [(usize, usize); 3] = [(360, 4), (3600, 4), (3600, 12)];
const TARGETS: usize = 1 << 14;
const CALLS: usize = 200_000;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.first().map(String::as_str) {
        Some("times") => println!("{}", times()),
        _ => eprintln!("rotary: run by tests/bench/run"),
    }
}

fn seconds(work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64()
}

fn median_and_least(values: &mut [f64]) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2], values[0])
}

fn evaluation(lines: usize, placements: usize) -> Value {
    let mut planned = None;
    let plan_s = seconds(|| planned = plan(lines, placements, Criterion::Worst).ok());
    let planned = planned.expect("so many placements are possible");
    let rms_s = seconds(|| drop(black_box(plan(lines, placements, Criterion::Rms))));
    let series = series(lines, planned.offsets());
    let options = SolveOptions {
        reading_noise: Some(Radians::from_arcsec(0.05)),
        ..SolveOptions::default()
    };
    let once = || {
        let solution = solve(black_box(&series), &options).expect("nothing is wrong with it");
        black_box((
            solution.uncertainty_seen(),
            solution.uncertainty_propagated(),
        ));
    };
    let mut times: Vec<f64> = (0..REPETITIONS).map(|_| seconds(once) * 1e6).collect();
    let (median, least) = median_and_least(&mut times);
    json!({
        "lines": lines,
        "placements": placements,
        "solve_us": median,
        "solve_us_min": least,
        "plan_worst_ms": plan_s * 1e3,
        "plan_rms_ms": rms_s * 1e3,
        "worst_amplification": planned.worst().1,
        "rms_amplification": planned.rms_amplification(),
    })
}

fn set_points(interpolation: PeriodicInterpolation) -> Value {
    let lines = 3600;
    let deviations = (0..lines).map(|line| Radians::from_arcsec(-table_arcsec(line, lines)));
    let table = PeriodicTable::new(deviations.collect(), None).unwrap();
    let limits = PeriodicLimits {
        size: Radians::from_arcsec(60.0),
        slope: 0.01,
    };
    let made = PeriodicCompensation::new(table, interpolation, limits).unwrap();
    let mut state = 1;
    let targets: Vec<Radians> = (0..TARGETS)
        .map(|_| Radians(20.0 * random(&mut state)))
        .collect();
    let run = || {
        let mut sum = 0.0;
        for call in 0..CALLS {
            let target = targets[call & (TARGETS - 1)];
            sum += made.set_point(target).expect("it is finite").value();
        }
        black_box(sum);
    };
    let mut times: Vec<f64> = (0..25).map(|_| seconds(run) / CALLS as f64 * 1e9).collect();
    let (median, least) = median_and_least(&mut times);
    json!({ "interpolation": format!("{interpolation:?}"), "ns": median, "ns_min": least })
}

fn times() -> Value {
    let cases: Vec<Value> = SIZES.iter().map(|(n, p)| evaluation(*n, *p)).collect();
    let set_points = [
        set_points(PeriodicInterpolation::BandLimited),
        set_points(PeriodicInterpolation::Linear),
    ];
    json!({ "repetitions": REPETITIONS, "evaluations": cases, "set_points": set_points })
}
