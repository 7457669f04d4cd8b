//! Journals as tables for other programs. What these find in them is asked in `peers`.

use std::fs;
use std::path::Path;
use std::process::Command;

use tests::Edit;

use crate::programs::{program, truestage};

/// A journal of a linear axis, in a folder of its own.
fn desk() -> tempfile::TempDir {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../controller/golden");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let to = folder.path().join("run.jsonl");
    fs::copy(golden.join("linear_calibrate.jsonl"), to).expect("there is room");
    folder
}

fn check_refused(folder: &Path, words: &str, code: i32, said: &[&str]) {
    let words: Vec<&str> = words.split(' ').collect();
    let ended = truestage(folder, &words);
    assert_eq!(ended.code, Some(code), "{words:?}: {ended:#?}");
    let error = ended.json["error"].to_string();
    for part in said {
        assert!(error.contains(part), "`{part}` is not in {error}");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder).expect("it is there");
    let names = files.map(|it| it.expect("it can be read").file_name());
    let mut names: Vec<_> = names.map(|it| it.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_journal_is_exported_beside_itself_and_nothing_is_ever_overwritten() {
    let folder = desk();
    let told = truestage(
        folder.path(),
        &["journal", "export", "run.jsonl", "--format", "csv"],
    );
    let told = told.with_code(0);
    let tables = told["tables"].as_array().expect("a list");
    assert!(tables.iter().any(|it| it["table"] == "point"), "{told:#}");
    let point = fs::read_to_string(folder.path().join("run.point.csv")).expect("it was written");
    let heading = "journal_line,time_utc,run,approach,target_m,set_point_m,encoder_m,measured_m,scatter_m,at_s,";
    assert!(point.starts_with(heading), "{point}");
    let before = names(folder.path());
    fs::write(folder.path().join("run.point.csv"), "mine").expect("there is room");
    let again = "journal export run.jsonl --format csv";
    check_refused(
        folder.path(),
        again,
        2,
        &["run.", "already", "nothing was written"],
    );
    assert_eq!(names(folder.path()), before);
    let kept = fs::read_to_string(folder.path().join("run.point.csv")).expect("it is there");
    assert_eq!(kept, "mine");
    for (format, file) in [("mcap", "run.mcap"), ("parquet", "run.header.parquet")] {
        let words = ["journal", "export", "run.jsonl", "--format", format];
        truestage(folder.path(), &words).with_code(0);
        assert!(folder.path().join(file).exists(), "{file}");
        check_refused(folder.path(), &words.join(" "), 2, &["nothing was written"]);
    }
}

#[test]
fn what_cannot_be_exported_is_refused_with_what_to_do() {
    let folder = desk();
    let it = folder.path();
    let export = "journal export run.jsonl --format";
    check_refused(
        it,
        &format!("{export} csv --table points"),
        2,
        &["no such table", "point, "],
    );
    check_refused(it, &format!("{export} parquet --out -"), 2, &["is for CSV"]);
    check_refused(
        it,
        &format!("{export} csv --out -"),
        2,
        &["--json", "--out"],
    );
    check_refused(
        it,
        &format!("{export} mcap --table point"),
        2,
        &["leave it out"],
    );
    let text = fs::read_to_string(it.join("run.jsonl")).expect("it is there");
    let damaged = text.edit("\"schema_version\":1", "\"schema_version\":0");
    fs::write(it.join("bad.jsonl"), damaged).expect("there is room");
    let bad = "journal export bad.jsonl --format csv";
    check_refused(it, bad, 3, &["bad.jsonl", "line 1", "checksum"]);
    assert_eq!(names(it), ["bad.jsonl", "run.jsonl"]);
}

/// What it prints, says, and ends with, as at a terminal.
fn printed(folder: &Path, words: &str) -> (String, String, Option<i32>) {
    let mut command = Command::new(program("truestage"));
    let command = command.current_dir(folder).args(words.split(' '));
    let ended = command.output().expect("it can be started");
    let text = |it: &[u8]| String::from_utf8_lossy(it).into_owned();
    (
        text(&ended.stdout),
        text(&ended.stderr),
        ended.status.code(),
    )
}

#[test]
fn one_table_is_printed_and_a_torn_line_is_told() {
    let folder = desk();
    let path = folder.path().join("run.jsonl");
    let text = fs::read_to_string(&path).expect("it is there");
    let whole = text.lines().filter(|it| it.contains("\"point\"")).count();
    fs::write(&path, format!("{text}0123abcd {{\"entry\":\"poi")).expect("there is room");
    let export = "journal export run.jsonl --format csv --out -";
    let (out, said, code) = printed(folder.path(), &format!("{export} --table point"));
    assert_eq!(
        (out.lines().count(), code),
        (whole + 1, Some(0)),
        "{out}{said}"
    );
    assert!(said.contains("not whole"), "{said}");
    let (out, said, code) = printed(folder.path(), export);
    assert_eq!((out.as_str(), code), ("", Some(2)), "{said}");
    assert!(
        said.contains("add --table with one of header, ") && said.contains(", point, "),
        "{said}"
    );
}
