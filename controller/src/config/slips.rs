//! A line that is no TOML: what is wrong with it in the words of whoever wrote it, and the line as it was meant.

mod characters;
pub(super) mod headings;
pub(super) mod informed;
mod loosely;
mod values;

use toml::Table;

use super::diagnostic::shown;
use super::place::is_of_key;

/// What is said of a line.
#[derive(Debug)]
pub(super) struct Slip {
    /// Bytes from the line's beginning to what is wrong.
    pub(super) at: usize,
    pub(super) cause: String,
    pub(super) help: String,
    /// The line as it was meant, where that can be told.
    pub(super) meant: Option<String>,
    /// Whether it was taken for a text without quotes, which may have been meant to be something else.
    pub(super) is_text: bool,
    /// Whether nothing more can be told than that it cannot be read.
    is_unknown: bool,
    /// Whether it can be meant in two ways, both of which are told.
    pub(super) is_ambiguous: bool,
    /// Whether it is a remark that does not begin as one.
    pub(super) is_comment: bool,
    /// Whether it begins a section of which the name cannot be read.
    pub(super) is_lost_heading: bool,
    /// A second key of the line, which is not read.
    pub(super) lost: Option<String>,
    /// The key that it is about, where the line does not tell it.
    pub(super) key: Option<String>,
}

impl Slip {
    fn new(at: usize, cause: String, help: String, meant: Option<String>) -> Self {
        Self {
            at,
            cause,
            help,
            meant,
            is_text: false,
            is_unknown: false,
            is_ambiguous: false,
            is_comment: false,
            is_lost_heading: false,
            lost: None,
            key: None,
        }
    }
}

/// What is wrong with `line`, which is no TOML; `message` and `at` are what the reader of TOML says, and where.
pub(super) fn of_line(line: &str, at: usize) -> Slip {
    let parts = Parts::of(line);
    conflict(&parts)
        .or_else(|| characters::hidden(&parts))
        .or_else(|| two_keys(&parts))
        .or_else(|| comment(&parts))
        .or_else(|| characters::look_alike(&parts))
        .or_else(|| headings::of_line(&parts))
        .or_else(|| equals(&parts))
        .or_else(|| values::of(&parts))
        .unwrap_or_else(|| Slip {
            at,
            ..nothing_known(&parts)
        })
}

fn nothing_known(parts: &Parts<'_>) -> Slip {
    let cause = format!("`{}` cannot be read", shown(parts.said.trim()));
    let help = "a line is `key = value`, `[section]`, or a remark that begins with #";
    Slip {
        is_unknown: true,
        ..Slip::new(0, cause, help.into(), None)
    }
}

/// What a value that goes on over further lines ends with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    List,
    Table,
    Text,
}

/// Whether the value that begins on `line` goes on over further ones.
pub(super) fn goes_on(line: &str) -> Option<End> {
    let value = Parts::of(line).value?;
    let is_open = |open, close| {
        value.starts_with(open) && value.matches(open).count() > value.matches(close).count()
    };
    // `axis.x = {` was meant to begin a section.
    let is_heading = value == "{" && line.split('=').next().is_some_and(|it| it.contains('.'));
    if is_heading || is_toml(line) {
        return None;
    }
    let is_text = ["\"\"\"", "'''"].iter().any(|it| value.starts_with(it));
    let ends = [
        (is_text, End::Text),
        (is_open('[', ']'), End::List),
        (is_open('{', '}'), End::Table),
    ];
    ends.iter().find(|it| it.0).map(|it| it.1)
}

/// What is wrong with a value that begins on `line`, and goes on over `count` lines in all: `whole`.
pub(super) fn of_lines(line: &str, whole: &str, end: End, count: usize) -> Slip {
    let parts = Parts::of(line);
    let (what, mark) = match end {
        End::List => ("list", "]"),
        End::Table => ("section in braces", "}"),
        End::Text => ("text", "the same three quotation marks"),
    };
    let closed = whole.matches(mark).count();
    let is_closed = closed > 0 && closed >= whole.matches(['[', '{']).count();
    if count > 1 && is_closed {
        let cause = format!("the {what} that begins here cannot be read");
        let help = "part its entries by one comma each; texts in quotes, numbers without a unit";
        return Slip::new(parts.value_at, cause, help.into(), None);
    }
    let cause = format!("the {what} that begins here does not end");
    let help = format!("write {mark} at its end");
    let value = parts.value.unwrap_or_default().trim_end_matches([',', ' ']);
    let meant = parts.with(&format!("{value}{mark}"));
    let meant = (count == 1 && is_toml(&meant)).then_some(meant);
    Slip::new(parts.value_at, cause, help, meant)
}

/// Whether a reader of TOML takes it, numbers and all.
pub(super) fn is_toml(text: &str) -> bool {
    text.parse::<Table>().is_ok()
}

/// A line as far as it can be told apart.
struct Parts<'a> {
    line: &'a str,
    /// All but a comment.
    said: &'a str,
    comment: &'a str,
    /// Before the first `=`, and behind it; the whole line is before it where there is none.
    key: &'a str,
    value: Option<&'a str>,
    /// Bytes from the line's beginning to the value.
    value_at: usize,
}

impl<'a> Parts<'a> {
    fn of(line: &'a str) -> Self {
        let (said, comment) = line.split_at(comment_at(line));
        let (key, value) = match said.split_once('=') {
            Some((key, value)) => (key.trim(), Some(value)),
            None => (said.trim(), None),
        };
        let trimmed = value.map(str::trim);
        let value_at = value.map_or(0, |it| {
            said.len() - it.len() + (it.len() - it.trim_start().len())
        });
        Self {
            line,
            said,
            comment,
            key,
            value: trimmed,
            value_at,
        }
    }

    /// The line with another value, its comment as it is.
    fn with(&self, value: &str) -> String {
        format!("{} = {value} {}", self.key, self.comment)
    }

    /// The slip of a value that was meant to be `value`, if that can be read.
    fn value_meant(&self, value: &str, cause: String, help: String) -> Option<Slip> {
        let meant = self.with(value);
        is_toml(&meant).then(|| Slip::new(self.value_at, cause, help, Some(meant)))
    }
}

/// Where the comment of a line begins: at the first # outside quotes; with a quotation mark too few at the last one
/// behind a space.
pub(super) fn comment_at(line: &str) -> usize {
    let mut open = None;
    for (at, it) in line.char_indices() {
        match (open, it) {
            (None, '#') => return at,
            (None, '"' | '\'') => open = Some(it),
            (Some(quote), it) if it == quote => open = None,
            _ => {}
        }
    }
    match open {
        Some(_) => line.rfind(" #").unwrap_or(line.len()),
        None => line.len(),
    }
}

/// What to do where two versions were joined.
pub(super) const KEEP_ONE: &str =
    "keep one version, and remove the other and the lines of <<<<<<<, ======= and >>>>>>>";

/// Whether a line is a mark of a version control.
pub(super) fn is_mark(line: &str) -> bool {
    let marks = ["<<<<<<<", "|||||||", "=======", ">>>>>>>"];
    marks.iter().any(|it| line.starts_with(it))
}

/// What a version control leaves in a file of which two versions could not be joined.
fn conflict(parts: &Parts<'_>) -> Option<Slip> {
    if !is_mark(parts.line) {
        return None;
    }
    let cause = "two versions of the file were joined here, and nobody chose between them";
    let help = KEEP_ONE.to_owned();
    Some(Slip::new(0, cause.into(), help, Some(String::new())))
}

/// How comments begin elsewhere.
const COMMENTS: [&str; 7] = ["//", "/*", "--", "<!--", ";", "%", "REM "];

fn comment(parts: &Parts<'_>) -> Option<Slip> {
    let line = parts.said.trim_start();
    let begin = parts.said.len() - line.len();
    if let Some(sign) = COMMENTS.iter().find(|it| line.starts_with(**it)) {
        return Some(no_comment(sign, begin, String::new()));
    }
    let is_begun = line.strip_prefix('\'').is_some_and(|it| !it.contains('\''));
    if is_begun && parts.value.is_none() {
        return Some(no_comment("'", begin, String::new()));
    }
    let value = parts.value?;
    let found = COMMENTS.iter().find_map(|sign| {
        let (before, after) = value.split_once(sign)?;
        let is_end = after.trim().is_empty();
        let meant = parts.with(before.trim());
        // `5;0` is a number that was mistyped.
        let is_apart = before.ends_with(' ') || after.starts_with(' ');
        let is_said = is_apart && !is_end && !before.trim().is_empty();
        (is_said && is_toml(&meant)).then_some((sign, before.len(), meant))
    });
    let (sign, at, meant) = found?;
    Some(no_comment(sign, parts.value_at + at, meant))
}

fn no_comment(sign: &str, at: usize, meant: String) -> Slip {
    let cause = format!("`{}` begins no comment here", sign.trim());
    let is_comment = meant.is_empty();
    Slip {
        is_comment,
        ..Slip::new(at, cause, "begin it with #".into(), Some(meant))
    }
}

/// A second key begins where the line should end.
fn two_keys(parts: &Parts<'_>) -> Option<Slip> {
    let value = parts.value?;
    if value.starts_with(['{', '=']) {
        return None;
    }
    let (before, _) = value.split_once('=')?;
    let before = before.trim_end();
    let is_name = |it: char| it.is_alphanumeric() || "_-".contains(it);
    let mut last = before.char_indices().rev();
    let (at, last) = last.find(|(_, it)| !is_name(*it))?;
    let begin = at + last.len_utf8();
    let (first, second) = before.split_at(begin);
    let first = first.trim().trim_end_matches([',', ';', '&']).trim_end();
    let first = first.strip_suffix(" and").unwrap_or(first).trim_end();
    let meant = parts.with(first);
    let is_told = !second.is_empty() && !first.is_empty() && is_toml(&meant);
    is_told.then(|| {
        let cause = format!("the key `{}` begins in the middle of a line", shown(second));
        let help = format!("begin a new line before `{}`", shown(second));
        Slip {
            lost: Some(second.to_owned()),
            ..Slip::new(parts.value_at + begin, cause, help, Some(meant))
        }
    })
}

fn is_key(text: &str) -> bool {
    !text.is_empty() && text.chars().all(is_of_key)
}

/// What stands between a key and its value, or one of these is missing.
fn equals(parts: &Parts<'_>) -> Option<Slip> {
    let Some(value) = parts.value else {
        return without_equals(parts);
    };
    let told =
        |at, cause: &str, help: String, meant| Some(Slip::new(at, cause.into(), help, meant));
    if parts.key.is_empty() {
        let help = "write the key's name before it: `key = value`";
        return told(0, "there is no key before the `=`", help.into(), None);
    }
    if value.is_empty() {
        let help = "write a value behind it".to_owned();
        let at = parts.said.trim_end().len();
        return told(at, "there is no value behind the `=`", help, None);
    }
    let key = parts.key.trim_end_matches([':', '-', '<', '=']).trim_end();
    let rest = value.trim_start_matches(['=', '>', ' ']);
    if (key, rest) != (parts.key, value) && is_key(key) {
        let meant = format!("{key} = {rest} {}", parts.comment);
        let cause = "a key and its value are parted by one `=`";
        let help = format!("write `{key} = {}`", shown(rest));
        return told(0, cause, help, is_toml(&meant).then_some(meant));
    }
    let words: Vec<&str> = parts.key.split_whitespace().collect();
    let joined = words.join("_");
    if words.len() > 1 && is_key(&joined) {
        let meant = format!("{joined} = {value} {}", parts.comment);
        let cause = format!("`{}` is no key: a key has no spaces", shown(parts.key));
        let help = format!("write `{joined}`");
        let meant = is_toml(&meant).then_some(meant);
        return Some(Slip::new(0, cause, help, meant));
    }
    None
}

fn without_equals(parts: &Parts<'_>) -> Option<Slip> {
    let line = parts.said.trim();
    if is_key(line) {
        let cause = format!("`{}` has no value", shown(line));
        let help = format!("write `{} = value`, or remove it", shown(line));
        return Some(Slip::new(0, cause, help, None));
    }
    let (key, value, cause) = match line.split_once(':') {
        Some((key, value)) => (key.trim(), value, "`:` stands where `=` belongs"),
        None => {
            let (key, value) = line.split_once(char::is_whitespace)?;
            (key, value, "there is no `=` between a key and its value")
        }
    };
    let value = value.trim();
    let value = value.strip_prefix("->").unwrap_or(value).trim();
    let key = key.trim_start_matches(['-', ' ']);
    if value.is_empty() || !is_key(key) {
        return None;
    }
    let quoted = format!("\"{value}\"");
    let values = [value, &quoted];
    let is_colon = line.contains(':');
    // Of prose the second word is no value.
    let values = &values[..if is_colon { 2 } else { 1 }];
    let value = values.iter().find(|it| is_toml(&format!("{key} = {it}")))?;
    let help = format!("write `{key} = {}`", shown(value));
    let meant = format!("{key} = {value} {}", parts.comment);
    Some(Slip::new(0, cause.into(), help, Some(meant)))
}

#[cfg(test)]
mod tests;
