//! Values as people write them and a file does not take them.

use super::{Parts, Slip};
use crate::config::diagnostic::shown;
use crate::config::unit::{converted, is_another, is_unit, magnified, split_unit};

pub(super) fn of(parts: &Parts<'_>) -> Option<Slip> {
    let value = parts.value?;
    template(parts, value)
        .or_else(|| ended(parts, value))
        .or_else(|| decimal_comma(parts, value))
        .or_else(|| hexadecimal(parts, value))
        .or_else(|| with_a_unit(parts, value))
        .or_else(|| too_large(parts, value))
        .or_else(|| number(parts, value))
        .or_else(|| list(parts, value))
        .or_else(|| backslash(parts, value))
        .or_else(|| quotes(parts, value))
        .or_else(|| word(parts, value))
}

/// What a program was to put a value in the place of.
fn template(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let marks = [("{{", "}}"), ("${", "}"), ("<%", "%>"), ("%(", ")")];
    let is_place = |it: &(&str, &str)| value.starts_with(it.0) && value.contains(it.1);
    if value.starts_with('=') {
        let cause = format!(
            "`{}` is a formula of a table, and not its value",
            shown(value)
        );
        let help = "give the value that the table shows there";
        return Some(Slip::new(parts.value_at, cause, help.into(), None));
    }
    marks.iter().find(|it| is_place(it))?;
    let cause = format!(
        "`{}` is a place in a template, and nothing filled it in",
        shown(value)
    );
    let help = "give the value that belongs there; texts in quotes, numbers as they are";
    Some(Slip::new(parts.value_at, cause, help.into(), None))
}

/// A line that ends as those of other languages do.
fn ended(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let sign = value.chars().last().filter(|it| ",;".contains(*it))?;
    let meant = value.trim_end_matches([',', ';', ' ']);
    let help = format!("write {}", shown(meant));
    let mut slip = parts.value_meant(meant, format!("no line ends with `{sign}`"), help)?;
    slip.at += meant.len();
    Some(slip)
}

fn decimal_comma(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let (whole, part) = value.split_once(',')?;
    let is_digits = |it: &str| !it.is_empty() && it.chars().all(|it| it.is_ascii_digit());
    let digits = whole.trim_start_matches(['-', '+']);
    if !(is_digits(digits) && is_digits(part)) {
        return None;
    }
    let meant = format!("{whole}.{part}");
    let cause = format!("`{}` has a comma", shown(value));
    // `5,000` may be five thousand.
    let thousands = (1..=3).contains(&digits.len()) && !digits.starts_with('0') && part.len() == 3;
    let help = match thousands {
        false => format!("write a point before the decimals: {meant}"),
        true => format!(
            "write a point before the decimals: {meant}; where the comma parts thousands: {whole}{part}"
        ),
    };
    let slip = parts.value_meant(&meant, cause, help)?;
    Some(Slip {
        is_ambiguous: thousands,
        ..slip
    })
}

/// `12.5 mm` in place of a number.
fn with_a_unit(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let (number, unit) = split_unit(value)?;
    let unit = unit.filter(|it| is_unit(it))?;
    let cause = format!(
        "`{}` is no number: the unit is in the key's name",
        shown(value)
    );
    if let Some(other) = magnified(value, parts.key) {
        let help = format!("write {other}");
        return parts.value_meant(&other, cause, help);
    }
    match converted(number, unit, parts.key) {
        Some(other) if other.parse() != number.parse::<f64>() => {
            let help = format!("write {other}, which is {number} {unit} in the key's unit");
            parts.value_meant(&other, cause, help)
        }
        None if is_another(unit, parts.key) => {
            let help = "give a number in the unit that the key ends with, and no unit behind it";
            Some(Slip::new(parts.value_at, cause, help.into(), None))
        }
        _ => {
            let help =
                format!("write {number} without `{unit}`, in the unit that the key ends with");
            parts.value_meant(number, cause, help)
        }
    }
}

/// More digits than any number has here.
fn too_large(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let digits = value.trim_start_matches(['-', '+']);
    let is_number = digits.starts_with(|it: char| it.is_ascii_digit())
        && digits
            .chars()
            .all(|it| it.is_ascii_hexdigit() || "_xob".contains(it));
    // Of a number that is written rightly nothing else can be wrong.
    let is_written = is_number && toml::de::DeTable::parse(&parts.with(value)).is_ok();
    is_written.then(|| {
        let cause = format!("`{}` is larger than any whole number here", shown(value));
        Slip::new(parts.value_at, cause, "give a smaller one".into(), None)
    })
}

/// A number with something too many, or too few.
fn number(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let cause = format!("`{}` is no number as it is written here", shown(value));
    let (sign, rest) = match value.strip_prefix('-') {
        Some(rest) => ("-", rest),
        None => ("", value.trim_start_matches('+')),
    };
    let is_of_number = |it: char| it.is_ascii_digit() || ".'_ ".contains(it);
    // `...` is a place that somebody left open.
    let has_digits = rest.contains(|it: char| it.is_ascii_digit());
    let begins = rest.starts_with(|it: char| it.is_ascii_digit() || it == '.');
    if !(begins && has_digits && rest.chars().all(is_of_number)) {
        return None;
    }
    // Spaces part thousands; the same number twice was pasted twice.
    let mut groups = rest.split(' ');
    let first = groups.next().unwrap_or_default();
    let is_grouped = !first.contains('.') && groups.all(|it| it.len() >= 3 && it != first);
    // `5'` are minutes of arc.
    if rest.contains(' ') && !is_grouped || rest.ends_with('\'') {
        return None;
    }
    let digits: String = rest.chars().filter(|it| !"'_ ".contains(*it)).collect();
    if digits.matches('.').count() > 1 {
        let help = "give one number, with one point before its decimals";
        return Some(Slip::new(parts.value_at, cause, help.into(), None));
    }
    let (whole, part) = match digits.split_once('.') {
        Some((whole, part)) => (whole, Some(part)),
        None => (digits.as_str(), None),
    };
    let or_zero = |it: &str| {
        if it.is_empty() {
            "0".to_owned()
        } else {
            it.to_owned()
        }
    };
    let whole = or_zero(whole.trim_start_matches('0'));
    let part = part.map_or_else(String::new, |it| format!(".{}", or_zero(it)));
    let meant = format!("{sign}{whole}{part}");
    let help = format!("write {meant}");
    parts.value_meant(&meant, cause, help)
}

/// Keys whose numbers are written with eight hexadecimal digits (CiA 301, 0x1000 and 0x1018).
const HEXADECIMAL: [&str; 4] = ["vendor_id", "product_code", "revision", "device_type"];

/// `0X1F`, `1Fh`, `$1F` and the like.
fn hexadecimal(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let marked = value.strip_prefix("0X").or_else(|| value.strip_prefix('$'));
    let digits = marked
        .or_else(|| value.strip_suffix(['h', 'H']))
        .unwrap_or(value);
    let digits = digits.replace('_', "");
    let letters = digits.matches(|it: char| it.is_ascii_alphabetic()).count();
    // `10h` are hours and `20c` degrees.
    let is_identity = HEXADECIMAL.contains(&parts.key);
    // `20ed` was a slip of the hand, but in an identity; `7FF` is how such numbers are written.
    let is_capital = !digits.contains(|it: char| it.is_ascii_lowercase());
    let is_number = marked.is_some()
        || digits.starts_with('0')
        || letters > 1 && (is_identity || is_capital)
        || digits.len() < value.len();
    let is_unit = marked.is_none() && letters == 0 && !digits.starts_with('0') && !is_identity;
    let is_digits = digits.starts_with(|it: char| marked.is_some() || it.is_ascii_digit())
        && digits.chars().all(|it| it.is_ascii_hexdigit());
    // `010` is ten with a zero before it, but in an identity.
    let is_decimal = digits.len() == value.len() && letters == 0 && !is_identity;
    if !is_digits || !is_number || is_unit || is_decimal {
        return None;
    }
    let meant = format!("0x{digits}");
    let cause = format!("`{}` is no number as it is written here", shown(value));
    let help = format!("write {meant}: hexadecimal numbers begin with 0x");
    parts.value_meant(&meant, cause, help)
}

fn list(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let begins = value.starts_with(['[', '(', '{']);
    let ends = value.ends_with([']', ')', '}']);
    let inner = value.trim_matches(['[', ']', '(', ')', '{', '}', ' ']);
    // A remark in brackets behind a value is none.
    let is_remark = !begins && value.contains(['(', '[', '{']);
    if !(begins || ends) || is_remark || inner.contains('=') {
        return None;
    }
    let meant = format!("[{inner}]");
    let help = format!("write {}", shown(&meant));
    let cause = format!("`{}`: a list begins with [ and ends with ]", shown(value));
    if let Some(slip) = parts.value_meant(&meant, cause, help) {
        return Some(slip);
    }
    let meant = match inner.contains(';') && inner.contains(',') {
        // Where semicolons part them commas are decimal ones.
        true => format!("[{}]", inner.replace(',', ".").replace(';', ",")),
        false => {
            let entries = inner.split([',', ';', ' ']).filter(|it| !it.is_empty());
            format!("[{}]", entries.collect::<Vec<_>>().join(", "))
        }
    };
    let help = format!("write {}", shown(&meant));
    let cause = format!(
        "`{}`: the entries of a list are parted by one comma",
        shown(value)
    );
    parts.value_meant(&meant, cause, help).or_else(|| {
        let cause = format!("the list `{}` cannot be read", shown(value));
        let help = "write its entries as [1.0, 2.0]; texts in quotes, numbers without a unit";
        Some(Slip::new(parts.value_at, cause, help.into(), None))
    })
}

/// A path of Windows.
fn backslash(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let inner = value.strip_prefix('"')?.strip_suffix('"')?;
    if !inner.contains('\\') || inner.contains(['\'', '"']) {
        return None;
    }
    if inner.starts_with('\\') {
        let meant = format!("\"{}\"", inner.split('\\').collect::<Vec<_>>().join("/"));
        let help = format!("write {}", shown(&meant));
        return parts.value_meant(&meant, "paths have `/` here".into(), help);
    }
    let meant = format!("'{inner}'");
    let cause = "`\\` has a meaning of its own in a text with double quotes";
    let help = format!("write it with single quotes: {}", shown(&meant));
    parts.value_meant(&meant, cause.into(), help)
}

/// A text with a quotation mark too few, or too many.
fn quotes(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let inner = value.trim_matches(['"', '\'']);
    if value.starts_with(['{', '[']) {
        return None;
    }
    if inner == value && !inner.contains(['"', '\'']) {
        return None;
    }
    // Of several texts, or of one with something before it, nobody knows which was meant.
    let count = value.matches('"').count().max(value.matches('\'').count());
    let is_one = value.starts_with(['"', '\'']) || !value.ends_with(['"', '\'']) || count < 2;
    let is_several = count > 2 && !(value.starts_with("\"\"") || value.starts_with("''"));
    if value.contains(['+', '&', '<']) || !is_one || is_several {
        return None;
    }
    if let Some(slip) = behind_a_text(parts, value) {
        return Some(slip);
    }
    if value.ends_with(']') && value.contains(" [") {
        return None;
    }
    if let Some(inches) = inches(parts, value) {
        return Some(inches);
    }
    let inner: String = inner.chars().filter(|it| !"\"'".contains(*it)).collect();
    let meant = format!("\"{inner}\"");
    let cause = format!("the quotation marks of `{}` do not match", shown(value));
    let help = format!("write {}", shown(&meant));
    parts.value_meant(&meant, cause, help)
}

/// `2.36"` of a length: inches, or a mark too many.
fn inches(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let number = value.strip_suffix('"').filter(|it| !it.contains('"'))?;
    let millimetres = converted(number, "in", parts.key)?;
    let cause = format!("`{}` is no number as it is written here", shown(value));
    let help =
        format!("write {millimetres} where `\"` means inches, or {number} where it is a slip");
    parts.value_meant(number, cause, help)
}

/// What stands behind the second mark is no part of the text: a remark, or a letter too many.
fn behind_a_text(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let quote = value.chars().next().filter(|it| "\"'".contains(*it))?;
    let end = value[1..].find(quote)? + 2;
    let (text, rest) = value.split_at(end);
    // A section that begins there is another slip.
    if rest.trim_start().starts_with('[')
        || rest.is_empty()
        || rest.contains(quote)
        || text.len() == 2
    {
        return None;
    }
    let cause = format!("`{}` stands behind the text's end", shown(rest.trim()));
    let help = format!("write {}; a remark begins with #", shown(text));
    let mut slip = parts.value_meant(text, cause, help)?;
    slip.at += end;
    Some(slip)
}

/// A word that is no number and no `true` or `false`.
fn word(parts: &Parts<'_>, value: &str) -> Option<Slip> {
    let (meant, is_text) = match value.to_lowercase().as_str() {
        "true" | "yes" | "on" => ("true".to_owned(), false),
        "false" | "no" | "off" => ("false".to_owned(), false),
        "null" | "nil" | "none" | "undefined" | "n/a" | "nan" | "inf" | "infinity" | "?"
        | "todo" | "tbd" | "..." | "…" | "-" | "--" | "xxx" => {
            let cause = format!("`{value}` is no value here");
            let help = "give a value; a key that may be left out is left out with its name";
            return Some(Slip::new(parts.value_at, cause, help.into(), None));
        }
        _ => (format!("\"{value}\""), true),
    };
    if !is_text {
        let cause = format!("`{value}` is not known here");
        let help = format!("write {meant}, in small letters");
        return parts.value_meant(&meant, cause, help);
    }
    if !value.starts_with(|it: char| it.is_alphabetic() || "/.~".contains(it)) {
        return None;
    }
    let cause = format!("`{}` is text without quotes", shown(value));
    let help = format!("write it in quotes: {}", shown(&meant));
    let slip = parts.value_meant(&meant, cause, help)?;
    Some(Slip { is_text, ..slip })
}
