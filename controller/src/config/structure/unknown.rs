//! Keys and sections that are not known where they stand: what was meant, or where they belong.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::section::Section;
use super::{Found, Part, any, places};
use crate::config::judge::Finding;
use crate::config::lines::below;
use crate::config::meant::key_meant;
use crate::config::repair::{Repair, join};
use crate::config::schema::DEVICE;

/// The sections of which a part has a mistyped name, `[axes.x]` beside `[axis.x.zero]`, with that part.
pub(super) fn merged(seen: &Table, section: &Section<'_>) -> Table {
    let mut merged = Table::new();
    for (key, value) in seen {
        let meant = match section.keys.contains_key(key.as_str()) {
            true => None,
            false => section.part_meant(key, value),
        };
        if let (Some(name), Value::Table(own)) = (meant, value)
            && let Some(Value::Table(other)) = seen.get(name)
        {
            let other = merged
                .remove(name)
                .unwrap_or_else(|| Value::Table(other.clone()));
            if let Value::Table(mut other) = other {
                join(&mut other, own.clone());
                merged.insert(name.to_owned(), Value::Table(other));
            }
        }
    }
    merged
}

/// Whether `[axis.zero]` was written for `[axis.x.zero]`.
pub(super) fn is_part_of_one(name: &str, inner: &Table, own: &Schema) -> bool {
    let section = Section::of(own, inner);
    let is_key = section.keys.contains_key(name) || section.is_of_another_device(name);
    is_key && name != DEVICE && !inner.contains_key(DEVICE)
}

pub(super) fn without_name(path: &str, part: &str, seen: &Table, found: &mut Found<'_>) {
    let key = below(path, part);
    let names: Vec<_> = seen.keys().filter(|it| *it != part).collect();
    let name = names.first().map_or("NAME", |it| it.as_str());
    let cause = format!("`{part}` is a section of one of [{path}.NAME], and says not of which");
    let help = format!("write [{path}.{name}.{part}]");
    found.repairs.push(Repair::Remove { key: key.clone() });
    found
        .findings
        .push((Finding { key, cause, help }, Part::Name));
}

/// Says what is wrong with a key that the section does not have; gives that of `free` which was meant.
pub(super) fn unknown<'a>(
    (path, name): (&str, &str),
    value: &Value,
    section: &Section<'a>,
    free: &[&'a str],
    found: &mut Found<'_>,
) -> Option<&'a str> {
    let key = below(path, name);
    let is_anothers = section.is_of_another_device(name);
    if is_anothers && section.device.is_none() {
        // Nobody knows yet which device it is.
        return None;
    }
    let (home, schema) = (found.home_of(name), found.schema);
    let mut tell = |cause: String, help: String, repair| {
        let key = key.clone();
        found.repairs.push(repair);
        found
            .findings
            .push((Finding { key, cause, help }, Part::Name));
    };
    let remove = || Repair::Remove { key: key.clone() };
    if is_anothers {
        tell(section.has_no_such_key(), "remove it".to_owned(), remove());
        return None;
    }
    // What must be there and is not comes first.
    let lacks = key_meant(name, &section.lacking(free));
    let meant = lacks.or_else(|| key_meant(name, free));
    let renamed = |to: &str| Repair::Rename {
        key: key.clone(),
        to: to.to_owned(),
    };
    let (help, repair, named) = match (section.part_meant(name, value), home, meant) {
        (Some(part), _, _) => (format!("did you mean `{part}`?"), renamed(part), Some(part)),
        (None, Some(home), _) => (home, remove(), None),
        (None, None, Some(key)) => (advice(meant, free), renamed(key), Some(key)),
        (None, None, None) => (elsewhere(schema, name, free), remove(), None),
    };
    tell("there is no such key here".to_owned(), help, repair);
    let is_judged =
        section.part_meant(name, value).is_some() && !free.contains(&named.unwrap_or_default());
    if let (Some(named), Value::Table(_) | Value::Array(_), false) = (named, value, is_judged) {
        any(&key, value, section.keys[named], found);
    }
    meant.filter(|_| named.is_some())
}

/// What to say of a key that is like none of those that are `free`.
fn elsewhere(schema: &Schema, key: &str, free: &[&str]) -> String {
    match places::of(schema, key) {
        Some(sections) => format!("`{key}` is a key of {sections}; {}", advice(None, free)),
        None => advice(None, free),
    }
}

/// What to write in place of a key that is not known, which may have `meant` another one.
fn advice(meant: Option<&str>, free: &[&str]) -> String {
    match meant {
        Some(key) => format!("did you mean `{key}`? A key's ending is its unit"),
        None if free.is_empty() => "remove it: every key of this section is there".into(),
        None => format!("known here: {}", free.join(", ")),
    }
}
