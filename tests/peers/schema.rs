//! The schema of `--json` and what judges by it in all other tests, against a library that judges by any schema.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use tests::json_schema::{Schema, check_output};
use tests::{Edit, LINEAR, left_out, random};

use crate::dcc::ended;
use crate::peer::{Peer, can_import};

/// Each object so often, spoilt in another place.
const SPOILT: usize = 40;
const SERIES: &str = "run,approach,target_mm,measured_mm\n";

/// What verbs print that need no machine, results and failures.
fn printed(folder: &Path) -> Vec<Value> {
    let sound = LINEAR.machine;
    fs::write(folder.join("machine.toml"), sound).expect("there is room");
    let wrong = sound.edit("serial", "seriall");
    fs::write(folder.join("wrong.toml"), wrong).expect("there is room");
    let sides = [("+", 0.001), ("-", 0.002)];
    let rows = (1..=3).flat_map(|run| sides.map(|(side, by)| (run, side, by)));
    let rows = rows.flat_map(|(run, side, by)| {
        let by = by * f64::from(run);
        [0, 10, 20].map(|at| format!("{run},{side},{at},{}\n", f64::from(at) + by))
    });
    let series = SERIES.to_owned() + &rows.collect::<String>();
    fs::write(folder.join("data.csv"), series).expect("there is room");
    let words = [
        "check machine.toml",
        "check wrong.toml",
        "check nowhere.toml",
        "cal list machine.toml",
        "cal show machine.toml abc",
        "explain 4 0x8611 0x06090030",
        "iso230 data.csv",
        "fit linear data.csv",
        "plan rotary --lines 24 --placements 3",
        "plan screw --lead-mm 2",
        "zero machine.toml --dry-run",
        "no-such-verb",
        "cal",
    ];
    let each = words.iter().map(|words| {
        let words: Vec<&str> = words.split(' ').collect();
        let ended = ended(folder, &words);
        let value = serde_json::from_slice(&ended.stdout);
        value.unwrap_or_else(|error| panic!("{words:?}: {error}: {ended:?}"))
    });
    each.collect()
}

/// How many values there are in `value`, itself among them.
fn places(value: &Value) -> usize {
    let inside: usize = match value {
        Value::Array(all) => all.iter().map(places).sum(),
        Value::Object(all) => all.values().map(places).sum(),
        _ => 0,
    };
    inside + 1
}

/// Changes the value that is reached after `at` others.
fn spoil(value: &mut Value, at: &mut usize, state: &mut u64) {
    if *at == 0 {
        change(value, state);
    }
    *at = at.wrapping_sub(1);
    match value {
        Value::Array(all) => all.iter_mut().for_each(|it| spoil(it, at, state)),
        Value::Object(all) => all.values_mut().for_each(|it| spoil(it, at, state)),
        _ => {}
    }
}

fn change(value: &mut Value, state: &mut u64) {
    let mut chance = |among: usize| (random(state) * among as f64) as usize;
    match value {
        Value::Object(members) if chance(4) > 0 => {
            let keys: Vec<String> = members.keys().cloned().collect();
            let gone = keys.get(chance(keys.len().max(1))).cloned();
            if chance(2) == 0 {
                members.insert("more".into(), json!(1));
            } else if let Some(gone) = gone {
                members.remove(&gone);
            }
        }
        Value::Array(all) if chance(2) == 0 => {
            all.pop();
        }
        other => {
            let others = [
                json!(null),
                json!(true),
                json!(1),
                json!(1.0),
                json!(1.5),
                json!("text"),
                json!([]),
                json!({}),
            ];
            *other = others[chance(others.len())].clone();
        }
    }
}

#[test]
fn whoever_knows_json_schema_finds_the_same_right_and_the_same_wrong() {
    if !can_import("jsonschema_rs") {
        let why = "the Python of the peers has no jsonschema_rs";
        return left_out("the schema of --json by jsonschema-rs", why);
    }
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let good = printed(folder.path());
    good.iter().for_each(check_output);
    let mut values = good.clone();
    let mut state = 58;
    for value in &good {
        for _ in 0..SPOILT {
            let mut spoilt = value.clone();
            let mut at = (random(&mut state) * places(value) as f64) as usize;
            spoil(&mut spoilt, &mut at, &mut state);
            values.push(spoilt);
        }
    }
    let schema = Schema::of_output();
    let mut judge = Peer::start("schema.py", &[]);
    let task = json!({"schema": schema.document(), "values": values});
    judge.feed(&format!("{task}\n"));
    let report = judge.report();
    let verdicts = report["valid"].as_array().expect("a list");
    assert_eq!(verdicts.len(), values.len());
    let mut wrong = 0;
    for (value, verdict) in values.iter().zip(verdicts) {
        let seen = schema.check(value);
        assert_eq!(json!(seen.is_ok()), *verdict, "{seen:?}: {value:#}");
        wrong += usize::from(seen.is_err());
    }
    println!("{} values, {wrong} of them wrong", values.len());
    // Neither everything nor nothing passes.
    assert!(wrong > values.len() / 2 && wrong < values.len() - good.len());
}
