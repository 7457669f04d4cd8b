//! Journals that were exported, read by software of others: DuckDB (Parquet), Python's csv, and the library of MCAP.
//! Every value is compared with what the journal itself says.

use std::fs;
use std::path::{Path, PathBuf};

use machine::records::sealed;
use serde_json::{Value, json};
use tests::{left_out, random};

use crate::dcc::truestage;
use crate::peer::{Peer, can_import};

/// So many journals are made up.
const DRAWN: u64 = 12;

/// One of each kind, as programs of the past wrote them.
fn written() -> Vec<PathBuf> {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../controller/golden");
    let files = fs::read_dir(golden).expect("it is there");
    let files = files.map(|it| it.expect("it can be read").path());
    let mut journals: Vec<PathBuf> = files
        .filter(|it| it.extension().is_some_and(|it| it == "jsonl"))
        .collect();
    journals.sort();
    journals
}

/// A value of any sort, also within others.
fn drawn(state: &mut u64, depth: u32) -> Value {
    let number = |state: &mut u64| {
        let size = 10_f64.powi((40.0 * random(state)) as i32 - 20);
        (random(state) - 0.5) * size
    };
    match (random(state) * if depth > 0 { 7.0 } else { 5.0 }) as u32 {
        0 => Value::Null,
        1 => json!(random(state) < 0.5),
        2 => json!((random(state) * 1e6) as i64),
        3 => json!(number(state)),
        4 => {
            let texts = ["", "µ, \"quoted\"", "two\nlines", "-0", "null", "1e5"];
            json!(texts[(random(state) * texts.len() as f64) as usize])
        }
        5 => {
            let count = (random(state) * 5.0) as usize;
            // Lists of numbers, some of which are not known, or of objects.
            let is_numbers = random(state) < 0.7;
            let item = |state: &mut u64| match is_numbers {
                true if random(state) < 0.2 => Value::Null,
                true => json!(number(state)),
                false => json!({"a_m": number(state), "name": "n"}),
            };
            (0..count).map(|_| item(state)).collect()
        }
        _ => {
            let mut members = serde_json::Map::new();
            for key in ["x_m", "y_m", "which"] {
                let value = match key {
                    "which" => drawn(state, 0),
                    _ => json!(number(state)),
                };
                members.insert(key.into(), value);
            }
            Value::Object(members)
        }
    }
}

/// A journal that was continued, with entries that no kind has.
fn made_up(seed: u64) -> String {
    let mut state = seed ^ 0x006a_6578;
    let golden = fs::read_to_string(&written()[0]).expect("it can be read");
    let header = golden.lines().next().and_then(|it| it.split_once(' '));
    let mut text = sealed(header.expect("checksum and header").1);
    // What a member looks like stays the same within a journal, as in those that are written.
    let shapes: Vec<Value> = (0..6).map(|_| drawn(&mut state, 1)).collect();
    for at in 0..30_u32 {
        let kind = ["alpha", "beta", "gamma"][(random(&mut state) * 3.0) as usize];
        let mut entry = json!({"entry": kind, "at_s": f64::from(at) * 0.123_456_789 + 7.0,
                               "at_m": [1.5, random(&mut state), -0.0]});
        for (shape, number) in shapes.iter().zip(0..) {
            let is_said = random(&mut state) < 0.8;
            entry[format!("member_{number}")] = if is_said { shape.clone() } else { Value::Null };
        }
        text += &sealed(&entry.to_string());
        if at == 15 {
            text += &sealed(r#"{"entry":"failed","cause":"the beam, \"blocked\""}"#);
            text += &sealed(r#"{"entry":"resumed","at":"2026-12-01T10:00:00Z"}"#);
        }
    }
    text + &sealed(r#"{"entry":"complete"}"#)
}

fn export(folder: &Path, journal: &Path, format: &str) -> Value {
    let (journal, out) = (journal.display().to_string(), format!("{format}-out"));
    let out = match format {
        "mcap" => format!(
            "{}.mcap",
            fs::read_dir(folder).expect("it is there").count()
        ),
        _ => out,
    };
    let words = [
        "journal", "export", &journal, "--format", format, "--out", &out,
    ];
    truestage(folder, &words)
}

fn files_of(told: &Value) -> Vec<&Value> {
    let tables = told["tables"].as_array().expect("a list");
    tables.iter().map(|it| &it["file"]).collect()
}

#[test]
fn whoever_reads_an_exported_journal_finds_every_value_of_it() {
    let what = "exported journals by DuckDB and MCAP";
    if !can_import("duckdb, mcap") {
        return left_out(what, "the Python of the peers has no duckdb or no mcap");
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut journals = written();
    assert!(journals.len() >= 7, "{journals:?}");
    for seed in 1..=DRAWN {
        let path = folder.path().join(format!("drawn-{seed}.jsonl"));
        fs::write(&path, made_up(seed)).expect("there is room");
        journals.push(path);
    }
    let tasks = journals.iter().map(|journal| {
        let [csv, parquet, mcap] =
            ["csv", "parquet", "mcap"].map(|it| export(folder.path(), journal, it));
        let whole = |it: &Value| folder.path().join(it.as_str().expect("a path"));
        let all = |told: &Value| files_of(told).into_iter().map(whole).collect::<Vec<_>>();
        let task = json!({"journal": journal, "csv": all(&csv), "parquet": all(&parquet),
                          "mcap": whole(&mcap["file"])});
        format!("{task}\n")
    });
    let tasks: String = tasks.collect();
    let mut judge = Peer::start("export.py", &[]);
    judge.feed(&tasks);
    for journal in &journals {
        let report = judge.report();
        let name = journal.display();
        assert_eq!(report["differences"], json!([]), "{name}: {report:#}");
        for format in ["csv", "parquet", "mcap"] {
            assert!(
                report["compared"][format].as_u64() > Some(10),
                "{name}: {report}"
            );
        }
    }
}
