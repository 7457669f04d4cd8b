//! Machines of every kind that a service keeps, at the command line: the same verbs say the same, and what a person
//! is asked is asked at this end.

use nix::sys::signal::Signal;
use serde_json::Value;
use tests::{Edit, ROTARY, Shipped, UVW};

use crate::programs::{Bench, live_rigs};
use crate::serve::keep;

/// The names of what an object says.
fn names(value: &Value) -> Vec<String> {
    let members = value.as_object().expect("an object");
    let mut names: Vec<_> = members.keys().cloned().collect();
    names.sort();
    names
}

/// Each of `verbs` without a service and with one.
fn check(shipped: Shipped, change: fn(String) -> String, verbs: &[&[&str]], refused: &[&[&str]]) {
    for rig in live_rigs() {
        let bench = Bench::of(rig, shipped, |text| text);
        bench.configure("machine.toml", change);
        let here: Vec<_> = verbs
            .iter()
            .map(|verb| bench.run(verb).with_code(0))
            .collect();
        let service = keep(&bench);
        for (verb, here) in verbs.iter().zip(&here) {
            let there = bench.run(verb).with_code(0);
            assert_eq!(names(&there), names(here), "{verb:?}: {there}");
        }
        for verb in refused {
            let refused = bench.run(verb).with_code(2);
            assert!(refused["error"].is_string(), "{refused}");
        }
        let status = bench.run(&["status"]).with_code(0);
        assert_eq!(status["machine"]["state"], "running", "{status}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}

#[test]
fn a_kept_table_is_calibrated_by_the_hand_that_its_client_lends() {
    let few = |text: String| {
        text.edit("placements = 4 ", "offsets = [0, 73, 162] ")
            .edit("optimise = ", "# ")
            .edit("amplification_limit = 3.0", "amplification_limit = 5.0")
    };
    let verbs: [&[&str]; 4] = [
        &["zero", "machine.toml"],
        &["calibrate", "machine.toml"],
        &["verify", "machine.toml"],
        &["move", "machine.toml", "c=400deg"],
    ];
    // Nobody is there who could be asked: nothing begins.
    let refused: [&[&str]; 2] = [
        &["calibrate", "machine.toml", "--hand", "ask"],
        &["calibrate", "machine.toml", "--record", "bus.log"],
    ];
    check(ROTARY, few, &verbs, &refused);
}

#[test]
fn a_kept_platform_says_what_it_says_without_a_service() {
    let short = |text: String| text.edit("poses = 20", "poses = 4");
    let verbs: [&[&str]; 4] = [
        &["zero", "machine.toml"],
        &["calibrate", "machine.toml"],
        &["verify", "machine.toml"],
        &["move", "machine.toml", "x=1mm", "theta=20arcsec"],
    ];
    let refused: [&[&str]; 1] = [&["zero", "machine.toml", "--axis", "u"]];
    check(UVW, short, &verbs, &refused);
}
