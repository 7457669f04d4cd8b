//! A linear axis whose resolution or direction is wrong is refused when it is zeroed, and that is named, in
//! place of broken sensors or magnets that are missing.

use tests::{Bench, Edit};
use truestage::Failure;

/// Why an axis with another resolution is not zeroed; all else is as it ships, but for accelerations
/// that the axis can follow, and that the check of the configuration permits, at that resolution.
fn refused(seed: u64, resolution_nm: &str) -> Failure {
    let nm: f64 = resolution_nm.parse().unwrap();
    let fitting = |key: &str, most: f64| format!("{key} = {}", most.min(500.0 * nm.abs()));
    let wrong = |text: String| {
        text.edit(
            "resolution_nm = 10.0",
            &format!("resolution_nm = {resolution_nm}"),
        )
        .edit(
            "acceleration_mm_per_s2 = 5000.0",
            &fitting("acceleration_mm_per_s2", 5000.0),
        )
        .edit(
            "deceleration_mm_per_s2 = 20000.0",
            &fitting("deceleration_mm_per_s2", 20000.0),
        )
    };
    let mut bench = Bench::with(seed, wrong, |text| text);
    let store = bench.store.clone();
    let result = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.linear("x")?.zero(&store)
    });
    assert!(!bench.machine.is_zeroed("x"), "{resolution_nm}");
    result.expect_err("the resolution is wrong")
}

/// The resolution is named, as well as the place of the limit switch is known.
#[track_caller]
fn check(resolution_nm: &str, words: &str, right_nm: f64) {
    for seed in [3, 4, 5] {
        let failure = refused(seed, resolution_nm);
        let text = failure.to_string();
        let (_, rest) = text
            .split_once(words)
            .unwrap_or_else(|| panic!("{resolution_nm}: `{words}` is not in {text}"));
        let number = rest.split('`').next().unwrap();
        let seen: f64 = number
            .parse()
            .unwrap_or_else(|_| panic!("{number}: {text}"));
        let off = (seen / right_nm - 1.0).abs();
        assert!(off < 0.05, "{resolution_nm}: {text}");
        assert_eq!(failure.exit_code(), 2, "{text}");
    }
}

#[test]
fn an_axis_that_goes_less_far_than_it_is_commanded_is_named_with_its_resolution() {
    for resolution_nm in ["20.0", "40.0", "80.0"] {
        check(
            resolution_nm,
            "resolution is probably `resolution_nm = ",
            10.0,
        );
    }
}

#[test]
fn an_axis_that_goes_farther_than_it_is_commanded_is_named_with_its_resolution() {
    check("5.0", "resolution is probably `resolution_nm = ", 10.0);
}

#[test]
fn an_axis_that_goes_the_other_way_is_named() {
    check(
        "-10.0",
        "direction is probably inverted, `resolution_nm = ",
        10.0,
    );
}

#[test]
fn an_axis_that_meets_no_limit_switch_on_far_more_than_its_travel_is_named() {
    for resolution_nm in ["1000.0", "10000.0"] {
        let text = refused(3, resolution_nm).to_string();
        for part in ["met no limit switch", "resolution is probably below"] {
            assert!(text.contains(part), "{resolution_nm}: {text}");
        }
    }
}

/// The travel is 69 mm by its encoder, which is hardly more than to the middle of the magnets.
#[test]
fn an_axis_that_goes_a_tenth_of_what_it_is_commanded_is_named_with_its_resolution() {
    check("100.0", "resolution is probably `resolution_nm = ", 10.0);
}
