//! Colours of what people read on a terminal: errors and bad verdicts red, warnings yellow, good verdicts green.
//!
//! Nothing says by its colour alone what it is: the words are the same without.

use core::fmt::Write as _;
use std::env;

use clap::builder::styling::{AnsiColor, Style};

use crate::program::text::SHOWS_NOTHING;

const BAD: Style = AnsiColor::Red.on_default().bold();
const DOUBTFUL: Style = AnsiColor::Yellow.on_default();
const GOOD: Style = AnsiColor::Green.on_default();

/// How a line begins, and its colour up to there.
const BEGINNINGS: [(&str, Style); 7] = [
    ("error:", BAD),
    ("bad ", BAD),
    ("NOT GOOD:", BAD),
    ("NOT VERIFIED:", DOUBTFUL),
    ("warning:", DOUBTFUL),
    ("warning ", DOUBTFUL),
    ("ok ", GOOD),
];
/// How a line that judges ends, and the colour of that.
const ENDS: [(&str, Style); 3] = [
    (": NOT WITHIN", BAD),
    (": within", GOOD),
    (SHOWS_NOTHING, BAD),
];

/// Whether the person at a terminal has not asked for plain text (<https://no-color.org>).
pub(super) fn is_wanted() -> bool {
    let is_plain = env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    !is_plain && !is_dumb()
}

/// Whether the terminal says that it obeys nothing.
pub(super) fn is_dumb() -> bool {
    env::var_os("TERM").is_some_and(|name| name == "dumb")
}

/// `text` with its colours.
pub(super) fn painted(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(line).collect();
    lines.join("\n")
}

fn line(line: &str) -> String {
    let mut told = String::new();
    let rest = match BEGINNINGS.iter().find(|it| line.starts_with(it.0)) {
        Some((beginning, style)) => {
            put(&mut told, beginning, *style);
            &line[beginning.len()..]
        }
        None => line,
    };
    match ENDS.iter().find(|it| rest.ends_with(it.0)) {
        Some((end, style)) => {
            told += &rest[..rest.len() - end.len()];
            put(&mut told, end, *style);
        }
        None => told += rest,
    }
    told
}

fn put(told: &mut String, words: &str, style: Style) {
    // To write into a text cannot fail.
    let _ = write!(told, "{}{words}{}", style.render(), style.render_reset());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_have_colours_and_everything_else_has_none() {
        let told = painted("A = 1.2 µm, tolerance 2 µm: within\nerror: x: beam lost\nplain");
        assert_eq!(
            told,
            "A = 1.2 µm, tolerance 2 µm\u{1b}[32m: within\u{1b}[0m\n\u{1b}[1m\u{1b}[31merror:\u{1b}[0m x: beam lost\nplain"
        );
        assert!(painted("tolerance 2 µm: NOT WITHIN").contains("\u{1b}[31m: NOT WITHIN"));
        assert_eq!(painted("ok can0"), "\u{1b}[32mok \u{1b}[0mcan0");
        assert!(painted("warning: m.toml:1:1: doubtful").starts_with("\u{1b}[33mwarning:"));
    }
}
