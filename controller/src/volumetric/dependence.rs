//! What calibrations of three axes depend on: lines of version 2 of that text
//! ([`crate::config::dependence`]). What was published stays as it is.

use crate::config::MachineConfig;
use crate::config::dependence::devices::say_module;
use crate::config::dependence::text::{Place, by_its_word};
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, LayoutName, RollConfig, SpotCameraConfig,
    VolumeAxisName, VolumetricConfig,
};

pub(crate) fn depends(config: &MachineConfig, top: &mut Place<'_>) {
    if let Some(volumetric) = &config.volumetric {
        say_volumetric(top.at("volumetric"), config, volumetric);
    }
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
    // That of one slide was published like this, and is the same in a list.
    match volumetric.roll.each() {
        [roll] => say_roll(place.at("roll"), config, roll),
        _ => {
            for (axis, roll) in ["x", "y", "z"].into_iter().zip(volumetric.rolls()) {
                if let Some(roll) = roll {
                    say_roll(place.at("roll").at(axis), config, roll);
                }
            }
        }
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
    // Where it sits is in the tables that it told, and taken off what it says later; nothing is taken
    // off what the other one says.
    if let Some(slider) = &beam.slider {
        say_detector(place.at("slider"), config, slider);
        place.at("slider").say("place_mm", slider.place_mm);
    }
    if let Some(slider) = &beam.slider_camera {
        say_spot(place.at("slider_camera"), config, slider);
        place.at("slider_camera").say("place_mm", slider.place_mm);
    }
    if let Some(end) = &beam.end {
        say_detector(place.at("end"), config, end);
    }
    if let Some(end) = &beam.end_camera {
        say_spot(place.at("end_camera"), config, end);
    }
}

/// What a camera reads depends on which one it is, and on what turns its numbers into places.
fn say_spot(mut place: Place<'_>, config: &MachineConfig, spot: &SpotCameraConfig) {
    // Its name may change.
    if let Some(camera) = config.camera.get(&spot.camera) {
        let keys = camera.keys();
        place.say("line", &camera.line);
        for (key, said) in camera.teaching() {
            place.say(key, said);
        }
        place.say("length_um_per_unit", keys.length_um_per_unit);
        place.say("rotation_deg", keys.rotation.degrees());
        place.say("mirrored", keys.mirrored);
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

by_its_word! {
    BeamDriftName { Pivoting: "pivoting", Translating: "translating", Mixed: "mixed" }
    LayoutName { Quadrants: "quadrants", Lateral: "lateral" }
    VolumeAxisName { X: "x", Y: "y", Z: "z" }
}
