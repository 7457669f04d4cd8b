//! Calibrations whose verification does not come to its end.

use std::collections::BTreeSet;
use std::fs;

use drivers::transport::lockstep::lend_hand;
use nix::sys::signal::Signal;
use serde_json::{Value, json};
use tests::{Edit, LINEAR, Shipped, UVW};

use crate::held::Steps;
use crate::programs::{Bench, live_rigs, text};
use crate::serve::keep;

/// How often `entry` is in journals of this verb.
fn entries(bench: &Bench, verb: &str, entry: &str) -> usize {
    let Ok(runs) = fs::read_dir(bench.records().join("runs")) else {
        return 0;
    };
    let named = runs.filter_map(|it| {
        let path = it.ok()?.path();
        let name = path.file_name()?.to_string_lossy().into_owned();
        name.contains(&format!("-{verb}-")).then_some(path)
    });
    let wanted = format!("\"entry\":\"{entry}\"");
    let texts = named.filter_map(|it| fs::read_to_string(it).ok());
    texts.map(|it| it.matches(&wanted).count()).sum()
}

/// What a calibration tells whose verification is stopped when it has written two of `entry`.
fn stopped(bench: &Bench, entry: &str) -> Value {
    let mut process = bench.start(&["calibrate", "machine.toml", "--verify"]);
    let mut time = Steps::of(bench);
    time.until(&mut process, || entries(bench, "verify", entry) >= 2);
    process.signal(Signal::SIGINT);
    // Whoever is stopped has the time to say so.
    let brake = time.slowly();
    let ended = process.end();
    drop(brake);
    assert!(ended.said.contains("stopped on request"), "{ended:?}");
    assert!(
        !ended.said.contains("the same command with --resume"),
        "{ended:?}"
    );
    ended.with_code(130)
}

/// What is stored is told with its place, and is in use; what to do next can be done.
#[track_caller]
fn check(bench: &Bench, told: &Value, count: usize) {
    assert_eq!(told["verification"]["ended"], "stopped", "{told:#}");
    let stored = told["verification"]["stored"].as_array().expect("a list");
    assert_eq!(stored.len(), count);
    let list = bench
        .run_plainly(&["cal", "list", "machine.toml"])
        .with_code(0);
    let list = list["calibrations"].as_array().expect("a list").clone();
    for it in stored {
        assert!(bench.folder().join(text(&it["path"])).exists(), "{it}");
        let listed = list.iter().find(|own| own["id"] == it["calibration"]);
        let listed = listed.unwrap_or_else(|| panic!("{it} is not in {list:?}"));
        assert_eq!(
            (&listed["active"], &it["in_use"]),
            (&json!(true), &json!(true)),
            "{it}"
        );
    }
    let next = told["verification"]["next"].as_array().expect("a list");
    let words: Vec<&str> = text(&next[0]).split(' ').skip(1).collect();
    assert_eq!(words[..2], ["verify", "machine.toml"], "{next:?}");
    bench.run(&words).with_code(0);
}

#[track_caller]
fn checked(shipped: Shipped, entry: &str, count: usize, change: impl Fn(String) -> String) {
    for rig in live_rigs() {
        let bench = Bench::of(rig, shipped, |text| text);
        bench.configure("machine.toml", &change);
        let told = stopped(&bench, entry);
        check(&bench, &told, count);
    }
}

#[test]
fn a_linear_calibration_whose_verification_is_stopped_is_told_and_verified_later() {
    checked(LINEAR, "point", 1, |text| text);
}

#[test]
fn the_screws_of_a_platform_whose_verification_is_stopped_are_told_and_verified_later() {
    checked(UVW, "pose", 3, |text| {
        text.edit("step_mm = 0.25", "step_mm = 0.625")
            .edit("runs = 2", "runs = 1")
            .edit("poses = 20", "poses = 6")
    });
}

/// The same through a service, which does not go on with a verification but begins it anew.
#[test]
fn a_kept_calibration_whose_verification_is_stopped_is_told_and_verified_later() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let service = keep(&bench);
        let told = stopped(&bench, "point");
        check(&bench, &told, 1);
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

/// What a calibration tells whose verification has lost the beam when two of its points were written.
fn beam_lost(bench: &Bench) -> Value {
    let mut process = bench.start(&["calibrate", "machine.toml", "--verify"]);
    let mut time = Steps::of(bench);
    time.until(&mut process, || entries(bench, "verify", "point") >= 2);
    let blocked = "fault fault = { kind = \"beam_blocked\" }";
    lend_hand(&bench.folder().join("clock"), blocked).expect("the machine has a beam");
    drop(time);
    process.end().with_code(4)
}

/// What a second calibration tells whose stage begins to shake when its verification does.
fn shaken(bench: &Bench) -> Value {
    let mut process = bench.start(&["calibrate", "machine.toml", "--verify"]);
    let mut time = Steps::of(bench);
    time.until(&mut process, || entries(bench, "verify", "criterion") >= 2);
    let shakes = "fault fault = { kind = \"vibration\", amplitude_um = 20.0 }";
    lend_hand(&bench.folder().join("clock"), shakes).expect("the machine can shake");
    drop(time);
    process.end().with_code(5)
}

/// What was in use before was better, and is in use again; so the stage is corrected as well as it was.
#[test]
fn a_new_calibration_that_is_worse_gives_way_to_the_one_before_with_a_service_and_without() {
    for rig in live_rigs() {
        for is_kept in [false, true] {
            let bench = Bench::new(rig);
            let service = is_kept.then(|| keep(&bench));
            let words = ["calibrate", "machine.toml", "--verify"];
            let first = bench.run(&words).with_code(0);
            let told = shaken(&bench);
            drop(service);
            let verification = &told["verification"];
            assert_eq!(verification["ended"], "worse", "{told:#}");
            assert_eq!(verification["stored"][0]["in_use"], false, "{told:#}");
            let error = text(&told["error"]);
            for part in [
                "IS WORSE than what was before",
                "its runs scatter",
                "used before, is in use again",
            ] {
                assert!(error.contains(part), "{part}: {error}");
            }
            let next = [
                "truestage verify machine.toml",
                "truestage calibrate machine.toml --verify",
            ];
            assert_eq!(verification["next"], json!(next));
            let list = bench.run_plainly(&["cal", "list", "machine.toml"]);
            let list = list.with_code(0)["calibrations"].clone();
            let list = list.as_array().expect("a list");
            let used: Vec<_> = list.iter().filter(|it| it["active"] == true).collect();
            assert_eq!(used.len(), 1, "{list:?}");
            assert_eq!(used[0]["id"], first["calibration"], "{first:#}");
        }
    }
}

#[test]
fn a_verification_that_fails_tells_the_same_with_a_service_and_without() {
    for rig in live_rigs() {
        let told = [false, true].map(|is_kept| {
            let bench = Bench::new(rig);
            let service = is_kept.then(|| keep(&bench));
            let told = beam_lost(&bench);
            drop(service);
            let verification = &told["verification"];
            assert_eq!(verification["ended"], "failed", "{told:#}");
            let stored = &verification["stored"][0];
            let path = bench.folder().join(text(&stored["path"]));
            assert!(path.exists(), "{stored}");
            assert_eq!(
                (&stored["of"], &stored["in_use"]),
                (&json!("x"), &json!(true))
            );
            assert_eq!(
                verification["next"],
                json!(["truestage verify machine.toml"])
            );
            told
        });
        let names = told.map(|it| {
            let names = it.as_object().expect("an object").keys().cloned();
            // What devices counted is known to who keeps them.
            names.filter(|it| it != "counters").collect::<BTreeSet<_>>()
        });
        assert_eq!(names[0], names[1]);
    }
}
