//! How long the correction of one target takes, exact inverse included.
//!
//! `table times` prints one JSON object: for each interpolation and length of table the
//! nanoseconds per call, as median and minimum of the repetitions; and, for comparison, of a
//! plain table of straight lines in which the interval is bisected. `table calls INTERPOLATION NODES CALLS`
//! does that many calls and nothing else, for who counts instructions.

use std::hint::black_box;
use std::time::Instant;

use compensator::error_table::{Compensation, Interpolation};
use serde_json::{Value, json};
use tests::specimens::stroke::{compensation, targets};
use units::{Approach, Metres};

const LENGTHS: [u32; 3] = [20, 2_000, 20_000];
const INTERPOLATIONS: [(&str, Interpolation); 3] = [
    ("piecewise constant", Interpolation::PiecewiseConstant),
    ("linear", Interpolation::Linear),
    ("monotone cubic", Interpolation::MonotoneCubic),
];
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
            black_box(in_a_row(
                &compensation,
                &targets(TARGETS),
                calls.parse().unwrap(),
            ));
        }
        _ => eprintln!("table: run by tests/bench/run"),
    }
}

/// What is measured: targets to set-points.
trait Correct {
    fn set_point(&self, target: Metres) -> Metres;
}

impl Correct for Compensation {
    fn set_point(&self, target: Metres) -> Metres {
        Self::set_point(self, target, Approach::Forward).expect("the ends hold")
    }
}

/// The straight lines of a [`Compensation`], searched as most programs would.
struct Bisected {
    actuals: Vec<f64>,
    commands: Vec<f64>,
}

impl Bisected {
    fn new(compensation: &Compensation) -> Self {
        let nodes = compensation.table().nodes();
        let commands: Vec<f64> = nodes.iter().map(|node| node.position.value()).collect();
        let deviations = nodes.iter().map(|node| node.forward.unwrap().value());
        let actuals = deviations
            .zip(&commands)
            .map(|(deviation, at)| at + deviation);
        Self {
            actuals: actuals.collect(),
            commands,
        }
    }
}

impl Correct for Bisected {
    fn set_point(&self, target: Metres) -> Metres {
        let target = target.value();
        let after = self.actuals.partition_point(|actual| *actual < target);
        let after = after.clamp(1, self.actuals.len() - 1);
        let (from, to) = (self.actuals[after - 1], self.actuals[after]);
        let (begin, end) = (self.commands[after - 1], self.commands[after]);
        Metres(begin + (target - from) * (end - begin) / (to - from))
    }
}

/// Every call has all it needs: a processor overlaps them.
fn in_a_row(table: &impl Correct, targets: &[Metres], calls: usize) -> Metres {
    let mut last = Metres::ZERO;
    for at in 0..calls {
        last = black_box(table.set_point(targets[at % TARGETS]));
    }
    last
}

/// Every call needs the result of the one before: what one call alone takes.
fn alone(table: &impl Correct, targets: &[Metres], calls: usize) -> Metres {
    let mut last = Metres::ZERO;
    for at in 0..calls {
        // Adds nothing, which the compiler may not assume of floating-point numbers.
        last = table.set_point(targets[at % TARGETS] + last * 0.0);
    }
    last
}

fn nanoseconds(calls: impl FnOnce(usize) -> Metres) -> f64 {
    let begin = Instant::now();
    black_box(calls(black_box(CALLS)));
    begin.elapsed().as_secs_f64() * 1e9 / CALLS as f64
}

fn median_and_least(values: &mut [f64]) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2], values[0])
}

struct Case {
    name: &'static str,
    nodes: u32,
    table: Table,
    alone_ns: Vec<f64>,
    in_a_row_ns: Vec<f64>,
}

enum Table {
    Ours(Box<Compensation>),
    Bisected(Bisected),
}

impl Case {
    fn new(name: &'static str, nodes: u32, table: Table) -> Self {
        Self {
            name,
            nodes,
            table,
            alone_ns: Vec::new(),
            in_a_row_ns: Vec::new(),
        }
    }

    fn repeat(&mut self, targets: &[Metres]) {
        let (alone_ns, in_a_row_ns) = match &self.table {
            Table::Ours(table) => both(&**table, targets),
            Table::Bisected(table) => both(table, targets),
        };
        self.alone_ns.push(alone_ns);
        self.in_a_row_ns.push(in_a_row_ns);
    }

    fn result(&mut self) -> Value {
        let (alone_ns, alone_ns_min) = median_and_least(&mut self.alone_ns);
        let (in_a_row_ns, in_a_row_ns_min) = median_and_least(&mut self.in_a_row_ns);
        json!({
            "interpolation": self.name,
            "nodes": self.nodes,
            "alone_ns": alone_ns,
            "alone_ns_min": alone_ns_min,
            "in_a_row_ns": in_a_row_ns,
            "in_a_row_ns_min": in_a_row_ns_min,
        })
    }
}

fn both(table: &impl Correct, targets: &[Metres]) -> (f64, f64) {
    (
        nanoseconds(|calls| alone(table, targets, calls)),
        nanoseconds(|calls| in_a_row(table, targets, calls)),
    )
}

/// Repetitions go round all cases, so that a disturbance hits each of them.
fn times() -> Value {
    let targets = targets(TARGETS);
    let mut cases = Vec::new();
    for (name, interpolation) in INTERPOLATIONS {
        for nodes in LENGTHS {
            let ours = Box::new(compensation(interpolation, nodes));
            cases.push(Case::new(name, nodes, Table::Ours(ours)));
        }
    }
    for nodes in LENGTHS {
        let bisected = Bisected::new(&compensation(Interpolation::Linear, nodes));
        cases.push(Case::new("(bisected)", nodes, Table::Bisected(bisected)));
    }
    for _ in 0..REPETITIONS {
        cases.iter_mut().for_each(|case| case.repeat(&targets));
    }
    let cases: Vec<Value> = cases.iter_mut().map(Case::result).collect();
    json!({ "calls": CALLS, "repetitions": REPETITIONS, "cases": cases })
}
