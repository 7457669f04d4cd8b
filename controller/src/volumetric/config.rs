//! `[volumetric]`: three linear axes whose errors are corrected throughout the work volume while
//! the machine works (system S4). Each key's suffix is its unit.

use core::num::NonZeroU32;

use serde::Deserialize;

/// Which axes make the volume, what watches them, and what is done with it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VolumetricConfig {
    pub axes: [String; 3],
    pub chain: String,
    pub low_mm: [f64; 3],
    pub high_mm: [f64; 3],
    pub tool_offset_mm: [f64; 3],
    pub tool_max_mm: f64,
    #[serde(default)]
    pub expansion_fixed_mm: [f64; 3],
    pub zero: VolumetricZeroConfig,
    #[serde(default)]
    pub beam: BeamsConfig,
    pub roll: Option<RollConfig>,
    #[serde(default)]
    pub temperature: Vec<TemperatureConfig>,
    #[serde(default)]
    pub bend: Vec<BendConfig>,
    #[serde(default)]
    pub influence: Vec<InfluenceConfig>,
    pub feed: Option<FeedConfig>,
    pub reference: Option<ReferenceConfig>,
    pub calibrate: Option<VolumetricCalibrateConfig>,
    pub verify: Option<VolumetricVerifyConfig>,
    pub compensation: VolumetricCompensationConfig,
}

/// One of the three directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum VolumeAxisName {
    X,
    Y,
    Z,
}

/// How the axes get their origin: the index pulse off the negative limit switch.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VolumetricZeroConfig {
    pub order: [VolumeAxisName; 3],
    pub search_speed_mm_per_s: f64,
    pub time_limit_s: f64,
    pub index_mm: [f64; 3],
}

/// The reference beams, of the axes that have one.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct BeamsConfig {
    pub x: Option<BeamConfig>,
    pub y: Option<BeamConfig>,
    pub z: Option<BeamConfig>,
}

impl BeamsConfig {
    /// In the order x, y, z.
    pub fn each(&self) -> [Option<&BeamConfig>; 3] {
        [&self.x, &self.y, &self.z].map(Option::as_ref)
    }
}

/// How a beam moves when it moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamDriftName {
    /// Its source stays, its direction changes.
    Pivoting,
    /// Its direction stays, its source moves.
    Translating,
    /// Both, in a share that is known.
    Mixed,
}

/// One reference beam and what sees it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct BeamConfig {
    pub drift: BeamDriftName,
    pub source_mm: Option<f64>,
    pub end_mm: Option<f64>,
    pub translation_share: Option<f64>,
    pub standard_uncertainty_um: Option<f64>,
    pub slider: BeamDetectorConfig,
    pub end: Option<BeamDetectorConfig>,
}

/// How four channels belong to two directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LayoutName {
    /// Quadrants (+, +), (−, +), (−, −), (+, −).
    Quadrants,
    /// Electrodes first +, first −, second +, second −.
    Lateral,
}

/// A detector of four channels.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct BeamDetectorConfig {
    pub analog: String,
    pub channels: [u8; 4],
    #[serde(default)]
    pub place_mm: [f64; 3],
    pub layout: LayoutName,
    #[serde(default)]
    pub dark_mv: [f64; 4],
    #[serde(default = "equal")]
    pub gain: [f64; 4],
    pub um_per_one: Option<[f64; 2]>,
    pub ratio_max: Option<f64>,
    #[serde(default)]
    pub curve: Vec<CurvePointConfig>,
    pub saturation_v: f64,
    pub intensity_min_v: f64,
    pub intensity_max_v: f64,
    pub age_max_ms: f64,
    pub speed_max_um_per_s: f64,
    pub noise_max_um: f64,
    pub stuck_samples: Option<NonZeroU32>,
}

const fn equal() -> [f64; 4] {
    [1.0; 4]
}

/// A calibrated ratio, with its place in both directions.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct CurvePointConfig {
    pub ratio: f64,
    pub first_um: f64,
    pub second_um: f64,
}

/// Two detectors that see one slider roll.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct RollConfig {
    pub axis: VolumeAxisName,
    pub analog: String,
    pub channels: [u8; 2],
    pub mm_per_v: [f64; 2],
    pub height_mm: f64,
    pub base_mm: f64,
    pub inclination_deg: f64,
    pub roll_max_arcsec: f64,
    pub standard_uncertainty_arcsec: Option<f64>,
    pub age_max_ms: f64,
    pub speed_max_arcsec_per_s: f64,
    pub noise_max_arcsec: f64,
    pub stuck_samples: Option<NonZeroU32>,
}

/// A thermometer, and what its temperature does to the machine.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct TemperatureConfig {
    pub analog: String,
    pub channel: u8,
    pub low_c: f64,
    pub high_c: f64,
    pub rate_max_k_per_min: f64,
    pub noise_max_k: f64,
    pub age_max_ms: f64,
    pub stuck_samples: Option<NonZeroU32>,
    pub standard_uncertainty_k: f64,
    #[serde(default)]
    pub expansion_ppm_per_k: [f64; 3],
    #[serde(default)]
    pub growth_um_per_k: [f64; 3],
    #[serde(default)]
    pub squareness_arcsec_per_k: [f64; 3],
}

/// A guide that bends when it is warmer over its neutral plane than under it; by how much is found
/// by calibration.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct BendConfig {
    pub axis: VolumeAxisName,
    pub towards: VolumeAxisName,
    pub over: usize,
    pub under: Option<usize>,
    pub low_mm: f64,
    pub high_mm: f64,
    pub gradient_max_k: f64,
}

/// How much of a displacement appears as an error at the tool, as a function of one position.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct InfluenceConfig {
    pub axis: VolumeAxisName,
    pub direction: VolumeAxisName,
    pub along: VolumeAxisName,
    pub position_mm: Vec<f64>,
    pub factor: Vec<f64>,
}

/// What is done about a detector in trouble.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
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
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct FeedConfig {
    pub patience_ms: f64,
    pub reaction: ReactionName,
    pub fade_out_s: Option<f64>,
    pub blend_s: f64,
    pub confirm: u32,
    #[serde(default)]
    pub smoothing_s: f64,
}

/// How it is found out what the detectors read when the machine is as its tables say.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct ReferenceConfig {
    pub step_mm: f64,
    pub samples: u32,
    pub warmth_tolerance_k: Option<f64>,
}

/// How lines are read to learn the errors.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VolumetricCalibrateConfig {
    pub instrument: String,
    pub step_mm: f64,
    pub settle_ms: f64,
    pub average_samples: u32,
    pub detector_samples: u32,
    #[serde(default = "resume_limit_um")]
    pub resume_limit_um: f64,
    pub second_tool_offset_mm: Option<[f64; 3]>,
}

/// What a calibration that is continued may find changed along an axis.
const fn resume_limit_um() -> f64 {
    10.0
}

/// Which line is read to judge the correction.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VolumetricVerifyConfig {
    pub from_mm: [f64; 3],
    pub to_mm: [f64; 3],
    pub points: u32,
    pub limit_um: f64,
}

/// How an error function is drawn between its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeName {
    /// Straight lines.
    Linear,
    /// Cubics without overshoot.
    MonotoneCubic,
    /// The cubic spline with continuous curvature.
    Spline,
}

/// How the errors are compensated, and the limits.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct VolumetricCompensationConfig {
    pub interpolation: ShapeName,
    pub size_limit_um: f64,
    pub slope_limit: f64,
    pub rate_limit_um_per_s: f64,
    pub displacement_max_um: f64,
}
