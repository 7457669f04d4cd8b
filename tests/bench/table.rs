//! How long the correction of one target takes, exact inverse included.
//!
//! `table times` prints one JSON object: for each interpolation and length of table the
//! nanoseconds per call, one median per repetition. `table calls INTERPOLATION NODES CALLS`
//! does that many calls and nothing else, for who counts instructions.

use std::hint::black_box;
use std::time::Instant;

use compensator::error_table::{Compensation, EndPolicy, ErrorTable, Interpolation, Limits, Node};
use serde_json::{Value, json};
use units::{Approach, Metres, MetresPerSecond};

const LENGTHS: [u32; 3] = [20, 2_000, 20_000];
const INTERPOLATIONS: [(&str, Interpolation); 3] = [
    ("piecewise constant", Interpolation::PiecewiseConstant),
    ("linear", Interpolation::Linear),
    ("monotone cubic", Interpolation::MonotoneCubic),
];
const STROKE_M: f64 = 0.06;
const REPETITIONS: usize = 25;
const CALLS: usize = 200_000;
/// Targets fit the second-level cache beside any table; a power of two.
const TARGETS: usize = 1 << 14;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["times"] => println!("{}", times()),
        ["calls", name, nodes, calls] => {
            let interpolation = INTERPOLATIONS.iter().find(|(known, _)| *known == name);
            let (_, interpolation) = interpolation.expect("a known interpolation");
            let compensation = compensation(*interpolation, nodes.parse().unwrap());
            black_box(apart(&compensation, &targets(), calls.parse().unwrap()));
        }
        _ => eprintln!("table: run by tests/bench/run"),
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014), as a number from 0 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// ±10 µm in two waves and some noise, reverse 1 µm beside forward, at even distances.
fn compensation(interpolation: Interpolation, nodes: u32) -> Compensation {
    let mut state = u64::from(nodes);
    let step_m = STROKE_M / f64::from(nodes - 1);
    let noise_m = 0.2e-6_f64.min(step_m * 1e-3);
    let node = |at: u32| {
        let phase = f64::from(at) * step_m / STROKE_M * 4.0 * core::f64::consts::PI;
        let forward = Metres(10e-6 * phase.sin() + noise_m * random(&mut state));
        Node {
            position: Metres(f64::from(at) * step_m),
            forward: Some(forward),
            reverse: Some(forward + Metres::from_um(1.0)),
            u_forward: Some(Metres::from_um(0.1)),
            u_reverse: Some(Metres::from_um(0.1)),
        }
    };
    let table = ErrorTable::new((0..nodes).map(node).collect()).unwrap();
    let limits = Limits {
        size: Metres::from_um(50.0),
        slope: 0.1,
        rate: MetresPerSecond(1.0),
    };
    Compensation::new(table, interpolation, limits, EndPolicy::Hold).unwrap()
}

fn targets() -> Vec<Metres> {
    let mut state = 1;
    (0..TARGETS)
        .map(|_| Metres(STROKE_M * random(&mut state)))
        .collect()
}

fn set_point(compensation: &Compensation, target: Metres) -> Metres {
    compensation
        .set_point(target, Approach::Forward)
        .expect("the ends hold")
}

/// Every call has all it needs: a processor overlaps them.
fn apart(compensation: &Compensation, targets: &[Metres], calls: usize) -> Metres {
    let mut last = Metres::ZERO;
    for at in 0..calls {
        last = black_box(set_point(compensation, targets[at % TARGETS]));
    }
    last
}

/// Every call needs the result of the one before: what one call alone takes.
fn chained(compensation: &Compensation, targets: &[Metres], calls: usize) -> Metres {
    let mut last = Metres::ZERO;
    for at in 0..calls {
        // Adds nothing, which the compiler may not assume of floating-point numbers.
        let target = targets[at % TARGETS] + last * 0.0;
        last = set_point(compensation, target);
    }
    last
}

fn nanoseconds(calls: impl FnOnce(usize) -> Metres) -> f64 {
    let begin = Instant::now();
    black_box(calls(black_box(CALLS)));
    begin.elapsed().as_secs_f64() * 1e9 / CALLS as f64
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

struct Case {
    name: &'static str,
    nodes: u32,
    compensation: Compensation,
    chained_ns: Vec<f64>,
    apart_ns: Vec<f64>,
}

/// Repetitions go round all cases, so that a disturbance hits each of them.
fn times() -> Value {
    let targets = targets();
    let mut cases = Vec::new();
    for (name, interpolation) in INTERPOLATIONS {
        cases.extend(LENGTHS.map(|nodes| Case {
            name,
            nodes,
            compensation: compensation(interpolation, nodes),
            chained_ns: Vec::new(),
            apart_ns: Vec::new(),
        }));
    }
    for _ in 0..REPETITIONS {
        for case in &mut cases {
            let table = &case.compensation;
            case.chained_ns
                .push(nanoseconds(|calls| chained(table, &targets, calls)));
            case.apart_ns
                .push(nanoseconds(|calls| apart(table, &targets, calls)));
        }
    }
    let result = |case: &mut Case| {
        json!({
            "interpolation": case.name,
            "nodes": case.nodes,
            "chained_ns": median(&mut case.chained_ns),
            "apart_ns": median(&mut case.apart_ns),
        })
    };
    json!({ "calls": CALLS, "repetitions": REPETITIONS, "cases": cases.iter_mut().map(result).collect::<Vec<_>>() })
}
