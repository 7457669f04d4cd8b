//! Jobs of one axis, as a user runs them.

use std::fs;
use std::path::PathBuf;

use nix::sys::signal::Signal;
use serde_json::Value;
use tests::Edit;

use crate::programs::{Bench, check_says, live_rigs, number, text};
use crate::serve::{ask, keep};

const JOB: &str = include_str!("../../configs/jobs/linear.toml");

fn write(bench: &Bench, name: &str, job: &str) {
    fs::write(bench.folder().join(name), job).expect("a file can be written");
}

#[test]
fn a_job_is_judged_done_and_shown_from_process_to_process() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        write(&bench, "job.toml", JOB);
        let words = ["run", "machine.toml", "job.toml"];
        let uncalibrated = bench.run(&words).with_code(2);
        assert!(text(&uncalibrated["error"]).contains("no active calibration"));
        let id = bench.run(&["calibrate"]).with_code(0)["calibration"].clone();

        // No bus is named: it is not needed.
        let planned = bench.run_plainly(&["run", "machine.toml", "job.toml", "--dry-run"]);
        let planned = planned.with_code(0);
        assert_eq!(
            (&planned["calibration"], &planned["dry_run"]),
            (&id, &Value::from(true))
        );
        refused(&bench);

        let done = bench
            .run(&["run", "machine.toml", "job.toml", "--yes"])
            .with_code(0);
        let (planned, reached) = (points(&planned), points(&done));
        assert_eq!((planned.len(), reached.len()), (6, 12));
        for (planned, reached) in planned.iter().zip(reached) {
            assert_eq!(planned["name"], reached["name"]);
            assert_eq!(planned["set_point_mm"], reached["set_point_mm"]);
            let off_um = (number(&reached["place_mm"]) - number(&reached["target_mm"])) * 1e3;
            assert!(off_um.abs() < 0.2, "{reached}");
            assert!(
                number(&reached["uncertainty"]["expanded_um"]) > 0.01,
                "{reached}"
            );
        }
        let report = ["report", text(&done["journal"]), "--output", "page.html"];
        bench.run(&report).with_code(0);
        let html = fs::read_to_string(bench.folder().join("page.html"));
        let html = html.expect("it was written");
        check_says(
            &html,
            &[
                "Job",
                "12 of 12 points",
                "hole 3",
                "operator",
                "input",
                "33 to 36",
            ],
        );
        interrupted(&bench);
        assert_eq!(bench.stop(), Some(0));
    }
}

fn points(value: &Value) -> &Vec<Value> {
    value["points"].as_array().expect("a list of points")
}

fn refused(bench: &Bench) {
    write(
        bench,
        "wrong.toml",
        &JOB.edit("position_mm = 57.25", "position_mm = 99.0"),
    );
    let refused = bench
        .run(&["run", "machine.toml", "wrong.toml"])
        .with_code(2);
    let said = text(&refused["error"]);
    for part in [
        "wrong.toml:28:",
        "position_mm",
        "99 mm is outside",
        "-3 to 63 mm",
    ] {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
    let first = bench.run(&["run", "machine.toml", "job.toml", "--first-part"]);
    assert!(text(&first.with_code(2)["error"]).contains("this is a job"));
}

/// Ctrl-C while the axis waits at a point for a time that does not end soon.
fn interrupted(bench: &Bench) {
    write(
        bench,
        "long.toml",
        &JOB.edit("after_s = 0.5", "after_s = 80000.0"),
    );
    let before = jobs(bench).len();
    let mut process = bench.start(&["run", "machine.toml", "long.toml", "--yes"]);
    process.wait_until(|| jobs(bench).len() > before && reached(bench) >= 2);
    process.signal(Signal::SIGINT);
    let ended = process.end();
    assert!(ended.said.contains("stopped on request"), "{ended:?}");
    assert!(ended.said.contains("--resume continues it"), "{ended:?}");
    ended.with_code(130);
    bench.run(&["zero"]).with_code(0);
    goes_on(bench);
}

/// It waited at the first hole: that is gone to again, and nothing else that is done.
fn goes_on(bench: &Bench) {
    let other = ["run", "machine.toml", "job.toml", "--resume", "--dry-run"];
    let refused = bench.run_plainly(&other).with_code(3);
    let said = text(&refused["error"]);
    assert!(
        said.contains("go_on[1] was `after 80000 s` and is now `after 0.5 s`"),
        "{said}"
    );
    let planned = bench.run_plainly(&["run", "machine.toml", "long.toml", "--resume", "--dry-run"]);
    let at = &planned.with_code(0)["goes_on"];
    assert_eq!(
        (&at["repetition"], &at["number"]),
        (&Value::from(1), &Value::from(2))
    );
    let mut process = bench.start(&["run", "machine.toml", "long.toml", "--yes", "--resume"]);
    process.wait_until(|| reached(bench) >= 3);
    process.signal(Signal::SIGINT);
    process.end().with_code(130);
    let path = bench.run(&["run", "machine.toml", "path.csv", "--resume"]);
    assert!(text(&path.with_code(2)["error"]).contains("this is a path"));
}

#[test]
fn a_kept_axis_does_a_job_as_it_does_without_a_service() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        write(&bench, "job.toml", JOB);
        bench.run(&["calibrate"]).with_code(0);
        let words = ["run", "machine.toml", "job.toml", "--yes"];
        let here = bench.run(&words);
        let service = keep(&bench);
        refused(&bench);
        // The hand that the client lends says that it is done.
        bench.run(&words[..3]).with_code(0);
        let there = bench.run(&words);
        assert_eq!(told(&there.said), told(&here.said));
        let (here, there) = (here.with_code(0), there.with_code(0));
        let keys = |value: &Value| {
            let keys = value.as_object().expect("an object").keys();
            keys.cloned().collect::<Vec<_>>()
        };
        assert_eq!(keys(&there), keys(&here));
        assert_eq!((points(&here).len(), points(&there).len()), (12, 12));
        for (here, there) in points(&here).iter().zip(points(&there)) {
            assert_eq!(keys(there), keys(here));
            for key in ["name", "repetition", "set_point_mm"] {
                assert_eq!(there[key], here[key], "{there}");
            }
        }
        let run = keeps_what_it_told(&bench);
        interrupted_there(&bench);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
        tells_programs(&bench, &run, &there);
        assert_eq!(bench.stop(), Some(0));
    }
}

/// What was said of each point as it was reached, but for its figures: they are other ones each time.
fn told(said: &str) -> Vec<String> {
    let lines = said.lines().filter(|it| it.starts_with("  repetition "));
    let lines = lines.map(|line| {
        let (point, place) = line.split_once("): at ").expect("which, and where");
        let words = place.chars().filter(|it| !it.is_ascii_digit());
        format!("{point}): at {}", words.collect::<String>())
    });
    let lines: Vec<_> = lines.collect();
    assert!(!lines.is_empty(), "no point was told: {said}");
    lines
}

/// The last run, and as much of what it told as somebody does not know.
fn keeps_what_it_told(bench: &Bench) -> Value {
    let (_, runs) = ask(bench.folder(), "GET /v1/runs", &Value::Null);
    let run = runs.as_array().and_then(|it| it.last()).expect("a run");
    let reached = run["reached"].as_array().expect("what was told");
    assert_eq!(reached.len(), 12, "{run}");
    let look = format!("GET /v1/runs/{}?heard=10", text(&run["id"]));
    let (_, rest) = ask(bench.folder(), &look, &Value::Null);
    assert_eq!(rest["reached"], Value::from(&reached[10..]), "{rest}");
    run.clone()
}

/// Each point was an event with the figures that are in the result.
fn tells_programs(bench: &Bench, run: &Value, done: &Value) {
    let reached = run["reached"].as_array().expect("what was told");
    let events = bench.records().join("service/journal.jsonl");
    let events = fs::read_to_string(events).expect("events are kept");
    let events = events
        .lines()
        .map(|it| serde_json::from_str(it).expect("an object"));
    let of_run = |it: &Value| it["kind"] == "point" && it["of"] == run["id"];
    let points: Vec<Value> = events.filter(of_run).collect();
    assert_eq!(points.len(), reached.len());
    for (event, (told, point)) in points.iter().zip(reached.iter().zip(self::points(done))) {
        let data = &event["data"];
        assert_eq!((&data["text"], &data["value"]), (told, point));
    }
}

/// Ctrl-C at the client while the axis waits: the job is paused, and goes on as the same job only.
fn interrupted_there(bench: &Bench) {
    let long = JOB.edit("after_s = 0.5", "after_s = 80000.0");
    write(bench, "long.toml", &long);
    let before = jobs(bench).len();
    let process = bench.start(&["run", "machine.toml", "long.toml", "--yes"]);
    // It is told while the axis waits there, and not when the job has ended.
    let ended = process.end_heard(|process, line| {
        if line.starts_with("  repetition 1, point 2 of 6 ") {
            process.signal(Signal::SIGINT);
        }
    });
    assert!(ended.said.contains("--resume"), "{ended:?}");
    ended.with_code(130);
    let other = ["run", "machine.toml", "job.toml", "--yes", "--resume"];
    let refused = bench.run(&other).with_code(3);
    let said = text(&refused["error"]);
    assert!(said.contains("is now `after 0.5 s`"), "{said}");
    let mut process = bench.start(&["run", "machine.toml", "long.toml", "--yes", "--resume"]);
    process.wait_until(|| reached(bench) >= 3);
    process.signal(Signal::SIGINT);
    process.end().with_code(130);
    assert_eq!(
        jobs(bench).len(),
        before + 1,
        "it went on with the same one"
    );
}

/// The journals of jobs, the newest one last.
fn jobs(bench: &Bench) -> Vec<PathBuf> {
    let runs = fs::read_dir(bench.records().join("runs")).expect("there are runs");
    let paths = runs.map(|it| it.expect("a folder can be read").path());
    let mut jobs: Vec<_> = paths
        .filter(|it| it.to_string_lossy().contains("-run-x-"))
        .collect();
    jobs.sort();
    jobs
}

/// How often the newest job has reached a point, the ones that it will go to again included.
fn reached(bench: &Bench) -> usize {
    let newest = jobs(bench).pop().expect("a job was begun");
    let text = fs::read_to_string(newest).expect("a journal can be read");
    text.matches("\"entry\":\"reached\"").count()
}
