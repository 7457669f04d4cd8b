//! The text of a machine whose calibrations are made with what has certificates.
//!
//! Version 2 or 3 of it and, for each certificate, the hash of its file and the result that is said to be meant. Calibrations that were made before there was one
//! stay good; those that were made with one are foreign with another: it corrects otherwise.

use super::text::Place;
use crate::config::model::MachineConfig;

/// Of `before`, the newest earlier version; `None` where nothing has a certificate.
pub(super) fn text(config: &MachineConfig, before: &str) -> Option<String> {
    let all = config.certificates();
    let hashes = all
        .iter()
        .filter_map(|(key, _, it)| Some((key, &it.certified.as_ref()?.hash, &it.result)));
    let hashes: Vec<_> = hashes.collect();
    if hashes.is_empty() {
        return None;
    }
    let (_, body) = before.split_once('\n')?;
    let mut text = format!("truestage: what a calibration depends on, version 4\n{body}");
    let mut top = Place::top(&mut text);
    for (key, hash, result) in hashes {
        top.say(key, hash);
        // Another result of the same certificate corrects otherwise.
        if let Some(result) = result {
            top.say(&format!("{key}.result"), result);
        }
    }
    Some(text)
}
