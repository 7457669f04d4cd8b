//! What a line that is no TOML was meant to be, by what its section can hold: what is proposed is a line that the
//! section takes.

use toml::Table;

use super::{Parts, Slip, is_key, is_toml, loosely, nothing_known};
use crate::config::diagnostic::shown;
use crate::config::meant::key_meant;
use crate::config::place::is_of_key;
use crate::config::unit::is_known;
use crate::config::wanted::Wanted;

/// What is wrong with `line`; `at` is where the reader of TOML stopped.
pub(in crate::config) fn of_line(line: &str, at: usize, wanted: &Wanted<'_>) -> Slip {
    let slip = super::of_line(line, at);
    let is_key = slip.meant.as_deref().is_none_or(|it| it.contains('='));
    let is_taken = slip.meant.as_deref().is_some_and(|it| wanted.takes(it));
    if slip.is_comment {
        return no_comment(slip, line, wanted);
    }
    let parts = Parts::of(line);
    if slip.is_ambiguous {
        return of_two(slip, &parts, wanted);
    }
    if let Some(slip) = by_dash(&parts, wanted) {
        return slip;
    }
    if !is_key || is_taken {
        return slip;
    }
    subsection(&parts, wanted)
        .or_else(|| reversed(&parts, wanted))
        .or_else(|| joined_heading(&parts, wanted))
        .or_else(|| by_value(&parts, &slip, wanted))
        .or_else(|| by_letter(line, wanted))
        .or_else(|| by_key(&parts, wanted))
        .or_else(|| by_separator(&parts, wanted))
        .or_else(|| glued(&parts, wanted))
        .unwrap_or_else(|| without_invention(slip, &parts, wanted))
}

/// Of two meanings the one that the key can have; where it can have both, nothing is judged by either.
fn of_two(slip: Slip, parts: &Parts<'_>, wanted: &Wanted<'_>) -> Slip {
    let value = parts.value.unwrap_or_default();
    let ways = [value.replace(',', "."), value.replace(',', "")];
    let takes = ways.each_ref().map(|it| wanted.takes(&parts.with(it)));
    match takes {
        [true, true] => Slip {
            meant: None,
            ..slip
        },
        [false, true] => by_value(parts, &slip, wanted).unwrap_or(slip),
        [_, false] => Slip {
            help: format!("write a point before the decimals: {}", ways[0]),
            ..slip
        },
    }
}

/// A line that somebody took out by the sign of another language may be one that is needed.
fn no_comment(mut slip: Slip, line: &str, wanted: &Wanted<'_>) -> Slip {
    let rest = line[slip.at..].trim_start_matches(|it: char| !it.is_alphanumeric());
    let rest = rest.strip_prefix("REM ").unwrap_or(rest).trim();
    let rest = ["*/", "-->"]
        .iter()
        .fold(rest, |rest, end| rest.trim_end_matches(end).trim());
    if wanted.takes(rest) {
        let key = rest.split('=').next().unwrap_or_default().trim();
        slip.help += &format!(", or write `{}` where {key} is to hold", shown(rest));
        slip.meant = None;
        slip.key = Some(key.to_owned());
    }
    slip
}

fn by_value(parts: &Parts<'_>, slip: &Slip, wanted: &Wanted<'_>) -> Option<Slip> {
    let raw = parts.value?;
    let value = loosely::read(raw, parts.key, wanted)?;
    let cause = match slip.meant {
        // That which was found wrong is not what was meant.
        Some(_) => unreadable(raw),
        None => slip.cause.clone(),
    };
    let meant = parts.with(&value);
    let is_word = |it: &str| it.len() > 1 && it.chars().all(char::is_alphabetic) && !is_known(it);
    let has_remark = raw.len() > value.len() + 2 && raw.split_whitespace().skip(1).any(is_word);
    let help = match has_remark {
        true => format!("write {}; a remark begins with #", shown(&value)),
        false => format!("write {}", shown(&value)),
    };
    Some(Slip::new(parts.value_at, cause, help, Some(meant)))
}

/// A section begins where the line should end.
fn joined_heading(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let value = parts.value?;
    let apart = value.find(" [").map(|it| it + 1);
    // `0.2[axis.x.zero]`, but `5.0[mm]` has a unit behind it.
    let close = value.find('[').filter(|at| value[*at..].contains('.'));
    let at = apart
        .or(close)
        .filter(|at| *at > 0 && value.ends_with(']'))?;
    let (before, heading) = value.split_at(at);
    let meant = parts.with(before.trim());
    let name = heading.trim_matches(['[', ']']);
    if is_known(name) || !(wanted.takes(&meant) && is_toml(heading)) {
        return None;
    }
    let cause = format!(
        "the section `{}` begins in the middle of a line",
        shown(heading)
    );
    let help = format!("begin a new line before `{}`", shown(heading));
    Some(Slip {
        is_lost_heading: true,
        ..Slip::new(parts.value_at + at, cause, help, Some(meant))
    })
}

/// `identity:` of a section that has such a section.
fn subsection(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let line = parts.said.trim();
    let name = line.strip_suffix([':', '{'])?.trim();
    let meant = format!("[{}]", wanted.section(name)?);
    let cause = format!("`{}` names no section", shown(line));
    Some(Slip::new(0, cause, format!("write `{meant}`"), Some(meant)))
}

/// The value stands where the key belongs.
fn reversed(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let key = parts.value.filter(|it| wanted.has(it))?;
    let meant = format!("{key} = {}", parts.key);
    if !wanted.takes(&meant) {
        return None;
    }
    let cause = "the value stands before the `=`, and the key behind it".to_owned();
    let help = format!("write `{}`", shown(&meant));
    Some(Slip::new(
        0,
        cause,
        help,
        Some(format!("{meant} {}", parts.comment)),
    ))
}

/// Something else than `=` parts the key and its value.
fn by_separator(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let said = entry(parts.said, wanted)?;
    let cause = "a key and its value are parted by one `=`".to_owned();
    let help = format!("write `{}`", shown(&said));
    let meant = format!("{said} {}", parts.comment);
    Some(Slip::new(0, cause, help, Some(meant)))
}

/// `key - 5.0`: a dash that may stand for the `=`, or be the sign.
fn by_dash(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let (key, value) = parts.said.trim().split_once(" - ")?;
    let (key, value) = (key.trim(), value.trim());
    if parts.value.is_some() || !wanted.has(key) {
        return None;
    }
    let value = loosely::read(value, key, wanted)?;
    let [plain, minus] = ["", "-"].map(|sign| format!("{key} = {sign}{value}"));
    let cause = "there is no `=` between a key and its value".to_owned();
    // A key that takes no value below zero has no sign.
    let is_either = wanted.takes(&minus) && value != "0";
    let help = match is_either {
        true => format!("write `{plain}`, or `{minus}` where the dash is its sign"),
        false => format!("write `{plain}`"),
    };
    let meant = (!is_either).then(|| format!("{plain} {}", parts.comment));
    Some(Slip {
        key: is_either.then(|| key.to_owned()),
        ..Slip::new(0, cause, help, meant)
    })
}

/// `delta1_mv20.0`: nothing stands between a key and its value.
fn glued(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let line = parts.said.trim();
    let keys = wanted.keys().into_iter();
    let key = keys
        .filter(|it| line.starts_with(it))
        .max_by_key(|it| it.len())?;
    let rest = line[key.len()..].trim();
    let is_value = |it: char| it.is_ascii_digit() || "\"'[+".contains(it);
    let value = loosely::read(rest, key, wanted).filter(|_| rest.starts_with(is_value))?;
    let cause = "there is no `=` between a key and its value".to_owned();
    let help = format!("write `{key} = {value}`");
    Some(Slip::new(
        0,
        cause,
        help,
        Some(format!("{key} = {value} {}", parts.comment)),
    ))
}

/// `key = value` of a line that parts them as other languages do: `"key": value,`, `<key>value</key>`.
pub(in crate::config) fn entry(line: &str, wanted: &Wanted<'_>) -> Option<String> {
    let element = element(line);
    let line = element.as_deref().unwrap_or(line).trim();
    let line = line.trim_start_matches(['"', '\'', '“', '{', ' ']);
    let end = line.find(|it| !is_of_key(it))?;
    let (key, rest) = line.split_at(end);
    let quote = rest.trim_start_matches(['"', '\'', '”', ' ']);
    let is_between = |it: char| ":=>~;,|&* \t".contains(it);
    let rest = if quote.starts_with(is_between) {
        quote
    } else {
        rest
    };
    let rest = rest.trim_start_matches(is_between);
    // A dash may part them, or be the sign.
    if rest.starts_with("- ") {
        return None;
    }
    let value = loosely::read(rest, key, wanted)?;
    Some(format!("{key} = {value}"))
}

/// `samples = 10` of `<samples>10</samples>`.
pub(in crate::config) fn element(line: &str) -> Option<String> {
    let (name, rest) = line.trim().strip_prefix('<')?.split_once('>')?;
    let value = rest.strip_suffix(&format!("</{name}>"))?;
    let is_meant = is_key(name) && !value.contains('<');
    is_meant.then(|| format!("{name} = {value}"))
}

/// A value that goes on in the next line, as one line.
pub(in crate::config) fn of_two_lines(line: &str, next: &str, wanted: &Wanted<'_>) -> Option<Slip> {
    let parts = Parts::of(line);
    if line.starts_with('[') && !line.contains(']') {
        return heading_of_two(line.trim(), next.trim());
    }
    let Some(value) = parts.value else {
        return key_of_two(parts.said.trim(), next.trim(), wanted);
    };
    let is_open = value.is_empty() || value.starts_with(['"', '\'']);
    let between = if value.is_empty() { " " } else { "" };
    let whole = format!("{}{between}{}", parts.said.trim_end(), next.trim_start());
    let is_own = is_toml(next) && !next.trim_start().starts_with('[');
    if !is_open || is_own || !wanted.takes(&whole) {
        return None;
    }
    let said = Parts::of(&whole).said.trim().to_owned();
    let cause = "the line ends within a value".to_owned();
    let help = format!("write it in one line: `{}`", shown(&said));
    Some(Slip::new(parts.value_at, cause, help, Some(whole)))
}

fn heading_of_two(line: &str, next: &str) -> Option<Slip> {
    let whole = format!("{line}{next}");
    let is_whole = next.ends_with(']') && !next.starts_with('[') && is_toml(&whole);
    is_whole.then(|| {
        let cause = "the line ends within the name of a section".to_owned();
        Slip::new(
            0,
            cause,
            format!("write it in one line: `{}`", shown(&whole)),
            Some(whole),
        )
    })
}

fn key_of_two(word: &str, next: &str, wanted: &Wanted<'_>) -> Option<Slip> {
    let whole = format!("{word}{next}");
    let own = next.split('=').next().unwrap_or_default().trim();
    let is_cut = is_key(word) && !wanted.has(own) && wanted.takes(&whole);
    is_cut.then(|| {
        let cause = "the line ends within a key".to_owned();
        let said = Parts::of(&whole).said.trim().to_owned();
        let help = format!("write it in one line: `{}`", shown(&said));
        Slip::new(0, cause, help, Some(whole))
    })
}

fn unreadable(raw: &str) -> String {
    format!("`{}` cannot be read as it is written here", shown(raw))
}

const TRIED_MAX: usize = 200;

/// One character is too many, and only one can be that.
fn by_letter(line: &str, wanted: &Wanted<'_>) -> Option<Slip> {
    // Each character is tried: of a long list that would take minutes.
    if line.len() > TRIED_MAX {
        return None;
    }
    let mut found: Option<(usize, char, String, Table)> = None;
    let parts = Parts::of(line);
    let is_number = |it: char| it.is_ascii_digit() || "+-.$#".contains(it);
    // Of a number that is one digit short nobody knows which was meant; a point that stands there twice is one.
    let of_number = parts
        .value
        .filter(|it| it.starts_with(is_number) || it.contains('/'));
    // `B12` is a cell of a table.
    let is_cell = |it: &str| {
        let digits = it.trim_start_matches(|it: char| it.is_ascii_uppercase());
        digits.len() < it.len()
            && !digits.is_empty()
            && digits.chars().all(|it| it.is_ascii_digit())
    };
    let of_number = of_number.or_else(|| parts.value.filter(|it| is_cell(it)));
    let value_at = of_number.map_or(line.len(), |_| parts.value_at);
    for (at, it) in line.char_indices().filter(|(_, it)| !it.is_whitespace()) {
        let behind = &line[at + it.len_utf8()..];
        if at >= value_at && !(it == '.' && behind.starts_with('.')) {
            continue;
        }
        let rest = format!("{}{behind}", &line[..at]);
        if !wanted.takes(&rest) {
            continue;
        }
        let table: Table = rest.parse().ok()?;
        match &found {
            Some((.., before)) if *before != table => return None,
            Some(_) => {}
            None => found = Some((at, it, rest, table)),
        }
    }
    let (at, it, meant, _) = found?;
    let said = Parts::of(&meant).said.trim().to_owned();
    let cause = format!("the `{}` does not belong here", shown(&it.to_string()));
    let help = format!("write `{}`", shown(&said));
    Some(Slip::new(at, cause, help, Some(meant)))
}

/// Something stands before the key, or in it.
fn by_key(parts: &Parts<'_>, wanted: &Wanted<'_>) -> Option<Slip> {
    let raw = parts.value?;
    let letters: String = parts.key.chars().filter(|it| is_of_key(*it)).collect();
    let last = parts.key.rsplit(|it| !is_of_key(it)).next();
    let known = last.filter(|it| wanted.has(it)).map(str::to_owned);
    let joined = Some(&letters).filter(|it| wanted.has(it)).cloned();
    let alike = key_meant(&letters, &wanted.keys()).map(str::to_owned);
    let key = known.or(joined).or(alike)?;
    let as_is = format!("{key} = {raw}");
    let value = match wanted.takes(&as_is) {
        true => raw.to_owned(),
        false => loosely::read(raw, &key, wanted)?,
    };
    let cause = format!("`{}` is no key", shown(parts.key));
    let help = format!("write `{key} = {}`", shown(&value));
    let meant = format!("{key} = {value} {}", parts.comment);
    Some(Slip::new(0, cause, help, Some(meant)))
}

/// A word that is no key of the section is none that wants a value; one that is cut short may be a longer one.
fn without_invention(slip: Slip, parts: &Parts<'_>, wanted: &Wanted<'_>) -> Slip {
    if parts.value.is_some() {
        return without_wrong_value(slip, parts, wanted);
    }
    let word = parts.said.trim();
    let is_alone = is_key(word);
    let word = word.split([':', ' ', '\t']).next().unwrap_or_default();
    if wanted.keys().is_empty() || !is_key(word) || wanted.has(word) {
        return slip;
    }
    let keys = wanted.keys();
    let longer = keys.iter().filter(|it| it.starts_with(word)).count();
    // Words of a sentence are no value.
    let is_prose = parts.said.split_whitespace().count() > 4;
    match key_meant(word, &keys).filter(|_| longer < 2 && !is_prose) {
        Some(key) if is_alone => Slip {
            help: format!("write `{key} = value`, or remove it"),
            ..slip
        },
        Some(_) => slip,
        None if longer > 1 => Slip {
            help: "write the key to its end, and a value, or remove it".into(),
            ..slip
        },
        None => nothing_known(parts),
    }
}

/// A proposal that the key cannot have is none, and neither is a key that nobody knows.
fn without_wrong_value(slip: Slip, parts: &Parts<'_>, wanted: &Wanted<'_>) -> Slip {
    let Some(meant) = slip.meant.as_deref() else {
        return of_kind(slip, parts, wanted);
    };
    let key = meant.split('=').next().unwrap_or_default().trim();
    let is_like = wanted.has(key) || key_meant(key, &wanted.keys()).is_some();
    if !wanted.keys().is_empty() && !is_like && !is_key(parts.key) {
        return nothing_known(parts);
    }
    // Two numbers that together are none that the key can have are two.
    let is_two = parts.value.is_some_and(|it| it.contains(' ')) && !wanted.takes(meant);
    let is_other = is_two || !wanted.fits_kind(meant);
    match wanted.can_be(key).filter(|_| is_other) {
        Some(kind) => Slip {
            help: format!("give {kind}"),
            meant: None,
            ..slip
        },
        None => slip,
    }
}

/// Where nothing can be told of a value, what the key can have.
fn of_kind(slip: Slip, parts: &Parts<'_>, wanted: &Wanted<'_>) -> Slip {
    match wanted.can_be(parts.key).filter(|_| slip.is_unknown) {
        Some(kind) => Slip {
            at: parts.value_at,
            cause: unreadable(parts.value.unwrap_or_default()),
            help: format!("give {kind}"),
            ..slip
        },
        None => slip,
    }
}
