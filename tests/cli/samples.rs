//! The samples of every data format, each read by the verb that takes it. No machine is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use tests::{Edit, LINEAR, ROTARY, VOLUMETRIC};

use crate::programs::{text, truestage};

/// The words of each verb that reads a sample, one after the other: what comes first is used by what follows.
/// ID stands for the calibration that was stored last.
const READ: [&str; 17] = [
    "iso230 linear.csv",
    "fit linear linear.csv --save linear.toml",
    "iso230 linear-environment.csv --instrument laser --config linear.toml",
    "cal import linear.toml table.csv --format csv",
    "cal import linear.toml table.comp --format linuxcnc --comp-file-type 1",
    "fit hall hall-sweep.csv",
    "plan zero linear.toml --sweep hall-sweep.csv",
    "fit screw screw.csv --lead-mm 2",
    "fit rotary rotary.csv --lines 36",
    "calibrate rotary.toml --readings readings.csv",
    "fit volumetric volumetric.csv --config volumetric.toml --save --temperatures-c 20,20,20,20,20,20",
    "cal activate volumetric.toml ID",
    "reference import volumetric.toml references.csv",
    "reference import volumetric.toml references.toml",
    "memory import volumetric.toml shape.csv",
    "memory import volumetric.toml shape-with-roll.csv",
    "run volumetric.toml path.csv --dry-run",
];
/// Streamed to a machine (`example.rs`).
const STREAMED: &str = "path-x.csv";

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// Every sample, and beside them a machine for each that wants one.
fn desk() -> (tempfile::TempDir, BTreeSet<String>) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(configs().join("data")).expect("it is there") {
        let entry = entry.expect("it can be read");
        let name = entry.file_name().into_string().expect("plain letters");
        fs::copy(entry.path(), folder.path().join(&name)).expect("there is room");
        names.insert(name);
    }
    let sighting = "[rotary.c.sighting]\nvalue = \"deviation\"\nrange_arcsec = 120.0";
    let detector =
        "[rotary.c.line_detector]       # at the drive's touch probe 1\nedge = \"positive\"";
    let sighted = ROTARY.machine.edit(detector, sighting);
    let sighted = sighted
        .edit("lines = 360", "lines = 36")
        .edit("offset_lines = 200.5", "offset_lines = 20.0")
        .edit("placements = 4 ", "offsets = [0, 1, 7, 11] ")
        .edit("optimise = ", "# ")
        .edit("amplification_limit = 3.0", "amplification_limit = 10.0");
    for (name, machine) in [
        ("linear.toml", LINEAR.machine),
        ("rotary.toml", &sighted),
        ("volumetric.toml", VOLUMETRIC.machine),
    ] {
        fs::write(folder.path().join(name), machine).expect("there is room");
    }
    (folder, names)
}

#[test]
fn each_sample_is_read_by_the_verb_that_takes_its_format_and_named_where_formats_are() {
    let (folder, samples) = desk();
    let mut id = String::new();
    for words in READ {
        let words = words
            .split(' ')
            .map(|it| if it == "ID" { id.as_str() } else { it });
        let words: Vec<_> = words.collect();
        let ended = truestage(folder.path(), &words);
        assert_eq!(ended.code, Some(0), "{words:?}: {ended:#?}");
        let stored = ended.json["calibration"].as_str();
        id = stored.map_or(id, str::to_owned);
    }
    let document = fs::read_to_string(configs().join("README.md")).expect("it is there");
    for name in samples {
        let is_read = READ.iter().any(|it| it.split(' ').any(|word| word == name));
        assert!(is_read || name == STREAMED, "nothing reads {name}");
        assert!(
            document.contains(&format!("`{name}`")),
            "{name} is not in configs/README.md"
        );
    }
    let list = truestage(folder.path(), &["cal", "list", "volumetric.toml"]).with_code(0);
    let list = list["calibrations"].as_array().expect("a list");
    let kinds: BTreeSet<_> = list.iter().map(|it| text(&it["kind"])).collect();
    assert!(
        kinds.contains("beam_references") && kinds.contains("state_memory"),
        "{kinds:?}"
    );
}
