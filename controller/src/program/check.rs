//! `truestage check`: whether a configuration is valid, and a summary of it.

use std::path::Path;

use serde_json::json;
use units::Several;

use crate::config;
use crate::program::kind::KINDS;
use crate::program::output::{Ended, Output};

pub(crate) fn run(path: &Path, output: Output) -> Ended {
    let loaded = config::load(path)?;
    let machine = &loaded.config.machine;
    let text = format!(
        "{}: sound; machine {} (stage {}), {}, {}, {}, {}\n\
         calibrations of it carry the configuration hash {}",
        path.display(),
        machine.name,
        machine.stage_serial,
        axes_text(loaded.config.axis.len() + loaded.config.rotary.len()),
        Several(loaded.config.analog.len(), "analog module"),
        Several(loaded.config.instrument.len(), "instrument"),
        Several(loaded.config.camera.len(), "camera"),
        &loaded.hash.as_str()[..12],
    );
    let warnings = loaded.warnings.iter().chain(&loaded.unfilled);
    let text = warnings.fold(text, |text, it| format!("{text}\nwarning: {it}"));
    let notes = KINDS.iter().flat_map(|it| (it.notes)(&loaded.config));
    let notes: Vec<_> = notes.collect();
    let text = notes.iter().fold(text, |text, note| text + "\n" + note);
    output.result(
        &text,
        &json!({"ok": true, "machine": machine.name, "hash": loaded.hash.as_str(), "notes": notes,
                "warnings": loaded.warnings, "unfilled": loaded.unfilled}),
    )
}

fn axes_text(count: usize) -> String {
    match count {
        1 => "1 axis".to_owned(),
        count => format!("{count} axes"),
    }
}
