//! The example of the library, as somebody who reads it runs it.

use std::fmt::Write as _;
use std::fs;

use tests::{Edit, Rig, not_run};

use crate::programs::{Bench, live_rigs};

/// The example lives in real time: SYNC periods as shipped, and what a busier computer may bear. With longer
/// ones the search of the zero takes longer than its `time_limit_s`.
const TRIES_MS: [&str; 3] = ["5.0", "20.0", "20.0"];

/// What was measured on some other stage: 20 um off at one end, 2 um apart between directions.
fn measured() -> String {
    let mut rows = "run,approach,target_mm,measured_mm\n".to_owned();
    for run in 1..=2 {
        for (approach, lag_um) in [("+", -1.0), ("-", 1.0)] {
            for at in 0..=20 {
                let at = if approach == "+" { at } else { 20 - at };
                let target_mm = 3.0 * f64::from(at);
                let off_um = target_mm / 3.0 + lag_um + 0.01 * f64::from(run);
                let measured_mm = target_mm + off_um * 1e-3;
                let row = writeln!(rows, "{run},{approach},{target_mm:.3},{measured_mm:.6}");
                row.expect("a text takes everything");
            }
        }
    }
    rows
}

/// From 10 mm to 40 mm and back in four seconds.
const PATH: &str = include_str!("../../configs/data/path-x.csv");

/// With its axis cyclic, and its bus where this machine has it.
fn streaming(bench: &Bench, text: &str, period_ms: &str) -> String {
    let cyclic = "synchronous_start = true\n[axis.x.cyclic]\njerk_mm_per_s3 = 100000.0\n\
                  deviation_limit_um = 1000.0\ncorrection_limit_um = 50.0\n\
                  correction_rate_um_per_s = 5000.0\n[axis.x.identity]";
    let port = bench.port("can0");
    let place = match port.split_once(':') {
        Some(("socketcan", interface)) => format!("interface = {interface:?}"),
        Some((_, path)) => format!("path = {path:?}"),
        None => panic!("{port} is no CAN bus"),
    };
    let text = text
        .edit(
            "sync_period_ms = 5.0",
            &format!("sync_period_ms = {period_ms}"),
        )
        .edit("[axis.x.identity]", cyclic)
        .edit("path = \"/dev/ttyACM1\"", &place);
    match bench.rig() {
        Rig::Vcan => text.edit("transport = \"slcan\"", "transport = \"socketcan\""),
        Rig::Pty | Rig::InProcess => text,
    }
}

/// The lines that say where the axis is: position, correction and its uncertainty.
fn lives(printed: &str) -> Vec<[f64; 3]> {
    let number = |text: &str| text.trim().parse::<f64>().expect("a number");
    let lines = printed.lines().filter_map(|line| {
        let (at, rest) = line.strip_prefix("x ")?.split_once(" mm, ")?;
        let (offset, rest) = rest.split_once(" ± ")?;
        let uncertainty = rest.strip_suffix(" um")?;
        Some([number(at), number(offset), number(uncertainty)])
    });
    lines.collect()
}

/// A machine that has just been powered on, with a calibration in force and a path to follow.
fn prepared(rig: Rig, period_ms: &str) -> Bench {
    let bench = Bench::in_real_time(rig);
    let machine = |text: String| streaming(&bench, &text, period_ms);
    bench.configure("machine.toml", machine);
    let file = |name: &str, text: String| {
        fs::write(bench.folder().join(name), text).expect("a file can be written");
    };
    file("data.csv", measured());
    file("path.csv", PATH.to_owned());
    let fit = ["fit", "linear", "data.csv", "--save", "machine.toml"];
    let saved = bench.run_plainly(&fit).with_code(0);
    let id = saved["calibration"].as_str().expect("its name");
    let activate = ["cal", "activate", "machine.toml", id];
    bench.run_plainly(&activate).with_code(0);
    bench
}

/// What the example printed, or why it came to no end. The machine is a new one each time: a drive
/// that was left without set-points stands in a fault, and would refuse whatever comes next.
fn try_once(rig: Rig, period_ms: &str) -> Result<String, String> {
    let bench = prepared(rig, period_ms);
    let (well, printed, said) = bench.example("stream", &["machine.toml", "path.csv"]);
    // A computer that is too busy is told so.
    assert!(well || !said.is_empty(), "it failed without a word");
    let all = format!("{printed}{said}");
    println!(
        "{rig:?}, {period_ms} ms: {}",
        all.lines().last().unwrap_or("")
    );
    if well && printed.contains("the path is done") {
        Ok(printed)
    } else {
        Err(all)
    }
}

#[test]
fn the_example_streams_a_path_and_shows_the_correction_and_its_uncertainty() {
    for rig in live_rigs() {
        let mut failures = Vec::new();
        let done = TRIES_MS.into_iter().find_map(|period_ms| {
            let tried = try_once(rig, period_ms);
            tried.map_err(|why| failures.push(why)).ok()
        });
        let Some(printed) = done else {
            let why = failures.join("\n");
            let why = format!("3 times this computer was too busy ({rig:?}): {why}");
            not_run("the example streams a path", &why);
            continue;
        };
        let lives = lives(&printed);
        assert!(lives.len() > 20, "{printed}");
        // Once it is slewed in: the negated table, and a turn's lost motion.
        for [at_mm, offset_um, uncertainty_um] in &lives[lives.len() / 2..] {
            let expected_um = -at_mm / 3.0;
            assert!((offset_um - expected_um).abs() < 1.6, "{printed}");
            assert!((0.0..1.0).contains(uncertainty_um), "{printed}");
        }
        assert!(lives.iter().any(|[_, _, uncertainty]| *uncertainty > 0.0));
        assert!(printed.contains("lateness"), "{printed}");
    }
}
