//! What is wrong with a configuration: where, why, and what to do.

use core::fmt;
use core::ops::Range;
use std::path::PathBuf;

use serde::Serialize;

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// The file as it was named.
    pub file: String,
    /// Counted from 1.
    pub line: usize,
    /// Counted from 1, in characters.
    pub column: usize,
    /// The key's path, such as `axis.x.soft_min_mm`; empty where none can be told.
    pub key: String,
    /// What is wrong.
    pub cause: String,
    /// What to do.
    pub help: String,
}

impl Diagnostic {
    /// A finding at a byte range of `text`.
    pub(super) fn at(
        file: &str,
        text: &str,
        span: &Range<usize>,
        key: &str,
        cause: String,
        help: String,
    ) -> Self {
        let (line, column) = LineStarts::find(text).place_of(span.start);
        Self {
            file: file.to_owned(),
            line,
            column,
            key: key.to_owned(),
            cause,
            help,
        }
    }
}

/// Where each line of a text begins: looked up often, and looked for once.
pub(super) struct LineStarts<'a> {
    text: &'a str,
    starts: Vec<usize>,
}

impl<'a> LineStarts<'a> {
    pub(super) fn find(text: &'a str) -> Self {
        let ends = text.match_indices('\n').map(|(at, _)| at + 1);
        Self {
            text,
            starts: core::iter::once(0).chain(ends).collect(),
        }
    }

    /// Line and column of the byte at `at`, both counted from 1; of one that is none, those of the end.
    pub(super) fn place_of(&self, at: usize) -> (usize, usize) {
        let before = self.text.get(..at).unwrap_or(self.text);
        let line = self.starts.partition_point(|start| *start <= before.len());
        let column = before[self.starts[line - 1]..].chars().count() + 1;
        (line, column)
    }
}

/// A text as a message can show it: not for ever, and without what a terminal would obey.
pub(crate) fn shown(text: &str) -> String {
    const MOST: usize = 60;
    let mut shown: String = text
        .chars()
        .take(MOST)
        .flat_map(|it| match it.is_control() {
            true => it.escape_default().collect::<Vec<_>>(),
            false => vec![it],
        })
        .collect();
    if text.chars().nth(MOST).is_some() {
        shown.push('…');
    }
    shown
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: ", self.file, self.line, self.column)?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "{}", self.cause)?;
        if !self.help.is_empty() {
            write!(f, "\n  help: {}", self.help)?;
        }
        Ok(())
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: cannot read the configuration: {source}{}", path.display(), hint(source))]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file says something that cannot be.
    #[error("{}", show(findings))]
    Invalid {
        /// All that was found, in the order of the file.
        findings: Vec<Diagnostic>,
    },
}

/// Somebody's first try is in a folder without a `machine.toml`.
fn hint(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::NotFound => {
            "\n  help: name a machine's configuration, such as configs/machines/linear.toml"
        }
        _ => "",
    }
}

fn show(findings: &[Diagnostic]) -> String {
    findings
        .iter()
        .map(Diagnostic::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}
