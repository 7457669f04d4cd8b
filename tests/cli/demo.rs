//! The demonstrations: what anybody runs first.

use std::path::Path;

use serde_json::Value;
use tests::{Edit, Rig, UVW, UVW_COPLEY};
use truestage::config;

use crate::programs::{live_rigs, truestage};

/// Runs the demonstration of `machine` to its end, which is a good one: as found and as left, by
/// their places in what it prints, and a page.
#[track_caller]
fn check(machine: &str, found: &str, left: [&str; 2], limit: f64) {
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
}

fn number(said: &Value, place: &str) -> f64 {
    let value = said.pointer(place).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("{place} is no number in {said:#}"))
}

/// What the demonstration of `machine` prints, and its page; `None` where it is not shown.
fn shown(machine: &str) -> Option<(Value, String)> {
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
fn the_platform_shows_its_cycle() {
    let left = [
        "/as_left/largest_um",
        "/as_left_after_power_cycle/largest_um",
    ];
    check("uvw", "/as_found/largest_um", left, 2.0);
}

/// Two machines are shown: what the second one stores is none of the first one's business.
#[test]
fn both_platforms_shown_in_one_folder_keep_their_calibrations() {
    if !live_rigs().any(|rig| rig == Rig::Pty) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for machine in ["uvw", "uvw-copley"] {
        let words = ["demo", "--machine", machine, "--data-dir", "."];
        truestage(folder.path(), &words).with_code(0);
    }
    for shipped in [&UVW, &UVW_COPLEY] {
        let here = format!("data_dir = {:?}", folder.path());
        let text = shipped
            .machine
            .to_owned()
            .edit("data_dir = \"machine-data\"", &here);
        let machine = config::parse(&text, "machine.toml");
        let machine = machine.unwrap_or_else(|error| panic!("{error}"));
        let machine = machine.config.machine;
        let store = truestage::store_of(&machine);
        for screw in ["u", "v", "w"] {
            let active = store.active(screw).expect("it can be read").current;
            let id = active.unwrap_or_else(|| panic!("{}: {screw} has none", machine.name));
            let head = store.glance(&id).expect("it is whole").head;
            assert_eq!(
                (head.machine, head.stage_serial),
                (machine.name.clone(), machine.stage_serial.clone())
            );
        }
    }
}

#[test]
fn the_rotary_table_shows_its_cycle() {
    let left = [
        "/verified/as_left/largest_arcsec",
        "/verified_after_power_cycle/as_left/largest_arcsec",
    ];
    check("rotary", "/verified/as_found/largest_arcsec", left, 0.3);
}

/// What is shown without terminals, and how soon, is the only difference.
#[test]
fn without_terminals_it_is_the_same() {
    for machine in ["linear", "uvw", "rotary"] {
        let Some((on_terminals, _)) = shown(machine) else {
            return;
        };
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let words = [
            "demo",
            "--machine",
            machine,
            "--data-dir",
            ".",
            "--in-process",
        ];
        let in_process = truestage(folder.path(), &words).with_code(0);
        assert_eq!(figures(in_process), figures(on_terminals), "{machine}");
    }
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

/// The errors of the machine and their drift by far exceed what is left of them when it is corrected
/// by what it sees; its tables alone drift away.
#[test]
fn three_axes_show_their_day() {
    let Some((said, page)) = shown("volumetric") else {
        return;
    };
    let hours = said["hours"].as_array().expect("a list");
    assert_eq!(hours.len(), 5);
    let of = |at: usize, state: &str| number(&said, &format!("/hours/{at}/{state}"));
    for at in 0..5 {
        let (found, live) = (of(at, "as_found_um"), of(at, "corrected_um"));
        assert!(
            live < found / 3.0 && live < 2.0,
            "reading {at}: {found}, {live}"
        );
    }
    let (morning, evening) = (of(0, "by_tables_um"), of(4, "by_tables_um"));
    assert!(
        evening > 3.0 * of(4, "corrected_um"),
        "{morning}, {evening}"
    );
    assert!(evening > morning, "{morning}, {evening}");
    let parts = [
        "hour (h)",
        "as found",
        "tables alone",
        "corrected live",
        "e_xx",
        "Squareness",
    ];
    for part in parts.into_iter().chain(["<polygon", "thermometer (°C)"]) {
        assert!(page.contains(part), "`{part}` is not on the page");
    }
}
