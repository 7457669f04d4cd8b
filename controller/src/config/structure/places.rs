//! Where a key is at home that stands where it is not known.

use serde_json::Value as Schema;
use toml::Table;

use super::called;
use crate::config::lines::below;

/// So many sections are named at most.
const NAMED_MAX: usize = 3;

/// The sections that have a key called `key`, as text; `None` where none has.
pub(super) fn of(schema: &Schema, key: &str) -> Option<String> {
    let mut found = Vec::new();
    walk(schema, "", key, &mut found);
    let named: Vec<_> = found
        .iter()
        .take(NAMED_MAX)
        .map(|it| match it.is_empty() {
            true => "the top of the file".to_owned(),
            false => format!("[{it}]"),
        })
        .collect();
    let more = match found.len() > NAMED_MAX {
        true => " and others",
        false => "",
    };
    (!named.is_empty()).then(|| format!("{}{more}", named.join(", ")))
}

/// The section that has all of `keys`, the first of them.
pub(super) fn of_all(schema: &Schema, keys: &[&str]) -> Option<String> {
    with_all(schema, keys).into_iter().find(|it| !it.is_empty())
}

/// The sections that have all of `keys`.
pub(in crate::config) fn with_all(schema: &Schema, keys: &[&str]) -> Vec<String> {
    let each = keys.iter().map(|key| {
        let mut found = Vec::new();
        walk(schema, "", key, &mut found);
        found
    });
    let common = each.reduce(|all, own| all.into_iter().filter(|it| own.contains(it)).collect());
    common.unwrap_or_default()
}

/// What to say of a key of one section alone that is known by name and is not in the file.
pub(super) fn lost(
    (schema, document): (&Schema, &Table),
    (path, key): (&str, &str),
) -> Option<String> {
    let homes = with_all(schema, &[key]);
    let [home] = &homes[..] else { return None };
    let home = called::with_a_name(home, path, document);
    let is_lost = !home.is_empty() && !home.contains("NAME") && !called::is_there(&home, document);
    is_lost.then(|| {
        format!("`{key}` is a key of [{home}], which is not there: write that line above it")
    })
}

fn walk(schema: &Schema, path: &str, key: &str, found: &mut Vec<String>) {
    for (name, part) in schema["properties"].as_object().into_iter().flatten() {
        if name == key && !found.iter().any(|it| it == path) {
            found.push(path.to_owned());
        }
        walk(part, &below(path, name), key, found);
    }
    if schema["additionalProperties"].is_object() {
        walk(
            &schema["additionalProperties"],
            &below(path, "NAME"),
            key,
            found,
        );
    }
    if schema["items"].is_object() {
        walk(&schema["items"], path, key, found);
    }
    for choices in ["oneOf", "anyOf"] {
        for part in schema[choices].as_array().into_iter().flatten() {
            walk(part, path, key, found);
        }
    }
}
