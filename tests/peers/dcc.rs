//! Certificates of drawn calibrations against the schema of the PTB, by lxml. The schema lies beside the project, not
//! in it.

mod instruments;
mod machines;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tests::json_schema::check_output;
use tests::{Edit, LINEAR, ROTARY, left_out, random};

use crate::peer::{Peer, can_import};

const CERTIFICATES: u64 = 20;

/// The schema of this version, if it lies beside the project.
pub(crate) fn schema(version: &str) -> Option<PathBuf> {
    let usual = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/dcc");
    let folder = std::env::var_os("TRUESTAGE_DCC").map_or_else(|| usual.into(), PathBuf::from);
    let own = format!("lib/dcc/schema/resources/dcc/v{version}/dcc.xsd");
    Some(folder.join(own)).filter(|it| it.exists())
}

/// Whether certificates can be judged by their schema here; says so where they cannot.
pub(crate) fn can_judge(what: &str) -> bool {
    if schema("3.3.0").is_none() {
        left_out(
            what,
            "the schema is not beside the project (../shared/dcc, or TRUESTAGE_DCC)",
        );
        return false;
    }
    if !can_import("lxml") {
        left_out(what, "the Python of the peers has no lxml");
        return false;
    }
    true
}

/// How the command beside the tests that cargo built ended.
pub(crate) fn ended(folder: &Path, words: &[&str]) -> Output {
    let test = std::env::current_exe().expect("a process knows its program");
    let program = test
        .ancestors()
        .nth(2)
        .expect("target/PROFILE/deps/TEST")
        .join("truestage");
    let ended = Command::new(program)
        .current_dir(folder)
        .arg("--json")
        .args(words)
        .output();
    ended.expect("`cargo build --workspace --bins` has built it")
}

/// What it printed.
pub(crate) fn truestage(folder: &Path, words: &[&str]) -> Value {
    let ended = ended(folder, words);
    assert!(
        ended.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&ended.stderr)
    );
    let printed = serde_json::from_slice(&ended.stdout).expect("one JSON object");
    check_output(&printed);
    printed
}

/// Columns of one or both approaches, with uncertainties.
fn columns(state: &mut u64) -> String {
    let is_both = random(state) < 0.6;
    let mut text = match is_both {
        true => "position_mm,forward_um,reverse_um,u_forward_um,u_reverse_um\n",
        false => "position_mm,reverse_um,u_reverse_um\n",
    }
    .to_owned();
    let scale = 0.4 * random(state) - 0.2;
    let count = 3 + (20.0 * random(state)) as usize;
    for at in 0..count {
        let place = 60.0 * at as f64 / (count - 1) as f64;
        let deviation = scale * place + random(state);
        let u = 0.01 + 0.1 * random(state);
        text += &match is_both {
            true => format!("{place},{deviation},{},{u},{u}\n", deviation + 0.5),
            false => format!("{place},{deviation},{u}\n"),
        };
    }
    text
}

const ISSUER: [&str; 6] = [
    "--laboratory",
    "Müller & Söhne <test>",
    "--country",
    "DE",
    "--person",
    "A. \"B\" C",
];

/// Certificates in `folder`, each with the nodes it was made of.
fn certificates(folder: &Path) -> Vec<(PathBuf, Value)> {
    let machine = LINEAR.machine.edit(
        "interpolation = \"monotone_cubic\"",
        "interpolation = \"linear\"",
    );
    fs::write(folder.join("machine.toml"), machine).expect("there is room");
    let make = |seed| {
        let mut state: u64 = seed ^ 0x0064_6363;
        fs::write(folder.join("x.csv"), columns(&mut state)).expect("there is room");
        let read = truestage(
            folder,
            &["cal", "import", "machine.toml", "x.csv", "--format", "csv"],
        );
        let id = read["calibration"].as_str().expect("a name").to_owned();
        let name = format!("{seed}.xml");
        let words = [
            "cal",
            "export",
            "machine.toml",
            &id,
            "--format",
            "dcc",
            "--out",
            &name,
        ];
        truestage(folder, &[&words[..], &ISSUER].concat());
        let shown = truestage(folder, &["cal", "show", "machine.toml", &id]);
        (folder.join(name), shown["record"]["nodes"].clone())
    };
    (1..=CERTIFICATES).map(make).collect()
}

/// Readings of a plate of some lines in three placements, with errors and noise.
fn plate(state: &mut u64, lines: usize) -> String {
    let mut text = "offset,line,deviation_arcsec\n".to_owned();
    let mut drawn = |count: usize, size: f64| -> Vec<f64> {
        (0..count).map(|_| size * (random(state) - 0.5)).collect()
    };
    let (table, plate) = (drawn(lines, 4.0), drawn(lines, 2.0));
    let noise = drawn(3 * lines, 0.05);
    for (placement, offset) in [0, 1, 5].into_iter().enumerate() {
        for line in 0..lines {
            let reading =
                table[(line + offset) % lines] + plate[line] + noise[placement * lines + line];
            text += &format!("{offset},{line},{reading}\n");
        }
    }
    text
}

/// Certificates of rotary tables in `folder`, each with the record that it was made of.
fn rotary_certificates(folder: &Path) -> Vec<(PathBuf, Value)> {
    fs::write(folder.join("rotary.toml"), ROTARY.machine).expect("there is room");
    let make = |seed| {
        let mut state: u64 = seed ^ 0x0072_6f74;
        let lines = 12 + 2 * (20.0 * random(&mut state)) as usize;
        fs::write(folder.join("c.csv"), plate(&mut state, lines)).expect("there is room");
        let lines = lines.to_string();
        let words = [
            "fit",
            "rotary",
            "c.csv",
            "--lines",
            &lines,
            "--save",
            "rotary.toml",
        ];
        let id = truestage(folder, &words)["calibration"].clone();
        let id = id.as_str().expect("a name");
        let name = format!("rotary-{seed}.xml");
        let words = [
            "cal",
            "export",
            "rotary.toml",
            id,
            "--format",
            "dcc",
            "--out",
            &name,
        ];
        truestage(folder, &[&words[..], &ISSUER].concat());
        let shown = truestage(folder, &["cal", "show", "rotary.toml", id]);
        (folder.join(name), shown["record"].clone())
    };
    (1..=CERTIFICATES).map(make).collect()
}

#[test]
fn certificates_of_rotary_tables_are_valid_and_say_what_was_stored() {
    if !can_judge("certificates of rotary tables by the DCC schema") {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let all = rotary_certificates(folder.path());
    let schema = schema("3.3.0").expect("it is there");
    let mut judge = Peer::start("dcc.py", &[&schema.display().to_string()]);
    let broken = all.iter().enumerate().map(|(at, (path, _))| {
        let (from, to) = BROKEN[at % BROKEN.len()];
        let turned = |it: &str| it.split("metre").collect::<Vec<_>>().join("radian");
        let (from, to) = (turned(from), turned(to));
        let text = fs::read_to_string(path).expect("it was written");
        let broken = path.with_extension("broken.xml");
        fs::write(&broken, text.edit_first(&from, &to)).expect("there is room");
        broken
    });
    let paths: Vec<PathBuf> = all.iter().map(|it| it.0.clone()).chain(broken).collect();
    judge.feed(
        &paths
            .iter()
            .map(|it| format!("{}\n", it.display()))
            .collect::<String>(),
    );
    for (path, record) in &all {
        let report = judge.report();
        assert_eq!(report["valid"], true, "{}: {report}", path.display());
        let [result] = report["results"].as_array().expect("a list").as_slice() else {
            panic!("{report}")
        };
        assert_eq!(result["units"], serde_json::json!(["\\radian", "\\radian"]));
        assert_eq!(result["uncertainties"], record["standard_uncertainty_rad"]);
        let errors = record["table_error_rad"].as_array().expect("numbers");
        let deviations = result["deviations"].as_array().expect("numbers");
        assert_eq!(errors.len(), deviations.len());
        for (error, deviation) in errors.iter().zip(deviations) {
            assert_eq!(error.as_f64().map(|it| -it), deviation.as_f64());
        }
    }
    for path in &paths[all.len()..] {
        assert_eq!(judge.report()["valid"], false, "{}", path.display());
    }
}

/// Something that no certificate may lack, or have otherwise.
const BROKEN: [(&str, &str); 10] = [
    ("<dcc:measurementResults>", "<dcc:measurementResult>"),
    ("schemaVersion=\"3.3.0\"", "schemaVersion=\"9.0.0\""),
    (
        "<dcc:countryCodeISO3166_1>DE</dcc:countryCodeISO3166_1>",
        "",
    ),
    (
        "<dcc:beginPerformanceDate>",
        "<dcc:beginPerformanceDate>on ",
    ),
    ("<dcc:customer>", "<dcc:customers>"),
    ("https://ptb.de/si", "https://ptb.de/is"),
    ("<si:unitXMLList>\\metre</si:unitXMLList>", ""),
    ("<si:valueXMLList>", "<si:valueXMLList>much "),
    (
        "<dcc:issuer>owner</dcc:issuer>",
        "<dcc:issuer>me</dcc:issuer>",
    ),
    (
        "<dcc:performanceLocation>other",
        "<dcc:performanceLocation>here",
    ),
];

#[test]
fn certificates_are_valid_by_the_schema_and_say_what_was_stored() {
    if !can_judge("certificates by the DCC schema") {
        return;
    }
    let schema = schema("3.3.0").expect("it is there");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let all = certificates(folder.path());
    let mut paths: Vec<PathBuf> = all.iter().map(|it| it.0.clone()).collect();
    for at in 0..CERTIFICATES as usize {
        let (from, to) = BROKEN[at % BROKEN.len()];
        let text = fs::read_to_string(&paths[at])
            .expect("it was written")
            .edit(from, to);
        let broken = folder.path().join(format!("broken-{at}.xml"));
        fs::write(&broken, text).expect("there is room");
        paths.push(broken);
    }
    let mut judge = Peer::start("dcc.py", &[&schema.display().to_string()]);
    judge.feed(
        &paths
            .iter()
            .map(|it| format!("{}\n", it.display()))
            .collect::<String>(),
    );
    for (path, nodes) in &all {
        let report = judge.report();
        assert_eq!(report["valid"], true, "{}: {report}", path.display());
        check_says(&report, nodes);
    }
    for path in &paths[all.len()..] {
        let report = judge.report();
        assert_eq!(report["valid"], false, "{}", path.display());
    }
}

#[track_caller]
fn check_says(report: &Value, nodes: &Value) {
    assert!(
        report["statements"][0]
            .to_string()
            .contains("not accredited"),
        "{report}"
    );
    let nodes = nodes.as_array().expect("a list");
    let sides = [
        ("forward", "forward_m", "forward_u_m"),
        ("reverse", "reverse_m", "reverse_u_m"),
    ];
    let known = sides.iter().filter(|it| !nodes[0][it.1].is_null());
    let results = report["results"].as_array().expect("a list");
    assert_eq!(results.len(), known.clone().count());
    for (result, (side, deviation, u)) in results.iter().zip(known) {
        assert!(result["name"].to_string().contains(side), "{result}");
        assert_eq!(result["units"], serde_json::json!(["\\metre", "\\metre"]));
        for (seen, key) in [
            ("positions", "position_m"),
            ("deviations", *deviation),
            ("uncertainties", *u),
        ] {
            let stored: Vec<&Value> = nodes.iter().map(|it| &it[key]).collect();
            let seen: Vec<&Value> = result[seen].as_array().expect("numbers").iter().collect();
            assert_eq!(seen, stored, "{side} {key}");
        }
    }
}
