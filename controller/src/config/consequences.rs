//! What is wrong only because something else is: told by that alone. A value that is wrong by itself is tried as others
//! that it could have; what is then no longer found was found because of it.

use std::collections::BTreeSet;

use toml::{Table, Value};

use super::judge::Finding;

/// A file with more findings than this is judged as it is: each is tried by itself.
const FINDINGS_MAX: usize = 24;
const LIST_MAX: usize = 16;
/// So many other values of one key are tried at most.
const TRIALS_MAX: usize = 200;

/// A value outside of what its key can have, with values within.
#[derive(Clone, Debug)]
pub(super) struct Doubt {
    pub(super) key: String,
    pub(super) within: Vec<f64>,
}

/// `findings` without those that are consequences of `doubts`, or of another one; `found_in` judges a document, and
/// gives nothing where it cannot be read.
pub(super) fn left_out(
    mut findings: Vec<Finding>,
    document: &Table,
    doubts: &[Doubt],
    mut found_in: impl FnMut(&Table) -> Option<Vec<Finding>>,
) -> Vec<Finding> {
    if findings.is_empty() {
        return findings;
    }
    let mut left = budget(document);
    let mut document = document.clone();
    let mut keys_with = |document: &Table, changes: Changes| {
        left = left.checked_sub(1)?;
        let mut other = document.clone();
        for (key, value) in changes {
            set(&mut other, &key, value)?;
        }
        let found = found_in(&other)?;
        Some(found.into_iter().map(|it| it.key).collect::<BTreeSet<_>>())
    };
    for doubt in doubts {
        let mut fewest = None;
        for value in &doubt.within {
            let changes = vec![(doubt.key.clone(), Value::Float(*value))];
            let Some(found) = keys_with(&document, changes) else {
                continue;
            };
            findings.retain(|it| found.contains(&it.key));
            if fewest.is_none_or(|(count, _)| found.len() < count) {
                fewest = Some((found.len(), *value));
            }
        }
        // What another value only brings about would hide what the others are because of.
        if let Some((_, value)) = fewest {
            set(&mut document, &doubt.key, Value::Float(value));
        }
    }
    if !(2..=FINDINGS_MAX).contains(&findings.len()) {
        return findings;
    }
    let all: BTreeSet<String> = findings.iter().map(|it| it.key.clone()).collect();
    // Of two that contradict each other either can be the wrong one: both are told.
    let mut roots: BTreeSet<String> = BTreeSet::new();
    let mut most = BTreeSet::new();
    for root in &all {
        for changes in trials(&document, root) {
            let Some(found) = keys_with(&document, changes) else {
                continue;
            };
            // Another value that is wrong in another way says nothing.
            if found.contains(root) || !found.is_subset(&all) {
                continue;
            }
            let gone: BTreeSet<String> = all.difference(&found).cloned().collect();
            if gone.len() > most.len().max(1) {
                roots.clear();
                most.clone_from(&gone);
            }
            if gone == most {
                roots.insert(root.clone());
            }
        }
    }
    findings.retain(|it| roots.contains(&it.key) || !most.contains(&it.key));
    findings
}

/// A number as `own` is one: whole or not.
fn like(own: &Value, number: f64) -> Value {
    match own {
        Value::Integer(_) => Value::Integer(number as i64),
        _ => Value::Float(number),
    }
}

/// Gives a key that is there another value, of the type that it has.
fn set(document: &mut Table, key: &str, value: Value) -> Option<()> {
    let own = value_at(document, key)?;
    *own = match (&own, value) {
        (Value::Integer(_), Value::Float(it)) => like(own, it),
        // Of a list all are doubted.
        (Value::Array(items), Value::Float(it)) => {
            Value::Array(items.iter().map(|own| like(own, it)).collect())
        }
        (_, value) => value,
    };
    Some(())
}

/// The document with a value that its key can have for each whole number that it cannot.
pub(super) fn within(mut document: Table, doubts: &[Doubt]) -> Table {
    for doubt in doubts {
        let is_whole = matches!(value_at(&mut document, &doubt.key), Some(Value::Integer(_)));
        if let (true, Some(value)) = (is_whole, doubt.within.first()) {
            set(&mut document, &doubt.key, Value::Float(*value));
        }
    }
    document
}

/// How often a document is judged at most: a long one less often, as each time takes longer.
pub(super) fn budget(document: &Table) -> usize {
    const VALUES: usize = 150_000;
    VALUES / document.values().map(count).sum::<usize>().max(1)
}

fn count(value: &Value) -> usize {
    match value {
        Value::Table(inner) => inner.values().map(count).sum(),
        Value::Array(items) => items.iter().map(count).sum(),
        _ => 1,
    }
}

/// Keys with other values.
type Changes = Vec<(String, Value)>;

/// Other values that the key could have: its own, or those of it and of the one that it bounds.
fn trials(document: &Table, key: &str) -> Vec<Changes> {
    let own = values(document, key).into_iter();
    let own = own.map(|value| vec![(key.to_owned(), value)]);
    own.chain(swapped(document, key)).collect()
}

/// The two ends of a range, the one as the other.
fn swapped(document: &Table, key: &str) -> Option<Changes> {
    const ENDS: [[&str; 2]; 4] = [
        ["high", "low"],
        ["max", "min"],
        ["last", "first"],
        ["end", "start"],
    ];
    let mut document = document.clone();
    let own = value_at(&mut document, key)?.clone();
    let partners = ENDS
        .iter()
        .flat_map(|[upper, lower]| [(upper, lower), (lower, upper)]);
    let (section, name) = key.rsplit_once('.')?;
    let partners = partners.map(|(from, to)| {
        let words = name.split('_').map(|it| if it == *from { to } else { it });
        format!("{section}.{}", words.collect::<Vec<_>>().join("_"))
    });
    let partner = partners
        .filter(|it| it != key)
        .find(|it| value_at(&mut document, it).is_some())?;
    let other = value_at(&mut document, &partner)?.clone();
    Some(vec![(key.to_owned(), other), (partner, own)])
}

fn values(document: &Table, key: &str) -> Vec<Value> {
    let mut document = document.clone();
    let names: Vec<String> = document
        .values()
        .filter_map(Value::as_table)
        .flat_map(|it| it.keys().cloned())
        .collect();
    let Some(own) = value_at(&mut document, key) else {
        return Vec::new();
    };
    let mut found = match own {
        // No list of a machine that is tried is longer.
        Value::Array(items) if items.len() > LIST_MAX => Vec::new(),
        Value::Array(items) => {
            let each = items.iter().enumerate();
            let other = each.flat_map(|(at, it)| {
                let others = others(it, &names).into_iter();
                let with = others.map(move |other| (at, other));
                with.collect::<Vec<_>>()
            });
            let whole = other.map(|(at, other)| {
                let mut items = items.clone();
                items[at] = other;
                Value::Array(items)
            });
            // Decimal commas make two entries of each.
            let halved: Vec<Value> = items.iter().step_by(2).cloned().collect();
            let halved = (items.len() % 2 == 0).then_some(Value::Array(halved));
            halved.into_iter().chain(whole).collect()
        }
        own => others(own, &names),
    };
    found.truncate(TRIALS_MAX);
    found
}

/// What a slip of the hand makes of a value, backwards.
fn others(value: &Value, names: &[String]) -> Vec<Value> {
    // Beyond what it was swapped with, too.
    const FACTORS: [f64; 12] = [
        -1.0, -1.01, -10.0, -100.0, 0.1, 10.0, 1e-2, 1e2, 1e-3, 1e3, 0.5, 2.0,
    ];
    match value {
        Value::Float(it) => FACTORS.iter().map(|by| Value::Float(it * by)).collect(),
        Value::Integer(it) => {
            let by_factor = FACTORS.iter().map(|by| (*it as f64 * by) as i64);
            let near = (0..8).chain([it.saturating_add(1), it.saturating_sub(1)]);
            near.chain(by_factor).map(Value::Integer).collect()
        }
        Value::String(_) => names.iter().cloned().map(Value::String).collect(),
        _ => Vec::new(),
    }
}

/// The document with another value of that key; `None` where it has no such key.
pub(super) fn with(document: &Table, key: &str, value: Value) -> Option<Table> {
    let mut other = document.clone();
    *value_at(&mut other, key)? = value;
    Some(other)
}

/// The value of a key as findings name it: `actuator[0]` is `actuator.0`.
pub(super) fn value_at<'a>(document: &'a mut Table, key: &str) -> Option<&'a mut Value> {
    let mut parts = key.split(['.', '[', ']']).filter(|it| !it.is_empty());
    let mut value = document.get_mut(parts.next()?)?;
    for part in parts {
        value = match value {
            Value::Table(inner) => inner.get_mut(part)?,
            Value::Array(items) => items.get_mut(part.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(value)
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const VOLUMETRIC: &str = include_str!("../../../configs/machines/volumetric.toml");

    #[track_caller]
    fn check(text: &str, keys: &[&str]) {
        let Err(ConfigError::Invalid { findings }) = parse(text, "m.toml") else {
            panic!("it is wrong")
        };
        let mut told: Vec<_> = findings.iter().map(|it| it.key.as_str()).collect();
        told.dedup();
        assert_eq!(told, keys, "{findings:#?}");
    }

    #[test]
    fn what_is_wrong_because_of_another_value_is_not_told() {
        let text = LINEAR.edit("rail_high_v = 4.9", "rail_high_v = -7.35");
        check(&text, &["axis.x.zero.rail_high_v"]);
        let text = LINEAR.edit("delta1_mv = 20.0", "delta1_mv = 20000.0");
        check(&text, &["axis.x.zero.delta1_mv"]);
        let text = LINEAR.edit("master_heartbeat_ms = 50", "master_heartbeat_ms = 15001");
        check(&text, &["can.can0.master_heartbeat_ms"]);
        let text = VOLUMETRIC.edit(
            "axes = [\"x\", \"y\", \"z\"]",
            "axes = [\"y\", \"y\", \"z\"]",
        );
        check(&text, &["volumetric.axes"]);
    }

    #[test]
    fn a_number_that_its_key_cannot_hold_hides_nothing() {
        let text = LINEAR
            .edit("rail_high_v = 4.9", "rail_high_v = -7.35")
            .edit_first("node_id = 2", "node_id = 300");
        check(&text, &["analog.hall.node_id", "axis.x.zero.rail_high_v"]);
    }

    #[test]
    fn two_that_have_nothing_to_do_with_each_other_are_both_told() {
        let text = LINEAR
            .edit("rail_high_v = 4.9", "rail_high_v = -7.35")
            .edit_first("node_id = 2", "node_id = 1");
        check(&text, &["analog.hall.node_id", "axis.x.zero.rail_high_v"]);
    }
}
