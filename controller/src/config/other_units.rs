//! Keys that end with another unit than the one that was meant: whether the number is of the one or of the other.

use toml::{Table, Value};

use super::consequences::{budget, value_at, with};
use super::judge::Finding;
use super::structure::{Converted, Findings};

/// `judged` of the numbers as they were meant, which is told in `findings`, and the document with them: by which of
/// the two less is wrong with the file. `found_in` judges a document, and gives nothing where it cannot be read.
pub(super) fn judged(
    mut judged: Vec<Finding>,
    (mut document, converted): (Table, &[Converted]),
    findings: &mut Findings,
    mut found_in: impl FnMut(&Table) -> Option<Vec<Finding>>,
) -> (Vec<Finding>, Table) {
    // The same slip in several keys: each by itself would contradict the others.
    let whole = converted.iter().try_fold(document.clone(), |whole, it| {
        with_either(&whole, it, &mut found_in)
    });
    if let Some(whole) = whole
        && let Some(other) = found_in(&whole)
        && other.len() < judged.len()
    {
        for it in converted {
            findings[it.finding].0.help =
                format!("write {}: a key's ending is its unit", line_of(it, &whole));
        }
        return (other, whole);
    }
    for it in converted.iter().take(budget(&document)) {
        let Some(whole) = with_either(&document, it, &mut found_in) else {
            continue;
        };
        let Some(other) = found_in(&whole) else {
            continue;
        };
        let line = line_of(it, &whole);
        let help = &mut findings[it.finding].0.help;
        if other.len() < judged.len() {
            *help = format!("write {line}: a key's ending is its unit");
            (judged, document) = (other, whole);
        } else if other.len() == judged.len() {
            *help = format!(
                "write {line}, or `{} = {}` where the number is in that unit already",
                name_of(it),
                written_like(it.seen, &it.key, &whole)
            );
        }
    }
    (judged, document)
}

/// The document with the number of that key in its unit; a key of whole numbers takes no others.
fn with_either(
    document: &Table,
    it: &Converted,
    found_in: &mut impl FnMut(&Table) -> Option<Vec<Finding>>,
) -> Option<Table> {
    let ways = [Value::Float(it.value), Value::Integer(it.value as i64)];
    let mut ways = ways
        .into_iter()
        .filter_map(|value| with(document, &it.key, value));
    ways.find(|it| found_in(it).is_some())
}

fn name_of(it: &Converted) -> &str {
    it.key.rsplit('.').next().unwrap_or_default()
}

/// A number as that key has it in the document: whole or not.
fn written_like(number: f64, key: &str, document: &Table) -> String {
    let mut document = document.clone();
    match value_at(&mut document, key) {
        Some(Value::Integer(_)) if number.fract() == 0.0 => format!("{number:.0}"),
        _ => format!("{number:?}"),
    }
}

/// The key with its number in the document.
fn line_of(it: &Converted, document: &Table) -> String {
    let mut document = document.clone();
    let value = value_at(&mut document, &it.key).map(|it| it.to_string());
    format!("`{} = {}`", name_of(it), value.unwrap_or_default())
}
