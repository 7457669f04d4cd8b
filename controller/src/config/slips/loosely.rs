//! Values read as loosely as people write them, by what the key can have: digits from text, texts from what looks like
//! quotes, lists without brackets.

use serde_json::Value as Schema;

use crate::config::schema::type_of;
use crate::config::unit::{converted, is_known, magnified, split_unit};
use crate::config::wanted::Wanted;

/// What `raw` was meant to be, as a value of `key`; `None` where that cannot be told.
pub(super) fn read(raw: &str, key: &str, wanted: &Wanted<'_>) -> Option<String> {
    // The end of a line of Windows, as some programs show it.
    let raw = raw.trim_end_matches("^M").trim();
    let mut tokens = raw.split_whitespace();
    let first = tokens.next()?;
    let raw = match raw.len() > first.len() && tokens.all(|it| it == first) {
        true => first,
        false => raw,
    };
    let ways = wanted.ways(key).into_iter();
    let mut candidates = ways.flat_map(|it| candidates(raw, key, it));
    candidates.find(|it| wanted.takes(&format!("{key} = {it}")))
}

fn candidates(raw: &str, key: &str, schema: &Schema) -> Vec<String> {
    match type_of(schema) {
        "number" | "integer" => numbers(raw, key),
        "boolean" => truth(raw).into_iter().collect(),
        "string" => text(raw).into_iter().collect(),
        "array" => list(raw, key, &schema["items"]).into_iter().collect(),
        "object" => section(raw, schema).into_iter().collect(),
        _ => Vec::new(),
    }
}

/// `True` and `FALSE`, as other languages write them.
fn truth(raw: &str) -> Option<String> {
    let word = raw.trim_end_matches([',', ';', ' ']).to_lowercase();
    ["true", "false"].contains(&word.as_str()).then_some(word)
}

/// What stands around a number and is no part of it.
fn is_around(it: char) -> bool {
    !it.is_alphanumeric() && !"+-.".contains(it)
}

fn numbers(raw: &str, key: &str) -> Vec<String> {
    // Which of two signs was meant nobody knows, nor whether one behind the number, or brackets, are one.
    let is_unsure = raw.starts_with(['±', '(']) || raw.starts_with("+/-") || raw.ends_with('-');
    if is_unsure {
        return Vec::new();
    }
    // A dash is a minus: without it the number would go the other way.
    let raw = raw.replace(['−', '–', '—', '‐', '‑', '‒', '⁻', '﹣', '﹘', '－'], "-");
    let core = raw.trim_matches(is_around);
    let rest = core.trim_start_matches(['-', '+', ' ']);
    let before = &core[..core.len() - rest.len()];
    // A sentence's end.
    let rest = rest.strip_suffix('.').unwrap_or(rest);
    let sign = match before.contains('-') {
        true => "-",
        false => "",
    };
    let first = rest.split([' ', '(', '\t']).next().unwrap_or_default();
    let bare = rest.replace(['[', ']', '(', ')'], "").replace(',', ".");
    // `1,000 mm` may be a metre, or a millimetre to its third decimal.
    if rest != first && is_either(first) {
        return Vec::new();
    }
    let by_unit = split_unit(&bare).and_then(|(number, unit)| {
        let unit = unit?;
        magnified(&bare, key).or_else(|| converted(number, unit, key))
    });
    // What follows a number may be a remark, or how sure it is; what looks like another number is part of it.
    let behind = rest[first.len()..].trim_start();
    let is_word = behind.chars().take(2).all(char::is_alphabetic) && behind.len() > 1;
    let is_sum = behind.contains(['=', '^', '*']);
    // A unit is no remark: what it is converted to is told, or nothing.
    let word = behind.split(' ').next().unwrap_or_default();
    let is_known_unit = is_known(word.trim_matches(['(', ')', '[', ']']));
    if is_known_unit && by_unit.is_none() {
        return Vec::new();
    }
    let is_remark =
        (is_word || behind.starts_with(['(', '±', '[']) || behind.starts_with("+/-")) && !is_sum;
    let mut found = Vec::new();
    let whole = by_unit.as_deref().and_then(|it| it.strip_suffix(".0"));
    found.extend(whole.map(str::to_owned));
    found.extend(by_unit);
    let joined = rest.replace(" e", "e").replace(" E", "e");
    for text in [Some(joined.as_str()), Some(first).filter(|_| is_remark)] {
        let text: Option<String> = text.map(|it| it.chars().map(digit_meant).collect());
        found.extend(text.iter().flat_map(|it| plain(it)));
    }
    found.iter().map(|it| format!("{sign}{it}")).collect()
}

/// Letters that look like digits.
fn digit_meant(it: char) -> char {
    match it {
        'O' | 'o' => '0',
        'l' | 'I' => '1',
        _ => it,
    }
}

/// The ways to read digits that are parted by points, commas, spaces and the like.
fn plain(text: &str) -> Vec<String> {
    if text.starts_with("0x") {
        return vec![text.to_owned()];
    }
    let is_part = |it: char| it.is_ascii_digit() || ".,'_ ".contains(it);
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, format!("e{exponent}")),
        None => (text, String::new()),
    };
    if !mantissa.chars().all(is_part) || !mantissa.contains(|it: char| it.is_ascii_digit()) {
        return Vec::new();
    }
    let decimal = mantissa.rfind(['.', ',']);
    let whole = decimal.map_or(mantissa, |at| &mantissa[..at]);
    let part = decimal.map(|at| &mantissa[at + 1..]);
    let mut found = Vec::new();
    // What stands there twice parts thousands.
    let twice = |mark: char| mantissa.matches(mark).count() > 1;
    let is_decimal = decimal.is_some_and(|at| !mantissa[at..].starts_with(twice));
    if let Some(part) = part.filter(|it| is_decimal && is_digits(it))
        && let Some(whole) = ungrouped(whole)
    {
        found.push(format!("{whole}.{part}{exponent}"));
        let is_whole = part.chars().all(|it| it == '0');
        found.extend(is_whole.then_some(whole));
    }
    // The last one parts thousands, too.
    found.extend(ungrouped(mantissa).map(|it| format!("{it}{exponent}")));
    found
}

/// Whether its comma may part thousands, or decimals.
fn is_either(text: &str) -> bool {
    let parts = text.split_once(',');
    parts.is_some_and(|(whole, part)| {
        is_digits(whole)
            && whole.len() <= 3
            && !whole.starts_with('0')
            && is_digits(part)
            && part.len() == 3
    })
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|it| it.is_ascii_digit())
}

/// Digits in groups of three, without what parts them.
fn ungrouped(text: &str) -> Option<String> {
    let groups: Vec<&str> = text.split(['.', ',', '\'', '_', ' ']).collect();
    let (first, rest) = groups.split_first()?;
    let is_grouped = is_digits(first)
        && (rest.is_empty() || first.len() <= 3)
        && rest.iter().all(|it| it.len() == 3 && is_digits(it));
    let digits = groups.concat();
    let digits = match digits.trim_start_matches('0') {
        "" => "0",
        rest => rest,
    };
    is_grouped.then(|| digits.to_owned())
}

const MARKS: [char; 16] = [
    '"', '\'', '“', '”', '„', '«', '»', '‘', '’', '‚', '‹', '›', '´', '`', '″', '′',
];

/// What is quoted, by whatever marks; of several texts nobody knows which was meant.
fn text(raw: &str) -> Option<String> {
    let raw = raw.replace("&quot;", "\"");
    let inner = match raw.matches(MARKS).count() {
        0 => raw.trim_matches(['(', ')', '[', ']', '<', '>', ' ']),
        1 => raw.trim_matches(|it| MARKS.contains(&it) || it == ' '),
        2 => raw.split(MARKS).nth(1)?.trim(),
        _ => return None,
    };
    // `[can.can0]` is how the section is called.
    let inner = match raw.starts_with('[') {
        true => inner.rsplit('.').next().unwrap_or(inner),
        false => inner,
    };
    let is_none = [
        "none",
        "null",
        "nil",
        "nan",
        "inf",
        "undefined",
        "todo",
        "tbd",
        "fixme",
        "xxx",
        "n/a",
    ];
    let is_plain = inner.starts_with(|it: char| it.is_alphanumeric() || "/.~_-".contains(it))
        && !inner.contains(['\\', '#', '=', '&']);
    let is_said = !is_none.contains(&inner.to_lowercase().as_str());
    (is_plain && is_said).then(|| format!("\"{inner}\""))
}

fn list(raw: &str, key: &str, items: &Schema) -> Option<String> {
    let is_bracket = |it: char| "[](){}<>".contains(it);
    // Behind the end there may be a remark.
    let end = raw
        .starts_with(is_bracket)
        .then(|| raw.rfind(']'))
        .flatten();
    let raw = end.map_or(raw, |end| &raw[..end]);
    let inner = raw.trim_matches(|it: char| is_bracket(it) || it.is_whitespace());
    // Where semicolons part them commas are decimal ones.
    let marks: &[char] = match inner.contains(';') {
        true => &[';'],
        false => &[',', '/', '|'],
    };
    let by_mark: Vec<&str> = inner.split(marks).collect();
    let by_space: Vec<&str> = inner.split_whitespace().collect();
    let entries = match by_mark.len() {
        1 => by_space,
        _ => by_mark,
    };
    let entries = entries
        .into_iter()
        .map(str::trim)
        .filter(|it| !it.is_empty());
    let each = entries.map(|it| candidates(it, key, items).into_iter().next());
    let each: Option<Vec<String>> = each.collect();
    each.map(|it| format!("[{}]", it.join(", ")))
}

/// A section within one line, told apart by the names of its keys.
fn section(raw: &str, schema: &Schema) -> Option<String> {
    let own = Wanted::at(schema, "");
    let mut names: Vec<(usize, &str)> = own
        .keys()
        .into_iter()
        .flat_map(|it| places(raw, it))
        .collect();
    names.sort_unstable();
    let ends = names.iter().skip(1).map(|it| it.0).chain([raw.len()]);
    let is_around = |it: char| " \t=:,;{}()[]\"'“”„`′″<>".contains(it);
    let each = names.iter().zip(ends).map(|((at, name), end)| {
        let value = raw[at + name.len()..end].trim_matches(is_around);
        let value = [value.to_owned(), format!("\"{value}\"")]
            .into_iter()
            .find(|it| own.takes(&format!("{name} = {it}")))?;
        Some(format!("{name} = {value}"))
    });
    let each: Option<Vec<String>> = each.collect();
    each.filter(|it| !it.is_empty())
        .map(|it| format!("{{ {} }}", it.join(", ")))
}

/// Where `name` stands as a word by itself, outside a value.
fn places<'a>(raw: &str, name: &'a str) -> Vec<(usize, &'a str)> {
    let is_word = |it: char| it.is_ascii_alphanumeric() || it == '_';
    let found = raw.match_indices(name).filter(|(at, _)| {
        let before = raw[..*at].chars().next_back();
        let after = raw[at + name.len()..]
            .trim_start_matches(['"', '\''])
            .trim_start();
        before.is_none_or(|it| !is_word(it)) && after.starts_with(['=', ':', '"', '“', ' ', '-'])
            || before.is_none_or(|it| !is_word(it)) && raw[at + name.len()..].starts_with(' ')
    });
    found.map(|(at, _)| (at, name)).collect()
}
