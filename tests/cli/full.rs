//! Where what is printed finds no room, the exit code says so, and so does standard error.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::Path;
use std::process::Command;

use tests::{Edit, LINEAR};

use crate::programs::{program, text, truestage};

/// Always full, as a disk is sometimes.
const FULL: &str = "/dev/full";

/// A machine with a calibration, whose name is returned.
fn calibrated(here: &Path) -> String {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../controller/golden");
    fs::copy(
        golden.join("linear_calibrate.jsonl"),
        here.join("run.jsonl"),
    )
    .expect("there is room");
    fs::write(here.join("machine.toml"), LINEAR.machine).expect("there is room");
    let mut data = "run,approach,target_mm,measured_mm\n".to_owned();
    for run in 1..=2 {
        for (approach, targets) in [("+", [0.0, 30.0, 60.0]), ("-", [60.0, 30.0, 0.0])] {
            for target in targets {
                data += &format!("{run},{approach},{target},{target}\n");
            }
        }
    }
    fs::write(here.join("data.csv"), data).expect("there is room");
    let words = ["fit", "linear", "data.csv", "--save", "machine.toml"];
    let fitted = truestage(here, &words).with_code(0);
    text(&fitted["calibration"]).to_owned()
}

/// How a command ends whose standard output is full: its exit code, and what it says.
fn on_a_full_disk(here: &Path, words: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(program("truestage"));
    command.current_dir(here).args(words);
    let full = File::options().write(true).open(FULL);
    command.stdout(full.expect("every Linux has it"));
    let ended = command.output().expect("it is a program");
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    (ended.status.code(), said)
}

fn check_told(here: &Path, words: &[&str]) {
    let (code, said) = on_a_full_disk(here, words);
    assert_eq!(code, Some(2), "{words:?}: {said}");
    let told = "error: standard output cannot be written: No space left on device";
    assert!(said.contains(told), "{words:?}: {said}");
}

#[test]
fn a_full_disk_under_standard_output_is_told_by_every_verb_that_prints() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    let id = calibrated(here);
    let of = |verb: &'static str| ["cal", verb, "machine.toml", &id];
    let table = [&of("export")[..], &["--format", "linuxcnc"]].concat();
    let journal = "journal export run.jsonl --format csv --table point --out -";
    let lines = [
        "check machine.toml",
        "cal list machine.toml",
        "explain 0x8611",
        "iso230 data.csv",
        "report run.jsonl",
        "schema machine",
        "completions bash",
        "man .",
        "help check",
        "cal --help",
        "--version",
        journal,
    ];
    for line in lines {
        check_told(here, &line.split(' ').collect::<Vec<_>>());
    }
    for words in [&of("show")[..], &table] {
        check_told(here, words);
        check_told(here, &[&["--json"], words].concat());
    }
}

#[test]
fn what_was_stored_is_kept_where_standard_output_is_full() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    calibrated(here);
    let data = fs::read_to_string(here.join("data.csv")).expect("it is there");
    fs::write(here.join("data.csv"), data.edit(",30\n", ",30.001\n")).expect("there is room");
    check_told(
        here,
        &["fit", "linear", "data.csv", "--save", "machine.toml"],
    );
    let listed = truestage(here, &["cal", "list", "machine.toml"]).with_code(0);
    let listed = listed["calibrations"].as_array().expect("a list");
    assert_eq!(listed.len(), 2, "{listed:#?}");
}

#[test]
fn a_result_that_is_a_failure_keeps_its_exit_code_where_standard_output_is_full() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let (code, said) = on_a_full_disk(folder.path(), &["--json", "check", "nowhere.toml"]);
    assert_eq!(code, Some(2), "{said}");
    for part in ["standard output cannot be written", "nowhere.toml"] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

/// How a command ends that may write no byte to any file, as on a full disk: its exit code.
fn without_room(here: &Path, words: &[&str]) -> Option<i32> {
    let mut command = Command::new("sh");
    command.args(["-c", "trap '' XFSZ; ulimit -f 0; exec \"$@\"", "sh"]);
    command
        .current_dir(here)
        .arg(program("truestage"))
        .args(words);
    command.output().expect("every Linux has sh").status.code()
}

#[test]
fn a_file_that_cannot_be_written_is_not_there_and_what_was_there_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let here = folder.path();
    let id = calibrated(here);
    let page = ["report", "run.jsonl", "-o", "page.html"];
    let export = [
        "cal",
        "export",
        "machine.toml",
        &id,
        "--format",
        "csv",
        "--out",
        "x.csv",
    ];
    let tables = [
        "journal",
        "export",
        "run.jsonl",
        "--format",
        "csv",
        "--out",
        "tables",
    ];
    let names = || {
        let files = fs::read_dir(here).expect("it is there");
        files
            .map(|it| it.expect("it can be read").file_name())
            .collect::<BTreeSet<_>>()
    };
    fs::create_dir(here.join("tables")).expect("there is room");
    let before = names();
    for words in [&page[..], &export, &tables] {
        assert_eq!(without_room(here, words), Some(2), "{words:?}");
        assert_eq!(names(), before, "{words:?}");
    }
    truestage(here, &page).with_code(0);
    let whole = fs::read(here.join("page.html")).expect("it was written");
    assert_eq!(without_room(here, &page), Some(2));
    assert_eq!(
        fs::read(here.join("page.html")).expect("it is there"),
        whole
    );
}
