//! Whether a file has the keys, types and ranges that its schema says.

use std::collections::BTreeMap;

use serde_json::Value as Schema;
use toml::{Table, Value};
use units::Short;

use super::judge::Finding;
use super::lines::below;
use super::schema::{DEVICE, type_of, without_null};
use super::unit::{is_unit, split_unit};

/// What is wrong with a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// That it is there.
    Name,
    /// What it says.
    Value,
    /// How much it says: the file can be read, and judged further.
    Size,
}

/// What was found, by keys, and which part of each it is.
type Findings = Vec<(Finding, Part)>;

/// All that is not as `schema` says.
pub(super) fn judge(document: &Table, schema: &Schema) -> Findings {
    let mut findings = Vec::new();
    table("", document, schema, &mut findings);
    findings
}

fn say(findings: &mut Findings, key: &str, cause: String, help: String) {
    let key = key.to_owned();
    findings.push((Finding { key, cause, help }, Part::Value));
}

fn say_size(findings: &mut Findings, key: &str, seen: f64, help: String) {
    let (key, cause) = (key.to_owned(), format!("{} is impossible", Short(seen)));
    findings.push((Finding { key, cause, help }, Part::Size));
}

fn any(path: &str, value: &Value, schema: &Schema, findings: &mut Findings) {
    if let Some(variants) = schema.as_array() {
        let words = variants.iter();
        let words = words.filter_map(|it| it["properties"][DEVICE]["const"].as_str());
        return name(path, value, &words.collect::<Vec<_>>(), findings);
    }
    let schema = fitting(schema, value);
    if let Some(names) = names(schema) {
        return name(path, value, &names, findings);
    }
    let seen = kind(value);
    match (type_of(schema), value) {
        ("object", Value::Table(inner)) => table(path, inner, schema, findings),
        ("array", Value::Array(items)) => array(path, items, schema, findings),
        ("number", Value::Float(it)) => number(path, *it, schema, findings),
        // Whoever writes 5 means 5.0.
        ("number" | "integer", Value::Integer(it)) => number(path, *it as f64, schema, findings),
        ("string", Value::String(_)) | ("boolean", Value::Boolean(_)) => {}
        (expected, _) => {
            let cause = format!("expected {} here, this is {seen}", in_words(expected));
            say(findings, path, cause, correction(expected, value));
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

fn in_words(expected: &str) -> &'static str {
    match expected {
        "object" => "a section",
        "array" => "a list",
        "number" => "a number",
        "integer" => "a whole number",
        "boolean" => "`true` or `false`",
        _ => "text",
    }
}

const fn kind(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "text",
        Value::Integer(_) => "a whole number",
        Value::Float(_) => "a number",
        Value::Boolean(_) => "`true` or `false`",
        Value::Datetime(_) => "a date",
        Value::Array(_) => "a list",
        Value::Table(_) => "a section",
    }
}

fn correction(expected: &str, value: &Value) -> String {
    match (expected, value) {
        ("number" | "integer", Value::String(text)) => match number_in(text) {
            Some(number) if number == text => format!("write it without quotes: {number}"),
            Some(number) => {
                format!("write it without quotes and unit: {number}; a key's ending is its unit")
            }
            None => format!("give {}", in_words(expected)),
        },
        ("string", Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
            format!("write it in quotes: \"{value}\"")
        }
        ("integer", Value::Float(it)) => format!("write {:.0}", it),
        ("array", Value::Table(_)) => "write a list: [...]".into(),
        ("array", _) => "write it in brackets: [...]".into(),
        ("number" | "integer" | "boolean" | "string", Value::Array(items)) => match &items[..] {
            [one] => format!("write it without brackets: {one}"),
            _ => format!("give {} and no list", in_words(expected)),
        },
        ("object", _) => "write its keys below a line with its name in brackets: [section]".into(),
        _ => format!("give {}", in_words(expected)),
    }
}

/// The number of a text that is one, with a unit or without.
fn number_in(text: &str) -> Option<&str> {
    let text = text.trim();
    let digits = text.strip_prefix("0x").unwrap_or_default();
    if !digits.is_empty() && digits.chars().all(|it| it.is_ascii_hexdigit() || it == '_') {
        return Some(text);
    }
    let (number, unit) = split_unit(text)?;
    unit.is_none_or(is_unit).then_some(number)
}

fn table(path: &str, seen: &Table, schema: &Schema, findings: &mut Findings) {
    if schema["properties"].is_null() {
        // Named by the user, all alike.
        for (key, value) in seen {
            let own = &schema["additionalProperties"];
            any(&below(path, key), value, own, findings);
        }
        return;
    }
    let section = Section::of(schema, seen);
    let keys = section.keys.keys().copied();
    let free: Vec<&str> = keys.filter(|it| !seen.contains_key(*it)).collect();
    let mut mistyped = Vec::new();
    for (key, value) in seen {
        match section.keys.get(key.as_str()) {
            Some(own) => any(&below(path, key), value, own, findings),
            None => {
                let is_anothers = section.is_of_another_device(key);
                if is_anothers && section.device.is_none() {
                    // Nobody knows yet which device it is.
                    continue;
                }
                let (cause, help) = match is_anothers {
                    true => (section.has_no_such_key(), "remove it".to_owned()),
                    false => {
                        // What must be there and is not comes first.
                        let lacks = meant(key, &section.lacking(&free));
                        let meant = lacks.or_else(|| meant(key, &free));
                        mistyped.extend(meant);
                        let cause = "there is no such key here".to_owned();
                        let part = section.part_meant(key, value);
                        (cause, part.unwrap_or_else(|| advice(meant, &free)))
                    }
                };
                let key = below(path, key);
                findings.push((Finding { key, cause, help }, Part::Name));
            }
        }
    }
    // What was only mistyped is told once.
    let missed = section.required.iter();
    let missed = missed.filter(|it| free.contains(it) && !mistyped.contains(it));
    for key in missed {
        missing(path, key, section.keys[*key], findings);
    }
}

/// What a section can hold, with the device that it is about, where it is about one.
struct Section<'a> {
    keys: BTreeMap<&'a str, &'a Schema>,
    required: Vec<&'a str>,
    device: Option<&'a str>,
    /// Of devices that it is not about.
    others: Vec<&'a str>,
}

impl<'a> Section<'a> {
    fn of(schema: &'a Schema, seen: &Table) -> Self {
        let mut section = Self {
            keys: BTreeMap::new(),
            required: Vec::new(),
            device: None,
            others: Vec::new(),
        };
        section.add(schema);
        let word = seen.get(DEVICE).and_then(Value::as_str);
        let variants = schema["oneOf"].as_array().into_iter().flatten();
        for variant in variants.clone() {
            let device = variant["properties"][DEVICE]["const"].as_str();
            if device.is_some() && device == word {
                section.device = device;
                section.add(variant);
            } else {
                let keys = variant["properties"].as_object().into_iter().flatten();
                section.others.extend(keys.map(|(key, _)| key.as_str()));
            }
        }
        if section.device.is_none() && variants.clone().next().is_some() {
            // What it can be is told where the word stands.
            section.keys.insert(DEVICE, &schema["oneOf"]);
            section.required.push(DEVICE);
        }
        section
    }

    fn add(&mut self, part: &'a Schema) {
        let keys = part["properties"].as_object().into_iter().flatten();
        self.keys.extend(keys.map(|(key, own)| (key.as_str(), own)));
        let required = part["required"].as_array().into_iter().flatten();
        self.required.extend(required.filter_map(Schema::as_str));
    }

    /// The keys of `free` that must be there.
    fn lacking(&self, free: &[&'a str]) -> Vec<&'a str> {
        let lacks = free.iter().filter(|it| self.required.contains(it));
        lacks.copied().collect()
    }

    /// What to say of a mistyped part of a section's name (`[axsi.x.zero]`), which other sections may have right.
    fn part_meant(&self, key: &str, value: &Value) -> Option<String> {
        let lists = value
            .as_array()
            .is_some_and(|it| it.iter().all(Value::is_table));
        if !(value.is_table() || lists) {
            return None;
        }
        let keys: Vec<&str> = self.keys.keys().copied().collect();
        let key = meant(key, &keys)?;
        Some(format!("did you mean `{key}`?"))
    }

    fn is_of_another_device(&self, key: &str) -> bool {
        self.others.contains(&key)
    }

    fn has_no_such_key(&self) -> String {
        let device = self.device.unwrap_or_default();
        format!("`device = \"{device}\"` has no such key")
    }
}

fn missing(path: &str, key: &str, schema: &Schema, findings: &mut Findings) {
    let what = match type_of(without_null(schema)) {
        "object" if names(schema).is_none() => format!("the section `{}`", below(path, key)),
        _ => format!("`{key}`"),
    };
    let help = format!("add {what}; configs/README.md describes every key");
    say(findings, path, format!("missing {what}"), help);
}

fn array(path: &str, items: &[Value], schema: &Schema, findings: &mut Findings) {
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
            findings,
            path,
            format!("{count} entries"),
            format!("give {wanted}"),
        );
        return;
    }
    for (at, item) in items.iter().enumerate() {
        // Numbers of a list are found where the list is; its sections each by themselves.
        let own = match item {
            Value::Table(_) => below(path, &at.to_string()),
            _ => path.to_owned(),
        };
        let found = findings.len();
        any(&own, item, &schema["items"], findings);
        // Our own words stand at the list; they hold for each number of it.
        if let (Some(seen), true) = (figure(item), findings.len() == found) {
            number(&own, seen, schema, findings);
        }
    }
}

fn figure(value: &Value) -> Option<f64> {
    match value {
        Value::Float(it) => Some(*it),
        Value::Integer(it) => Some(*it as f64),
        _ => None,
    }
}

fn number(path: &str, seen: f64, schema: &Schema, findings: &mut Findings) {
    let bound = |key: &str| schema[key].as_f64();
    let (least, most) = whole_numbers(schema);
    let (low, high) = match schema["x-magnitude"].as_array() {
        Some(bounds) => (bounds[0].as_f64(), bounds[1].as_f64()),
        None => (bound("minimum").or(least), bound("maximum").or(most)),
    };
    let value = match schema["x-magnitude"].is_array() {
        true => seen.abs(),
        false => seen,
    };
    // A comparison with NaN, which TOML can write, is false.
    let is_within = low.is_none_or(|it| value >= it) && high.is_none_or(|it| value <= it);
    let is_whole = type_of(schema) != "integer" || seen.fract() == 0.0;
    if !(is_within && is_whole && seen.is_finite()) {
        let help = match (low, high) {
            (Some(low), Some(high)) => format!("give {} to {}", whole(low), whole(high)),
            (Some(low), None) => format!("give {} or more", whole(low)),
            (None, Some(high)) => format!("give {} or less", whole(high)),
            (None, None) => "give a number".into(),
        };
        say_size(findings, path, seen, help);
        return;
    }
    if let Some(limit) = schema["x-above"].as_f64().filter(|it| seen <= *it) {
        let help = format!("give more than {}", Short(limit));
        say_size(findings, path, seen, help);
    }
}

/// A bound to its last digit, where it is a whole number.
fn whole(bound: f64) -> String {
    match bound.fract() == 0.0 && bound.abs() < 1e15 {
        true => format!("{bound:.0}"),
        false => Short(bound).to_string(),
    }
}

/// What a whole number of this size can be.
fn whole_numbers(schema: &Schema) -> (Option<f64>, Option<f64>) {
    let (least, most): (i64, i64) = match schema["format"].as_str() {
        Some("uint8") => (0, u8::MAX.into()),
        Some("uint16") => (0, u16::MAX.into()),
        Some("uint32") => (0, u32::MAX.into()),
        Some("int16") => (i16::MIN.into(), i16::MAX.into()),
        Some("int32") => (i32::MIN.into(), i32::MAX.into()),
        _ => return (None, None),
    };
    (Some(least as f64), Some(most as f64))
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

fn name(path: &str, value: &Value, names: &[&str], findings: &mut Findings) {
    let seen = match value {
        Value::String(text) if names.contains(&text.as_str()) => return,
        Value::String(text) => format!("`{text}`"),
        other => kind(other).to_owned(),
    };
    let known: Vec<_> = names.iter().map(|it| format!("\"{it}\"")).collect();
    let help = format!("give {}", known.join(" or "));
    say(findings, path, format!("{seen} is not known here"), help);
}

/// What to write in place of a key that is not known, which may have `meant` another one.
fn advice(meant: Option<&str>, free: &[&str]) -> String {
    match meant {
        Some(key) => format!("did you mean `{key}`? A key's ending is its unit"),
        None if free.is_empty() => "remove it: every key of this section is there".into(),
        None => format!("known here: {}", free.join(", ")),
    }
}

/// The key of `free` that is most like `seen`, if one is.
fn meant<'a>(seen: &str, free: &[&'a str]) -> Option<&'a str> {
    let likeness = |key: &str| {
        let whole = strsim::normalized_damerau_levenshtein(key, seen);
        // With another unit it is still the same quantity.
        whole.max(strsim::normalized_damerau_levenshtein(stem(key), stem(seen)) * STEM_WEIGHT)
    };
    let scored = free.iter().map(|key| (likeness(key), *key));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    match best.0 >= LIKE {
        true => Some(best.1),
        false => with_words_left_out(seen, free),
    }
}

/// The only key of `free` that has all words of `seen`, and more.
fn with_words_left_out<'a>(seen: &str, free: &[&'a str]) -> Option<&'a str> {
    let has_all = |key: &&&str| {
        let mut words = key.split('_');
        seen.split('_').all(|wanted| words.any(|it| it == wanted))
    };
    let mut longer = free.iter().filter(has_all);
    match (longer.next(), longer.next()) {
        (Some(only), None) => Some(only),
        _ => None,
    }
}

/// So much alike two words are one that was mistyped.
const LIKE: f64 = 0.6;
/// A key that is right as a whole is nearer than one that is right but for its unit.
const STEM_WEIGHT: f64 = 0.95;

/// A key without its unit.
fn stem(key: &str) -> &str {
    key.rsplit_once('_').map_or(key, |(stem, _)| stem)
}

#[cfg(test)]
mod tests;
