//! What is no TOML, in the words of whoever wrote it: the key, what stands there, what to write.

use core::ops::Range;

use super::judge::Finding;
use super::unit::{is_unit, split_unit};

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
        let told = place.twice(text).or_else(|| place.key_and_section(text));
        return told.unwrap_or_else(other);
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
        let (number, unit) = split_unit(value)?;
        let unit = unit.filter(|it| is_unit(it))?;
        Some(Finding {
            key: self.key(),
            cause: format!("`{value}` is no number: the unit is in the key's name"),
            help: format!("write {number} without `{unit}`, in the unit that the key ends with"),
        })
    }

    /// A word that is no number and no `true` or `false`.
    fn without_quotes(&self) -> Option<Finding> {
        let value = self.value()?;
        let is_word = value.starts_with(|it: char| it.is_alphabetic() || "/.~".contains(it));
        if !is_word || value.contains('"') {
            return None;
        }
        let key = self.key();
        let told = |cause: String, help: String| Some(Finding { key, cause, help });
        match value.to_lowercase().as_str() {
            "true" | "yes" | "on" => told(
                format!("`{value}` is not known here"),
                "write true, in small letters".into(),
            ),
            "false" | "no" | "off" => told(
                format!("`{value}` is not known here"),
                "write false, in small letters".into(),
            ),
            _ => told(
                format!("`{value}` is text without quotes"),
                format!("write it in quotes: \"{value}\""),
            ),
        }
    }

    /// Where the same key, or the same section, stands before.
    fn twice(&self, text: &str) -> Option<Finding> {
        let is_section = is_header(self.line);
        let wanted = match is_section {
            true => name_of(self.line),
            false => self.line.split_once('=')?.0.trim(),
        };
        let mut section = "";
        let mut first = None;
        for (number, line) in text.lines().map(str::trim).enumerate().take(self.number) {
            if is_header(line) {
                section = line;
                // Each section of a list is another one.
                first = first.filter(|_| !(line.starts_with("[[") && line == self.section));
            }
            let seen = match (is_section, line.split_once('=')) {
                (true, _) if is_header(line) => name_of(line),
                (false, Some((key, _))) if section == self.section => key.trim(),
                _ => continue,
            };
            if seen == wanted && first.is_none() {
                first = Some(number + 1);
            }
        }
        let what = if is_section { "the section" } else { "the key" };
        Some(Finding {
            key: self.key(),
            cause: format!(
                "{what} stands here a second time; line {} has it first",
                first?
            ),
            help: "leave one of them out".into(),
        })
    }

    /// Where a key has the name that a section has here, or the other way round.
    fn key_and_section(&self, text: &str) -> Option<Finding> {
        let here = self.key();
        let mut section = "";
        let mut before = text.lines().map(str::trim).take(self.number);
        let first = before.position(|line| {
            if is_header(line) {
                section = name_of(line);
                return !is_header(self.line) && section == here;
            }
            let key = line.split_once('=').map(|it| it.0.trim());
            is_header(self.line) && key.is_some_and(|it| here == format!("{section}.{it}"))
        })?;
        let [what, other] = match is_header(self.line) {
            true => ["section", "key"],
            false => ["key", "section"],
        };
        Some(Finding {
            key: here,
            cause: format!("it is a {what} here, and a {other} on line {}", first + 1),
            help: format!("one of them has the wrong name: correct the {other} or the {what}"),
        })
    }
}

/// `[axis.x]`, and no line of a list over several lines.
fn is_header(line: &str) -> bool {
    let name = name_of(line);
    let is_name = |it: char| it.is_alphanumeric() || "_.-\"' ".contains(it);
    let is_list = name.starts_with(|it: char| it.is_ascii_digit() || it == '-');
    line.starts_with('[') && !name.is_empty() && !is_list && name.chars().all(is_name)
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
    fn a_key_that_is_called_like_a_section_is_named_with_both_places() {
        let header = LINEAR.lines().position(|it| it == "[axis.x]");
        let header = header.expect("it is there") + 1;
        let says = format!("a section here, and a key on line {}", header + 1);
        let to = "[axis.x]\nzero = 400.0\n";
        check("[axis.x]\n", to, "axis.x.zero", [&says, "wrong name"]);
        let says = format!("a key here, and a section on line {header}");
        let to = "[axis.x.soft]\n[axis.x]\nsoft = 3\n";
        check("[axis.x]\n", to, "axis.x.soft", [&says, "wrong name"]);
    }

    #[test]
    fn a_number_or_a_word_that_is_nearly_right_is_told_as_what_it_is() {
        let (from, key) = ("correct_air = true", "instrument.laser.correct_air");
        check(from, "correct_air = True", key, ["`True`", "write true"]);
        check(from, "correct_air = off", key, ["`off`", "write false"]);
        let from = "device_type = 0x00020192";
        let key = "axis.x.identity.device_type";
        check(from, "device_type = 0x0002019G", key, ["", "`key = value`"]);
    }

    #[test]
    fn in_a_list_of_sections_the_same_section_is_searched() {
        const UVW: &str = include_str!("../../../configs/machines/uvw.toml");
        let third = UVW.rfind("lead_mm").expect("it is there");
        let text = format!("{}lead_mm = 2.0\n{}", &UVW[..third], &UVW[third..]);
        let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
            panic!("it stands there twice")
        };
        let first = text[..third].matches('\n').count() + 1;
        assert!(
            findings[0]
                .cause
                .contains(&format!("line {first} has it first")),
            "{findings:?}"
        );
    }

    #[test]
    fn a_list_over_several_lines_is_no_section() {
        let from = "channels = [0, 1] ";
        let to = "channels = [\n  0,\n  1\n]\nnoise = [\n  [1.0, 2.0],\n]\nx = 5 mm #";
        check(from, to, "analog.hall.x", ["`5 mm`", "write 5"]);
    }

    #[test]
    fn anything_else_says_what_a_line_is() {
        let says = ["", "`key = value`"];
        check("node_id = 1\n", "node_id 1\n", "axis.x", says);
    }
}
