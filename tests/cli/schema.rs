//! The schema of `--json`: printed as it stands beside the documents, and kept to by what no other test runs.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};
use tests::json_schema::Schema;

use crate::programs::{program, text, truestage};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

#[test]
fn the_program_prints_the_schemas_that_lie_beside_its_documents() {
    let folder = folder();
    let printed = |which| truestage(folder.path(), &["schema", which]).with_code(0);
    let output = printed("output");
    assert_eq!(output["document"], *Schema::of_output().document());
    let machine = include_str!("../../configs/machine.schema.json");
    let machine: Value = serde_json::from_str(machine).expect("it is JSON");
    assert_eq!(printed("machine")["document"], machine);
    // For a file of its own, as it is.
    let plain = Command::new(program("truestage"))
        .args(["schema", "output"])
        .output()
        .expect("it can be started");
    let plain: Value = serde_json::from_slice(&plain.stdout).expect("it is JSON");
    assert_eq!(plain, output["document"]);
}

#[test]
fn a_command_line_that_is_refused_is_an_object_like_every_failure() {
    let folder = folder();
    for (words, says) in [
        (&["no-such-verb"][..], "no-such-verb"),
        (&["cal"], "Usage"),
        (&["move", "--no-such-option"], "--no-such-option"),
    ] {
        let ended = truestage(folder.path(), words);
        assert!(ended.said.contains(says), "{ended:?}");
        let refused = ended.with_code(2);
        assert_eq!(refused["verb"], "", "{refused}");
        assert!(text(&refused["error"]).contains(says), "{refused}");
        assert_eq!(refused["exit_code"], 2, "{refused}");
    }
    let mut plain = Command::new(program("truestage"));
    let ended = plain.arg("no-such-verb").output();
    let ended = ended.expect("it can be started");
    assert!(ended.stdout.is_empty(), "{ended:?}");
}

#[test]
fn every_object_says_its_version_and_whose_it_is() {
    let folder = folder();
    fs::write(folder.path().join("wrong.toml"), "schema_version = 1\n").expect("there is room");
    for (words, verb, code) in [
        ("explain 4 0x8611 0x06090030", "explain", 0),
        ("man .", "man", 0),
        ("plan rotary --lines 24 --placements 3", "plan rotary", 0),
        ("plan screw --lead-mm 2", "plan screw", 0),
        ("check wrong.toml", "check", 2),
        ("cal list nowhere.toml", "cal list", 2),
        ("serve nowhere.toml", "serve", 2),
        ("reference import nowhere.toml f.csv", "reference import", 2),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let printed = truestage(folder.path(), &words).with_code(code);
        assert_eq!(printed["schema"], json!(1), "{printed}");
        assert_eq!(printed["verb"], verb, "{printed}");
        assert_eq!(printed["error"].is_null(), code == 0, "{printed}");
    }
}
