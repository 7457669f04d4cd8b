//! `truestage check`: whether a configuration is valid, and a summary of it.

use std::path::Path;

use serde_json::{Value, json};
use units::Several;

use crate::certificate::{CertificateConfig, Measurand, shown};
use crate::config;
use crate::program::kind::KINDS;
use crate::program::output::{Ended, Output};

pub(crate) fn run(path: &Path, output: Output) -> Ended {
    let loaded = config::load(path)?;
    loaded.certified()?;
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
    let certificates = loaded.config.certificates();
    let text = certificates
        .iter()
        .fold(text, |text, it| text + "\n" + &certified_text(it));
    let warnings = loaded.warnings.iter().chain(&loaded.unfilled);
    let text = warnings.fold(text, |text, it| format!("{text}\nwarning: {it}"));
    let notes = KINDS.iter().flat_map(|it| (it.notes)(&loaded.config));
    let notes: Vec<_> = notes.collect();
    let text = notes.iter().fold(text, |text, note| text + "\n" + note);
    let certified: Vec<_> = certificates.iter().map(certified_value).collect();
    output.result(
        &text,
        &json!({"ok": true, "machine": machine.name, "hash": loaded.hash.as_str(), "notes": notes,
                "certificates": certified, "warnings": loaded.warnings, "unfilled": loaded.unfilled}),
    )
}

/// A certificate that the configuration names: its key, what it is of, and what was read.
type Certificate<'a> = (String, Measurand, &'a CertificateConfig);

fn certified_text((key, measurand, config): &Certificate<'_>) -> String {
    let Some(it) = &config.certified else {
        return format!("{key}: not read");
    };
    format!(
        "{key}: {} of {}, serial number {}, calibrated {}, valid until {}: {} {}",
        it.identifier,
        it.laboratory,
        it.serial_number,
        it.calibrated,
        it.valid_until,
        measurand.name(),
        shown(it, *measurand)
    )
}

fn certified_value((key, measurand, config): &Certificate<'_>) -> Value {
    let read = config.certified.as_ref();
    json!({
        "key": key,
        "file": config.file,
        "quantity": measurand.name(),
        "certificate": read.map(|it| it.record(key)),
        "figures": read.map(|it| it.figures.value()),
    })
}

fn axes_text(count: usize) -> String {
    match count {
        1 => "1 axis".to_owned(),
        count => format!("{count} axes"),
    }
}
