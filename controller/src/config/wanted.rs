//! What can stand in a section, by where that is: the schema's word on a line that is looked at by itself.

use std::collections::BTreeMap;

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::schema::type_of;
use super::structure;

/// The keys of a section, each with what it can be. Where the section is about one of several devices, those of all.
pub(super) struct Wanted<'a> {
    path: String,
    keys: BTreeMap<&'a str, Vec<&'a Schema>>,
}

impl<'a> Wanted<'a> {
    /// `path` is the section's as findings name it: `axis.x.zero`, `platform.actuator.0`; empty for the top of the file.
    pub(super) fn at(schema: &'a Schema, path: &str) -> Self {
        let mut parts = path.split('.').filter(|it| !it.is_empty());
        let nodes = parts.try_fold(vec![schema], |nodes, part| {
            let inner: Vec<_> = nodes.iter().flat_map(|it| within(it, part)).collect();
            (!inner.is_empty()).then_some(inner)
        });
        let mut keys: BTreeMap<&str, Vec<&Schema>> = BTreeMap::new();
        let nodes = nodes.into_iter().flatten().flat_map(choices);
        for (key, own) in nodes.flat_map(|it| it["properties"].as_object().into_iter().flatten()) {
            keys.entry(key).or_default().push(own);
        }
        let path = path.to_owned();
        Self { path, keys }
    }

    /// The path of the section in this one that is called `name`, where there is such a one.
    pub(super) fn section(&self, name: &str) -> Option<String> {
        let is_section = |it: &&Schema| it["properties"].is_object();
        self.ways(name).iter().find(|it| is_section(it))?;
        // One of several is named by what stands before it.
        let is_of_several = self.path.split('.').any(|it| it.parse::<usize>().is_ok());
        (!is_of_several).then(|| super::lines::below(&self.path, name))
    }

    pub(super) fn keys(&self) -> Vec<&'a str> {
        self.keys.keys().copied().collect()
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.keys.contains_key(key)
    }

    /// What `key` can be, each way by itself.
    pub(super) fn ways(&self, key: &str) -> Vec<&'a Schema> {
        let own = self.keys.get(key).into_iter().flatten();
        own.flat_map(|it| choices(it)).collect()
    }

    /// Whether `line` is one key of the section with a value that it can have.
    pub(super) fn takes(&self, line: &str) -> bool {
        let Ok(table) = line.parse::<Table>() else {
            return false;
        };
        let mut entries = table.iter();
        match (entries.next(), entries.next()) {
            (Some((key, value)), None) => self.takes_value(key, value),
            _ => false,
        }
    }

    /// What `key` is, in words, where it is known.
    pub(super) fn can_be(&self, key: &str) -> Option<&'static str> {
        let mut kinds = self.ways(key).into_iter().map(type_of);
        kinds.next_back().map(structure::in_words)
    }

    /// Whether the value of `line` is of a kind that its key has, of whatever size.
    pub(super) fn fits_kind(&self, line: &str) -> bool {
        let table = line.parse::<Table>().unwrap_or_default();
        let Some((key, value)) = table.iter().next() else {
            return false;
        };
        let kind = match value {
            Value::Float(it) if it.fract() != 0.0 => &["number"][..],
            Value::Float(_) | Value::Integer(_) => &["number", "integer"],
            Value::String(_) => &["string"],
            Value::Boolean(_) => &["boolean"],
            Value::Array(_) => &["array"],
            Value::Table(_) | Value::Datetime(_) => &["object"],
        };
        self.ways(key)
            .into_iter()
            .any(|it| kind.contains(&type_of(it)))
    }

    fn takes_value(&self, key: &str, value: &Value) -> bool {
        let own = self.keys.get(key).into_iter().flatten();
        own.into_iter().any(|it| structure::takes(it, value))
    }
}

/// What is called `part` in what `schema` describes: a key's, a section's of the user's, or a list's by its number.
fn within<'a>(schema: &'a Schema, part: &str) -> Vec<&'a Schema> {
    let found = choices(schema).into_iter().filter_map(|it| {
        let known = it["properties"].get(part);
        let named = Some(&it["additionalProperties"]).filter(|_| it["properties"].is_null());
        let listed = part.parse::<usize>().ok().map(|_| &it["items"]);
        let mut all = [known, named, listed].into_iter().flatten();
        all.find(|it| it.is_object())
    });
    found.collect()
}

/// A schema and what it lets choose from.
fn choices(schema: &Schema) -> Vec<&Schema> {
    // Devices stand in a list by themselves.
    let own = schema.as_array().into_iter().flatten();
    let named = ["oneOf", "anyOf"].into_iter();
    let named = named.flat_map(|it| schema[it].as_array().into_iter().flatten());
    let inner = own.chain(named).flat_map(choices);
    core::iter::once(schema).chain(inner).collect()
}

/// The name of a section as it was meant: each part that is not the user's own as the schema has it. `None` where it
/// begins with nothing that is known.
pub(super) fn section_meant(schema: &Schema, parts: &[&str]) -> Option<String> {
    let mut path = String::new();
    for part in parts {
        let wanted = Wanted::at(schema, &path);
        let keys = wanted.keys();
        let part = match keys.is_empty() || wanted.has(part) {
            true => part,
            false => super::meant::key_meant(part, &keys)?,
        };
        path = super::lines::below(&path, part);
    }
    Some(path).filter(|it| !it.is_empty())
}

/// Whether there can be several sections of that name: `[[platform.actuator]]`.
pub(super) fn is_list(schema: &Schema, path: &str) -> bool {
    let (section, name) = path.rsplit_once('.').unwrap_or(("", path));
    let ways = Wanted::at(schema, section).ways(name);
    // Where there can be one by itself, too, that is what is written.
    let is_one = ways.iter().any(|it| it["properties"].is_object());
    !is_one && ways.iter().any(|it| it["items"]["properties"].is_object())
}

/// The line that begins a section of that name.
pub(super) fn heading(schema: &Schema, path: &str) -> String {
    match is_list(schema, path) {
        true => format!("[[{path}]]"),
        false => format!("[{path}]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::schema;

    #[test]
    fn a_section_takes_its_own_keys_with_values_that_they_can_have() {
        let zero = Wanted::at(schema::inline(), "axis.x.zero");
        assert!(zero.takes("delta2_mv = 5.0"));
        for line in [
            "delta2_mv = \"5.0\"",
            "delta2_mv = -5.0",
            "bus = \"can0\"",
            "delta2_mv =",
            "",
        ] {
            assert!(!zero.takes(line), "{line}");
        }
        let screws = Wanted::at(schema::inline(), "platform.actuator.0");
        assert!(screws.takes("direction = [0.0, 1.0]"));
        assert!(!screws.takes("direction = [0.0]"));
        assert!(Wanted::at(schema::inline(), "axis.x").takes("position_window_um = 0.1"));
        assert!(Wanted::at(schema::inline(), "nothing.x").keys().is_empty());
    }

    #[test]
    fn a_name_of_a_section_is_corrected_but_for_what_the_user_called() {
        let meant = |parts: &[&str]| section_meant(schema::inline(), parts);
        assert_eq!(
            meant(&["axes", "x1", "ident"]).as_deref(),
            Some("axis.x1.identity")
        );
        assert_eq!(meant(&["machine"]).as_deref(), Some("machine"));
        assert_eq!(meant(&["sic"]), None);
    }
}
