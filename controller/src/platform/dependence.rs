//! What calibrations of alignment platforms depend on: lines of version 2 of that text
//! ([`crate::config::dependence`]). What was published stays as it is.

use crate::config::MachineConfig;
use crate::config::dependence::text::Place;
use crate::platform::config::ActuatorConfig;

pub(crate) fn depends(config: &MachineConfig, top: &mut Place<'_>) {
    let actuators = config.platform.iter().flat_map(|it| &it.actuator);
    for (number, actuator) in actuators.enumerate() {
        say_actuator(
            top.at("platform").at(format!("actuator[{number}]")),
            actuator,
        );
    }
}

/// Points and directions turn what the camera sees into strokes; the index is their zero.
fn say_actuator(mut place: Place<'_>, actuator: &ActuatorConfig) {
    place.say("axis", &actuator.axis);
    place.say("point_mm", actuator.point_mm);
    place.say("direction", actuator.direction);
    place.say("lead_mm", actuator.lead_mm);
    place.say("index_mm", actuator.index_mm);
}
