//! How long the correction of a point in space takes, exact inverse included.
//!
//! `volumetric times` prints one JSON object: for each case the nanoseconds per point of three
//! components, as median and minimum of the repetitions.
//! `volumetric calls CASE CALLS` does that many calls and nothing else, for who counts
//! instructions.

use std::hint::black_box;
use std::time::Instant;

use compensator::error_table::Limits;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::model::{
    AxisErrors, Conditions, Machine, Squareness, Thermal, ThermalBend, ThermalChannel,
    VolumetricModel,
};
use compensator::volumetric::online::MovingState;
use compensator::volumetric::{Axis, Point, Volume};
use serde_json::{Value, json};
use tests::random;
use units::{Celsius, Metres, MetresPerSecond, Radians};

const SPAN_M: [f64; 3] = [0.6, 0.5, 0.4];
const NODES: usize = 25;
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
            black_box(in_a_row(&*case.run, &targets(), calls.parse().unwrap()));
        }
        _ => eprintln!("volumetric: run by tests/bench/run"),
    }
}

fn limits() -> Limits {
    Limits {
        size: Metres::from_um(500.0),
        slope: 0.1,
        rate: MetresPerSecond(0.1),
    }
}

fn volume() -> Volume {
    Volume::new(Point::ZERO, point(SPAN_M)).unwrap()
}

fn point(v: [f64; 3]) -> Point {
    Point::new(Metres(v[0]), Metres(v[1]), Metres(v[2]))
}

fn targets() -> Vec<Point> {
    let mut state = 1;
    let mut target = || point(SPAN_M.map(|span| span * random(&mut state)));
    (0..TARGETS).map(|_| target()).collect()
}

/// Eighteen functions of ±5 µm and ±5″ with a node every 25 mm or less, squarenesses, a tool, two
/// temperatures and live detectors.
fn model(shape: Shape) -> (VolumetricModel, Conditions) {
    let mut state = 7;
    let mut axes: [AxisErrors; 3] = Default::default();
    for axis in Axis::ALL {
        let span = SPAN_M[axis.index()];
        let step = span / (NODES - 1) as f64;
        let nodes: Vec<Metres> = (0..NODES).map(|n| Metres(step * n as f64)).collect();
        let mut even = || 2.0 * random(&mut state) - 1.0;
        for k in 0..3 {
            let along: Vec<Metres> = nodes
                .iter()
                .map(|_| Metres::from_um(5.0 * even()))
                .collect();
            axes[axis.index()].along[k] = Some(Function::new(&nodes, &along, shape).unwrap());
            let about: Vec<Radians> = nodes
                .iter()
                .map(|_| Radians::from_arcsec(5.0 * even()))
                .collect();
            axes[axis.index()].about[k] = Some(Function::new(&nodes, &about, shape).unwrap());
        }
    }
    let channel = ThermalChannel {
        reference: Celsius(20.0),
        low: Celsius(15.0),
        high: Celsius(35.0),
        expansion: [8e-6, 8e-6, 11e-6],
        u_expansion: [1e-7; 3],
        growth: point([0.0, 1e-6, 3e-6]),
        squareness: [Radians(1e-6), Radians(0.0), Radians(0.0)],
        u: 0.1,
    };
    let bend = |axis: Axis| ThermalBend {
        axis,
        towards: axis.others()[1],
        over: 0,
        under: Some(1),
        bow: Metres::from_um(4.0),
        u: Metres::from_um(0.1),
        low: Metres(0.0),
        high: Metres(SPAN_M[axis.index()]),
        gradient_max: 5.0,
        is_watched: axis == Axis::X,
    };
    let machine = Machine {
        chain: "XFYZ".parse().unwrap(),
        volume: volume(),
        axes,
        squareness: Squareness {
            y_to_x: Radians(20e-6),
            z_to_x: Radians(-30e-6),
            z_to_y: Radians(10e-6),
            u: [Radians(1e-6); 3],
        },
        thermal: Thermal {
            channels: vec![channel; 2],
            bends: Axis::ALL.map(bend).to_vec(),
            fixed: Point::ZERO,
        },
        tool_max: Metres(0.3),
        displacement_max: Metres::from_um(50.0),
        roll_max: Radians::from_arcsec(30.0),
    };
    let model = VolumetricModel::new(machine, limits()).unwrap();
    let now = conditions(&model, 22.0);
    (model, now)
}

fn conditions(model: &VolumetricModel, temperature: f64) -> Conditions {
    let live = MovingState {
        sideways: [[Metres::from_um(3.0); 2]; 3],
        roll: [Radians::from_arcsec(2.0); 3],
    };
    let temperatures = [Celsius(temperature), Celsius(21.0)];
    let tool = point([0.05, 0.0, -0.2]);
    model.conditions(tool, &temperatures, &live).unwrap()
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
    let targets = targets();
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
