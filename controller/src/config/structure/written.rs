//! Values of another type than was wanted: how they are written, and what was meant.

use toml::Value;

use crate::config::unit::{self, is_unit, split_unit};

/// A value of another type as it was meant.
pub(super) fn converted(expected: &str, value: &Value, key: &str) -> Option<Value> {
    match (expected, value) {
        ("number", Value::String(text)) => {
            let other = in_other_unit(text, key);
            let number = other.as_deref().or_else(|| number_in(text))?.trim();
            number.parse().ok().map(Value::Float)
        }
        ("integer", Value::String(text)) => {
            let other = in_other_unit(text, key).map(without_decimals);
            let number = other.as_deref().or_else(|| number_in(text))?.trim();
            let number = without_decimals(number.to_owned());
            number.parse().ok().map(Value::Integer)
        }
        ("array", Value::String(text)) => list_in(text),
        ("integer", Value::Float(it)) if megabits(*it, key).is_some() => {
            megabits(*it, key).map(Value::Integer)
        }
        ("integer", Value::Float(it)) if it.fract() == 0.0 => Some(Value::Integer(*it as i64)),
        ("boolean", Value::String(text)) => truth(text).map(Value::Boolean),
        ("string", Value::Integer(_) | Value::Float(_)) => Some(Value::String(value.to_string())),
        (_, Value::Array(items)) => match (&items[..], expected) {
            ([Value::Float(it)], "number") => Some(Value::Float(*it)),
            ([one @ Value::Integer(_)], "integer" | "number") => Some(one.clone()),
            ([one @ Value::String(_)], "string") => Some(one.clone()),
            ([one @ Value::Boolean(_)], "boolean") => Some(one.clone()),
            _ => None,
        },
        _ => None,
    }
}

/// `1.0` of a bit rate is megabits.
fn megabits(value: f64, key: &str) -> Option<i64> {
    // Nothing here is slower than 10 bit/s, nor faster than 100 Mbit/s.
    let is_meant = key.ends_with("bit_per_s") && value > 0.0 && value < 10.0;
    is_meant.then(|| (value * 1e6).round() as i64)
}

/// The list that a text is, but for its quotes.
fn list_in(text: &str) -> Option<Value> {
    let text = text.trim();
    let document = text.starts_with('[').then(|| format!("it = {text}"))?;
    document.parse::<toml::Table>().ok()?.remove("it")
}

/// What a word of everyday says instead of `true` or `false`.
fn truth(word: &str) -> Option<bool> {
    match word.to_lowercase().as_str() {
        "true" | "yes" | "on" => Some(true),
        "false" | "no" | "off" => Some(false),
        _ => None,
    }
}

pub(in crate::config) fn in_words(expected: &str) -> &'static str {
    match expected {
        "object" => "a section",
        "array" => "a list",
        "number" => "a number",
        "integer" => "a whole number",
        "boolean" => "`true` or `false`",
        _ => "text",
    }
}

pub(super) const fn kind(value: &Value) -> &'static str {
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

/// What to write instead of a value of `key` that stands in the file as `written`.
pub(super) fn correction(expected: &str, value: &Value, (key, written): (&str, &str)) -> String {
    match (expected, value) {
        ("number" | "integer", Value::String(text)) => number_written(expected, text, key),
        ("boolean", Value::String(text)) => match truth(text) {
            Some(it) => format!("write it without quotes: {it}"),
            None => "give true or false".into(),
        },
        ("boolean", Value::Integer(it)) => match it {
            0 => "write false".into(),
            1 => "write true".into(),
            _ => "give true or false".into(),
        },
        // A serial number may have digits alone; what is called by a name has none.
        ("string", Value::Integer(_)) if is_of_digits(key) => {
            format!("write it in quotes: \"{written}\"")
        }
        ("string", Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
            "give text, in quotes".into()
        }
        ("integer", Value::Float(it)) if megabits(*it, key).is_some() => {
            let bits = megabits(*it, key).unwrap_or_default();
            format!("write {bits}, if {it} Mbit/s are meant: the unit is bit/s")
        }
        ("integer", Value::Float(it)) if it.fract() == 0.0 => format!("write {it:.0}"),
        ("integer", Value::Float(_)) if parts_thousands(written) => {
            let whole = written.replace('.', "");
            format!("give a whole number: {whole}, where the point parts thousands")
        }
        ("array", Value::Table(_)) => "write a list: [...]".into(),
        ("array", Value::String(text)) if list_in(text).is_some() => {
            format!("write it without quotes: {}", text.trim())
        }
        ("array", _) => "write it in brackets: [...]".into(),
        ("number" | "integer" | "boolean" | "string", Value::Array(items)) => match &items[..] {
            [_] => {
                let one = written.trim_matches(['[', ']', ' ', ',']);
                format!("write it without brackets: {one}")
            }
            _ => format!("give {} and no list", in_words(expected)),
        },
        ("object", _) => "write its keys below a line with its name in brackets: [section]".into(),
        _ => format!("give {}", in_words(expected)),
    }
}

/// What to write in place of a text where a number is wanted.
fn number_written(expected: &str, text: &str, key: &str) -> String {
    let is_strange = split_unit(text.trim())
        .and_then(|it| it.1)
        .is_some_and(|unit| unit::is_another(unit, key));
    match (in_other_unit(text, key), number_in(text)) {
        _ if is_strange => format!(
            "give {} in the unit that the key ends with, without quotes and unit",
            in_words(expected)
        ),
        (Some(number), _)
            if expected == "integer" && !number.ends_with(".0") && number.contains('.') =>
        {
            format!("give {}", in_words(expected))
        }
        (Some(number), _) => {
            let number = match expected {
                "integer" => without_decimals(number),
                _ => number,
            };
            format!("write {number}, which is {text} in the key's unit")
        }
        (None, Some(number)) if number == text => {
            let number = match expected {
                "integer" => without_decimals(number.to_owned()),
                _ => number.to_owned(),
            };
            format!("write it without quotes: {number}")
        }
        (None, Some(number)) => {
            format!("write it without quotes and unit: {number}; a key's ending is its unit")
        }
        (None, None) => format!("give {}", in_words(expected)),
    }
}

/// `"0.01 um"` of a key in nanometres.
fn in_other_unit(text: &str, key: &str) -> Option<String> {
    let (number, unit) = split_unit(text.trim())?;
    let unit = unit?;
    let other = unit::magnified(text.trim(), key).or_else(|| unit::converted(number, unit, key))?;
    (other.parse() != number.parse::<f64>()).then_some(other)
}

/// Whether the text of a key can be digits and nothing else.
fn is_of_digits(key: &str) -> bool {
    ["serial", "name", "plate", "number", "version", "object"]
        .iter()
        .any(|it| key.contains(it))
}

/// `10` of `10.0`.
fn without_decimals(number: String) -> String {
    number
        .strip_suffix(".0")
        .map_or(number.clone(), str::to_owned)
}

fn parts_thousands(written: &str) -> bool {
    let part = written.split_once('.').map(|it| it.1);
    part.is_some_and(|it| it.len() == 3 && it.chars().all(|it| it.is_ascii_digit()))
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
