//! How often machines are blamed that are sound: their configurations are drawn by seeds, over what machines are really
//! like, and whatever `check` says against one of them is a false alarm.
//!
//! `SEEDS=1..5000 cargo test -p tests --test configurations -- --nocapture` draws as many of each kind and prints the rates.

mod axis;
mod bus;
mod detectors;
mod draft;
mod hall;
mod linear;
mod platform;
mod rotary;
mod volumetric;

use std::collections::BTreeMap;

use tests::seeds;
use truestage::config::{ConfigError, parse};

use crate::draft::{Draft, Draw};

/// A kind of machine by its shipped file, and how others of it are drawn.
struct Kind {
    name: &'static str,
    shipped: &'static str,
    drawn: fn(&str, &mut Draw) -> String,
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "linear",
        shipped: include_str!("../../configs/machines/linear.toml"),
        drawn: linear::stage,
    },
    Kind {
        name: "gantry",
        shipped: include_str!("../../configs/machines/gantry.toml"),
        drawn: linear::gantry,
    },
    Kind {
        name: "rotary",
        shipped: include_str!("../../configs/machines/rotary.toml"),
        drawn: rotary::table,
    },
    Kind {
        name: "uvw",
        shipped: include_str!("../../configs/machines/uvw.toml"),
        drawn: platform::platform,
    },
    Kind {
        name: "uvw-copley",
        shipped: include_str!("../../configs/machines/uvw-copley.toml"),
        drawn: platform::platform,
    },
    Kind {
        name: "volumetric",
        shipped: include_str!("../../configs/machines/volumetric.toml"),
        drawn: volumetric::machine,
    },
];

/// Of sound machines, so many may be blamed: whoever is warned of nothing soon reads no warning.
const BLAMED_MAX: f64 = 0.01;

/// Of values a thousand times too large or too small, at least so many are told. Of the others most are as possible as
/// those that were drawn, such as a scan a thousand times as slow.
const TOLD_MIN: f64 = 0.6;

/// What is said against a machine.
fn said(kind: &Kind, text: &str) -> Vec<(String, String)> {
    match parse(text, "m.toml") {
        Ok(loaded) => {
            let warnings = loaded.warnings.into_iter();
            warnings.map(|it| (it.key, it.cause)).collect()
        }
        Err(ConfigError::Invalid { findings }) => {
            let errors = findings.into_iter();
            errors
                .map(|it| (format!("error: {}", it.key), it.cause))
                .collect()
        }
        Err(other) => panic!("{}: {other}", kind.name),
    }
}

#[test]
fn sound_machines_are_not_blamed() {
    let mut wrong = Vec::new();
    for kind in &KINDS {
        let (mut drawn, mut blamed) = (0_u32, 0_u32);
        let mut keys: BTreeMap<String, (u32, String)> = BTreeMap::new();
        for seed in seeds("1..100") {
            let said = said(kind, &(kind.drawn)(kind.shipped, &mut Draw(seed)));
            drawn += 1;
            blamed += u32::from(!said.is_empty());
            for (key, cause) in said {
                let example = || (0, format!("seed {seed}: {cause}"));
                keys.entry(key).or_insert_with(example).0 += 1;
            }
        }
        let share = f64::from(blamed) / f64::from(drawn);
        println!(
            "{}: {blamed} of {drawn} sound machines are blamed, {:.2} %",
            kind.name,
            100.0 * share
        );
        for (key, (times, example)) in keys {
            println!("  {times} times {key}, {example}");
        }
        if share > BLAMED_MAX {
            wrong.push(kind.name);
        }
    }
    assert!(wrong.is_empty(), "blamed too often: {wrong:?}");
}

#[test]
fn values_of_another_unit_are_told() {
    for kind in &KINDS {
        let (mut drawn, mut told) = (0_u32, 0_u32);
        let mut missed: BTreeMap<String, u32> = BTreeMap::new();
        for seed in seeds("1..100") {
            let draw = &mut Draw(seed);
            let mut draft = Draft::of(&(kind.drawn)(kind.shipped, draw));
            let key = draft.misread(draw);
            let is_told = !said(kind, &draft.text()).is_empty();
            drawn += 1;
            told += u32::from(is_told);
            if !is_told {
                *missed.entry(key).or_default() += 1;
            }
        }
        let share = f64::from(told) / f64::from(drawn);
        println!(
            "{}: {told} of {drawn} values of another unit are told, {:.0} %; not {missed:?}",
            kind.name,
            100.0 * share
        );
        assert!(share >= TOLD_MIN, "{}: {told} of {drawn}", kind.name);
    }
}
