//! Keys and sections that are not known where they stand: what was meant, or where they belong.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::section::Section;
use super::{Converted, Found, any, called, places};
use crate::config::judge::Finding;
use crate::config::lines::below;
use crate::config::meant::key_meant;
use crate::config::place::Part;
use crate::config::repair::{Repair, join};
use crate::config::schema::without_null;
use crate::config::unit::converted;

/// The sections of which a part has a mistyped name, `[axes.x]` beside `[axis.x.zero]`, with that part.
pub(super) fn merged(seen: &Table, section: &Section<'_>) -> Table {
    let mut merged = Table::new();
    for (key, value) in seen {
        let meant = match section.keys.contains_key(key.as_str()) {
            true => None,
            false => section.part_meant(key, value),
        };
        if let (Some(name), Value::Array(own)) = (meant, value)
            && let Some(Value::Array(other)) = seen.get(name)
        {
            let all = other.iter().chain(own).cloned().collect();
            merged.insert(name.to_owned(), Value::Array(all));
        }
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

/// Of a file with more findings nobody reads where each key would be at home, and looking takes long.
const LOOKED_FOR_MAX: usize = 100;

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
    let is_long = found.findings.len() > LOOKED_FOR_MAX;
    let mut tell = |cause: String, help: String, repair| {
        let key = key.clone();
        found.repairs.push(repair);
        found
            .findings
            .push((Finding { key, cause, help }, Part::Name));
    };
    let remove = || Repair::Remove { key: key.clone() };
    if let Some(joined) = joined(name, value, section) {
        let help = format!("write `{joined}`");
        tell("there is no such key here".to_owned(), help, remove());
        return Some(joined);
    }
    if is_anothers {
        tell(section.has_no_such_key(), "remove it".to_owned(), remove());
        found.moved.add_strange(found.findings.len() - 1, name);
        return None;
    }
    // What must be there and is not comes first.
    let lacks = key_meant(name, &section.lacking(free));
    let meant = lacks.or_else(|| key_meant(name, free));
    let renamed = |to: &str| Repair::Rename {
        key: key.clone(),
        to: to.to_owned(),
    };
    // A key of a section that is not there is no other one that was mistyped.
    let home = home.filter(|_| lacks.is_none());
    let is_looked_for = lacks.is_none() && !is_long;
    let lost = is_looked_for.then(|| places::lost((schema, found.document), (path, name)));
    let lost = lost.flatten();
    let (help, repair, named) = match (section.part_meant(name, value), home.or(lost), meant) {
        (Some(part), _, _) => (format!("did you mean `{part}`?"), renamed(part), Some(part)),
        (None, Some(home), _) => (home, remove(), None),
        (None, None, Some(key)) => (advice(meant, free), renamed(key), Some(key)),
        (None, None, None) if !is_looked_for => (advice(None, free), remove(), None),
        (None, None, None) => {
            let help = elsewhere((schema, found.document), (path, name), free);
            (help, remove(), None)
        }
    };
    let is_own = meant.is_some_and(|it| section.required.contains(&it));
    tell("there is no such key here".to_owned(), help, repair);
    if !is_own {
        found.moved.add_strange(found.findings.len() - 1, name);
    }
    in_other_unit((path, name), named, value, found);
    let is_judged =
        section.part_meant(name, value).is_some() && !free.contains(&named.unwrap_or_default());
    if let (Some(named), Value::Table(_) | Value::Array(_), false) = (named, value, is_judged) {
        any(&key, value, section.keys[named], found);
    }
    meant.filter(|_| named.is_some())
}

/// Notes what a number of another unit is in that of the key `to`; its finding is the last one.
fn in_other_unit(
    (path, seen): (&str, &str),
    to: Option<&str>,
    value: &Value,
    found: &mut Found<'_>,
) {
    if let (Some(to), Some(number)) = (to, number_of(value))
        && let Some(value) = in_the_unit_of(to, seen, number)
    {
        let key = below(path, to);
        let finding = found.findings.len() - 1;
        found.converted.push(Converted {
            finding,
            key,
            seen: number,
            value,
        });
    }
}

fn number_of(value: &Value) -> Option<f64> {
    match value {
        Value::Float(it) => Some(*it),
        Value::Integer(it) => Some(*it as f64),
        _ => None,
    }
}

/// `-3000.0` of `soft_min_um` as `soft_min_mm`.
fn in_the_unit_of(key: &str, seen: &str, number: f64) -> Option<f64> {
    let words: Vec<&str> = seen.split('_').collect();
    let unit = match words[..] {
        [.., above, "per", below] => format!("{above}/{below}"),
        [.., last] => last.to_owned(),
        [] => return None,
    };
    let value = converted(&number.to_string(), &unit, key)?.parse().ok()?;
    (value != number).then_some(value)
}

/// `stage.serial` is a section with a key, and was meant to be a key.
fn joined<'a>(name: &str, value: &Value, section: &Section<'a>) -> Option<&'a str> {
    let mut entries = value.as_table()?.iter();
    let ((only, inner), None) = (entries.next()?, entries.next()) else {
        return None;
    };
    let joined = format!("{name}_{only}");
    // `self.speed`, as in a program.
    let known = [joined.as_str(), only].into_iter();
    let mut known = known.filter_map(|it| section.keys.get_key_value(it));
    let own = known.next().map(|it| *it.0);
    // `instrument.laser.average_samples`, by its whole path.
    own.or_else(|| self::joined(only, inner, section))
}

/// Keys of another section, of which the heading above them is missing: at least two, all of one.
pub(super) fn orphans<'a>(
    (path, seen): (&str, &'a Table),
    section: &Section<'_>,
    free: &[&str],
    schema: &Schema,
) -> Option<(Vec<&'a str>, String, bool)> {
    let strange = seen.iter().filter(|(key, value)| {
        let is_own = section.keys.contains_key(key.as_str()) || section.is_of_another_device(key);
        !is_own && !value.is_table() && key_meant(key, free).is_none()
    });
    let strange: Vec<&str> = strange.map(|(key, _)| key.as_str()).collect();
    // A section of this one is nearer than any other.
    let has_all = |own: &Schema| {
        let own = without_null(own);
        let inner = match own["items"].is_object() {
            true => &own["items"]["properties"],
            false => &own["properties"],
        };
        strange.iter().all(|it| !inner[*it].is_null())
    };
    let mut inner = section.keys.iter().filter(|(_, own)| has_all(own));
    let (home, is_list) = match (inner.next(), inner.next()) {
        // Which of several nobody knows.
        (Some(_), Some(_)) => (below(path, "NAME"), false),
        (Some((name, own)), None) => (below(path, name), own["items"].is_object()),
        (None, _) => (places::of_all(schema, &strange)?, false),
    };
    (strange.len() > 1).then_some((strange, home, is_list))
}

pub(super) fn tell_orphans(
    path: &str,
    (orphans, home, is_list): (&[&str], &str, bool),
    section: &Section<'_>,
    found: &mut Found<'_>,
) {
    let keys = orphans.iter().map(|it| below(path, it));
    let mut keys: Vec<String> = keys.collect();
    let repairs = keys.iter().cloned().map(|key| Repair::Remove { key });
    found.repairs.extend(repairs);
    keys.sort_by_key(|it| found.written(it, Part::Name).map(|it| it.start));
    let names: Vec<_> = orphans.iter().map(|it| format!("`{it}`")).collect();
    found.has_nameless = true;
    let home = &called::with_a_name(home, path, found.document);
    let heading = match is_list {
        true => format!("[[{home}]]"),
        false => format!("[{home}]"),
    };
    let cause = format!("{} are keys of {heading}", names.join(", "));
    // Of a section of this one the name is known.
    let is_known = !home.contains("NAME") && !called::is_there(home, found.document);
    let is_own = home == &below(path, "NAME");
    let help = match is_known || !path.is_empty() && home.starts_with(&format!("{path}.")) {
        true if is_own => {
            let parts = section
                .keys
                .iter()
                .filter(|(_, own)| without_null(own)["properties"].is_object());
            let parts: Vec<&str> = parts.map(|it| *it.0).collect();
            format!(
                "write the line {heading} above them, NAME being one of {}",
                parts.join(", ")
            )
        }
        true => format!("write the line {heading} above them, or remove them"),
        false => "write the line with the name of their section above them, or remove them".into(),
    };
    let key = keys.into_iter().next().unwrap_or_default();
    found
        .findings
        .push((Finding { key, cause, help }, Part::Name));
}

/// What to say of a key that is like none of those that are `free`.
fn elsewhere(
    (schema, document): (&Schema, &Table),
    (path, key): (&str, &str),
    free: &[&str],
) -> String {
    let homes = places::with_all(schema, &[key]);
    if let [home] = &homes[..]
        && !home.is_empty()
    {
        let home = called::with_a_name(home, path, document);
        if called::all_have(&home, key, document) {
            return format!("`{key}` is a key of [{home}], which has it: remove it here");
        }
        return match called::is_there(&home, document) || home.contains("NAME") {
            true => format!("`{key}` is a key of [{home}]: write it there"),
            false => advice(None, free),
        };
    }
    match places::of(schema, key) {
        // One that is known elsewhere is moved there, and not only removed.
        Some(sections) if free.is_empty() => format!("`{key}` is a key of {sections}"),
        Some(sections) => format!("`{key}` is a key of {sections}; {}", advice(None, free)),
        None => advice(None, free),
    }
}

/// What to write in place of a key that is not known, which may have `meant` another one.
fn advice(meant: Option<&str>, free: &[&str]) -> String {
    match meant {
        Some(key) => format!("did you mean `{key}`? A key's ending is its unit"),
        None if free.is_empty() => "remove it: every key of this section is there".into(),
        None => format!(
            "remove it; known here, and not given yet: {}",
            free.join(", ")
        ),
    }
}
