//! The certificates of a machine, read and judged.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use jiff::civil::Date;

use super::config::CertificateConfig;
use super::dcc::Parts;
use super::measurand::Measurand;
use super::table::Certified;
use super::xml::{BYTES_MAX, parsed};
use super::{Unfit, result, unfit};
use crate::config::judge::{Finding, Judge};
use crate::time_of_day::time_of_day;

/// A certificate that a configuration names, where it stands there.
pub(crate) struct Named<'a> {
    /// Its section, such as `instrument.laser.certificate.wavelength`.
    pub(crate) key: String,
    /// Of what.
    pub(crate) measurand: Measurand,
    /// What is said of it.
    pub(crate) config: &'a mut CertificateConfig,
}

/// The day by the clock of this computer, UTC.
pub(crate) fn today() -> Date {
    time_of_day().to_zoned(jiff::tz::TimeZone::UTC).date()
}

/// Reads each certificate; paths count from `folder`. What cannot be used is found.
pub(crate) fn read<'a>(
    named: impl IntoIterator<Item = Named<'a>>,
    folder: Option<&Path>,
    findings: &mut Vec<Finding>,
) {
    for Named {
        key,
        measurand,
        config,
    } in named
    {
        match read_one(config, measurand, folder) {
            Ok(certified) => config.certified = Some(Arc::new(certified)),
            Err((at, Unfit { cause, help })) => {
                let cause = format!("{}: {cause}", config.file.display());
                Judge::at(key, findings).say(at, cause, help);
            }
        }
    }
}

/// The key that is to blame, and why.
type Refused = (&'static str, Unfit);

fn read_one(
    config: &CertificateConfig,
    measurand: Measurand,
    folder: Option<&Path>,
) -> Result<Certified, Refused> {
    let at = |key: &'static str| move |unfit: Unfit| (key, unfit);
    if config.serial_number.trim().is_empty() {
        let empty = unfit("`serial_number` is empty", "give that of what is certified");
        return empty.map_err(at("serial_number"));
    }
    let text = text_of(config, folder).map_err(at("file"))?;
    let document = parsed(&text).map_err(at("file"))?;
    let parts = Parts::of(&document).map_err(at("file"))?;
    let calibrated = parts.calibrated().map_err(at("file"))?;
    parts
        .require_of(&config.serial_number)
        .map_err(at("serial_number"))?;
    let wanted = config.result.as_deref();
    let figures = result::figures(&parts.results(), measurand, wanted);
    Ok(Certified {
        identifier: parts.identifier().map_err(at("file"))?,
        laboratory: parts.laboratory().map_err(at("file"))?,
        serial_number: config.serial_number.trim().to_owned(),
        calibrated,
        valid_until: parts
            .valid_until(calibrated, config.valid_months)
            .map_err(at("file"))?,
        hash: blake3::hash(text.as_bytes()).to_hex().to_string(),
        figures: figures.map_err(at(if wanted.is_some() { "result" } else { "file" }))?,
    })
}

fn text_of(config: &CertificateConfig, folder: Option<&Path>) -> Result<String, Unfit> {
    let path = match folder {
        Some(folder) => folder.join(&config.file),
        None if config.file.is_absolute() => config.file.clone(),
        None => {
            return unfit(
                "this configuration has no folder that its path could count from",
                "load it from its file, or give the whole path",
            );
        }
    };
    let failed = |error: std::io::Error| Unfit {
        cause: format!("cannot be read: {error}"),
        help: "its path counts from the folder of this configuration".into(),
    };
    let mut bytes = Vec::new();
    let file = File::open(&path).map_err(failed)?;
    file.take(BYTES_MAX + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    if bytes.len() as u64 > BYTES_MAX {
        return unfit(
            format!("it is larger than {} MiB", BYTES_MAX >> 20),
            "a certificate is smaller; one with a copy of itself as PDF in it is to be issued without",
        );
    }
    String::from_utf8(bytes).or_else(|_| {
        unfit(
            "it is not written in UTF-8",
            "ask the laboratory for it in UTF-8, as DCC has it",
        )
    })
}
