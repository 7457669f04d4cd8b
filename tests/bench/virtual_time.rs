//! How much faster than real time machines live in virtual time, with every frame on their buses.
//!
//! `virtual_time times` runs the whole cycle of each machine that ships on a few seeds and prints
//! one JSON object: seconds that the machine lived, by seconds of the processor.
//!
//! `virtual_time show NAME SEED` runs one (`linear`, `uvw`, `uvw-copley`, `rotary`, `volumetric`)
//! and prints that for a person, with the number that stands for its log: what makes it faster must
//! not change it. `virtual_time part NAME SEED`: the same of the part whose log is pinned by the tests.

use nix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};
use tests::cycles::{Cycle, PARTS, WHOLE, named};

const SEEDS: u64 = 5;

fn main() {
    // `cargo bench` adds a word of its own.
    let words = std::env::args().skip(1).filter(|word| word != "--bench");
    let words: Vec<String> = words.collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["times"] => println!("{}", times()),
        ["show", name, seed] => show(&WHOLE, name, seed),
        ["part", name, seed] => show(&PARTS, name, seed),
        _ => eprintln!("virtual_time: run by tests/bench/run, or as `virtual_time show linear 1`"),
    }
}

/// What a cycle took.
struct Run {
    lived_s: f64,
    processor_s: f64,
    log_hash: u64,
}

fn run(cycle: &Cycle, seed: u64) -> Run {
    let bench = cycle.bench(seed);
    let before_s = processor_s();
    let bench = cycle.run(bench);
    Run {
        processor_s: processor_s() - before_s,
        lived_s: bench.machine.now().seconds(),
        log_hash: bench.emulated.simulation().log_hash(),
    }
}

/// What the processor has worked for this process: other programs do not count.
fn processor_s() -> f64 {
    let time = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).expect("every process has one");
    time.tv_sec() as f64 + time.tv_nsec() as f64 * 1e-9
}

fn times() -> Value {
    let cases: Vec<Value> = WHOLE.iter().map(case).collect();
    json!({ "cases": cases })
}

fn case(cycle: &Cycle) -> Value {
    let runs: Vec<Run> = (1..=SEEDS).map(|seed| run(cycle, seed)).collect();
    let lived_s: f64 = runs.iter().map(|run| run.lived_s).sum();
    let processor_s: f64 = runs.iter().map(|run| run.processor_s).sum();
    json!({
        "machine": cycle.name,
        "runs": runs.len(),
        "lived_s": lived_s,
        "processor_s": processor_s,
        "times_real_time": lived_s / processor_s,
    })
}

fn show(cycles: &'static [Cycle], name: &str, seed: &str) {
    let run = run(
        named(cycles, name),
        seed.parse().expect("a seed is a number"),
    );
    println!(
        "{name} {seed}: {:.1} s in {:.3} s of the processor, {:.0} times real time; log {:016x}",
        run.lived_s,
        run.processor_s,
        run.lived_s / run.processor_s,
        run.log_hash
    );
}
