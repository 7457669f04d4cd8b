//! The level and the bands of a zero search, as a user has them proposed.

use crate::programs::{Bench, live_rigs, number, text};

#[test]
fn a_sweep_is_measured_kept_and_planned_with_again() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let planned = bench.run(&["plan", "zero"]).with_code(0);
        let zero = &planned["zero"];
        let level = number(&zero["level_below_peak_v"]);
        assert!((0.5..1.5).contains(&level), "{planned}");
        assert!(
            number(&zero["noise_mv"]) < 0.4 && number(&zero["delta1_mv"]) > 1.0,
            "{planned}"
        );
        assert_eq!(planned["proposed"]["fits"], true);
        assert_eq!(
            planned["configured"]["fits"], true,
            "the shipped level is a good one"
        );
        let sweep = text(&planned["sweep"]);
        let again = bench
            .run_plainly(&["plan", "zero", "--sweep", sweep])
            .with_code(0);
        assert_eq!(&again["zero"], zero);
        let missing = bench.run_plainly(&["plan", "zero", "--sweep", "nowhere.csv"]);
        missing.with_code(2);
        assert_eq!(bench.stop(), Some(0));
    }
}
