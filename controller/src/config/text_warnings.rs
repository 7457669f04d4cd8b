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
    if trimmed.starts_with('~') || trimmed.contains('$') {
        judge.say(
            key,
            format!("\"{text}\" is taken as it stands: `~` and `$` mean nothing in this file"),
            "write the whole path",
        );
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
}
