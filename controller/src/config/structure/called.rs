//! Sections that the user has named, by what calls them: `bus = "can0"` calls `[can.can0]`.

use toml::{Table, Value};

use crate::config::lines::below;

/// The keys that call a section of each group by its name.
const CALLED_BY: [(&str, &[&str]); 6] = [
    ("can", &["bus"]),
    ("serial", &["line"]),
    ("analog", &["analog"]),
    ("axis", &["axis", "axes"]),
    ("instrument", &["instrument"]),
    ("camera", &["camera"]),
];

/// The only name of a section of `group` that is called and is not there.
pub(super) fn missing(group: &str, document: &Table) -> Option<String> {
    let mut called = called(group, document);
    let there = document.get(group).and_then(Value::as_table);
    called.retain(|it| there.is_none_or(|own| !own.get(it).is_some_and(Value::is_table)));
    called.sort_unstable();
    called.dedup();
    match &called[..] {
        [one] => Some(one.clone()),
        _ => None,
    }
}

/// Whether a key calls a section of `group` by that name: the drive's bus, an axis' sensors.
pub(super) fn is_called(group: &str, name: &str, document: &Table) -> bool {
    called(group, document).iter().any(|it| it == name)
}

fn called(group: &str, document: &Table) -> Vec<String> {
    let mut called = Vec::new();
    if let Some((_, keys)) = CALLED_BY.iter().find(|it| it.0 == group) {
        collect(document, keys, &mut called);
    }
    called
}

fn collect(table: &Table, keys: &[&str], called: &mut Vec<String>) {
    for (key, value) in table {
        let is_call = keys.contains(&key.as_str());
        match value {
            Value::String(name) if is_call => called.push(name.clone()),
            Value::Table(inner) => collect(inner, keys, called),
            Value::Array(items) => {
                let names = items.iter().filter_map(Value::as_str);
                called.extend(names.filter(|_| is_call).map(str::to_owned));
                for inner in items.iter().filter_map(Value::as_table) {
                    collect(inner, keys, called);
                }
            }
            _ => {}
        }
    }
}

/// `axis.x.zero` of `axis.NAME.zero`: the one that `near` is of, or the only one that is called and not there; as it
/// is where neither tells.
pub(super) fn with_a_name(path: &str, near: &str, document: &Table) -> String {
    let Some((group, rest)) = path.split_once(".NAME") else {
        return path.to_owned();
    };
    let own = near.strip_prefix(group).and_then(|it| it.strip_prefix('.'));
    let own = own
        .and_then(|it| it.split('.').next())
        .filter(|_| !rest.is_empty());
    match own.map(str::to_owned).or_else(|| missing(group, document)) {
        Some(name) => below(group, &name) + rest,
        None => path.to_owned(),
    }
}

/// Whether each section of this path has that key: `axis.NAME` are all of `axis`.
pub(super) fn all_have(path: &str, key: &str, document: &Table) -> bool {
    let (group, rest) = path.split_once(".NAME").unwrap_or((path, ""));
    let whole = |name: &str| match path.contains(".NAME") {
        true => below(group, name) + rest,
        false => path.to_owned(),
    };
    let names = document.get(group).and_then(Value::as_table);
    let mut names = names.into_iter().flat_map(|it| it.keys());
    match path.contains(".NAME") {
        true => names.all(|it| is_there(&below(&whole(it), key), document)),
        false => is_there(&below(path, key), document),
    }
}

/// Whether a section of this path is in the document.
pub(super) fn is_there(path: &str, document: &Table) -> bool {
    let mut parts = path.split('.');
    let first = parts.next().and_then(|it| document.get(it));
    parts.fold(first, |value, part| value?.get(part)).is_some()
}
