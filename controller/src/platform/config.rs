//! `[platform]`: an alignment platform on screws, and its cycle (system S1).

use serde::Deserialize;

/// Which axes push the platform, what sees it, and what is done with it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct PlatformConfig {
    pub camera: String,
    pub exposures: u32,
    pub settle_ms: u32,
    pub speed_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    pub x_max_mm: f64,
    pub y_max_mm: f64,
    pub theta_max_deg: f64,
    pub edge_mm: f64,
    #[serde(default = "condition_max")]
    pub condition_max: f64,
    pub inconsistency_limit_um: Option<f64>,
    pub actuator: Vec<ActuatorConfig>,
    pub zero: PlatformZeroConfig,
    pub calibrate: Option<PlatformCalibrateConfig>,
    pub verify: Option<PlatformVerifyConfig>,
    pub align: Option<AlignConfig>,
    pub compensation: Option<ScrewCompensationConfig>,
}

const fn condition_max() -> f64 {
    compensator::platform::Platform::CONDITION_MAX
}

/// One screw: which axis, and where and which way it pushes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct ActuatorConfig {
    pub axis: String,
    pub point_mm: [f64; 2],
    pub direction: [f64; 2],
    pub lead_mm: f64,
    pub index_mm: f64,
}

/// How the screws get their origin: the index pulse off the negative limit switch.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct PlatformZeroConfig {
    pub search_speed_mm_per_s: f64,
    pub time_limit_s: f64,
    #[serde(default)]
    pub lone_homing: bool,
}

/// How the screws' errors are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScrewMethodName {
    /// Means at the ends and over all.
    Patent,
    /// Least squares over all strokes, with what is periodic in the lead.
    LeastSquares,
}

/// The calibration run: each screw alone, from both sides.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct PlatformCalibrateConfig {
    pub method: ScrewMethodName,
    pub first_mm: f64,
    pub last_mm: f64,
    pub step_mm: f64,
    pub runs: u32,
    pub overrun_mm: f64,
    pub closure_limit_um: f64,
    #[serde(default = "harmonics_max")]
    pub harmonics_max: u32,
    #[serde(default = "significance")]
    pub significance: f64,
}

const fn harmonics_max() -> u32 {
    4
}

const fn significance() -> f64 {
    0.01
}

/// The verification: moves from pose to pose over the whole range, each looked at.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct PlatformVerifyConfig {
    pub poses: u32,
    pub seed: u64,
    pub tolerance_um: f64,
}

/// Moving until the image agrees.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct AlignConfig {
    pub tolerance_um: f64,
    pub iterations_max: u32,
}

/// When lost motion is compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostMotionRule {
    /// As far as it is not taken up, by what is remembered of each screw.
    Engagement,
    /// All of it on each reverse move, as the patent says.
    Patent,
}

/// How a screw's model is applied, and its limits.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct ScrewCompensationConfig {
    pub rule: LostMotionRule,
    pub size_limit_um: f64,
    pub slope_limit: f64,
    pub extrapolation_mm: f64,
    pub lost_motion_max_um: f64,
}
