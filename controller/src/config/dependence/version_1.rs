//! The text whose hash calibrations of the first programs carry.
//!
//! Those programs let the compiler write it (`{:?}` of their own types). The names that these had then
//! stand here as words, so that nobody changes the text by renaming something; numbers and lists of
//! numbers are written by the standard library. Nothing is ever added: what version 1 did not know, its
//! calibrations do not depend on.

use core::fmt::{Debug, Formatter, Result};

use crate::config::axis::AxisConfig;
use crate::config::model::MachineConfig;
use crate::hardware::drive::DriveConfig;
use crate::hardware::node::IdentityConfig;
use crate::rotary::{DirectionName, RotaryConfig};
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, CurvePointConfig, LayoutName, RollConfig,
    VolumeAxisName, VolumetricConfig,
};

pub(super) fn text(config: &MachineConfig) -> String {
    let axes: Vec<_> = config
        .axis
        .iter()
        .map(|(name, it)| axis(name, it))
        .collect();
    let mut text = format!("1 {} {}", config.machine.stage_serial, axes.join("\n"));
    for (name, it) in &config.rotary {
        text += &rotary(name, it);
    }
    for it in config.platform.iter().flat_map(|it| &it.actuator) {
        let place = (it.point_mm, it.direction, it.lead_mm, it.index_mm);
        text += &format!("\n{} {place:?}", it.axis);
    }
    if let Some(it) = &config.volumetric {
        text += &volumetric(config, it);
    }
    text
}

fn axis(name: &str, axis: &AxisConfig) -> String {
    let zero = axis.zero.as_ref();
    let zero = zero.map(|zero| (&zero.analog, zero.level_below_peak_v));
    let resolution_nm = axis.motion.resolution_nm;
    match &axis.drive {
        DriveConfig::Cia402(drive) => {
            let (node_id, identity) = (drive.node.node_id, Identity(&drive.node.identity));
            format!("{name} Cia402 {node_id} {resolution_nm} {identity:?} {zero:?}")
        }
        DriveConfig::Copley(drive) => {
            let device = Word("Copley");
            let address = Some(drive.address);
            let amplifier = drive.amplifier.as_ref().map(|it| Amplifier {
                model: it.model.as_deref(),
                serial_number: it.serial_number,
            });
            format!("{name} {device:?} {address:?} {resolution_nm} {amplifier:?} {zero:?}")
        }
    }
}

fn rotary(name: &str, rotary: &RotaryConfig) -> String {
    let zero = rotary.zero.as_ref().map(|zero| {
        let direction = Word(match zero.index_direction {
            DirectionName::Forward => "Forward",
            DirectionName::Reverse => "Reverse",
        });
        (direction, zero.index_deg)
    });
    let (node_id, counts, reverse) = (rotary.node.node_id, rotary.counts_per_turn, rotary.reverse);
    let identity = Identity(&rotary.node.identity);
    format!("\nrotary {name} Cia402 {node_id} {counts} {reverse} {identity:?} {zero:?}")
}

fn volumetric(config: &MachineConfig, volumetric: &VolumetricConfig) -> String {
    let (axes, chain, index_mm) = (
        &volumetric.axes,
        &volumetric.chain,
        volumetric.zero.index_mm,
    );
    let mut text = format!("\nvolumetric {axes:?} {chain} {index_mm:?}");
    for it in volumetric.beam.each() {
        text += &it.map_or_else(|| "\nno beam".into(), |it| beam(config, it));
    }
    for it in volumetric.rolls().into_iter().flatten() {
        text += &roll(config, it);
    }
    for it in &volumetric.temperature {
        let wired = (module(config, &it.analog), it.channel);
        text += &format!("\ntemperature {wired:?}");
    }
    text
}

fn beam(config: &MachineConfig, beam: &BeamConfig) -> String {
    let drift = Word(match beam.drift {
        BeamDriftName::Pivoting => "Pivoting",
        BeamDriftName::Translating => "Translating",
        BeamDriftName::Mixed => "Mixed",
    });
    let drift = (drift, beam.source_mm, beam.end_mm, beam.translation_share);
    // Cameras came with version 2: nothing of this version belongs to a machine that has one.
    let of = |it: &Option<BeamDetectorConfig>| it.as_ref().map(|it| detector(config, it));
    let (slider, end) = (of(&beam.slider).unwrap_or_default(), of(&beam.end));
    let place_mm = beam.on_the_slide().map_or([0.0; 3], |it| it.place_mm());
    format!("\nbeam {drift:?} {slider} {place_mm:?} {end:?}")
}

fn detector(config: &MachineConfig, detector: &BeamDetectorConfig) -> String {
    let layout = Word(match detector.layout {
        LayoutName::Quadrants => "Quadrants",
        LayoutName::Lateral => "Lateral",
    });
    let wired = (module(config, &detector.analog), &detector.channels, layout);
    let curve: Vec<_> = detector.curve.iter().map(CurvePoint).collect();
    let read = (detector.dark_mv, detector.gain, detector.um_per_one, &curve);
    format!("{wired:?} {read:?}")
}

fn roll(config: &MachineConfig, roll: &RollConfig) -> String {
    let axis = Word(match roll.axis {
        VolumeAxisName::X => "X",
        VolumeAxisName::Y => "Y",
        VolumeAxisName::Z => "Z",
    });
    let module = module(config, &roll.analog);
    let wired = (axis, module, roll.channels, roll.mm_per_v);
    let optics = (roll.height_mm, roll.base_mm, roll.inclination_deg);
    format!("\nroll {wired:?} {optics:?}")
}

fn module<'a>(config: &'a MachineConfig, name: &str) -> impl Debug + use<'a> {
    let analog = config.analog.get(name);
    analog.map(|it| {
        let node = it.node();
        let (bus, node_id) = (node.map(|it| &it.bus), node.map(|it| it.node_id));
        (bus, node_id, node.map(|it| Identity(&it.identity)))
    })
}

/// A word without quotes.
struct Word(&'static str);

impl Debug for Word {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(self.0)
    }
}

struct Identity<'a>(&'a IdentityConfig);

impl Debug for Identity<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.debug_struct("IdentityConfig")
            .field("device_type", &self.0.device_type)
            .field("vendor_id", &self.0.vendor_id)
            .field("product_code", &self.0.product_code)
            .field("revision", &self.0.revision)
            .field("serial_number", &self.0.serial_number)
            .finish()
    }
}

struct Amplifier<'a> {
    model: Option<&'a str>,
    serial_number: Option<u32>,
}

impl Debug for Amplifier<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.debug_struct("AmplifierConfig")
            .field("model", &self.model)
            .field("serial_number", &self.serial_number)
            .finish()
    }
}

struct CurvePoint<'a>(&'a CurvePointConfig);

impl Debug for CurvePoint<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.debug_struct("CurvePointConfig")
            .field("ratio", &self.0.ratio)
            .field("first_um", &self.0.first_um)
            .field("second_um", &self.0.second_um)
            .finish()
    }
}
