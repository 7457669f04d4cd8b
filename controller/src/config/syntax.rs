//! What is no TOML, in the words of whoever wrote it: the key, what stands there, what to write.

use core::ops::Range;

use super::judge::Finding;

/// What a TOML reader says of a second key, or of a second section.
const TWICE: &str = "duplicate key";

/// What is wrong at `span` of `text`, of which the reader says `message`.
pub(super) fn explained(text: &str, span: &Range<usize>, message: &str) -> Finding {
    let place = Place::at(text, span.start);
    let other = || Finding {
        key: place.key(),
        cause: message.to_owned(),
        help: "a line is `key = value`, `[section]`, or a comment after #".into(),
    };
    if message.starts_with(TWICE) {
        return place.twice(text).unwrap_or_else(other);
    }
    place
        .with_a_unit()
        .or_else(|| place.without_quotes())
        .unwrap_or_else(other)
}

/// A line of a file.
struct Place<'a> {
    /// Counted from 0.
    number: usize,
    line: &'a str,
    /// The section that it is in; the line itself where that begins one.
    section: &'a str,
}

impl<'a> Place<'a> {
    fn at(text: &'a str, byte: usize) -> Self {
        let before = text.get(..byte).unwrap_or(text);
        let number = before.matches('\n').count();
        let lines = || text.lines().take(number + 1).map(str::trim);
        Self {
            number,
            section: lines()
                .filter(|it| is_header(it))
                .last()
                .unwrap_or_default(),
            line: lines().last().unwrap_or_default(),
        }
    }

    /// The path of its key, as far as a line tells it.
    fn key(&self) -> String {
        let section = name_of(self.section);
        match self.line.split_once('=') {
            _ if is_header(self.line) => section.to_owned(),
            Some((key, _)) if section.is_empty() => key.trim().to_owned(),
            Some((key, _)) => format!("{section}.{}", key.trim()),
            None => section.to_owned(),
        }
    }

    /// What it says, without a comment.
    fn value(&self) -> Option<&'a str> {
        let (_, value) = self.line.split_once('=')?;
        Some(value.split('#').next().unwrap_or_default().trim())
    }

    /// `12.5 mm` in place of a number.
    fn with_a_unit(&self) -> Option<Finding> {
        let value = self.value()?;
        let end = value.find(|it: char| !(it.is_ascii_digit() || "+-._eE".contains(it)))?;
        let (number, unit) = value.split_at(end);
        number.parse::<f64>().ok()?;
        let unit = unit.trim();
        unit.chars()
            .all(|it| it.is_alphabetic() || "/°²³%″′0123456789".contains(it))
            .then(|| Finding {
                key: self.key(),
                cause: format!("`{value}` is no number: the unit is in the key's name"),
                help: format!(
                    "write {number} without `{unit}`, in the unit that the key ends with"
                ),
            })
    }

    /// A word that is no number and no `true` or `false`.
    fn without_quotes(&self) -> Option<Finding> {
        let value = self.value()?;
        let is_word = value.starts_with(|it: char| it.is_alphabetic() || "/.~".contains(it));
        (is_word && !value.contains('"')).then(|| Finding {
            key: self.key(),
            cause: format!("`{value}` is text without quotes"),
            help: format!("write it in quotes: \"{value}\""),
        })
    }

    /// Where the same key, or the same section, stands before.
    fn twice(&self, text: &str) -> Option<Finding> {
        let is_section = is_header(self.line);
        let wanted = match is_section {
            true => name_of(self.line),
            false => self.line.split_once('=')?.0.trim(),
        };
        let mut section = "";
        for (number, line) in text.lines().map(str::trim).enumerate().take(self.number) {
            if is_header(line) {
                section = line;
            }
            let seen = match (is_section, line.split_once('=')) {
                (true, _) if is_header(line) => name_of(line),
                (false, Some((key, _))) if section == self.section => key.trim(),
                _ => continue,
            };
            if seen == wanted {
                let what = if is_section { "the section" } else { "the key" };
                return Some(Finding {
                    key: self.key(),
                    cause: format!(
                        "{what} stands here a second time; line {} has it first",
                        number + 1
                    ),
                    help: "leave one of them out".into(),
                });
            }
        }
        None
    }
}

fn is_header(line: &str) -> bool {
    line.starts_with('[')
}

/// `axis.x` of `[axis.x]`, with whatever comment.
fn name_of(header: &str) -> &str {
    let inner = header.trim_start_matches('[');
    inner.split(']').next().unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[track_caller]
    fn check(from: &str, to: &str, key: &str, says: [&str; 2]) {
        let found = match parse(&LINEAR.edit_first(from, to), "m.toml") {
            Err(ConfigError::Invalid { findings }) => findings,
            other => panic!("{other:?}"),
        };
        let [one] = &found[..] else {
            panic!("{found:#?}")
        };
        assert_eq!(one.key, key);
        assert!(one.cause.contains(says[0]), "{one}");
        assert!(one.help.contains(says[1]), "{one}");
    }

    #[test]
    fn a_number_with_a_unit_says_how_it_is_written() {
        let says = ["`0.2 mm` is no number", "write 0.2 without `mm`"];
        let from = "standard_uncertainty_limit_um = 0.2";
        let key = "axis.x.zero.standard_uncertainty_limit_um";
        check(from, "standard_uncertainty_limit_um = 0.2 mm", key, says);
        let says = ["`200mm/s` is no number", "write 200 without `mm/s`"];
        let (from, key) = ("speed_mm_per_s = 200.0", "axis.x.speed_mm_per_s");
        check(from, "speed_mm_per_s = 200mm/s    # fast", key, says);
    }

    #[test]
    fn text_without_quotes_is_shown_in_them() {
        let says = ["`slcan` is text without quotes", "\"slcan\""];
        let (from, key) = ("transport = \"slcan\"", "can.can0.transport");
        check(from, "transport = slcan", key, says);
        let says = ["`/dev/ttyACM0`", "\"/dev/ttyACM0\""];
        check(
            "path = \"/dev/ttyACM0\"",
            "path = /dev/ttyACM0",
            "serial.laser.path",
            says,
        );
    }

    #[test]
    fn what_stands_there_twice_is_named_with_both_places() {
        let first = LINEAR.lines().position(|it| it.starts_with("node_id = 1"));
        let line = format!("line {} has it first", first.expect("it is there") + 1);
        let (key, says) = ("axis.x.node_id", [line.as_str(), "leave one"]);
        check("node_id = 1\n", "node_id = 1\nnode_id = 2\n", key, says);
        let says = ["the section stands here a second time", "leave one"];
        check(
            "[axis.x.verify]",
            "[axis.x.calibrate]\n[axis.x.verify]",
            "axis.x.calibrate",
            says,
        );
    }

    #[test]
    fn anything_else_says_what_a_line_is() {
        let says = ["", "`key = value`"];
        check("node_id = 1\n", "node_id 1\n", "axis.x", says);
    }
}
