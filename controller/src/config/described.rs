//! What the declaration of a key says of it, in words.

use serde_json::Value;
use units::Short;

use super::schema::{DEVICE, type_of, without_null};

/// The schema that it stands in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Described<'a> {
    pub(super) schema: &'a Value,
}

/// What is said of a key.
pub(super) struct Row {
    pub(super) kind: String,
    pub(super) range: String,
    pub(super) meaning: String,
}

impl<'a> Described<'a> {
    /// What a part of the schema refers to.
    pub(super) fn resolved(self, part: &'a Value) -> &'a Value {
        let part = without_null(part);
        let name = part["$ref"]
            .as_str()
            .and_then(|it| it.strip_prefix("#/$defs/"));
        name.map_or(part, |name| &self.schema["$defs"][name])
    }

    /// How the sections of a key are named, and what each has.
    pub(super) fn section(self, part: &'a Value) -> (&'static str, &'a Value) {
        if part["additionalProperties"].is_object() {
            return (".NAME", self.resolved(&part["additionalProperties"]));
        }
        match part["items"].is_object() {
            true => ("", self.resolved(&part["items"])),
            false => ("", part),
        }
    }

    pub(super) fn row(self, section: &'a Value, key: &str) -> Row {
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
            kind,
            range: range(field, part),
            meaning: meaning.replace('\n', " ") + &values,
        }
    }

    fn kind(self, part: &'a Value) -> String {
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
pub(super) fn variants(section: &Value) -> impl Iterator<Item = &Value> {
    let choices = section["oneOf"].as_array().into_iter().flatten();
    choices.filter(|it| it["properties"][DEVICE].is_object())
}

/// What `device` calls it.
pub(super) fn word(variant: &Value) -> &str {
    let word = &variant["properties"][DEVICE]["const"];
    word.as_str().unwrap_or_default()
}

/// What is said of `device` itself.
pub(super) fn of_devices(variants: &[&Value]) -> Row {
    let words = variants.iter().map(|it| {
        let about = it["description"].as_str();
        (word(it), about.unwrap_or_default())
    });
    let words: Vec<_> = words.collect();
    let each: Vec<_> = words.iter().map(|(it, _)| format!("`\"{it}\"`")).collect();
    Row {
        kind: "text, req.".into(),
        range: each.join(", "),
        meaning: described(&words),
    }
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

/// In the middle of a sentence.
pub(super) fn uncapital(text: String) -> String {
    let mut letters = text.chars();
    let first = letters.next();
    // What is an abbreviation stays one.
    let is_word = letters.clone().next().is_none_or(|it| !it.is_uppercase());
    match first {
        Some(first) if is_word => first.to_lowercase().chain(letters).collect(),
        _ => text,
    }
}
