//! What was read of a plate, or designed, and is given in files: the same with a service that keeps the machine.

use std::path::Path;

use nix::sys::signal::Signal;
use serde_json::Value;
use tests::ROTARY;

use crate::programs::{Bench, live_rigs, truestage};
use crate::rotary::{folder, placement_file, sighted_machine};
use crate::serve::keep;

/// A machine that a service keeps, and the same without one.
struct Both<'b> {
    kept: &'b Bench,
    alone: &'b Path,
}

impl Both<'_> {
    /// What `words` print on both, which must be the same but for names with the time in them.
    fn run(&self, words: &[&str], code: i32) -> Value {
        let [kept, alone] = [self.kept.run(words), truestage(self.alone, words)]
            .map(|ended| without_names(ended.with_code(code)));
        assert_eq!(kept, alone, "{words:?}");
        kept
    }

    /// Writes the placement at `offset` into both folders; what it is called.
    fn placement(&self, offset: usize) -> String {
        placement_file(self.alone, offset);
        placement_file(self.kept.folder(), offset)
    }
}

fn without_names(mut value: Value) -> Value {
    let all = value.as_object_mut().expect("one object");
    for name in ["journal", "path", "calibration", "counters"] {
        all.remove(name);
    }
    value
}

#[test]
fn a_plate_that_was_read_elsewhere_is_taken_alike_with_a_service_and_without() {
    for rig in live_rigs() {
        let bench = Bench::of(rig, ROTARY, |text| text);
        let alone = folder();
        for at in [bench.folder(), alone.path()] {
            sighted_machine(at, "deviation");
        }
        let service = keep(&bench);
        let both = Both {
            kept: &bench,
            alone: alone.path(),
        };
        let calibrate = |words: &[&str], code| {
            let words = [&["calibrate", "machine.toml"], words].concat();
            both.run(&words, code)
        };
        let later = both.placement(7);
        let refused = calibrate(&["--readings", &later], 2)["error"].to_string();
        assert!(refused.contains("at-7.csv:2:1: `offset` is 7"), "{refused}");
        let first = both.placement(0);
        calibrate(&["--readings", &first, "--verify"], 2);
        let begun = calibrate(&["--readings", &first], 0);
        assert_eq!(begun["due"]["offset"], 1.0);
        let rest: Vec<_> = [1, 7, 11].map(|it| both.placement(it)).into();
        let mut words = vec!["--resume"];
        rest.iter()
            .for_each(|it| words.extend(["--readings", it.as_str()]));
        assert_eq!(calibrate(&words, 0)["complete"], true);
        let between = both.placement(20);
        let words = ["verify", "machine.toml", "--readings", &between];
        assert_eq!(both.run(&words, 0)["within_tolerance"], true);
        // None of that has moved anything.
        let status = bench.run(&["status"]).with_code(0);
        assert_eq!(status["axes"][0]["homed"], false, "{status:#}");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
