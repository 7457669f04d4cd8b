//! The text of a machine whose calibrations are made with what has certificates.
//!
//! Version 2 or 3 of it and, for each certificate, the hash of its file. Calibrations that were made before there was one
//! stay good; those that were made with one are foreign with another: it corrects otherwise.

use super::text::Place;
use crate::config::model::MachineConfig;

/// Of `before`, the newest earlier version; `None` where nothing has a certificate.
pub(super) fn text(config: &MachineConfig, before: &str) -> Option<String> {
    let all = config.certificates();
    let hashes = all
        .iter()
        .filter_map(|(key, _, it)| Some((key, &it.certified.as_ref()?.hash)));
    let hashes: Vec<_> = hashes.collect();
    if hashes.is_empty() {
        return None;
    }
    let (_, body) = before.split_once('\n')?;
    let mut text = format!("truestage: what a calibration depends on, version 4\n{body}");
    let mut top = Place::top(&mut text);
    for (key, hash) in hashes {
        top.say(key, hash);
    }
    Some(text)
}
