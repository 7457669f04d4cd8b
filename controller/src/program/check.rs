//! `truestage check`: whether a configuration is valid, and a summary of it.

use std::path::Path;

use serde_json::json;

use crate::config;
use crate::program::output::{Ended, Output};
use crate::program::text;

pub(crate) fn run(path: &Path, output: Output) -> Ended {
    let loaded = config::load(path)?;
    let machine = &loaded.config.machine;
    let text = format!(
        "{}: sound; machine {} (stage {}), {} axes, {} analog modules, {} instruments, \
         {} cameras\n\
         calibrations of it carry the configuration hash {}",
        path.display(),
        machine.name,
        machine.stage_serial,
        loaded.config.axis.len() + loaded.config.rotary.len(),
        loaded.config.analog.len(),
        loaded.config.instrument.len(),
        loaded.config.camera.len(),
        &loaded.hash.as_str()[..12],
    );
    let notes = text::table_notes(&loaded.config);
    let text = notes.iter().fold(text, |text, note| text + "\n" + note);
    output.result(
        &text,
        &json!({"ok": true, "machine": machine.name, "hash": loaded.hash.as_str(), "notes": notes}),
    )
}
