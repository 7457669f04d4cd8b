//! `[volumetric]`: three linear axes whose errors are corrected throughout the work volume while
//! the machine works (system S4). Each key's suffix is its unit.

use compensator::volumetric::Axis;
use machine::records::CertificateRecord;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::certificate::{CertificateConfig, Measurand, Named};

mod detectors;
mod one_or_more;

pub(crate) use detectors::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, BeamsConfig, CurvePointConfig, DetectorConfig,
    LayoutName, PICTURE_PERIODS_MAX, RollConfig, SpotCameraConfig, TemperatureConfig,
};
pub(crate) use one_or_more::OneOrMore;
#[cfg(test)]
pub(crate) use one_or_more::tests::with_three_rolls;

/// Three axes corrected throughout their volume (system S4).
///
/// Three linear axes at right angles that carry a tool and a workpiece against each other. Their
/// errors, and what detectors see of them now, become part of every set-point: each axis needs a
/// section `cyclic`, whose `correction_limit_um` and `correction_rate_um_per_s` are at least the
/// limits below, and no `compensation` of its own. The period is the bus's `sync_period_ms`. Lists
/// of three are for x, y and z.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricConfig {
    /// Which axis moves along x, y and z.
    #[schemars(extend("x-range" = "an `[axis.NAME]` each"))]
    pub axes: [String; 3],
    /// Which slide stands on which, from the workpiece to the tool; F is the foundation. `"FXYZ"`:
    /// the tool does everything; `"XFYZ"`: x carries the workpiece.
    #[schemars(extend("x-range" = "each of X, Y, Z, F once"))]
    #[schemars(extend("x-own" = true))]
    pub chain: String,
    /// The lowest corner of the work volume.
    #[schemars(extend("x-range" = "below `high_mm`; with `size_limit_um` within the soft limits"))]
    #[schemars(extend("x-own" = true))]
    pub low_mm: [f64; 3],
    /// The highest corner.
    #[schemars(extend("x-own" = true))]
    pub high_mm: [f64; 3],
    /// From the machine's zero to the tool point with all axes at 0.
    #[schemars(extend("x-range" = "up to `tool_max_mm`"))]
    #[schemars(extend("x-own" = true))]
    pub tool_offset_mm: [f64; 3],
    /// Longest component of any tool: the correction is proven for tools up to it.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub tool_max_mm: f64,
    /// Where the scales are held: they expand from here.
    #[serde(default)]
    #[schemars(extend("x-magnitude" = [0.0, 1e5]))]
    pub expansion_fixed_mm: [f64; 3],
    /// How the axes get their origin.
    pub zero: VolumetricZeroConfig,
    /// The reference beams, of the axes that have one.
    #[serde(default)]
    pub beam: BeamsConfig,
    /// Two detectors that see one slide roll; a list, `[[volumetric.roll]]`, where several slides have two.
    #[serde(default)]
    pub roll: OneOrMore<RollConfig>,
    /// Thermometers, and what warmth does; counted from 0 in their order.
    #[serde(default)]
    pub temperature: Vec<TemperatureConfig>,
    /// Guides that bend as they are warmer on one side.
    #[serde(default)]
    pub bend: Vec<BendConfig>,
    /// How much of a displacement appears at the tool.
    #[serde(default)]
    pub influence: Vec<InfluenceConfig>,
    /// How values of detectors come into the correction and leave it; needed with any detector.
    pub feed: Option<FeedConfig>,
    /// How it is found out what the detectors read when the machine is as its tables say; needed by
    /// `reference` and `calibrate`.
    pub reference: Option<ReferenceConfig>,
    /// Lines of an interferometer that tell the errors; needed by `calibrate` and `verify`.
    pub calibrate: Option<VolumetricCalibrateConfig>,
    /// A line that is read with the correction on.
    pub verify: Option<VolumetricVerifyConfig>,
    /// How the errors are compensated, and the limits.
    pub compensation: VolumetricCompensationConfig,
}

/// How the keys of the certificates of thermometers begin.
pub(crate) const THERMOMETERS: &str = "volumetric.";

/// Where the certificate of a thermometer stands in the file.
fn of_thermometer(at: usize) -> String {
    format!("volumetric.temperature.{at}.certificate")
}

impl VolumetricConfig {
    /// Between how many stretches along `axis` its errors have nodes, where these are so far apart at most.
    pub(super) fn stretches(&self, axis: Axis, step_mm: f64) -> u32 {
        let span = self.high_mm[axis.index()] - self.low_mm[axis.index()];
        (span / step_mm).ceil().max(2.0) as u32
    }

    /// The roll detectors of x, y and z.
    pub fn rolls(&self) -> [Option<&RollConfig>; 3] {
        let axes = [VolumeAxisName::X, VolumeAxisName::Y, VolumeAxisName::Z];
        axes.map(|axis| self.roll.each().iter().find(|it| it.axis == axis))
    }

    /// The certificates of its thermometers, to be read.
    pub(crate) fn certificates_mut(&mut self) -> impl Iterator<Item = Named<'_>> {
        let each = self.temperature.iter_mut().enumerate();
        each.filter_map(|(at, it)| {
            Some(Named {
                key: of_thermometer(at),
                measurand: Measurand::Temperature,
                config: it.certificate.as_mut()?,
            })
        })
    }

    /// The same by their keys, once they have been read.
    pub(crate) fn certificates(
        &self,
    ) -> impl Iterator<Item = (String, Measurand, &CertificateConfig)> {
        let each = self.temperature.iter().enumerate();
        each.filter_map(|(at, it)| {
            let own = it.certificate.as_ref()?;
            Some((of_thermometer(at), Measurand::Temperature, own))
        })
    }

    /// What records say of them.
    pub(crate) fn certificate_records(&self) -> Vec<CertificateRecord> {
        let each = self.temperature.iter().enumerate();
        let records = each.filter_map(|(at, it)| {
            let certified = it.certified()?;
            Some(certified.record(&format!("temperature {at}")))
        });
        records.collect()
    }

    /// The cameras that see beams.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = &SpotCameraConfig> {
        let beams = self.beam.each().into_iter().flatten();
        beams.flat_map(BeamConfig::cameras)
    }
}

/// One of the three directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum VolumeAxisName {
    X,
    Y,
    Z,
}

/// How the three axes get their origin: the first index pulse off each negative limit switch
/// (method 1).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricZeroConfig {
    /// One after the other; that which clears the workpiece first.
    #[schemars(extend("x-range" = "each once"))]
    #[schemars(extend("x-own" = true))]
    pub order: [VolumeAxisName; 3],
    /// How fast the limit switch is sought.
    #[schemars(range(min = 0.001), extend("x-range" = "at most `speed_max_mm_per_s` of each axis"))]
    #[schemars(extend("x-own" = true))]
    pub search_speed_mm_per_s: f64,
    /// For one axis.
    #[schemars(range(min = 0.1, max = 100000.0))]
    pub time_limit_s: f64,
    /// The coordinates of these pulses; the axes are left there.
    #[schemars(extend("x-range" = "within the soft limits"))]
    #[schemars(extend("x-own" = true))]
    pub index_mm: [f64; 3],
}

/// A guide that bends to an arc as it is warmer over its neutral plane than under it.
///
/// Its slide tilts along, which no detector sees. By how much per kelvin is found by `calibrate` at
/// two warmths (`--warm-up-min`); without, it stays uncorrected, which result and record say.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BendConfig {
    /// Whose guide.
    pub axis: VolumeAxisName,
    /// The direction across it to which it bends.
    #[schemars(extend("x-range" = "another"))]
    pub towards: VolumeAxisName,
    /// The `[[volumetric.temperature]]` over the neutral plane, counted from 0.
    #[schemars(extend("x-range" = "a thermometer"))]
    pub over: usize,
    /// The one under it; without it `over` alone counts.
    #[schemars(extend("x-range" = "another"))]
    pub under: Option<usize>,
    /// Where the arc begins on its chord.
    #[schemars(extend("x-range" = "below `high_mm`"))]
    pub low_mm: f64,
    /// Where it ends.
    pub high_mm: f64,
    /// The largest difference it is known for; beyond it nothing is corrected.
    #[schemars(range(min = 0.001, max = 100.0))]
    pub gradient_max_k: f64,
}

/// How much of a displacement appears at the tool.
///
/// Its part at the tool is the product of the functions given, 1 without.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InfluenceConfig {
    /// The displacement of this slide ...
    pub axis: VolumeAxisName,
    /// ... in this direction is meant.
    #[schemars(extend("x-range" = "another"))]
    pub direction: VolumeAxisName,
    /// Along which axis its part at the tool changes.
    pub along: VolumeAxisName,
    /// Places along that axis.
    #[schemars(extend("x-range" = "two or more, increasing"))]
    pub position_mm: Vec<f64>,
    /// The part of the displacement that appears at the tool there, straight lines between them.
    #[schemars(extend("x-range" = "as many as `position_mm`"))]
    pub factor: Vec<f64>,
}

/// What is done about a detector in trouble.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReactionName {
    /// Its last good value stays.
    Hold,
    /// It fades to nothing over `fade_out_s`.
    FadeOut,
    /// It stays, and the machine stops.
    Stop,
}

/// How the detectors' values come into the correction and leave it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedConfig {
    /// How long trouble is borne; the last good value stays.
    #[schemars(range(min = 0.0, max = 600000.0))]
    pub patience_ms: f64,
    /// What is done then.
    pub reaction: ReactionName,
    /// How long fading takes.
    #[schemars(range(min = 0.0, max = 3600.0), extend("x-range" = "with `fade_out`, only then"))]
    pub fade_out_s: Option<f64>,
    /// How long the way to a detector that comes (back) takes.
    #[schemars(range(min = 0.0, max = 3600.0))]
    pub blend_s: f64,
    /// Good samples in a row, of a camera pictures, before it is believed.
    #[schemars(range(min = 1, max = 1000000))]
    pub confirm: u32,
    /// Time constant against noise.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 3600.0))]
    pub smoothing_s: f64,
}

/// How it is found out what the detectors read when the machine is as its tables say.
///
/// Each axis with a beam or roll detectors stops along the work volume.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceConfig {
    /// From stop to stop at most; both ends are stops, and with `calibrate` all nodes of the error
    /// functions.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub step_mm: f64,
    /// Samples of each detector that are averaged at a stop.
    #[schemars(range(min = 1, max = 10000))]
    pub samples: u32,
    /// How far a thermometer, or the difference across a guide that bends, may be from what it was
    /// when the errors were measured; beyond it `reference` refuses.
    #[schemars(range(min = 0.001, max = 100.0))]
    pub warmth_tolerance_k: Option<f64>,
}

/// How lines are read to learn the errors of three axes.
///
/// Readings that scatter about the errors found more than twice as much as is stated of them are
/// refused, with the worst line and place; of nine spare readings and fewer, those that scatter
/// more than one of 30 000 sound calibrations does. Ten spare readings of a sound machine exceed
/// the limit once in 60 000 times, thirty and more never. With straight lines or monotone cubics as
/// `interpolation` the readings are judged by splines all the same: what such curves cannot draw
/// makes the errors less certain, and is no fault of the readings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricCalibrateConfig {
    /// What reads the lines; it needs the optics' factors.
    #[schemars(extend("x-range" = "an `[instrument.NAME]`"))]
    pub instrument: String,
    /// Between the nodes of the error functions, at most; the ends are nodes. Nodes too far apart
    /// for errors that change fast leave readings that nothing explains: they are refused as
    /// scatter.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub step_mm: f64,
    /// How long the machine stands before it is read.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub settle_ms: f64,
    /// Readings of the instrument that are averaged.
    #[schemars(range(min = 1, max = 100000))]
    pub average_samples: u32,
    /// Samples of the machine's detectors at each reading.
    #[schemars(range(min = 1, max = 10000))]
    pub detector_samples: u32,
    /// `calibrate --resume`: by how much what the detectors see now beyond the references of the
    /// interrupted run may differ along an axis.
    #[serde(default = "resume_limit_um")]
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub resume_limit_um: f64,
    /// A second place of the target, where a roll that nothing reads acts on a lever.
    #[schemars(extend("x-range" = "up to `tool_max_mm`"))]
    pub second_tool_offset_mm: Option<[f64; 3]>,
}

/// What a calibration that is continued may find changed along an axis.
const fn resume_limit_um() -> f64 {
    10.0
}

/// A line that is read with the correction on.
///
/// Choose one that no calibration uses: neither along an axis nor a diagonal of the whole volume.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricVerifyConfig {
    /// One end of it.
    #[schemars(extend("x-range" = "within the work volume"))]
    pub from_mm: [f64; 3],
    /// The other end.
    #[schemars(extend("x-range" = "within the work volume"))]
    pub to_mm: [f64; 3],
    /// Places on it, ends included.
    #[schemars(range(min = 2, max = 10000))]
    pub points: u32,
    /// Deviations along the line beyond are out of tolerance.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub limit_um: f64,
}

/// How an error function is drawn between its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShapeName {
    /// Straight lines.
    Linear,
    /// Cubics without overshoot.
    MonotoneCubic,
    /// The cubic spline with continuous curvature.
    Spline,
}

/// How the errors of three axes are compensated, and the limits.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumetricCompensationConfig {
    /// Between the nodes of the error functions.
    pub interpolation: ShapeName,
    /// Largest deviation corrected, along each axis.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub size_limit_um: f64,
    /// Largest change of the deviation per way that may be proven possible.
    #[schemars(range(min = 1e-09, max = 0.5))]
    pub slope_limit: f64,
    /// Fastest change of the correction. Error functions so steep that the axes'
    /// `speed_max_mm_per_s` could ask for more are refused.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub rate_limit_um_per_s: f64,
    /// Largest displacement that a detector may report.
    #[schemars(range(min = 0.0), extend("x-range" = "at most `size_limit_um`"))]
    pub displacement_max_um: f64,
}
