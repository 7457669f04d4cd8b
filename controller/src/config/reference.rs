//! The keys of a machine's file for people: `configs/README.md` is written from the schema.

use core::fmt::Write as _;

use serde_json::Value;
use units::Short;

use super::schema::{DEVICE, type_of, without_null};

/// Every section with its keys, as Markdown.
pub(crate) fn markdown(schema: &Value) -> String {
    let reference = Reference { schema };
    let mut text = reference.keys(schema);
    reference.sections("", schema, &mut text);
    text
}

struct Reference<'a> {
    schema: &'a Value,
}

const HEAD: &str = "| key | type | range | meaning |\n|---|---|---|---|\n";

/// One row of a table.
struct Row {
    keys: Vec<String>,
    kind: String,
    range: String,
    meaning: String,
}

impl<'a> Reference<'a> {
    /// What a part of the schema refers to.
    fn resolved(&self, part: &'a Value) -> &'a Value {
        let part = without_null(part);
        let name = part["$ref"]
            .as_str()
            .and_then(|it| it.strip_prefix("#/$defs/"));
        name.map_or(part, |name| &self.schema["$defs"][name])
    }

    /// The sections below `path`, each followed by its own.
    fn sections(&self, path: &str, part: &'a Value, text: &mut String) {
        let of_devices = variants(part).map(|it| self.resolved(it));
        for (part, key) in core::iter::once(part)
            .chain(of_devices)
            .flat_map(|part| ordered(part).into_iter().map(move |key| (part, key)))
        {
            let own = self.resolved(&part["properties"][&key]);
            let (below, section) = self.section(own);
            if section["properties"].is_null() {
                continue;
            }
            let path = if path.is_empty() {
                key
            } else {
                format!("{path}.{key}")
            };
            let (open, close) = if own["type"] == "array" {
                ("[[", "]]")
            } else {
                ("[", "]")
            };
            let about = section["description"].as_str().unwrap_or_default();
            let (title, intro) = about.split_once("\n\n").unwrap_or((about, ""));
            let title = uncapital(title.trim_end_matches('.').replace('\n', " "));
            let heading = format!("\n### `{open}{path}{below}{close}`: {title}\n\n");
            // What several devices have is described once.
            if text.contains(&heading) {
                continue;
            }
            text.push_str(&heading);
            if !intro.is_empty() {
                let _ = write!(text, "{}\n\n", paragraphs(intro));
            }
            text.push_str(&self.keys(section));
            self.sections(&format!("{path}{below}"), section, text);
        }
    }

    /// How the sections of a key are named, and what each has.
    fn section(&self, part: &'a Value) -> (&'static str, &'a Value) {
        if part["additionalProperties"].is_object() {
            return (".NAME", self.resolved(&part["additionalProperties"]));
        }
        match part["items"].is_object() {
            true => ("", self.resolved(&part["items"])),
            false => ("", part),
        }
    }

    /// The tables of a section's keys: those of every device, then those of each.
    fn keys(&self, section: &'a Value) -> String {
        let variants: Vec<_> = variants(section).collect();
        let mut text = HEAD.to_owned();
        if !variants.is_empty() {
            text += &device_row(&variants);
        }
        self.rows(section, &mut text);
        for variant in variants {
            let _ = write!(text, "\nWith `device = \"{}\"`:\n\n", word(variant));
            let about = variant["description"].as_str().unwrap_or_default();
            if let Some((_, more)) = about.split_once("\n\n") {
                let _ = write!(text, "{}\n\n", paragraphs(more));
            }
            text += HEAD;
            self.rows(self.resolved(variant), &mut text);
        }
        text
    }

    /// Keys one after the other that are alike share a row.
    fn rows(&self, section: &'a Value, text: &mut String) {
        let mut rows: Vec<Row> = Vec::new();
        for key in ordered(section) {
            let row = self.row(section, &key);
            match rows.last_mut() {
                Some(last) if last.meaning == row.meaning && last.range == row.range => {
                    last.keys.push(key);
                }
                _ => rows.push(row),
            }
        }
        for row in rows {
            let keys: Vec<_> = row.keys.iter().map(|it| format!("`{it}`")).collect();
            let (keys, kind) = (keys.join(", "), row.kind);
            let _ = writeln!(
                text,
                "| {keys} | {kind} | {} | {} |",
                row.range, row.meaning
            );
        }
    }

    fn row(&self, section: &'a Value, key: &str) -> Row {
        let field = &section["properties"][key];
        let is_required = is_required(section, key);
        let part = self.resolved(field);
        let mut kind = self.kind(part);
        match (&field["default"], is_required) {
            (_, true) => kind += ", req.",
            (Value::Null | Value::Object(_), false) => kind += ", opt.",
            (Value::Array(of), false) if of.is_empty() => kind += ", default none",
            (Value::Array(of), false) => kind += &format!(", default {}", short(&of[0])),
            (default, false) => kind += &format!(", default {}", short(default)),
        }
        let meaning = field["description"].as_str().unwrap_or_default();
        let values = choices(part).map_or_else(String::new, |it| described(&it));
        Row {
            keys: vec![key.to_owned()],
            kind,
            range: range(field, part),
            meaning: meaning.replace('\n', " ") + &values,
        }
    }

    fn kind(&self, part: &'a Value) -> String {
        if choices(part).is_some() {
            return "text".into();
        }
        let of = type_of(part);
        match of {
            "object" if part["additionalProperties"].is_object() => "sections".into(),
            "object" => "section".into(),
            "string" => "text".into(),
            "array" => {
                let item = self.kind(self.resolved(&part["items"]));
                let many = match (&part["minItems"], &part["maxItems"]) {
                    (Value::Number(least), Value::Number(most)) if least == most => {
                        format!("{least} ")
                    }
                    _ => String::new(),
                };
                match item.as_str() {
                    "text" => format!("{many}texts"),
                    item => format!("{many}{item}s"),
                }
            }
            other => other.into(),
        }
    }
}

/// What a section is for each device, where it is about one.
fn variants(section: &Value) -> impl Iterator<Item = &Value> {
    let choices = section["oneOf"].as_array().into_iter().flatten();
    choices.filter(|it| it["properties"][DEVICE].is_object())
}

/// What `device` calls it.
fn word(variant: &Value) -> &str {
    let word = &variant["properties"][DEVICE]["const"];
    word.as_str().unwrap_or_default()
}

fn device_row(variants: &[&Value]) -> String {
    let words = variants
        .iter()
        .map(|it| (word(it), it["description"].as_str()));
    let words: Vec<_> = words
        .map(|(word, about)| (word, about.unwrap_or_default()))
        .collect();
    let each: Vec<_> = words.iter().map(|(it, _)| format!("`\"{it}\"`")).collect();
    let about = described(&words);
    format!("| `device` | text, req. | {} |{about} |\n", each.join(", "))
}

/// The keys of a section: first those that must be there, as they are declared.
fn ordered(section: &Value) -> Vec<String> {
    let required = section["required"].as_array().into_iter().flatten();
    let mut keys: Vec<_> = required
        .filter_map(Value::as_str)
        .map(str::to_owned)
        .collect();
    let all = section["properties"].as_object().into_iter().flatten();
    for (key, _) in all {
        if !keys.contains(key) {
            keys.push(key.clone());
        }
    }
    keys
}

fn is_required(section: &Value, key: &str) -> bool {
    let required = section["required"].as_array();
    required.is_some_and(|it| it.iter().any(|it| it == key))
}

/// The words that a value is one of, and what each means.
fn choices(part: &Value) -> Option<Vec<(&str, &str)>> {
    let words = part["enum"]
        .as_array()
        .or_else(|| part["oneOf"].as_array())?;
    let each = words.iter().map(|it| match it {
        Value::String(word) => Some((word.as_str(), "")),
        it => Some((
            it["const"].as_str()?,
            it["description"].as_str().unwrap_or_default(),
        )),
    });
    each.collect()
}

fn described(choices: &[(&str, &str)]) -> String {
    let known = choices.iter().filter(|(_, about)| !about.is_empty());
    known.fold(String::new(), |text, (word, about)| {
        let about = about.split("\n\n").next().unwrap_or_default();
        let about = uncapital(about.trim_end_matches('.').replace('\n', " "));
        text + &format!(" `\"{word}\"`: {about}.")
    })
}

fn range(field: &Value, part: &Value) -> String {
    let mut parts = Vec::new();
    if let Some(choices) = choices(part) {
        let each: Vec<_> = choices
            .iter()
            .map(|(it, _)| format!("`\"{it}\"`"))
            .collect();
        parts.push(each.join(", "));
    }
    let bound = |key: &str| {
        let own = &field[key];
        let own = if own.is_null() {
            &field["items"][key]
        } else {
            own
        };
        own.as_f64()
    };
    // What a type of so many bits holds is no range.
    let is_bits = |it: &f64| [255.0, 4_294_967_295.0].contains(it);
    let most = bound("maximum").filter(|it| !is_bits(it));
    match (bound("minimum"), most) {
        (Some(low), Some(high)) => parts.push(format!("{} to {}", figure(low), figure(high))),
        (Some(low), None) if low != 0.0 => parts.push(format!("{} or more", figure(low))),
        (None, Some(high)) if field["x-above"].is_null() => {
            parts.push(format!("at most {}", figure(high)));
        }
        _ => {}
    }
    if let Some(limit) = field["x-above"].as_f64() {
        let most = most.map_or_else(String::new, |it| format!(" to {}", figure(it)));
        parts.push(format!("above {}{most}", figure(limit)));
    }
    if let Some(bounds) = field["x-magnitude"].as_array() {
        let [low, high] = [0, 1].map(|at| figure(bounds[at].as_f64().unwrap_or_default()));
        parts.push(format!("magnitude {low} to {high}"));
    }
    parts.extend(field["x-range"].as_str().map(str::to_owned));
    parts.join(", ")
}

fn figure(value: f64) -> String {
    let exponent = format!("{value:e}");
    // Whoever reads 0.000001 or 1000000 counts zeros; of 2147483647 every digit counts.
    let is_round = !exponent.contains('.');
    let is_handy = value == 0.0 || (1e-3..1e6).contains(&value.abs());
    match (is_handy || !is_round, value.fract() == 0.0) {
        (true, true) => format!("{value:.0}"),
        (true, false) => Short(value).to_string(),
        (false, _) => exponent,
    }
}

fn short(value: &Value) -> String {
    match value {
        Value::Number(it) => it.as_f64().map_or_else(String::new, figure),
        Value::String(it) => format!("`\"{it}\"`"),
        other => format!("`{other}`"),
    }
}

/// Lines of a paragraph joined again, as Markdown has them.
fn paragraphs(text: &str) -> String {
    let each = text.split("\n\n").map(|it| it.replace('\n', " "));
    each.collect::<Vec<_>>().join("\n\n")
}

/// In the middle of a sentence.
fn uncapital(text: String) -> String {
    let mut letters = text.chars();
    let first = letters.next();
    // What is an abbreviation stays one.
    let is_word = letters.clone().next().is_none_or(|it| !it.is_uppercase());
    match first {
        Some(first) if is_word => first.to_lowercase().chain(letters).collect(),
        _ => text,
    }
}

#[cfg(test)]
mod tests;
