//! The demonstrations: what anybody runs first.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tests::Rig;

use crate::programs::{check_error, live_rigs, program, truestage};
use crate::tutorial::{are_lines, blocks, repository};

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

#[test]
fn the_linear_stage_shows_what_the_readme_says() {
    let readme = std::fs::read_to_string(repository().join("README.md"));
    let readme = readme.expect("it is there");
    let mut blocks = blocks(&readme).into_iter().map(|it| it.1);
    let shown = blocks.find(|it| it.first().is_some_and(|it| it.starts_with("ISO 230-2")));
    let shown = shown.expect("README shows what the demonstration prints");
    let shown: Vec<_> = shown.into_iter().map(str::to_owned).collect();
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut command = Command::new(program("truestage"));
    command
        .args(["demo", "--in-process"])
        .current_dir(folder.path());
    let printed = command.output().expect("it is a program").stdout;
    let printed = String::from_utf8(printed).expect("it prints text");
    let lines: Vec<_> = printed.trim_start().lines().collect();
    assert!(
        are_lines(&shown, &lines),
        "README has {shown:#?}, printed is\n{printed}"
    );
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
