//! Files that somebody mistyped: each is refused with its place, its key, the cause and what to write, and what was
//! mistyped is told with what was meant.
//!
//! A file is drawn by a seed: `MUTATIONS=20000 cargo test -p truestage --lib mutated_tests -- --nocapture` tries as many.

use std::collections::BTreeMap;

use crate::chance::Chance;
use crate::config::diagnostic::Diagnostic;
use crate::config::{ConfigError, parse};

const SHIPPED: [&str; 6] = [
    include_str!("../../../configs/machines/gantry.toml"),
    include_str!("../../../configs/machines/linear.toml"),
    include_str!("../../../configs/machines/rotary.toml"),
    include_str!("../../../configs/machines/uvw.toml"),
    include_str!("../../../configs/machines/uvw-copley.toml"),
    include_str!("../../../configs/machines/volumetric.toml"),
];

/// So many in every run.
const USUAL: usize = 1200;
/// Of mistyped keys and sections, so many are told with the one that was meant.
const RIGHT_MIN: f64 = 0.98;

/// What somebody did to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Slip {
    Key,
    Section,
    TextForNumber,
    UnitBehindNumber,
    Twice,
    WordWithoutQuotes,
    NotANumber,
    List,
    Capitals,
    Word,
    Reference,
    DecimalComma,
    PrintedQuotes,
    PrintedMinus,
    Colon,
    CommentSign,
    ListWithoutEnd,
    HeadingWithoutEnd,
}

const SLIPS: [Slip; 18] = [
    Slip::Key,
    Slip::Section,
    Slip::TextForNumber,
    Slip::UnitBehindNumber,
    Slip::Twice,
    Slip::WordWithoutQuotes,
    Slip::NotANumber,
    Slip::List,
    Slip::Capitals,
    Slip::Word,
    Slip::Reference,
    Slip::DecimalComma,
    Slip::PrintedQuotes,
    Slip::PrintedMinus,
    Slip::Colon,
    Slip::CommentSign,
    Slip::ListWithoutEnd,
    Slip::HeadingWithoutEnd,
];

/// Keys whose value is one of the words that are known.
const WORDS: [&str; 9] = [
    "device",
    "transport",
    "interpolation",
    "end_policy",
    "drift",
    "layout",
    "reaction",
    "method",
    "position_range",
];
/// Keys whose value is the name of a section.
const REFERENCES: [&str; 5] = ["bus", "line", "analog", "instrument", "camera"];

/// A file as it was mistyped.
struct Mistyped {
    slip: Slip,
    text: String,
    /// Counted from 1.
    line: usize,
    /// The key, or the part of a section's name, that was meant or that has the wrong value.
    meant: String,
}

/// A letter too few, too many, another one, two exchanged, or a word left out.
fn mistype(word: &str, chance: &mut Chance) -> String {
    let letters: Vec<char> = word.chars().collect();
    let at = chance.below(letters.len());
    let other = chance.of(&['a', 'e', 'n', 's', 't', '_']);
    let mut seen = letters.clone();
    match chance.below(5) {
        0 => drop(seen.remove(at)),
        1 => seen.insert(at, other),
        2 => seen[at] = other,
        3 if at + 1 < seen.len() => seen.swap(at, at + 1),
        _ => {
            let words: Vec<&str> = word.split('_').collect();
            let without = chance.below(words.len());
            let kept = words.iter().enumerate().filter(|(n, _)| *n != without);
            let kept: Vec<&str> = kept.map(|(_, it)| *it).collect();
            seen = kept.join("_").chars().collect();
        }
    }
    seen.into_iter().collect()
}

/// The key and the value of a line.
fn key_and_value(line: &str) -> Option<(&str, &str)> {
    let (key, value) = line.split_once('=')?;
    let is_key = !line.starts_with(['#', '[']);
    is_key.then(|| {
        (
            key.trim(),
            value.split('#').next().unwrap_or_default().trim(),
        )
    })
}

/// `None` where the drawn slip does not fit the drawn line.
fn mistyped(seed: u64) -> Option<Mistyped> {
    let mut chance = Chance(seed);
    let text = chance.of(&SHIPPED);
    in_text(text, &mut chance)
}

fn in_text(text: &str, chance: &mut Chance) -> Option<Mistyped> {
    let slip = chance.of(&SLIPS);
    let lines: Vec<&str> = text.lines().collect();
    let fits = |line: &&str| match slip {
        Slip::Section | Slip::HeadingWithoutEnd => line.starts_with('['),
        Slip::Word => key_and_value(line).is_some_and(|it| WORDS.contains(&it.0)),
        Slip::ListWithoutEnd => key_and_value(line).is_some_and(|it| it.1.ends_with(']')),
        Slip::WordWithoutQuotes | Slip::PrintedQuotes => {
            key_and_value(line).is_some_and(|it| it.1.starts_with('"'))
        }
        Slip::Reference => key_and_value(line).is_some_and(|it| REFERENCES.contains(&it.0)),
        _ => key_and_value(line).is_some(),
    };
    let places: Vec<usize> = (0..lines.len()).filter(|at| fits(&lines[*at])).collect();
    if places.is_empty() {
        return None;
    }
    let at = chance.of(&places);
    let (changed, meant) = changed(lines[at], slip, chance)?;
    let before = lines[..at].iter().copied();
    let after = lines[at + 1..].iter().copied();
    let text: Vec<&str> = before.chain([changed.as_str()]).chain(after).collect();
    let line = at + 1 + usize::from(slip == Slip::Twice);
    Some(Mistyped {
        slip,
        text: text.join("\n"),
        line,
        meant,
    })
}

/// The line with the slip, and what was meant.
fn changed(line: &str, slip: Slip, chance: &mut Chance) -> Option<(String, String)> {
    if slip == Slip::Section {
        let name = line.trim_start_matches('[').split(']').next()?;
        // What users name themselves can be called anything, and a word too many is a section of its own.
        let part = name.split('.').next()?;
        let other = mistype(part, chance);
        let is_other = other != part && !other.is_empty();
        return is_other.then(|| (line.replacen(part, &other, 1), part.to_owned()));
    }
    if slip == Slip::HeadingWithoutEnd {
        let name = line.trim_start_matches('[').split(']').next()?;
        let part = name.split('.').next()?;
        return Some((line.replacen(']', "", 1), part.to_owned()));
    }
    let (key, value) = key_and_value(line)?;
    let is_number = value.parse::<f64>().is_ok();
    let is_text = value.starts_with('"') && value.len() > 2;
    let told = |text: String| Some((text, key.to_owned()));
    match slip {
        Slip::Key => {
            let other = mistype(key, chance);
            (other != key && !other.is_empty())
                .then(|| (format!("{other} = {value}"), key.to_owned()))
        }
        Slip::TextForNumber if is_number => told(format!("{key} = \"{value} mm\"")),
        Slip::UnitBehindNumber if is_number => {
            let unit = chance.of(&[" mm", "um", " mm/s", " V", "°"]);
            told(format!("{key} = {value}{unit}"))
        }
        Slip::Twice => told(format!("{line}\n{line}")),
        Slip::WordWithoutQuotes if is_text => told(format!("{key} = {}", value.trim_matches('"'))),
        Slip::NotANumber if is_number => told(format!("{key} = nan")),
        Slip::Capitals => {
            let other = match chance.below(3) {
                0 => key.to_uppercase(),
                1 => key.replace('_', "-"),
                _ => key.split('_').map(capital).collect(),
            };
            (other != key).then(|| (format!("{other} = {value}"), key.to_owned()))
        }
        Slip::Word | Slip::Reference if is_text => {
            let word = value.trim_matches('"');
            let other = mistype(word, chance);
            let is_other = other != word && !text_has(&other);
            let meant = if slip == Slip::Word { word } else { key };
            is_other.then(|| (format!("{key} = \"{other}\""), meant.to_owned()))
        }
        Slip::DecimalComma if is_number && value.contains('.') && !value.contains('e') => {
            told(format!("{key} = {}", value.replace('.', ",")))
        }
        Slip::PrintedQuotes if is_text => {
            let [open, close] = chance.of(&[['“', '”'], ['„', '“'], ['‘', '’'], ['«', '»']]);
            told(format!("{key} = {open}{}{close}", value.trim_matches('"')))
        }
        Slip::PrintedMinus if is_number => {
            let minus = chance.of(&['−', '–', '—']);
            told(format!("{key} = {minus}{}", value.trim_start_matches('-')))
        }
        Slip::Colon => told(format!("{key}: {value}")),
        Slip::CommentSign => {
            let sign = chance.of(&["//", ";", "--", "%"]);
            told(format!("{key} = {value} {sign} as ordered"))
        }
        Slip::ListWithoutEnd if value.ends_with(']') => {
            told(format!("{key} = {}", value.trim_end_matches(']')))
        }
        Slip::List if !value.starts_with('[') => told(format!("{key} = [{value}]")),
        _ => None,
    }
}

/// As names are written elsewhere.
fn capital(word: &str) -> String {
    let (first, rest) = word.split_at(word.len().min(1));
    first.to_uppercase() + rest
}

/// Whether a word is a name, or a word that is known, of a machine that ships.
fn text_has(word: &str) -> bool {
    let quoted = format!("\"{word}\"");
    let named = format!(".{word}]");
    word.is_empty()
        || SHIPPED
            .iter()
            .any(|it| it.contains(&quoted) || it.contains(&named))
}

/// What is told of a file; or why nothing is.
fn refused(it: &Mistyped) -> Result<Vec<Diagnostic>, String> {
    match parse(&it.text, "m.toml") {
        Err(ConfigError::Invalid { findings }) => Ok(findings),
        Err(other) => Err(format!("{other}")),
        Ok(_) => Err("it is sound".into()),
    }
}

/// What is wrong with how a file was refused.
fn complaint(it: &Mistyped, found: &[Diagnostic]) -> Option<String> {
    let is_whole =
        |one: &Diagnostic| !(one.key.is_empty() || one.cause.is_empty() || one.help.is_empty());
    // A key that is mistyped as the name of a section is told where that begins, with the line of both.
    let tells_line = |one: &Diagnostic| one.cause.ends_with(&format!(" on line {}", it.line));
    let told = |one: &Diagnostic| (one.line == it.line || tells_line(one)) && is_whole(one);
    let text = format!("{found:?}");
    if let Some(word) = FOREIGN.iter().find(|it| text.contains(**it)) {
        return Some(format!("it says `{word}`: {found:#?}"));
    }
    if !found.iter().any(told) {
        return Some(format!(
            "nothing whole is told of line {}: {found:#?}",
            it.line
        ));
    }
    let names = |one: &Diagnostic| one.key.split('.').any(|part| part == it.meant);
    (!is_word(it.slip) && !found.iter().any(names))
        .then(|| format!("no `{}` in {found:#?}", it.meant))
}

/// Whether what was mistyped is one of the words that are known.
const fn is_word(slip: Slip) -> bool {
    matches!(
        slip,
        Slip::Key | Slip::Section | Slip::Capitals | Slip::Word
    )
}

/// Whether a mistyped word is told with the one that was meant.
fn is_meant(it: &Mistyped, found: &[Diagnostic]) -> bool {
    let quote = if it.slip == Slip::Word { '"' } else { '`' };
    let wanted = format!("did you mean {quote}{}{quote}?", it.meant);
    found.iter().any(|one| one.help.starts_with(&wanted))
}

/// Words of the libraries that read a file, which nobody who writes one knows.
const FOREIGN: [&str; 8] = [
    "invalid type",
    "unknown field",
    "duplicate key",
    "expected f64",
    "basic string",
    "unexpected key or value",
    "expected `=`",
    "recursion",
];

#[test]
fn what_somebody_mistyped_is_refused_with_its_place_and_what_was_meant() {
    let given = std::env::var("MUTATIONS").ok();
    let count = given.and_then(|it| it.parse().ok()).unwrap_or(USUAL);
    let drawn = (0..).filter_map(mistyped).take(count);
    let mut tally: BTreeMap<Slip, usize> = BTreeMap::new();
    let (mut words, mut right) = (0, 0);
    let mut wrong = Vec::new();
    for it in drawn {
        *tally.entry(it.slip).or_default() += 1;
        let shown = it.text.lines().nth(it.line - 1).unwrap_or_default();
        let refused = refused(&it);
        let found = refused.as_deref().unwrap_or_default();
        let told = match &refused {
            Ok(found) => complaint(&it, found),
            Err(told) => Some(told.clone()),
        };
        wrong.extend(told.map(|told| format!("{:?}, `{shown}`: {told}", it.slip)));
        if is_word(it.slip) {
            words += 1;
            let is_right = is_meant(&it, found);
            right += usize::from(is_right);
            if !is_right {
                println!("not told what was meant: `{shown}` for `{}`", it.meant);
            }
        }
    }
    println!("{tally:?}: {right} of {words} words told");
    assert!(
        wrong.is_empty(),
        "{} of {count}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(tally.values().all(|it| *it >= count / 100), "{tally:?}");
    assert!(
        f64::from(right as u32) >= RIGHT_MIN * f64::from(words),
        "{right} of {words}"
    );
}

/// A file in which two lines were mistyped, and where.
fn mistyped_twice(seed: u64) -> Option<(Mistyped, Mistyped)> {
    let first = mistyped(seed)?;
    let second = in_text(&first.text, &mut Chance(!seed))?;
    // A line more above it moves the first one.
    let moved = usize::from(second.slip == Slip::Twice && second.line < first.line);
    let first = Mistyped {
        line: first.line + moved,
        text: second.text.clone(),
        ..first
    };
    (first.line.abs_diff(second.line) > 2).then_some((first, second))
}

#[test]
fn of_two_lines_that_somebody_mistyped_both_are_told_at_once() {
    const PAIRS: usize = 400;
    let pairs = (0..).filter_map(mistyped_twice).take(PAIRS);
    let mut missed = Vec::new();
    for (first, second) in pairs {
        let found = refused(&second).unwrap_or_default();
        let is_told = |it: &Mistyped| {
            let tells_line = format!(" on line {}", it.line);
            found
                .iter()
                .any(|one| one.line == it.line || one.cause.ends_with(&tells_line))
        };
        if !(is_told(&first) && is_told(&second)) {
            let slips = (first.slip, first.line, second.slip, second.line);
            missed.push(format!("{slips:?}: {found:#?}"));
        }
    }
    // What a value that cannot be read would have contradicted is told once it can be read.
    assert!(
        missed.len() <= PAIRS / 50,
        "{} of {PAIRS}:\n{}",
        missed.len(),
        missed.join("\n")
    );
}
