//! A person at the service's page, in a browser that nobody here has written.

use serde_json::{Value, json};
use tests::{Rig, rigs};

use crate::http::programs;
use crate::peer::{Peer, can_import};

/// As Debian calls it.
pub(crate) const BROWSER: &str = "chromium";

pub(crate) fn has_browser() -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|it| it.join(BROWSER).is_file())
}

/// From a file, in which a slip is named first; along x and then along y.
fn follows_a_path_of_three_axes(path: &Value) {
    assert_eq!(path["zeroed"], true, "{path}");
    let said = |name: &str, part: &str| {
        let text = path[name].as_str().expect("what the page says");
        assert!(text.contains(part), "`{part}` is not in {name}: {path}");
    };
    said("slip", "line 3, column x_mm");
    // Four seconds of periods of 60 ms, and the last row itself.
    said("planned", "68 points");
    said("planned", "4 s at least");
    said("planned", "bus load can0 ");
    let stood = path["ended"].as_array().expect("where each axis is");
    let stood = stood.iter().map(|it| it.as_f64().expect("in millimetres"));
    for (axis, (mm, expected)) in stood.zip([9.0, 9.0, 5.0]).enumerate() {
        assert!((mm - expected).abs() < 0.01, "axis {axis}: {path}");
    }
    assert_eq!(path["errors"], json!([]), "{path}");
}

#[test]
fn a_person_at_the_page_takes_a_machine_through_its_cycle_and_through_a_lost_connection() {
    // Which bus the machine is on makes no difference to a page.
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    if !has_browser() || !can_import("websocket") {
        let why = "Chromium or Python's websocket-client is not installed: run tests/run";
        return tests::not_run("a person at the service's page", why);
    }
    let programs = programs();
    let report = Peer::start("page_judge.py", &[&programs.to_string_lossy(), BROWSER]).finish();
    for step in ["zeroed", "calibrated", "zero_again", "verified"] {
        assert_eq!(report[step], true, "{step}: {report}");
    }
    assert_eq!(report["job"], true, "{report}");
    follows_a_path_of_three_axes(&report["path"]);
    for look in ["1100_light", "1100_dark", "360_light", "360_dark"] {
        assert_eq!(report["looks"][look], true, "{look}: {report}");
    }
    let robbed = json!([
        "Take control from anna",
        "Yes, take control from anna",
        "anna"
    ]);
    assert_eq!(report["robbed"], robbed, "{report}");
    let reached = report["keyboard"].as_array().expect("what Tab reaches");
    for id in ["file", "rows", "Plan"] {
        assert!(reached.iter().any(|it| it == id), "{id}: {report}");
    }
    assert_eq!(report["errors"], json!([]), "{report}");
    assert_eq!(report["axis"], "x · Standstill", "{report}");
    let stood = report["true_mm"].as_f64();
    assert!(
        stood.is_some_and(|it| (it - 12.5).abs() < 0.003),
        "{report}"
    );
}

/// A person at a service that hangs, and at one of more pages than a browser has connections.
#[test]
fn a_page_shows_silence_and_whether_a_stop_was_taken() {
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    if !has_browser() || !can_import("websocket") {
        let why = "Chromium or Python's websocket-client is not installed: run tests/run";
        return tests::not_run("a person at the page of a service that hangs", why);
    }
    let programs = programs();
    let words = [&*programs.to_string_lossy(), BROWSER];
    let report = Peer::start("silence_judge.py", &words).finish();
    for (name, expected) in [
        ("grey_before", false),
        ("grey", true),
        ("grey_after", false),
    ] {
        assert_eq!(report[name], expected, "{name}: {report}");
    }
    let within = |stop: &Value, word: &str, most_s: f64| {
        let said = stop[0].as_str().expect("what the page says");
        let after_s = stop[1].as_f64().expect("seconds");
        assert!(said.starts_with(word), "{stop}: {report}");
        assert!(after_s <= most_s, "{stop}: {report}");
    };
    // What the page draws and this program asks again for comes on top of the two seconds.
    let silent_s = report["silent_s"].as_f64().expect("seconds");
    assert!((1.0..=3.0).contains(&silent_s), "{report}");
    let unanswered = &report["unanswered"];
    within(unanswered, "NO ANSWER: use the emergency stop", 3.0);
    within(&report["taken"], "taken at ", 2.0);
    let stops = report["many"]["stops"].as_array().expect("of each page");
    assert_eq!(stops.len(), 10, "{report}");
    for stop in stops {
        within(stop, "taken at ", 2.0);
    }
}
