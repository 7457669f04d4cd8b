//! The name of a section whose brackets, or the points between its parts, are not as they must be.

use serde_json::Value as Schema;

use super::{Parts, Slip, is_toml};
use crate::config::diagnostic::shown;
use crate::config::place::is_of_key;
use crate::config::schema::{type_of, without_null};
use crate::config::wanted::{is_list, section_meant};

const OPEN: [char; 4] = ['[', '(', '{', '<'];
const CLOSED: [char; 4] = [']', ')', '}', '>'];
/// What parts a name elsewhere.
const BETWEEN: [char; 8] = ['.', ' ', '/', '\\', ',', ':', ';', '|'];
const QUOTES: [char; 4] = ['"', '\'', '“', '”'];

/// A line that was meant to begin a section.
struct Heading<'a> {
    line: &'a str,
    at: usize,
    parts: Vec<&'a str>,
    is_list: bool,
}

impl<'a> Heading<'a> {
    fn of(parts: &Parts<'a>) -> Option<Self> {
        let bare = bare(parts);
        let is_bracketed = bare.starts_with(OPEN) || bare.ends_with(CLOSED);
        is_bracketed.then(|| Self::named(parts))?
    }

    fn named(parts: &Parts<'a>) -> Option<Self> {
        let (line, bare) = (parts.said.trim(), bare(parts));
        if bare.contains('=') {
            return None;
        }
        let inner = bare.trim_start_matches(OPEN);
        let index = inner.find('[').filter(|_| bare.starts_with('['));
        let inner = index.map_or(inner, |at| &inner[..at]);
        // Words behind it, or in round brackets, are a remark.
        let behind = bare.rsplit(CLOSED).next().unwrap_or_default().trim();
        let is_remark = bare.starts_with('(') && (inner.contains(' ') || !behind.is_empty());
        let is_list = inner.starts_with(|it: char| it.is_ascii_digit() || "-+".contains(it));
        if inner.contains(OPEN) || is_remark || is_list {
            return None;
        }
        // `axis->x` has an arrow, and no bracket, between its parts.
        let is_arrow = inner.contains("->");
        let name = match is_arrow {
            true => inner.trim_end_matches(CLOSED),
            false => inner.split(CLOSED).next().unwrap_or_default(),
        };
        let is_between = |it: char| BETWEEN.contains(&it) || is_arrow && it == '>';
        let named = name.split(is_between).map(|it| it.trim_matches(QUOTES));
        let named = named.map(|it| {
            if is_arrow {
                it.trim_end_matches('-')
            } else {
                it
            }
        });
        Some(Self {
            line,
            at: parts.said.len() - parts.said.trim_start().len(),
            parts: named.filter(|it| !it.is_empty()).collect(),
            is_list: bare.starts_with("[[") || (!bare.starts_with('[') && bare.ends_with("]]")),
        })
    }

    fn told(&self, name: &str) -> Option<Slip> {
        let meant = match self.is_list {
            true => format!("[[{name}]]"),
            false => format!("[{name}]"),
        };
        let is_name = |it: char| is_of_key(it) || it == '.';
        if name.is_empty() || !name.chars().all(is_name) || !is_toml(&meant) {
            return None;
        }
        let cause = format!("`{}` names no section", shown(self.line));
        let help =
            format!("write `{meant}`: a section's name stands in brackets, its parts with points");
        // Words in other brackets may be a remark: what follows stays where it is.
        let is_remark = self.line.starts_with(['(', '<']) && self.line.contains(' ');
        let meant = Some(meant).filter(|_| !is_remark);
        Some(Slip::new(self.at, cause, help, meant))
    }
}

/// A line without what ends one elsewhere.
fn bare<'a>(parts: &Parts<'a>) -> &'a str {
    let line = parts.said.trim();
    let is_quoted = line.starts_with("\"[") || line.starts_with("'[");
    let line = if is_quoted {
        line.trim_matches(QUOTES)
    } else {
        line
    };
    let line = line.trim_end_matches(['=', ':', ',', ';', '.', ' ', '{']);
    // A word, or a list's mark, before the bracket.
    match line.find('[') {
        Some(at)
            if is_name_at(&line[at..])
                && line.ends_with(']')
                && !line[..at].contains(['=', '.', ':', '"', '\'', '＝']) =>
        {
            &line[at..]
        }
        _ => line,
    }
}

/// Whether a name stands in the brackets, and no list.
fn is_name_at(text: &str) -> bool {
    let inner = text.trim_start_matches('[');
    inner.starts_with(char::is_alphabetic)
}

/// A name of several parts without any brackets, of which the first is known.
fn without_brackets<'a>(parts: &Parts<'a>, schema: &Schema) -> Option<Heading<'a>> {
    let heading = Heading::named(parts)?;
    let first = heading.parts.first()?;
    let is_ended = parts.said.trim().ends_with([':', '{']);
    let is_name =
        (heading.parts.len() > 1 || is_ended) && !bare(parts).contains([' ', ':', ',', ';']);
    let is_known = schema["properties"].get(*first).is_some();
    let has_no_value = parts.value.is_none_or(|it| it.is_empty() || it == "{");
    (is_name && is_known && has_no_value).then_some(heading)
}

pub(super) fn of_line(parts: &Parts<'_>) -> Option<Slip> {
    if parts.value.is_some() {
        return None;
    }
    let heading = Heading::of(parts)?;
    heading.told(&heading.parts.join("."))
}

/// Likewise where the schema tells what sections there are; one that begins like none of them is none.
pub(in crate::config) fn of_schema(line: &str, schema: &Schema) -> Option<Slip> {
    let parts = Parts::of(line);
    if let Some(slip) = with_a_key(line) {
        return Some(slip);
    }
    let heading = Heading::of(&parts).or_else(|| without_brackets(&parts, schema))?;
    if heading.parts.is_empty() && heading.line != "[]" {
        return None;
    }
    let without_first = heading.parts.get(1..).unwrap_or_default();
    let name =
        section_meant(schema, &heading.parts).or_else(|| section_meant(schema, without_first));
    if let Some(name) = name {
        let is_list = is_list(schema, &name);
        return Heading { is_list, ..heading }.told(&name);
    }
    let known = schema["properties"].as_object()?;
    let known = known
        .iter()
        .filter(|(_, own)| type_of(without_null(own)) == "object");
    let known: Vec<_> = known.map(|(name, _)| format!("[{name}]")).collect();
    let cause = format!("`{}` names no section", shown(heading.line));
    let help = match heading.line.starts_with('[') && heading.line.ends_with(']') {
        true => format!("sections are {}, and those in them", known.join(", ")),
        false => "remove it, or begin it with #".to_owned(),
    };
    if heading.line == "[]" {
        // What stands below it goes on with the section above.
        let help = format!("remove it, or write a name in it: {help}");
        return Some(Slip::new(heading.at, cause, help, Some(String::new())));
    }
    let is_lost_heading = heading.line.starts_with('[');
    Some(Slip {
        is_lost_heading,
        ..Slip::new(heading.at, cause, help, None)
    })
}

/// A key on the line of the heading.
fn with_a_key(line: &str) -> Option<Slip> {
    let indent = line.len() - line.trim_start().len();
    let line = line.trim();
    let end = line.find(']')? + 1;
    let end = end + line[end..].len() - line[end..].trim_start_matches(']').len();
    let (heading, rest) = line.split_at(end);
    let key = rest.split_once('=')?.0.trim();
    // `[143]` is the number of a line.
    let is_number = heading.trim_matches(['[', ']']).parse::<usize>().is_ok();
    if !line.starts_with('[') || is_number || !is_toml(heading) || !super::is_key(key) {
        return None;
    }
    let cause = format!(
        "the key `{}` begins on the line of a section's name",
        shown(key)
    );
    let help = format!("begin a new line before `{}`", shown(key));
    Some(Slip {
        key: Some(key.to_owned()),
        ..Slip::new(indent + end, cause, help, Some(heading.to_owned()))
    })
}
