//! Sections that the user has named, all alike: `[axis.x]`, `[axis.y]`.

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::section::Section;
use super::{Found, any, called};
use crate::config::judge::Finding;
use crate::config::lines::below;
use crate::config::meant::word_meant;
use crate::config::place::Part;
use crate::config::repair::{Repair, join};
use crate::config::schema::{DEVICE, type_of, without_null};

pub(super) fn named(path: &str, seen: &Table, own: &Schema, found: &mut Found<'_>) {
    let all_are_sections = type_of(own) == "object";
    let mut whole = with_strays(path, seen, own, found);
    if all_are_sections && seen.values().any(is_plain) {
        nameless(path, &mut whole, own, found);
    }
    for (key, value) in &whole {
        if let Value::Table(inner) = value
            && is_part_of_one(key, inner, own)
            && let Some(name) = lacking(key, seen)
        {
            // Its keys are told with it.
            found.told.push(below(&below(path, name), key));
        }
    }
    for (key, value) in &whole {
        match value {
            Value::Table(inner) if is_part_of_one(key, inner, own) => {
                without_name(path, key, seen, found);
            }
            _ if all_are_sections && is_plain(value) => {}
            _ => any(&below(path, key), value, own, found),
        }
    }
}

fn tell(found: &mut Found<'_>, key: String, cause: String, help: String) {
    found
        .findings
        .push((Finding { key, cause, help }, Part::Name));
}

/// What is neither a section nor several of them.
fn is_plain(value: &Value) -> bool {
    let is_list = |it: &Vec<Value>| !it.is_empty() && it.iter().all(Value::is_table);
    !value.is_table() && !value.as_array().is_some_and(is_list)
}

/// `[axis]` was written for `[axis.x]`: its keys are told with it, and are of `x` where of that only sections are there.
fn nameless(path: &str, whole: &mut Table, own: &Schema, found: &mut Found<'_>) {
    let keys = whole.iter().filter(|(_, it)| is_plain(it));
    let keys: Table = keys.map(|(key, it)| (key.clone(), it.clone())).collect();
    let removed = keys.keys().map(|key| Repair::Remove {
        key: below(path, key),
    });
    found.repairs.extend(removed);
    let strays = whole.iter().filter(|(name, it)| is_stray(name, it, own));
    let strays: Vec<String> = strays.map(|(name, _)| name.clone()).collect();
    let cause = format!("keys stand below [{path}], which says not of which one they are");
    let help = match &strays[..] {
        [one] => {
            if let Some(Value::Table(other)) = whole.get_mut(one) {
                join(other, keys);
            }
            format!("write [{path}.{one}]")
        }
        _ => {
            found.has_nameless = true;
            match called::missing(path, found.document) {
                Some(name) => format!("write [{path}.{name}]"),
                None => format!("write [{path}.NAME] above them, with a name of your own"),
            }
        }
    };
    tell(found, path.to_owned(), cause, help);
}

/// Whether `[axis.zero]` was written for `[axis.x.zero]`.
fn is_part_of_one(name: &str, inner: &Table, own: &Schema) -> bool {
    let section = Section::of(own, inner);
    // `path` is a key of a bus, and may be the name of one as well.
    let is_plain = |own: &Schema| {
        ["number", "integer", "string", "boolean"].contains(&type_of(without_null(own)))
    };
    let is_key = match section.keys.get(name) {
        Some(own) => !is_plain(own),
        None => section.is_of_another_device(name),
    };
    is_key && name != DEVICE && !inner.contains_key(DEVICE)
}

/// The only one of these sections without such a part.
fn lacking<'a>(part: &str, seen: &'a Table) -> Option<&'a str> {
    let others = seen.iter().filter(|(name, _)| *name != part);
    let lacks = |it: &Value| it.as_table().is_some_and(|it| !it.contains_key(part));
    let mut lacking = others.filter(|(_, it)| lacks(it)).map(|it| it.0.as_str());
    match (lacking.next(), lacking.next()) {
        (Some(one), None) => Some(one),
        _ => None,
    }
}

fn without_name(path: &str, part: &str, seen: &Table, found: &mut Found<'_>) {
    let key = below(path, part);
    let name = lacking(part, seen).unwrap_or("NAME");
    let cause = format!("`{part}` is a section of one of [{path}.NAME], and says not of which");
    let help = match name {
        "NAME" => format!("write [{path}.NAME.{part}], with the name of one of them"),
        name => format!("write [{path}.{name}.{part}]"),
    };
    found.repairs.push(Repair::Remove { key: key.clone() });
    tell(found, key, cause, help);
}

/// All sections, those that were meant for another one in that one: `[axis.x21.identity]` without an `[axis.x21]`.
fn with_strays(path: &str, seen: &Table, own: &Schema, found: &mut Found<'_>) -> Table {
    let mut whole = seen.clone();
    let strays = seen.iter().filter(|(name, it)| is_stray(name, it, own));
    for (name, parts) in strays {
        let Value::Table(parts) = parts else { continue };
        let lacks = |other: &&str| {
            let other = seen.get(*other).and_then(Value::as_table);
            other.is_some_and(|it| parts.keys().all(|key| !it.contains_key(key)))
        };
        let others: Vec<&str> = seen
            .iter()
            .filter(|(other, it)| *other != name && it.is_table() && !is_stray(other, it, own))
            .map(|(other, _)| other.as_str())
            .filter(lacks)
            .collect();
        // Of what only one can be lacking that one was meant.
        let meant = word_meant(name, &others).or_else(|| match others[..] {
            [only] => Some(only),
            _ => None,
        });
        let Some(meant) = meant else {
            of_another_group((path, name), parts, &mut whole, found);
            continue;
        };
        if called::is_called(path, name, found.document)
            && !called::is_called(path, meant, found.document)
        {
            misnamed(path, (meant, name), &mut whole, found);
            continue;
        }
        let key = below(path, name);
        whole.remove(name);
        if let Some(Value::Table(other)) = whole.get_mut(meant) {
            join(other, parts.clone());
        }
        let cause = format!("there is no [{key}], and a section of it");
        let help = format!("did you mean [{}]?", below(path, meant));
        found.repairs.push(Repair::Rename {
            key: key.clone(),
            to: meant.to_owned(),
        });
        tell(found, key, cause, help);
    }
    whole
}

/// `[axis.c.compensation]` where `c` is a rotary table without one.
fn of_another_group(
    (path, name): (&str, &str),
    parts: &Table,
    whole: &mut Table,
    found: &mut Found<'_>,
) {
    let lacks = |group: &str, own: &Value| {
        let schema = &found.schema["properties"][group]["additionalProperties"]["properties"];
        own.get(name).is_some_and(|it| {
            parts
                .keys()
                .all(|key| it.get(key).is_none() && !schema[key.as_str()].is_null())
        })
    };
    let groups = found
        .document
        .iter()
        .filter(|(group, own)| *group != path && lacks(group, own));
    let mut groups = groups.map(|it| it.0.as_str());
    let (Some(group), None) = (groups.next(), groups.next()) else {
        return;
    };
    let key = below(path, name);
    let told: Vec<String> = parts
        .keys()
        .map(|it| below(&below(group, name), it))
        .collect();
    let cause = format!("there is no [{key}], and a section of it");
    let help = format!("did you mean [{}]?", below(group, name));
    found.told.extend(told);
    whole.remove(name);
    found.repairs.push(Repair::Remove { key: key.clone() });
    tell(found, key, cause, help);
}

/// Of a section that all the file calls otherwise, sections of it included, the name is wrong.
fn misnamed(path: &str, (seen, meant): (&str, &str), whole: &mut Table, found: &mut Found<'_>) {
    let key = below(path, seen);
    if let (Some(Value::Table(own)), Some(Value::Table(other))) =
        (whole.remove(seen), whole.get_mut(meant))
    {
        join(other, own);
    }
    let cause = format!("nothing names [{key}], and the rest of the file names [{path}.{meant}]");
    let help = format!("did you mean [{path}.{meant}]?");
    found.repairs.push(Repair::Rename {
        key: key.clone(),
        to: meant.to_owned(),
    });
    tell(found, key, cause, help);
}

/// Whether there are only sections of it where it has keys of its own.
fn is_stray(name: &str, value: &Value, own: &Schema) -> bool {
    let Value::Table(inner) = value else {
        return false;
    };
    let section = Section::of(own, inner);
    let has_own = !section.required.is_empty();
    let only_sections = !inner.is_empty() && inner.values().all(Value::is_table);
    has_own && only_sections && !is_part_of_one(name, inner, own)
}
