//! The lines of a machine's file as somebody sees them, comments included: what the values stand for is judged
//! elsewhere, by the keys.

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
    Key {
        name: &'a str,
        value: &'a str,
        is_marked: bool,
    },
}

/// Each line of `text` that says something, with its number, counted from 1. Sections and keys stand in lines of
/// their own, as in every file that ships.
pub(crate) fn lines(text: &str) -> Vec<(usize, Line<'_>)> {
    let mut heads = Vec::new();
    let numbered = text.lines().enumerate();
    let read = numbered.filter_map(|(at, line)| Some((at + 1, read(line, &mut heads)?)));
    read.collect()
}

fn read<'a>(line: &'a str, heads: &mut Vec<&'a str>) -> Option<Line<'a>> {
    let (said, comment) = parted(line);
    if let Some((name, value)) = said.split_once('=') {
        return Some(Line::Key {
            name: name.trim(),
            value: value.trim(),
            is_marked: comment.trim_start_matches('#').trim() == MARK,
        });
    }
    let text = said.strip_prefix('[').map(|_| said)?;
    let path = text.trim_start_matches('[').trim_end_matches(']').trim();
    let before = heads.iter().filter(|it| **it == path).count();
    heads.push(path);
    let path = match text.starts_with("[[") {
        true => format!("{path}.{before}"),
        false => path.to_owned(),
    };
    Some(Line::Section { text, path })
}

/// Every value that is marked, at its place.
pub(super) fn unfilled(text: &str, file: &str) -> Vec<Diagnostic> {
    let mut section = String::new();
    let mut found = Vec::new();
    for (line, it) in lines(text) {
        match it {
            Line::Section { path, .. } => section = path,
            Line::Key {
                name,
                value,
                is_marked: true,
            } => found.push(Diagnostic {
                file: file.to_owned(),
                line,
                column: 1,
                key: below(&section, name),
                cause: format!("{value} is an example's"),
                help: String::new(),
            }),
            Line::Key { .. } => {}
        }
    }
    if let Some(last) = found.last_mut() {
        last.help = format!("write what this machine has, and remove `# {MARK}`");
    }
    found
}

/// What a line says, and the comment behind it.
fn parted(line: &str) -> (&str, &str) {
    let mut quote = None;
    for (at, it) in line.char_indices() {
        match (quote, it) {
            (None, '#') => return (line[..at].trim(), line[at..].trim()),
            (None, '"' | '\'') => quote = Some(it),
            (Some(open), it) if it == open => quote = None,
            _ => {}
        }
    }
    (line.trim(), "")
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
    fn sections_and_keys_are_found_with_their_marks_and_lists_are_counted() {
        let text = "# a\n[axis.x] # b\njob = \"#1\" # FILL IN\n\n[[p.a]]\nn = 1 # FILL IN later\n[[p.a]]\n";
        let section = |text, path: &str| Line::Section {
            text,
            path: path.into(),
        };
        let key = |name, value, is_marked| Line::Key {
            name,
            value,
            is_marked,
        };
        let expected = [
            (2, section("[axis.x]", "axis.x")),
            (3, key("job", "\"#1\"", true)),
            (5, section("[[p.a]]", "p.a.0")),
            (6, key("n", "1", false)),
            (7, section("[[p.a]]", "p.a.1")),
        ];
        assert_eq!(lines(text), expected);
    }
}
