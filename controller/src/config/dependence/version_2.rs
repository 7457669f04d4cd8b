//! The text that calibrations carry the hash of since version 2.
//!
//! A key that is optional and absent has no line, and one with a default has the value that it stands
//! for, so that writing a default out changes nothing. A key that a later program adds gets a line
//! only where it says something else than what machines did before there was that key.

use super::text::{Place, Value, quoted};
use crate::config::axis::AxisConfig;
use crate::config::model::MachineConfig;
use crate::hardware::analog::AnalogConfig;
use crate::hardware::drive::DriveConfig;
use crate::hardware::node::IdentityConfig;
use crate::platform::config::ActuatorConfig;
use crate::rotary::{DirectionName, RotaryConfig, RotaryDevice};
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, LayoutName, RollConfig, VolumeAxisName,
    VolumetricConfig,
};

pub(super) fn text(config: &MachineConfig) -> String {
    let mut text = String::from("truestage: what a calibration depends on, version 2\n");
    let mut top = Place::top(&mut text);
    top.at("machine")
        .say("stage_serial", &config.machine.stage_serial);
    for (name, axis) in &config.axis {
        say_axis(top.at("axis").at(quoted(name)), axis);
    }
    for (name, rotary) in &config.rotary {
        say_rotary(top.at("rotary").at(quoted(name)), rotary);
    }
    let actuators = config.platform.iter().flat_map(|it| &it.actuator);
    for (number, actuator) in actuators.enumerate() {
        say_actuator(
            top.at("platform").at(format!("actuator[{number}]")),
            actuator,
        );
    }
    if let Some(volumetric) = &config.volumetric {
        say_volumetric(top.at("volumetric"), config, volumetric);
    }
    text
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

fn say_identity(mut place: Place<'_>, identity: &IdentityConfig) {
    place.say("device_type", identity.device_type);
    place.say("vendor_id", identity.vendor_id);
    place.say("product_code", identity.product_code);
    place.say("revision", identity.revision);
    place.say("serial_number", identity.serial_number);
}

fn say_rotary(mut place: Place<'_>, rotary: &RotaryConfig) {
    place.say("device", rotary.device);
    place.say("node_id", rotary.node.node_id);
    place.say("counts_per_turn", rotary.counts_per_turn);
    place.say("reverse", rotary.reverse);
    say_identity(place.at("identity"), &rotary.node.identity);
    if let Some(zero) = &rotary.zero {
        let mut place = place.at("zero");
        place.say("index_direction", zero.index_direction);
        place.say("index_deg", zero.index_deg);
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

/// Tables and references of three axes hold for the same axes in the same order, the same zero, and
/// detectors that are wired and read in the same way.
fn say_volumetric(mut place: Place<'_>, config: &MachineConfig, volumetric: &VolumetricConfig) {
    place.say("axes", &volumetric.axes);
    place.say("chain", &volumetric.chain);
    place.at("zero").say("index_mm", volumetric.zero.index_mm);
    for (axis, beam) in ["x", "y", "z"].into_iter().zip(volumetric.beam.each()) {
        if let Some(beam) = beam {
            say_beam(place.at("beam").at(axis), config, beam);
        }
    }
    if let Some(roll) = &volumetric.roll {
        say_roll(place.at("roll"), config, roll);
    }
    for (number, thermometer) in volumetric.temperature.iter().enumerate() {
        let mut place = place.at(format!("temperature[{number}]"));
        say_module(place.at("analog"), config, &thermometer.analog);
        place.say("channel", thermometer.channel);
    }
}

fn say_beam(mut place: Place<'_>, config: &MachineConfig, beam: &BeamConfig) {
    place.say("drift", beam.drift);
    place.say("source_mm", beam.source_mm);
    place.say("end_mm", beam.end_mm);
    place.say("translation_share", beam.translation_share);
    say_detector(place.at("slider"), config, &beam.slider);
    // Where it sits is in the tables that it told, and taken off what it says later; nothing is taken
    // off what the other one says.
    place.at("slider").say("place_mm", beam.slider.place_mm);
    if let Some(end) = &beam.end {
        say_detector(place.at("end"), config, end);
    }
}

fn say_detector(mut place: Place<'_>, config: &MachineConfig, detector: &BeamDetectorConfig) {
    say_module(place.at("analog"), config, &detector.analog);
    place.say("channels", detector.channels);
    place.say("layout", detector.layout);
    place.say("dark_mv", detector.dark_mv);
    place.say("gain", detector.gain);
    place.say("um_per_one", detector.um_per_one);
    for (number, point) in detector.curve.iter().enumerate() {
        let mut place = place.at(format!("curve[{number}]"));
        place.say("ratio", point.ratio);
        place.say("first_um", point.first_um);
        place.say("second_um", point.second_um);
    }
}

fn say_roll(mut place: Place<'_>, config: &MachineConfig, roll: &RollConfig) {
    place.say("axis", roll.axis);
    say_module(place.at("analog"), config, &roll.analog);
    place.say("channels", roll.channels);
    place.say("mm_per_v", roll.mm_per_v);
    place.say("height_mm", roll.height_mm);
    place.say("base_mm", roll.base_mm);
    place.say("inclination_deg", roll.inclination_deg);
}

/// Which module a name stands for: where it is, and who it must be. The name itself may change.
fn say_module(mut place: Place<'_>, config: &MachineConfig, name: &str) {
    let module: Option<&AnalogConfig> = config.analog.get(name);
    let Some(module) = module else { return };
    let node = module.node();
    place.say("bus", node.map(|it| &it.bus));
    place.say("node_id", node.map(|it| it.node_id));
    place.say("line", node.is_none().then(|| module.port().to_owned()));
    place.say("address", module.address());
    if let Some(node) = node {
        say_identity(place.at("identity"), &node.identity);
    }
}

/// Words of the configuration file. They are written out here: a word that changes there must not
/// change here.
macro_rules! by_its_word {
    ($($name:ty { $($variant:ident: $word:literal),* })*) => {$(
        impl Value for $name {
            fn written(&self) -> Option<String> {
                let word = match self {
                    $(Self::$variant => $word,)*
                };
                word.written()
            }
        }
    )*};
}

by_its_word! {
    RotaryDevice { Cia402: "cia402" }
    DirectionName { Forward: "forward", Reverse: "reverse" }
    BeamDriftName { Pivoting: "pivoting", Translating: "translating", Mixed: "mixed" }
    LayoutName { Quadrants: "quadrants", Lateral: "lateral" }
    VolumeAxisName { X: "x", Y: "y", Z: "z" }
}
