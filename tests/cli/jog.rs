//! `truestage jog`: an axis that runs as long as somebody says so.

use crate::programs::{Bench, live_rigs, number};

#[test]
fn an_axis_is_jogged_for_a_time_and_to_its_soft_limit() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let jogged = bench.run(&["jog", "machine.toml", "x=2mm/s", "--for", "1.5"]);
        let jogged = jogged.with_code(0);
        // From its zero, less what it takes to speed up, plus what it takes to stop.
        let stands = number(&jogged["encoder_mm"]);
        assert!((2.5..=3.5).contains(&stands), "{jogged}");
        assert_eq!(jogged["at_soft_limit"], false, "{jogged}");
        let jogged = bench.run(&["jog", "machine.toml", "x=-5mm/s"]).with_code(0);
        let stands = number(&jogged["encoder_mm"]);
        assert!((stands + 3.0).abs() < 0.001, "{jogged}");
        assert_eq!(jogged["at_soft_limit"], true, "{jogged}");
    }
}

#[test]
fn a_jog_that_makes_no_sense_is_refused_before_anything_moves() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let refused = |words: &[&str], said: &str| {
            let words = [&["jog", "machine.toml"], words].concat();
            let refused = bench.run(&words).with_code(2);
            assert!(refused["error"].to_string().contains(said), "{refused}");
        };
        refused(&["x=2"], "with a sign and a unit");
        refused(&["x=0mm/s"], "with a sign and a unit");
        refused(&["x=2mm/s", "--for", "0"], "no time");
        refused(&["x=900mm/s"], "faster than it usually moves");
        refused(&["q=2mm/s"], "q");
        let zeros = std::fs::read_dir(bench.records().join("runs"));
        assert_eq!(zeros.map_or(0, Iterator::count), 0, "it zeroed nothing");
    }
}
