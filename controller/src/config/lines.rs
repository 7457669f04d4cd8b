//! The lines of a machine's file as somebody sees them, comments included: what the values stand for is judged
//! elsewhere, by the keys.

use std::collections::HashMap;

use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use super::diagnostic::Diagnostic;

/// What an example's value is followed by that the owner of the machine must replace.
pub(crate) const MARK: &str = "FILL IN";

/// A line that is neither empty nor only a comment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Line<'a> {
    /// `[axis.x]` or `[[platform.actuator]]`.
    Section {
        /// As it stands.
        text: &'a str,
        /// How findings name it: `axis.x`, `platform.actuator.0`.
        path: String,
    },
    /// `soft_min_mm = -3.0   # FILL IN`
    Key { name: &'a str, value: &'a str },
}

/// Each line of `text` that says something, with its number, counted from 1. Sections and keys stand in lines of
/// their own, as in every file that ships.
pub(crate) fn lines(text: &str) -> Vec<(usize, Line<'_>)> {
    let mut heads = HashMap::new();
    let numbered = text.lines().enumerate();
    let read = numbered.filter_map(|(at, line)| Some((at + 1, read(line, &mut heads)?)));
    read.collect()
}

fn read<'a>(line: &'a str, heads: &mut HashMap<&'a str, usize>) -> Option<Line<'a>> {
    let said = said(line);
    if let Some((name, value)) = said.split_once('=') {
        return Some(Line::Key {
            name: name.trim(),
            value: value.trim(),
        });
    }
    let is_row = said.contains(',');
    let text = (said.starts_with('[') && said.ends_with(']') && !is_row).then_some(said)?;
    let path = text.trim_start_matches('[').trim_end_matches(']').trim();
    let count = heads.entry(path).or_default();
    let before = *count;
    *count += 1;
    let path = match text.starts_with("[[") {
        true => format!("{path}.{before}"),
        false => path.to_owned(),
    };
    Some(Line::Section { text, path })
}

/// Every value that is marked, at the line of its mark: wherever a person may have written it, and whatever beside it.
pub(super) fn unfilled(text: &str, file: &str) -> Vec<Diagnostic> {
    let lines = lines(text);
    let marks = comments(text).filter(|(_, it)| is_mark(it));
    let found = marks.map(|(line, comment)| {
        let (key, cause) = marked(&lines, line);
        Diagnostic {
            file: file.to_owned(),
            line,
            column: 1,
            key,
            cause: cause
                .unwrap_or_else(|| format!("`{comment}` says that something here is an example's")),
            help: String::new(),
        }
    });
    let mut found: Vec<_> = found.collect();
    if let Some(last) = found.last_mut() {
        last.help = format!("write what this machine has, and remove `# {MARK}`");
    }
    found
}

/// Every remark that begins right behind a value, as no remark does: `16#2000` is 16.
pub(super) fn glued(text: &str, file: &str) -> Vec<Diagnostic> {
    let lines_with = comments(text).filter_map(|(number, comment)| {
        let line = text.lines().nth(number - 1)?;
        let before = line.strip_suffix(comment)?;
        let is_glued = before.ends_with(|it: char| it.is_ascii_alphanumeric());
        let goes_on = comment[1..].starts_with(|it: char| it.is_ascii_alphanumeric());
        (is_glued && goes_on && before.contains('=')).then_some((number, before, comment))
    });
    let lines = lines(text);
    let found = lines_with.map(|(line, before, comment)| Diagnostic {
        file: file.to_owned(),
        line,
        column: before.chars().count() + 1,
        key: marked(&lines, line).0,
        cause: format!("`{comment}` is a remark, and no part of the value before it"),
        help: "write the whole value (hexadecimal numbers begin with 0x), or a blank before #"
            .into(),
    });
    found.collect()
}

/// Each comment, with the number of its line.
fn comments(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let tokens = Source::new(text).lex();
    let comments = tokens.filter(|it| it.kind() == TokenKind::Comment);
    // Counted on from the comment before.
    let (mut line, mut counted) = (1, 0);
    comments.filter_map(move |it| {
        let (start, end) = (it.span().start(), it.span().end());
        line += text.get(counted..start)?.matches('\n').count();
        counted = start;
        Some((line, text.get(start..end)?))
    })
}

/// Whether `comment` has the words of the mark in it: `# fill in`, `# FILL IN: ask Tom`, `# (Fill-in)`.
fn is_mark(comment: &str) -> bool {
    let words = comment.split(|it: char| !it.is_alphanumeric());
    let words: Vec<_> = words
        .filter(|it| !it.is_empty())
        .map(str::to_uppercase)
        .collect();
    words.windows(2).any(|it| it.join(" ") == MARK)
}

/// The key that a mark on `line` stands at, and what is to be said of its value; a mark in a line of its own may be
/// meant for what is above it or below.
fn marked(lines: &[(usize, Line<'_>)], line: usize) -> (String, Option<String>) {
    let mut section = "";
    let mut key = None;
    for (at, it) in lines.iter().take_while(|(at, _)| *at <= line) {
        match it {
            Line::Section { path, .. } => (section, key) = (path, None),
            Line::Key { name, value } => key = Some((*at, *name, *value)),
        }
    }
    match key {
        Some((at, name, value)) if at == line && !value.ends_with('[') => {
            let cause = format!("{value} is an example's");
            (below(section, name), Some(cause))
        }
        Some((_, name, _)) => (below(section, name), None),
        None => (section.to_owned(), None),
    }
}

/// The key that stands on `line`.
#[cfg(feature = "program")]
pub(crate) fn key_on(text: &str, line: usize) -> Option<String> {
    let lines = lines(text);
    let is_key = |(at, it): &(usize, Line<'_>)| *at == line && matches!(it, Line::Key { .. });
    lines.iter().any(is_key).then(|| marked(&lines, line).0)
}

/// What a line says before its comment.
fn said(line: &str) -> &str {
    let end = comments(line)
        .next()
        .map_or(line.len(), |(_, it)| line.len() - it.len());
    line[..end].trim()
}

/// The key called `name` of the section at `path`.
pub(crate) fn below(path: &str, name: &str) -> String {
    match path.is_empty() {
        true => name.to_owned(),
        false => format!("{path}.{name}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_and_keys_are_found_and_lists_are_counted() {
        let text = "# a\n[axis.x] # b\njob = \"#1\" # c\n\n[[p.a]]\nn = 'it\\' # 'd'\n[[p.a]]\n";
        let section = |text, path: &str| Line::Section {
            text,
            path: path.into(),
        };
        let key = |name, value| Line::Key { name, value };
        let expected = [
            (2, section("[axis.x]", "axis.x")),
            (3, key("job", "\"#1\"")),
            (5, section("[[p.a]]", "p.a.0")),
            (6, key("n", "'it\\'")),
            (7, section("[[p.a]]", "p.a.1")),
        ];
        assert_eq!(lines(text), expected);
    }

    fn marks(text: &str) -> Vec<(usize, String, String)> {
        let found = unfilled(text, "m.toml").into_iter();
        found.map(|it| (it.line, it.key, it.cause)).collect()
    }

    #[test]
    fn a_mark_counts_however_it_is_written_and_whatever_else_its_comment_says() {
        for comment in [
            "# FILL IN",
            "# fill in",
            "#FILL IN: ask Tom",
            "# FILL IN, see drawing",
            "# from Tom's, FILL  IN",
            "# Fill-in!",
        ] {
            let text = format!("[axis.x]\nsoft_min_mm = -3.0{comment}\n");
            let expected = (
                2,
                "axis.x.soft_min_mm".to_owned(),
                "-3.0 is an example's".to_owned(),
            );
            assert_eq!(marks(&text), [expected], "{comment}");
        }
        for comment in ["# filled in", "# fill it in", "# refill in May", "# FILL"] {
            assert_eq!(marks(&format!("soft_min_mm = -3.0 {comment}")), []);
        }
        assert_eq!(marks("name = \"# FILL IN\"\nother = '# FILL IN'"), []);
        let quoted = marks("name = \"a\\\"b\" # FILL IN");
        assert_eq!(quoted[0].2, "\"a\\\"b\" is an example's");
    }

    #[test]
    fn a_mark_counts_on_whatever_line_it_stands() {
        let list =
            "[zero]\nindex_mm = [ # fill in\n  [1.0, 2.0], # FILL IN\n  # FILL IN\n] # FILL IN\n";
        let found = marks(list);
        let places: Vec<_> = found.iter().map(|(line, key, _)| (*line, &**key)).collect();
        let key = "zero.index_mm";
        assert_eq!(places, [(2, key), (3, key), (4, key), (5, key)]);
        assert!(found[3].2.contains("`# FILL IN` says"), "{found:?}");
        let section = marks("# FILL IN\n[axis.x] # FILL IN\nname = \"x\"\n");
        let places: Vec<_> = section
            .iter()
            .map(|(line, key, _)| (*line, &**key))
            .collect();
        assert_eq!(places, [(1, ""), (2, "axis.x")]);
    }
}
