//! A platform whose configuration is wrong is refused by its calibration, and the key that is wrong is
//! named.

use tests::{Bench, Edit, UVW};
use truestage::Failure;

/// Changes of the shipped configuration.
type Edits<'a> = &'a [(&'a str, &'a str)];

/// Fewer strokes than it ships with.
fn shortened(text: String) -> String {
    text.edit("step_mm = 0.25", "step_mm = 0.625")
        .edit("runs = 2", "runs = 1")
}

/// Why a platform with these changes is not calibrated; nothing is stored.
fn refused(seed: u64, edits: Edits<'_>) -> Failure {
    let wrong = |text: String| {
        let edit = |text: String, (from, to): &(&str, &str)| text.edit(from, to);
        edits.iter().fold(shortened(text), edit)
    };
    let mut bench = Bench::of(&UVW, seed, wrong);
    let store = bench.store.clone();
    bench.machine.start().unwrap();
    bench.machine.platform().unwrap().zero(&store).unwrap();
    let result = bench.machine.platform().unwrap().calibrate(&store);
    let failure = result.expect_err("the configuration is wrong");
    for axis in ["u", "v", "w"] {
        assert_eq!(store.active(axis).unwrap().current, None, "{edits:?}");
    }
    assert_eq!(store.list().unwrap(), Vec::<String>::new(), "{edits:?}");
    failure
}

/// The cause is named, and keys with the value that they should have, to what the screws' own errors
/// leave of it.
#[track_caller]
fn check(edits: Edits<'_>, cause: &str, keys: &[(&str, f64)]) {
    for seed in [3, 4] {
        let failure = refused(seed, edits);
        let text = failure.to_string();
        let probably = format!("; probably {cause}");
        assert!(
            text.contains(&probably),
            "{edits:?}: `{probably}` is not in {text}"
        );
        for (key, value) in keys {
            let seen = number_behind(&text, key);
            assert!((seen - value).abs() <= 0.005 * value.abs(), "{key}: {text}");
        }
        assert!(text.contains("nothing was stored"), "{text}");
        assert!(!text.contains("; or "), "{edits:?}: {text}");
        assert_eq!(failure.exit_code(), 2, "{text}");
    }
}

#[track_caller]
fn number_behind(text: &str, words: &str) -> f64 {
    let (_, rest) = text
        .split_once(words)
        .unwrap_or_else(|| panic!("`{words}` is not in {text}"));
    let end = rest.find(|it: char| !(it.is_ascii_digit() || "-.".contains(it)));
    rest[..end.unwrap_or(rest.len())].parse().unwrap()
}

const MIRRORED: (&str, &str) = ("mirrored = false", "mirrored = true");

#[test]
fn a_camera_that_is_mirrored_or_turned_is_named() {
    let right = [("`mirrored = false` and `rotation_deg = ", 0.0)];
    check(&[MIRRORED], "the picture is mirrored in y", &right);
    let turned = |to| ("rotation_deg = 0.0", to);
    let edits = [MIRRORED, turned("rotation_deg = 180.0")];
    check(&edits, "the picture is mirrored in x", &right);
    let edits = [turned("rotation_deg = 90.0")];
    check(&edits, "the camera is turned by -90°", &right);
}

#[test]
fn a_wrong_unit_of_the_camera_is_named() {
    let right = [("`length_um_per_unit = ", 1.0)];
    for unit in ["0.001", "0.1", "0.5", "2.0", "10.0", "25.4", "1000.0"] {
        let to = format!("length_um_per_unit = {unit}");
        let edits = [("length_um_per_unit = 1.0", to.as_str())];
        check(&edits, "the camera's lengths are ", &right);
    }
    let right = [("`angle_arcsec_per_unit = ", 1.0)];
    for unit in ["0.5", "2.0", "60.0", "3600.0"] {
        let to = format!("angle_arcsec_per_unit = {unit}");
        let edits = [("angle_arcsec_per_unit = 1.0", to.as_str())];
        check(&edits, "the camera's angles are ", &right);
    }
}

#[test]
fn screws_that_were_exchanged_are_named() {
    let exchanged = |a: &'static str, b: &'static str| {
        let edits = [(a, "axis = \"\""), (b, a), ("axis = \"\"", b)];
        edits.to_vec()
    };
    let (u, v, w) = ("axis = \"u\"", "axis = \"v\"", "axis = \"w\"");
    let cause = "screws are exchanged (v moved u, u moved v): \
                 `axis = \"v\"` in the [[platform.actuator]] of u";
    check(&exchanged(u, v), cause, &[]);
    let cause = "screws are exchanged (w moved u, u moved w): \
                 `axis = \"w\"` in the [[platform.actuator]] of u";
    check(&exchanged(u, w), cause, &[]);
}

#[test]
fn a_wrong_resolution_of_the_screws_is_named() {
    let edit = |to| [("resolution_nm = 10.0", to)];
    let right = [("every screw goes ", 0.5), ("`resolution_nm = ", 10.0)];
    check(&edit("resolution_nm = 20.0"), "every screw goes ", &right);
    let right = [("`resolution_nm = ", 10.0)];
    let cause = "every screw goes the other way";
    check(&edit("resolution_nm = -10.0"), cause, &right);
    let of_w = [(
        "node_id = 3\nresolution_nm = 10.0",
        "node_id = 3\nresolution_nm = 25.0",
    )];
    let right = [("screw w goes ", 0.4), ("`resolution_nm = ", 10.0)];
    check(&of_w, "screw w goes ", &right);
}

#[test]
fn what_no_single_mistake_explains_is_said_to_be_so_with_what_was_seen() {
    let edits = [
        MIRRORED,
        (
            "node_id = 3\nresolution_nm = 10.0",
            "node_id = 3\nresolution_nm = 20.0",
        ),
    ];
    let failure = refused(5, &edits);
    let text = failure.to_string();
    for part in ["explains it by itself", "1 mm of w was seen as", "um/mm"] {
        assert!(text.contains(part), "`{part}` is not in {text}");
    }
    assert_eq!(failure.exit_code(), 3, "as without the look at causes");
}
