//! What is doubtful of paths: nobody expands them, and a blank at an end is part of a name.

use std::path::Path;

use super::judge::{Finding, Judge};
use super::model::MachineConfig;

pub(super) fn check(config: &MachineConfig, found: &mut Vec<Finding>) {
    let buses = config.can.iter();
    let buses = buses.filter_map(|(name, it)| Some((format!("can.{name}"), it.path.as_deref()?)));
    let lines = config.serial.iter();
    let lines = lines.map(|(name, it)| (format!("serial.{name}"), it.path.as_path()));
    for (key, path) in buses.chain(lines) {
        check_path(&mut Judge::at(key, found), "path", path);
    }
    let judge = &mut Judge::at("machine".into(), found);
    check_serial(judge, &config.machine.stage_serial);
    check_path(judge, "data_dir", &config.machine.data_dir);
    check_folder(judge, &config.machine.data_dir);
}

fn check_path(judge: &mut Judge<'_>, key: &str, path: &Path) {
    let text = path.to_string_lossy();
    let trimmed = text.trim();
    if trimmed.is_empty() {
        return;
    }
    if trimmed.len() != text.len() {
        judge.say(
            key,
            format!("\"{text}\" begins or ends with a blank, which is part of the name"),
            format!("write \"{trimmed}\""),
        );
    }
    check_letters(judge, key, trimmed);
    let (begin, port) = trimmed.split_at_checked(3).unwrap_or_default();
    if begin == "tty" {
        judge.say(
            key,
            format!("\"{trimmed}\" is looked for beside this file"),
            format!("write the whole path: \"/dev/{trimmed}\""),
        );
    }
    if begin.eq_ignore_ascii_case("com")
        && !port.is_empty()
        && port.chars().all(|it| it.is_ascii_digit())
    {
        let cause = format!("\"{trimmed}\" is a port's name on Windows");
        judge.say(
            key,
            cause,
            "write the device file: /dev/ttyUSB0, /dev/serial/by-id/…",
        );
    }
    if trimmed.starts_with('~') || trimmed.contains('$') {
        judge.say(
            key,
            format!("\"{text}\" is taken as it stands: `~` and `$` mean nothing in this file"),
            "write the whole path",
        );
    }
}

/// Words that stand for what somebody still has to find out.
const PLACEHOLDERS: [&str; 12] = [
    "todo",
    "fixme",
    "changeme",
    "tbd",
    "xxx",
    "unknown",
    "yourserial",
    "fillin",
    "serial",
    "serialnumber",
    "stageserial",
    "replaceme",
];

fn check_serial(judge: &mut Judge<'_>, serial: &str) {
    let letters = serial.chars().filter(|it| it.is_alphanumeric());
    let letters: String = letters.flat_map(char::to_lowercase).collect();
    if PLACEHOLDERS.contains(&letters.as_str()) {
        judge.say(
            "stage_serial",
            format!("\"{serial}\" is a word that stands for a number"),
            "give the serial number on the stage's plate",
        );
    }
    check_letters(judge, "stage_serial", serial);
}

/// Greek and Cyrillic: most capitals of theirs look like Latin ones.
fn is_look_alike(it: char) -> bool {
    ('\u{370}'..='\u{52f}').contains(&it)
}

/// Letters that look like others, marks within marks, blanks at an end.
fn check_letters(judge: &mut Judge<'_>, key: &str, text: &str) {
    if let Some(it) = text.chars().find(|it| is_look_alike(*it)) {
        let cause = format!(
            "\"{text}\" has a `{it}` that is none of the keyboard's (U+{:04X})",
            u32::from(it)
        );
        judge.say(
            key,
            cause,
            "type it anew, if it was meant to be the letter that it looks like",
        );
    }
    let is_quoted = |mark| text.len() > 1 && text.starts_with(mark) && text.ends_with(mark);
    if is_quoted('"') || is_quoted('\'') {
        let cause = format!("the quotation marks in {text} are part of it");
        judge.say(key, cause, "remove those within it");
    }
    if key == "stage_serial" && text.trim().len() < text.len() {
        let cause = format!("\"{text}\" begins or ends with a blank, which is part of it");
        judge.say(key, cause, format!("write \"{}\"", text.trim()));
    }
}

fn check_folder(judge: &mut Judge<'_>, folder: &Path) {
    if folder.to_string_lossy().trim().is_empty() {
        judge.say(
            "data_dir",
            "is empty: calibrations, journals and reports would lie beside this file",
            "name a folder, such as \"machine-data\"; \".\" is this file's own",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");

    #[test]
    fn a_folder_that_nobody_expands_or_that_has_no_name_is_told() {
        let key = "machine.data_dir";
        let from = "data_dir = \"machine-data\"";
        for (to, says) in [
            ("\"\"", "would lie beside this file"),
            ("\"~/machine-data\"", "mean nothing in this file"),
            ("\"$HOME/machine-data\"", "mean nothing in this file"),
            ("\"machine-data \"", "ends with a blank"),
        ] {
            check(LINEAR, &[(from, &format!("data_dir = {to}"))], &[key], says);
        }
    }

    #[test]
    fn a_blank_at_the_end_of_a_path_is_told() {
        let edit = ("\"/dev/ttyACM1\"", "\"/dev/ttyACM1 \"");
        let says = "\"/dev/ttyACM1 \" begins or ends with a blank";
        check(LINEAR, &[edit], &["can.can0.path"], says);
        let edit = ("\"/dev/ttyACM0\"", "\" /dev/ttyACM0\"");
        let says = "\" /dev/ttyACM0\" begins or ends with a blank";
        check(LINEAR, &[edit], &["serial.laser.path"], says);
    }

    #[test]
    fn a_text_that_says_something_else_than_it_seems_to_is_told() {
        let (from, key) = ("stage_serial = \"TS-LIN-0001\"", "machine.stage_serial");
        for (to, says) in [
            ("\"CHANGE-ME\"", "stands for a number"),
            ("\"<serial>\"", "stands for a number"),
            ("\"ТS-LIN-0001\"", "none of the keyboard's (U+0422)"),
            ("'\"TS-LIN-0001\"'", "are part of it"),
            ("\"TS-LIN-0001 \"", "ends with a blank"),
        ] {
            let edit = (from, &*format!("stage_serial = {to}"));
            check(LINEAR, &[edit], &[key], says);
        }
        let edit = ("\"/dev/ttyACM1\"", "\"COM3\"");
        check(
            LINEAR,
            &[edit],
            &["can.can0.path"],
            "a port's name on Windows",
        );
        let edit = ("\"/dev/ttyACM1\"", "\"ttyACM1\"");
        let says = "is looked for beside this file";
        check(LINEAR, &[edit], &["can.can0.path"], says);
    }
}
