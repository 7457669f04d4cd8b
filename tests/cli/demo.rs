//! The demonstrations: what anybody runs first.

use std::path::Path;

use serde_json::Value;
use tests::Rig;

use crate::programs::{live_rigs, one_machine, speed, truestage};

/// Runs the demonstration of `machine` to its end, which is a good one: as found and as left, by
/// their places in what it prints, and a page.
#[track_caller]
fn check(machine: &str, found: &str, left: [&str; 2], limit: f64) {
    // On CAN it would be the same ptys again.
    if !live_rigs().any(|rig| rig == Rig::Pty) {
        return;
    }
    let _turn = one_machine();
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let speed = speed(Rig::Pty);
    let words = [
        "demo",
        "--machine",
        machine,
        "--speed",
        &speed,
        "--data-dir",
        ".",
    ];
    let said = truestage(folder.path(), &words).with_code(0);
    let number = |place: &str| {
        let value = said.pointer(place).and_then(Value::as_f64);
        value.unwrap_or_else(|| panic!("{place} is no number in {said:#}"))
    };
    for left in left {
        let (found, left) = (number(found), number(left));
        assert!(left < found / 3.0, "{found} as found, {left} as left");
        assert!(left < limit, "{left}");
    }
    let report = said["report"].as_str().expect("it names its page");
    let page = std::fs::read_to_string(folder.path().join(Path::new(report)));
    assert!(page.expect("the page is there").contains("<svg"));
}

#[test]
fn the_linear_stage_shows_its_cycle() {
    let accuracy = "/accuracy/bidirectional";
    let of = |state: &str| format!("/{state}{accuracy}");
    let (left, after) = (of("as_left"), of("as_left_after_power_cycles"));
    check("linear", &of("as_found"), [&left, &after], 2.0);
}

#[test]
fn the_platform_shows_its_cycle() {
    let left = [
        "/as_left/largest_um",
        "/as_left_after_power_cycle/largest_um",
    ];
    check("uvw", "/as_found/largest_um", left, 2.0);
}

#[test]
fn the_rotary_table_shows_its_cycle() {
    let left = [
        "/verified/as_left/largest_arcsec",
        "/verified_after_power_cycle/as_left/largest_arcsec",
    ];
    check("rotary", "/verified/as_found/largest_arcsec", left, 0.3);
}
