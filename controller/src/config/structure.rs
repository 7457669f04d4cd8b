//! Whether a file has the keys, types and ranges that its schema says.

mod called;
mod moved;
mod named;
pub(in crate::config) mod places;
mod regrouped;
mod section;
mod sizes;
mod unknown;
mod written;

use core::ops::Range;

use serde_json::Value as Schema;
use toml::{Table, Value};

use super::consequences::Doubt;
use super::diagnostic::shown;
use super::judge::Finding;
use super::lines::below;
use super::meant::word_meant;
use super::place::{Part, Places};
use super::repair::Repair;
use super::schema::{DEVICE, type_of, without_null};
use moved::Moved;
use named::named;
pub(super) use regrouped::regrouped;
use section::Section;
use sizes::number;
use unknown::{merged, orphans, tell_orphans, unknown};
pub(super) use written::in_words;
use written::{converted, correction, kind};

/// What was found, by keys, and which part of each it is.
pub(super) type Findings = Vec<(Finding, Part)>;

/// What is there and cannot be read: it is not missing.
#[derive(Clone, Copy, Default)]
pub(super) struct Unread<'a> {
    pub(super) keys: &'a [String],
    /// Sections whose last lines cannot be read.
    pub(super) cut_short: &'a [String],
    /// Whether there is a section of which nobody knows which it is.
    pub(super) a_section: bool,
}

/// A key that has another unit than the one that was meant.
pub(super) struct Converted {
    /// The place of its finding among all.
    pub(super) finding: usize,
    pub(super) key: String,
    /// As it stands.
    pub(super) seen: f64,
    pub(super) value: f64,
}

/// What is told of a file.
pub(super) struct Found<'a> {
    pub(super) findings: Findings,
    /// What makes a file that can be read all the same of it, as far as that can be told.
    pub(super) repairs: Vec<Repair>,
    /// Keys with another unit, each with its finding, the key that was meant and the value in that one's unit.
    pub(super) converted: Vec<Converted>,
    /// Values outside of what their keys can have.
    pub(super) doubts: Vec<Doubt>,
    unread: Unread<'a>,
    schema: &'a Schema,
    document: &'a Table,
    /// The file as it stands.
    text: &'a str,
    places: Places<'a>,
    /// Whether keys stand in a section that lacks its name: what is missing may be theirs.
    pub(super) has_nameless: bool,
    /// Sections that stand elsewhere, and are told there.
    told: Vec<String>,
    /// Keys that are not known where they stand, and keys that are missing, each with its finding.
    moved: Moved,
    /// The sections that are being judged, from the outermost on, with the keys that they could still have.
    above: Vec<(String, Vec<String>)>,
}

impl<'a> Found<'a> {
    fn of((document, text): (&'a Table, &'a str), schema: &'a Schema, unread: Unread<'a>) -> Self {
        Self {
            findings: Vec::new(),
            repairs: Vec::new(),
            converted: Vec::new(),
            doubts: Vec::new(),
            unread,
            schema,
            document,
            text,
            places: Places::of(text),
            has_nameless: false,
            told: Vec::new(),
            moved: Moved::default(),
            above: Vec::new(),
        }
    }

    fn replace(&mut self, key: &str, value: Option<Value>) {
        let key = key.to_owned();
        self.repairs
            .extend(value.map(|value| Repair::Replace { key, value }));
    }

    /// Where that part of a key stands.
    fn written(&self, key: &str, part: Part) -> Option<Range<usize>> {
        self.places.span_of(key, part)
    }

    /// A value as it stands in the file.
    fn as_written(&self, key: &str) -> Option<&str> {
        self.text.get(self.written(key, Part::Value)?)
    }

    /// The section around this one that has such a key, and the one that has it wherever it is.
    fn home_of(&self, key: &str) -> Option<String> {
        let (_, around) = self.above.split_last()?;
        let home = around
            .iter()
            .rev()
            .find(|(_, keys)| keys.iter().any(|it| it == key));
        home.map(|(path, _)| match path.is_empty() {
            true => format!("write `{key}` above all sections"),
            false => {
                format!("`{key}` is a key of [{path}]: write it there, above the sections in it")
            }
        })
    }
}

/// All that is not as `schema` says.
pub(super) fn judge<'a>(
    (document, text): (&'a Table, &'a str),
    schema: &'a Schema,
    unread: Unread<'a>,
) -> Found<'a> {
    let mut found = Found::of((document, text), schema, unread);
    table("", document, schema, &mut found);
    moved::join(&mut found);
    found
}

/// Whether a value can be what `schema` says.
pub(super) fn takes(schema: &Schema, value: &Value) -> bool {
    let document = Table::new();
    let mut found = Found::of((&document, ""), schema, Unread::default());
    any("", value, schema, &mut found);
    found.findings.is_empty()
}

fn say(found: &mut Found<'_>, key: &str, cause: String, help: String) {
    let key = key.to_owned();
    found
        .findings
        .push((Finding { key, cause, help }, Part::Value));
}

fn any(path: &str, value: &Value, schema: &Schema, found: &mut Found<'_>) {
    if let Some(variants) = schema.as_array() {
        let words = variants.iter();
        let words = words.filter_map(|it| it["properties"][DEVICE]["const"].as_str());
        return name(path, value, &words.collect::<Vec<_>>(), found);
    }
    let schema = fitting(schema, value);
    if let Some(names) = names(schema) {
        return name(path, value, &names, found);
    }
    let seen = kind(value);
    match (type_of(schema), value) {
        ("object", Value::Table(inner)) => table(path, inner, schema, found),
        ("array", Value::Array(items)) => array(path, items, schema, found),
        ("number", Value::Float(it)) => number(path, *it, schema, found),
        // Whoever writes 5 means 5.0.
        ("number" | "integer", Value::Integer(it)) => number(path, *it as f64, schema, found),
        ("string", Value::String(_)) | ("boolean", Value::Boolean(_)) => {}
        (expected, _) => {
            let cause = format!("expected {} here, this is {seen}", in_words(expected));
            let key = path.rsplit('.').next().unwrap_or_default();
            found.replace(path, converted(expected, value, key));
            let written = found.as_written(path).unwrap_or_default();
            let help = match (expected, value) {
                ("array", _) if type_of(&schema["items"]) == "object" && !value.is_table() => {
                    format!("write each below a line `[[{path}]]`")
                }
                ("object", Value::Array(items)) if items.iter().all(Value::is_table) => {
                    match schema["properties"].is_null() {
                        true => format!("write `[{path}.NAME]`, once for each of them"),
                        false => format!("write `[{path}]`, once"),
                    }
                }
                _ => correction(expected, value, (key, written)),
            };
            say(found, path, cause, help);
        }
    }
}

/// Of a section that may be a list as well, that which `value` is.
fn fitting<'a>(schema: &'a Schema, value: &Value) -> &'a Schema {
    let wanted = match value {
        Value::Table(_) => "object",
        Value::Array(_) => "array",
        _ => return without_null(schema),
    };
    let choices = schema["anyOf"].as_array();
    let fits = choices.and_then(|it| it.iter().find(|it| type_of(it) == wanted));
    fits.unwrap_or_else(|| without_null(schema))
}

fn table(path: &str, seen: &Table, schema: &Schema, found: &mut Found<'_>) {
    if schema["properties"].is_null() {
        return named(path, seen, &schema["additionalProperties"], found);
    }
    if let [first, rest @ ..] = &Section::devices_meant(schema, seen)[..] {
        return another_device(path, seen, (schema, [&[*first], rest].concat()), found);
    }
    let section = Section::of(schema, seen);
    let merged = merged(seen, &section);
    let keys = section.keys.keys().copied();
    let free: Vec<&str> = keys.filter(|it| !seen.contains_key(*it)).collect();
    let names = free.iter().map(|it| (*it).to_owned());
    found.above.push((path.to_owned(), names.collect()));
    let orphans = orphans((path, seen), &section, &free, found.schema);
    let orphans = orphans.filter(|(keys, ..)| keys.iter().all(|it| found.home_of(it).is_none()));
    if let Some((keys, home, is_list)) = &orphans {
        tell_orphans(path, (keys, home, *is_list), &section, found);
    }
    let mut mistyped = Vec::new();
    for (key, value) in seen {
        match section.keys.get(key.as_str()) {
            Some(own) => {
                let value = merged.get(key).unwrap_or(value);
                any(&below(path, key), value, own, found);
            }
            None if orphans
                .as_ref()
                .is_some_and(|it| it.0.contains(&key.as_str())) => {}
            None => mistyped.extend(unknown((path, key), value, &section, &free, found)),
        }
    }
    // What was only mistyped, or cannot be read, is told once.
    let missed = section.required.iter();
    let is_whole = !found.unread.cut_short.iter().any(|it| it == path);
    let missed = missed.filter(|it| is_whole && free.contains(it) && !mistyped.contains(it));
    for key in missed {
        let is_told = orphans.as_ref().is_some_and(|it| it.1 == below(path, key));
        let is_told = is_told || found.told.contains(&below(path, key));
        let is_lost = is_told
            || (found.unread.a_section || found.has_nameless)
                && is_section(key, section.keys[*key]);
        if !is_lost && !found.unread.keys.contains(&below(path, key)) {
            missing(path, key, section.keys[*key], found);
        }
    }
    found.above.pop();
}

/// The keys of a section are those of another device than it names: the name was wrong.
fn another_device(
    path: &str,
    seen: &Table,
    (schema, meant): (&Schema, Vec<&str>),
    found: &mut Found<'_>,
) {
    let word = seen[DEVICE].as_str().unwrap_or_default();
    let cause = format!(
        "the keys of this section are not those of \"{}\"",
        shown(word)
    );
    let names: Vec<_> = meant.iter().map(|it| format!("\"{it}\"")).collect();
    let key = below(path, DEVICE);
    say(
        found,
        &key,
        cause,
        format!("did you mean {}?", names.join(" or ")),
    );
    let value = Value::String(meant[0].to_owned());
    found.replace(&key, Some(value.clone()));
    let mut whole = seen.clone();
    whole.insert(DEVICE.to_owned(), value);
    table(path, &whole, schema, found);
}

fn is_section(key: &str, schema: &Schema) -> bool {
    type_of(without_null(schema)) == "object" && names(schema).is_none() && key != DEVICE
}

fn missing(path: &str, key: &str, schema: &Schema, found: &mut Found<'_>) {
    let what = match is_section(key, schema) {
        true => format!("the section `{}`", below(path, key)),
        false => format!("`{key}`"),
    };
    let help = format!("add {what}; configs/README.md describes every key");
    let at = found.findings.len();
    found.moved.add_lacking(at, path, key);
    say(found, path, format!("missing {what}"), help);
}

fn array(path: &str, items: &[Value], schema: &Schema, found: &mut Found<'_>) {
    if let Some((cause, help)) = otherwise(path, items, schema, found) {
        return say(found, path, cause, help);
    }
    let (least, most) = (schema["minItems"].as_u64(), schema["maxItems"].as_u64());
    let count = items.len() as u64;
    if least.is_some_and(|it| count < it) || most.is_some_and(|it| count > it) {
        let wanted = match (least, most) {
            (Some(least), Some(most)) if least == most => least.to_string(),
            (Some(least), Some(most)) => format!("{least} to {most}"),
            (least, most) => format!(
                "{} or {}",
                least.unwrap_or(0),
                most.map_or("more".into(), |it| it.to_string())
            ),
        };
        say(
            found,
            path,
            match count {
                1 => "1 entry".to_owned(),
                count => format!("{count} entries"),
            },
            match type_of(&schema["items"]) == "number" && has_commas(items, least) {
                true => with_points(found.as_written(path).unwrap_or_default()),
                false => format!("give {wanted}"),
            },
        );
        return;
    }
    let is_number = matches!(type_of(&schema["items"]), "number" | "integer");
    if is_number && items.len() > 1 && items.iter().all(Value::is_str) {
        let written = found.as_written(path).unwrap_or_default();
        let bare: String = written.chars().filter(|it| !"\"'".contains(*it)).collect();
        if takes_text(&bare, schema) {
            let cause = "expected numbers here, these are texts".to_owned();
            return say(
                found,
                path,
                cause,
                format!("write them without quotes: {bare}"),
            );
        }
    }
    for (at, item) in items.iter().enumerate() {
        // Numbers of a list are found where the list is; its sections each by themselves.
        let own = match item {
            Value::Table(_) => below(path, &at.to_string()),
            _ => path.to_owned(),
        };
        let told = found.findings.len();
        // Our own words stand at the list; they hold for each number of it, and say more than its type does.
        let is_bound = !schema["maximum"].is_null() || !schema["x-magnitude"].is_null();
        if let (Some(seen), true) = (figure(item), is_bound) {
            number(&own, seen, schema, found);
        }
        if found.findings.len() == told {
            any(&own, item, &schema["items"], found);
        }
        if let (Some(seen), true) = (figure(item), found.findings.len() == told) {
            number(&own, seen, schema, found);
        }
    }
}

/// What is told of a list that is one of something else, or of lists.
fn otherwise(
    path: &str,
    items: &[Value],
    schema: &Schema,
    found: &mut Found<'_>,
) -> Option<(String, String)> {
    let of_sections = schema["items"]["properties"].is_object();
    if of_sections && !items.is_empty() && !items.iter().any(Value::is_table) {
        let cause = format!(
            "expected sections here, this is a list of {}",
            kind(&items[0])
        );
        let help = format!("write each below a line `[[{path}]]`");
        return Some((cause, help));
    }
    let flat = Value::Array(flattened(items, schema)?);
    let help = format!("write it with one pair of brackets: {flat}");
    found.replace(path, Some(flat));
    Some(("a list in a list".to_owned(), help))
}

/// `[[0], [1]]` and `[[0, 1]]` as one list, where that is what was meant.
fn flattened(items: &[Value], schema: &Schema) -> Option<Vec<Value>> {
    let inner = items.iter().map(Value::as_array);
    let inner = inner.collect::<Option<Vec<_>>>()?;
    let flat: Vec<Value> = inner.into_iter().flatten().cloned().collect();
    (!flat.is_empty() && takes(schema, &Value::Array(flat.clone()))).then_some(flat)
}

fn takes_text(value: &str, schema: &Schema) -> bool {
    let document = format!("it = {value}").parse::<Table>();
    document.is_ok_and(|it| it.values().all(|it| takes(schema, it)))
}

/// Whether it may be `[0,5, 1,5]` for `[0.5, 1.5]`.
fn has_commas(items: &[Value], wanted: Option<u64>) -> bool {
    let is_whole = |it: &Value| it.as_integer().is_some();
    let is_twice = wanted.is_some_and(|it| it > 0 && items.len() as u64 == 2 * it);
    is_twice && items.iter().all(is_whole)
}

/// `[0,5, 1,5]` as it was meant.
fn with_points(list: &str) -> String {
    let inner = list.trim_matches(['[', ']', ' ']);
    let numbers: Vec<&str> = inner.split(',').map(str::trim).collect();
    let pairs = numbers.chunks(2).map(|it| it.join("."));
    let list = pairs.collect::<Vec<_>>().join(", ");
    format!("write a point before the decimals: [{list}]")
}

fn figure(value: &Value) -> Option<f64> {
    match value {
        Value::Float(it) => Some(*it),
        Value::Integer(it) => Some(*it as f64),
        _ => None,
    }
}

/// The words that a value is one of, where it is one of words.
fn names(schema: &Schema) -> Option<Vec<&str>> {
    if let Some(words) = schema["enum"].as_array() {
        return Some(words.iter().filter_map(Schema::as_str).collect());
    }
    if let Some(word) = schema["const"].as_str() {
        return Some(vec![word]);
    }
    let choices = schema["oneOf"].as_array()?;
    let each = choices.iter().map(names);
    let words: Option<Vec<Vec<&str>>> = each.collect();
    Some(words?.concat())
}

fn name(path: &str, value: &Value, names: &[&str], found: &mut Found<'_>) {
    let known: Vec<_> = names.iter().map(|it| format!("\"{it}\"")).collect();
    let known = known.join(" or ");
    let Value::String(text) = value else {
        let cause = format!("expected a word here, this is {}", kind(value));
        return say(found, path, cause, format!("give {known}"));
    };
    if names.contains(&text.as_str()) {
        return;
    }
    // A device of another section was no slip of the hand.
    let meant = word_meant(text, names).filter(|_| !is_device(found.schema, text));
    found.replace(path, meant.map(|it| Value::String(it.to_owned())));
    let help = match meant {
        Some(word) if names.len() > 1 => format!("did you mean \"{word}\"? It can be {known}"),
        Some(word) => format!("did you mean \"{word}\"?"),
        None => format!("give {known}"),
    };
    say(
        found,
        path,
        format!("`{}` is not known here", shown(text)),
        help,
    );
}

/// Whether the word names a device, of whatever section.
fn is_device(schema: &Schema, word: &str) -> bool {
    match schema {
        Schema::Object(inner) => {
            let own = inner.get(DEVICE).and_then(|it| it["const"].as_str());
            own == Some(word) || inner.values().any(|it| is_device(it, word))
        }
        Schema::Array(items) => items.iter().any(|it| is_device(it, word)),
        _ => false,
    }
}

#[cfg(test)]
mod tests;
