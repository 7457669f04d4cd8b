//! How long the correction of a point in space takes, exact inverse included.
//!
//! `volumetric times` prints one JSON object: for each case the nanoseconds per point of three
//! components, as median and minimum of the repetitions.
//! `volumetric calls CASE CALLS` does that many calls and nothing else, for who counts
//! instructions.

use std::hint::black_box;
use std::time::Instant;

use compensator::volumetric::Point;
use compensator::volumetric::function::Shape;
use serde_json::{Value, json};
use tests::specimens::volume::{conditions, model, targets};
use units::Metres;

const REPETITIONS: usize = 25;
const CALLS: usize = 100_000;
/// A power of two.
const TARGETS: usize = 1 << 13;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["times"] => println!("{}", times()),
        ["calls", name, calls] => {
            let cases = cases();
            let case = cases
                .iter()
                .find(|it| it.name == name)
                .expect("a known case");
            black_box(in_a_row(
                &*case.run,
                &targets(TARGETS),
                calls.parse().unwrap(),
            ));
        }
        _ => eprintln!("volumetric: run by tests/bench/run"),
    }
}

type Run = Box<dyn Fn(&[Point], bool) -> Point>;

struct Case {
    name: String,
    run: Run,
    alone_ns: Vec<f64>,
    in_a_row_ns: Vec<f64>,
}

/// The loops are compiled for each case, so that a call is not hidden behind a pointer.
fn case(name: String, correct: impl Fn(Point) -> Point + 'static) -> Case {
    let run = move |targets: &[Point], wait: bool| {
        let mut last = Point::ZERO;
        for target in targets {
            last = if wait {
                // Adds nothing, which the compiler may not assume of floating-point numbers.
                let nothing = Metres(last.x.value() * 0.0);
                correct(*target + Point::new(nothing, nothing, nothing))
            } else {
                black_box(correct(*target))
            };
        }
        last
    };
    Case {
        name,
        run: Box::new(run),
        alone_ns: Vec::new(),
        in_a_row_ns: Vec::new(),
    }
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, shape) in [("tables", Shape::Linear), ("splines", Shape::Spline)] {
        let (own, now) = model(shape);
        let (other, then) = model(shape);
        let deviation = move |at| own.deviation(at, &now).expect("within the volume");
        cases.push(case(format!("model of {name}"), deviation));
        let command = move |at| other.command(at, &then).expect("within the volume");
        cases.push(case(format!("model of {name}, inverse"), command));
    }
    let (own, _) = model(Shape::Linear);
    let with_conditions = move |at: Point| {
        let now = conditions(&own, 22.0 + at.x.value());
        own.deviation(at, &now).expect("within the volume")
    };
    cases.push(case(
        "model, new conditions each time".into(),
        with_conditions,
    ));
    cases
}

fn in_a_row(run: &dyn Fn(&[Point], bool) -> Point, targets: &[Point], calls: usize) -> Point {
    let mut last = Point::ZERO;
    for _ in 0..calls / TARGETS {
        last = run(targets, false);
    }
    last
}

fn nanoseconds(case: &Case, targets: &[Point], wait: bool) -> f64 {
    let rounds = CALLS / TARGETS;
    let begin = Instant::now();
    for _ in 0..rounds {
        black_box((case.run)(black_box(targets), wait));
    }
    begin.elapsed().as_secs_f64() * 1e9 / (rounds * TARGETS) as f64
}

fn median_and_least(values: &mut [f64]) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2], values[0])
}

/// Repetitions go round all cases, so that a disturbance hits each of them.
fn times() -> Value {
    let targets = targets(TARGETS);
    let mut cases = cases();
    for _ in 0..REPETITIONS {
        for case in &mut cases {
            let alone = nanoseconds(case, &targets, true);
            let in_a_row = nanoseconds(case, &targets, false);
            case.alone_ns.push(alone);
            case.in_a_row_ns.push(in_a_row);
        }
    }
    let results = cases.iter_mut().map(|case| {
        let (alone_ns, alone_ns_min) = median_and_least(&mut case.alone_ns);
        let (in_a_row_ns, in_a_row_ns_min) = median_and_least(&mut case.in_a_row_ns);
        json!({
            "case": case.name,
            "alone_ns": alone_ns,
            "alone_ns_min": alone_ns_min,
            "in_a_row_ns": in_a_row_ns,
            "in_a_row_ns_min": in_a_row_ns_min,
        })
    });
    let results: Vec<Value> = results.collect();
    json!({ "calls": CALLS, "repetitions": REPETITIONS, "cases": results })
}
