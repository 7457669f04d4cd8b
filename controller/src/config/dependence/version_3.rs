//! The text of a machine of which a correction is switched off that calibrations need.
//!
//! Version 2 and, for each linear axis and for three axes, what the readings of their instrument are not corrected for. A machine
//! that corrects everything has no such text: its calibrations carry the hash of version 2, and stay good when
//! somebody switches a correction off later; one that was made meanwhile is foreign as soon as it is on again.

use super::text::{Place, quoted};
use super::version_2;
use crate::config::model::MachineConfig;

/// `None` where nothing is switched off.
pub(super) fn text(config: &MachineConfig) -> Option<String> {
    let off = config.axis.iter().filter_map(|(name, axis)| {
        let instrument = &axis.calibrate.as_ref()?.instrument;
        let off = config.instrument.get(instrument)?.switched_off();
        (!off.is_empty()).then_some((name, off))
    });
    let off: Vec<_> = off.collect();
    let of_lines = of_lines(config);
    if off.is_empty() && of_lines.is_empty() {
        return None;
    }
    let before = version_2::text(config);
    let (_, body) = before.split_once('\n')?;
    let mut text = format!("truestage: what a calibration depends on, version 3\n{body}");
    let mut top = Place::top(&mut text);
    for (name, off) in off {
        let off: Vec<String> = off.into_iter().map(|it| it.name.to_owned()).collect();
        top.at("axis")
            .at(quoted(name))
            .at("calibrate")
            .say("uncorrected", off.as_slice());
    }
    if !of_lines.is_empty() {
        let mut volume = top.at("volumetric");
        volume
            .at("calibrate")
            .say("uncorrected", of_lines.as_slice());
    }
    Some(text)
}

/// Of three axes, which are measured as warm as they are.
fn of_lines(config: &MachineConfig) -> Vec<String> {
    let own = config
        .volumetric
        .as_ref()
        .and_then(|it| it.calibrate.as_ref());
    let instrument = own.and_then(|it| config.instrument.get(&it.instrument));
    let off = instrument
        .into_iter()
        .flat_map(|it| it.switched_off_of_lines());
    off.map(|it| it.name.to_owned()).collect()
}
