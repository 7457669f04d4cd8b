//! A machine's file to begin with: from an example, flags, answers at a terminal. No machine is there.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tests::Edit;

use crate::intended::at_a_terminal;
use crate::programs::{check_error, check_says, text, truestage};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn read(folder: &Path) -> String {
    fs::read_to_string(folder.join("machine.toml")).expect("it was written")
}

fn keys(list: &Value) -> Vec<String> {
    let each = list.as_array().expect("a list").iter();
    each.map(|it| text(it).to_owned()).collect()
}

/// Sound, with what is to be filled in at its line, and not overwritten.
#[test]
fn a_file_is_written_for_each_machine_and_check_says_what_is_missing_in_it() {
    for machine in ["linear", "uvw", "uvw-copley", "rotary", "volumetric"] {
        let folder = folder();
        let here = folder.path();
        let made = truestage(here, &["new", "--machine", machine]).with_code(0);
        let checked = truestage(here, &["check"]).with_code(0);
        assert_eq!(
            (&checked["machine"], &checked["warnings"]),
            (&machine.into(), &[(); 0][..].into())
        );
        let unfilled = checked["unfilled"].as_array().expect("a list");
        let named: Vec<_> = unfilled
            .iter()
            .map(|it| text(&it["key"]).to_owned())
            .collect();
        assert_eq!(named, keys(&made["to_fill_in"]), "{machine}");
        let (written, at) = (read(here), unfilled[0]["line"].as_u64().expect("a number"));
        let line = written.lines().nth(at as usize - 1).expect("it is there");
        assert!(
            line.starts_with("stage_serial") && line.ends_with("# FILL IN"),
            "{line}"
        );
        let again = truestage(here, &["new", "--machine", "rotary"]).with_code(2);
        check_error(
            &again,
            &["machine.toml: this file already exists", "another name"],
        );
        assert_eq!(read(here), written);
    }
}

#[test]
fn nothing_moves_by_the_values_of_an_example() {
    let folder = folder();
    let here = folder.path();
    let words = [
        "new",
        "--machine",
        "linear",
        "--set",
        "axis.x.soft_max_mm=62.5",
    ];
    truestage(here, &words).with_code(0);
    for words in [&["zero", "--dry-run"][..], &["zero"], &["jog", "x=1mm/s"]] {
        let refused = truestage(here, words).with_code(2);
        check_error(
            &refused,
            &[
                "axis.x.soft_min_mm: -3.0 is an example's",
                "remove `# FILL IN`",
            ],
        );
        assert!(
            !text(&refused["error"]).contains("soft_max_mm"),
            "{refused}"
        );
    }
    fs::write(
        here.join("machine.toml"),
        read(here).edit("   # FILL IN", ""),
    )
    .expect("there is room");
    truestage(here, &["zero", "--dry-run"]).with_code(0);
}

#[test]
fn what_cannot_be_is_told_and_nothing_is_written() {
    let folder = folder();
    let here = folder.path();
    for (words, says) in [
        (&[][..], "add --machine"),
        (
            &["--machine", "linear", "--set", "axis.x.soft_mim_mm=1"],
            "no such key",
        ),
        (
            &["--machine", "linear", "--set", "axis.x.soft_max_mm=10"],
            "axis.x.calibrate.end_mm",
        ),
        (
            &["--machine", "linear", "--port", "can7=socketcan:can0"],
            "`can7` is not a CAN bus",
        ),
        (
            &["--machine", "linear", "--found", "nowhere.json"],
            "nowhere.json",
        ),
    ] {
        let refused = truestage(here, &[&["new"], words].concat()).with_code(2);
        check_error(&refused, &[says]);
    }
    assert_eq!(fs::read_dir(here).expect("it is there").count(), 0);
}

/// Measurements of the example that a shorter travel leaves no room for are asked for again.
#[test]
fn a_person_is_asked_for_what_every_machine_has_another_of_until_all_of_it_fits() {
    let folder = folder();
    let first = "curved\nlinear\nTS-12\n/dev/can\n/dev/laser\n0.0\n20.0\n\n33.0\n";
    let example = "\n".repeat(11);
    let answers = format!("{first}{example}30.0\n28.7\n");
    let (seen, code) = at_a_terminal(folder.path(), &["new"], &answers);
    check_says(
        &seen,
        &[
            "`curved` is none of them",
            "machine.stage_serial [\"TS-LIN-0001\"]: Serial number of the stage",
            "0 is impossible",
            "axis.x.calibrate.end_mm [60.0]",
        ],
    );
    assert_eq!(code, Some(0), "{seen}");
    let written = read(folder.path());
    for line in [
        "resolution_nm = 20.0\n",
        "soft_max_mm = 33.0\n",
        "end_mm = 28.7\n",
    ] {
        assert!(written.contains(line), "{line}: {written}");
    }
    let checked = truestage(folder.path(), &["check"]).with_code(0);
    assert!(
        checked["unfilled"].to_string().contains("soft_min_mm"),
        "{checked}"
    );
}

/// Answers are not thrown away because one of them cannot be right yet, or nobody has the next one.
#[test]
fn what_was_answered_at_a_terminal_is_written_though_it_does_not_fit_and_though_nobody_goes_on() {
    let first = "linear\nTS-12\n/dev/can\n/dev/laser\n20.0\n\n33.0\n";
    let enters = "\n".repeat(13);
    for (last, code) in [(&*enters, 2), ("\u{4}", 2)] {
        let folder = folder();
        let (seen, ended) = at_a_terminal(folder.path(), &["new"], &format!("{first}{last}"));
        assert_eq!(ended, Some(code), "{seen}");
        check_says(&seen, &["machine.toml: written", "axis.x.calibrate.end_mm"]);
        let written = read(folder.path());
        for line in [
            "stage_serial = \"TS-12\"\n",
            "soft_max_mm = 33.0\n",
            "soft_min_mm = -3.0   # FILL IN\n",
        ] {
            assert!(written.contains(line), "{line}: {written}");
        }
        let checked = truestage(folder.path(), &["check"]).with_code(2);
        check_error(&checked, &["axis.x.calibrate.end_mm"]);
    }
    let folder = folder();
    let (seen, ended) = at_a_terminal(folder.path(), &["new"], "linear\nTS-12\n\u{4}");
    assert_eq!(ended, Some(0), "{seen}");
    truestage(folder.path(), &["check"]).with_code(0);
    let (seen, ended) = at_a_terminal(folder.path(), &["new", "other.toml"], "linear\n\u{4}");
    check_says(&seen, &["nothing was written"]);
    assert_eq!(ended, Some(2), "{seen}");
}
