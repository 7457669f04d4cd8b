//! Sections whose parts are joined otherwise than by points, or written in capitals: put where they were meant to be.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::Findings;
use crate::config::judge::Finding;
use crate::config::place::Part;
use crate::config::repair::join;

/// The document with each of them in its place, and what is told of them.
pub(in crate::config) fn regrouped(document: Table, schema: &Schema) -> (Table, Findings) {
    let mut whole = document.clone();
    let mut findings = Findings::new();
    for (name, value) in document {
        let Some(path) = path_meant(&name, &value, &whole, schema) else {
            continue;
        };
        whole.remove(&name);
        let is_capital = name.to_lowercase() == path;
        let value = if is_capital { small(value) } else { value };
        let nested = path.rsplit('.').fold(value, |inner, part| {
            let mut table = Table::new();
            table.insert(part.to_owned(), inner);
            Value::Table(table)
        });
        let heading = heading_of(&nested);
        if let Value::Table(nested) = nested {
            join(&mut whole, nested);
        }
        let cause = "no section has this name".to_owned();
        let help = format!("write `{heading}`");
        let finding = Finding {
            key: name,
            cause,
            help,
        };
        findings.push((finding, Part::Name));
    }
    (whole, findings)
}

/// What `["axis.x"]`, `[axis_x]`, `[axis-x]`, `[axisx]` and `[AXIS.X]` were meant to be.
fn path_meant(name: &str, value: &Value, document: &Table, schema: &Schema) -> Option<String> {
    let known = schema["properties"].as_object()?;
    if !value.is_table() || known.contains_key(name) {
        return None;
    }
    if let Some((first, _)) = name.split_once('.') {
        return known.contains_key(first).then(|| name.to_owned());
    }
    let lower = name.to_lowercase();
    if known.contains_key(&lower) {
        return Some(lower);
    }
    known.iter().find_map(|(group, own)| {
        let rest = name.strip_prefix(group.as_str())?;
        let own_name = rest.trim_start_matches(['_', '-', ' ']);
        let has = |it: Option<&Value>| it.and_then(|it| it.get(own_name)).is_some();
        let is_parted = own_name.len() < rest.len() && own["properties"].is_null();
        let is_known = has(document.get(group)) || own["properties"].get(own_name).is_some();
        let is_meant = !own_name.is_empty() && (is_parted || is_known);
        is_meant.then(|| format!("{group}.{own_name}"))
    })
}

/// Names of sections in small letters.
fn small(value: Value) -> Value {
    match value {
        Value::Table(inner) => {
            let each = inner.into_iter().map(|(key, it)| match it.is_table() {
                true => (key.to_lowercase(), small(it)),
                false => (key, it),
            });
            Value::Table(each.collect())
        }
        other => other,
    }
}

/// The name of the innermost section as far as there is only one.
fn heading_of(value: &Value) -> String {
    let mut parts = Vec::new();
    let mut at = value;
    while let Value::Table(inner) = at {
        let mut entries = inner.iter();
        match (entries.next(), entries.next()) {
            (Some((name, only @ Value::Table(_))), None) => {
                parts.push(name.as_str());
                at = only;
            }
            (Some((name, Value::Array(_))), None) => {
                parts.push(name.as_str());
                return format!("[[{}]]", parts.join("."));
            }
            _ => break,
        }
    }
    format!("[{}]", parts.join("."))
}
