//! The text that calibrations carry the hash of since version 2.
//!
//! A key that is optional and absent has no line, and one with a default has the value that it stands
//! for, so that writing a default out changes nothing. A key that a later program adds gets a line
//! only where it says something else than what machines did before there was that key.

use super::text::Place;
use crate::config::model::MachineConfig;
use crate::kinds::KINDS;

/// Of the machine, then of each kind in the order of their list; a kind that a machine has nothing of
/// says nothing.
pub(super) fn text(config: &MachineConfig) -> String {
    let mut text = String::from("truestage: what a calibration depends on, version 2\n");
    let mut top = Place::top(&mut text);
    top.at("machine")
        .say("stage_serial", &config.machine.stage_serial);
    for kind in KINDS {
        (kind.depends)(config, &mut top);
    }
    text
}
