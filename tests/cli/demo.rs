//! The demonstrations: what anybody runs first.

use std::path::Path;

use serde_json::Value;
use tests::Rig;

use crate::programs::{check_error, live_rigs, truestage};

/// Runs the demonstration of `machine` to its end, which is a good one: as found and as left, by
/// their places in what it prints, and a page. What is shown without terminals, and how soon, is the
/// only difference to one in the same process.
#[track_caller]
pub(crate) fn check(machine: &str, found: &str, left: [&str; 2], limit: f64) {
    let Some((said, page)) = shown(machine) else {
        return;
    };
    let number = |place: &str| number(&said, place);
    for left in left {
        let (found, left) = (number(found), number(left));
        assert!(left < found / 3.0, "{found} as found, {left} as left");
        assert!(left < limit, "{left}");
    }
    assert!(page.contains("<svg"));
    assert_eq!(figures(in_process(machine)), figures(said), "{machine}");
}

pub(crate) fn number(said: &Value, place: &str) -> f64 {
    let value = said.pointer(place).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("{place} is no number in {said:#}"))
}

/// What the demonstration of `machine` prints, and its page; `None` where it is not shown.
pub(crate) fn shown(machine: &str) -> Option<(Value, String)> {
    // On CAN it would be the same ptys again.
    if !live_rigs().any(|rig| rig == Rig::Pty) {
        return None;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let words = ["demo", "--machine", machine, "--data-dir", "."];
    let said = truestage(folder.path(), &words).with_code(0);
    let report = said["report"].as_str().expect("it names its page");
    let page = std::fs::read_to_string(folder.path().join(Path::new(report)));
    let page = page.expect("the page is there");
    Some((said, page))
}

#[test]
fn the_linear_stage_shows_its_cycle() {
    let accuracy = "/accuracy/bidirectional";
    let of = |state: &str| format!("/{state}{accuracy}");
    let (left, after) = (of("as_left"), of("as_left_after_power_cycles"));
    check("linear", &of("as_found"), [&left, &after], 2.0);
}

/// What it prints without terminals.
fn in_process(machine: &str) -> Value {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let words = ["demo", "--machine", machine, "--data-dir", "."];
    truestage(folder.path(), &[&words[..], &["--in-process"]].concat()).with_code(0)
}

/// The numbers without the time on the wall, which is another one in every run, as are the names of files and the
/// hashes of records, which say when they were made.
fn figures(said: Value) -> Value {
    match said {
        Value::Object(fields) => fields
            .into_iter()
            .filter(|(key, _)| key != "wall_s")
            .map(|(key, value)| (key, figures(value)))
            .collect(),
        Value::Array(values) => values.into_iter().map(figures).collect(),
        Value::String(_) => Value::Null,
        number => number,
    }
}

#[test]
fn a_speed_is_refused_by_what_is_never_shown_in_real_time() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let words = ["demo", "--machine", "volumetric", "--speed", "30"];
    let refused = truestage(folder.path(), &words).with_code(2);
    check_error(&refused, &["--speed", "volumetric", "leave it out"]);
    let left = std::fs::read_dir(folder.path()).expect("it is there");
    assert_eq!(left.count(), 0, "nothing was begun");
}
