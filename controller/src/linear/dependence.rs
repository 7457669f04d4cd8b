//! What calibrations of linear axes depend on: lines of version 2 of that text
//! ([`crate::config::dependence`]). What was published stays as it is.

use crate::config::{AxisConfig, MachineConfig};

use crate::config::dependence::devices::say_identity;
use crate::config::dependence::text::{Place, quoted};
use crate::hardware::drive::DriveConfig;

pub(crate) fn depends(config: &MachineConfig, top: &mut Place<'_>) {
    for (name, axis) in &config.axis {
        say_axis(top.at("axis").at(quoted(name)), axis);
    }
}

fn say_axis(mut place: Place<'_>, axis: &AxisConfig) {
    let (device, amplifier) = match &axis.drive {
        DriveConfig::Cia402(_) => ("cia402", None),
        DriveConfig::Copley(drive) => ("copley", drive.amplifier.as_ref()),
    };
    let node = axis.node();
    place.say("device", device);
    place.say("node_id", node.map(|it| it.node_id));
    place.say("address", axis.address());
    place.say("resolution_nm", axis.motion.resolution_nm);
    if let Some(node) = node {
        say_identity(place.at("identity"), &node.identity);
    }
    if let Some(amplifier) = amplifier {
        let mut place = place.at("amplifier");
        place.say("model", &amplifier.model);
        place.say("serial_number", amplifier.serial_number);
    }
    if let Some(zero) = &axis.zero {
        let mut place = place.at("zero");
        place.say("analog", &zero.analog);
        place.say("level_below_peak_v", zero.level_below_peak_v);
    }
}
