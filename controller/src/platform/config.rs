//! `[platform]`: an alignment platform on screws, and its cycle (system S1).

use schemars::JsonSchema;
use serde::Deserialize;
use units::Metres;

/// What a pose is made of, as targets are named.
pub(crate) const PARTS: [&str; 3] = ["x", "y", "theta"];

/// An alignment platform on screws (system S1).
///
/// Three or four axes that move one body in x, y and angle. Its cycle is that of the verbs `zero`,
/// `calibrate`, `verify` and `move`; its axes need no `zero`, `calibrate`, `verify` or
/// `compensation` of their own. Poses are counted from where all screws stand at their zero,
/// reached forward.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatformConfig {
    /// What sees the pose.
    #[schemars(extend("x-range" = "a `[camera.NAME]`"))]
    pub camera: String,
    /// Pictures averaged for each pose; eight times as many for the zero.
    #[schemars(range(min = 1, max = 1000))]
    pub exposures: u32,
    /// How long all screws stand before a picture.
    pub settle_ms: u32,
    /// Of the screw with the longest way; the others are slower, so that all arrive together. No screw goes faster than
    /// `speed_mm_per_s` of the slowest axis either.
    #[schemars(range(min = 0.001, max = 1000.0), extend("x-range" = "at most the axes'"))]
    #[schemars(extend("x-own" = true))]
    pub speed_mm_per_s: f64,
    /// Likewise.
    #[schemars(range(min = 0.01, max = 1000000.0), extend("x-range" = "at most the axes'"))]
    #[schemars(extend("x-own" = true))]
    pub acceleration_mm_per_s2: f64,
    /// The work range along x, to both sides; refused when the screws do not reach its corners.
    #[schemars(range(min = 0.0, max = 1000.0))]
    #[schemars(extend("x-own" = true))]
    pub x_max_mm: f64,
    /// Along y.
    #[schemars(range(min = 0.0, max = 1000.0))]
    #[schemars(extend("x-own" = true))]
    pub y_max_mm: f64,
    /// The angle, to both sides.
    #[schemars(range(min = 0.0, max = 90.0))]
    #[schemars(extend("x-own" = true))]
    pub theta_max_deg: f64,
    /// Where errors of the angle count as lengths.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub edge_mm: f64,
    /// How much worse the worst motion may be held than the best.
    #[serde(default = "condition_max")]
    #[schemars(range(max = 1000000.0), extend("x-above" = 1.0))]
    pub condition_max: f64,
    /// How far four screws may contradict each other, by their models before each move and by their
    /// encoders after it; beyond it the move is refused, and the message names the screws. While
    /// each screw is homed by itself this is not watched (`zero.lone_homing`).
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub inconsistency_limit_um: Option<f64>,
    /// Its screws.
    #[schemars(extend("x-range" = "three or four"))]
    pub actuator: Vec<ActuatorConfig>,
    /// How the screws get their origin.
    pub zero: PlatformZeroConfig,
    /// How the screws are calibrated.
    pub calibrate: Option<PlatformCalibrateConfig>,
    /// How the platform is verified.
    pub verify: Option<PlatformVerifyConfig>,
    /// When `move --align` is content.
    pub align: Option<AlignConfig>,
    /// How the screws' calibrations are applied, and their limits; needed to calibrate or to use
    /// them.
    pub compensation: Option<ScrewCompensationConfig>,
}

const fn condition_max() -> f64 {
    compensator::platform::Platform::CONDITION_MAX
}

/// A screw of a platform: which axis, and where and which way it pushes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActuatorConfig {
    /// The drive of this screw.
    #[schemars(extend("x-range" = "an `[axis.NAME]`"))]
    pub axis: String,
    /// The point it pushes, in the platform's frame, at pose zero.
    #[schemars(extend("x-own" = true))]
    pub point_mm: [f64; 2],
    /// Which way it pushes; the length does not matter.
    #[schemars(extend("x-range" = "not both 0"))]
    #[schemars(extend("x-own" = true))]
    pub direction: [f64; 2],
    /// Travel per turn: the period of its periodic error.
    #[schemars(range(min = 0.001, max = 1000.0))]
    #[schemars(extend("x-own" = true))]
    pub lead_mm: f64,
    /// The coordinate of the first index pulse off the negative limit switch.
    #[schemars(range(min = -10000.0, max = 10000.0), extend("x-range" = "below `soft_max_mm`"))]
    #[schemars(extend("x-own" = true))]
    pub index_mm: f64,
    /// Strokes of its own for `calibrate`, in place of those of all.
    pub strokes: Option<StrokesConfig>,
}

/// The strokes that one screw is calibrated at, in place of those of `[platform.calibrate]`.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrokesConfig {
    /// The first stroke.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub first_mm: f64,
    /// The last one.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub last_mm: f64,
    /// From one to the next.
    pub step_mm: f64,
}

impl StrokesConfig {
    /// These strokes, increasing.
    pub(crate) fn targets(self) -> Vec<Metres> {
        let steps = ((self.last_mm - self.first_mm) / self.step_mm + 1e-9).floor() as u32;
        (0..=steps)
            .map(|step| Metres::from_mm(self.first_mm + f64::from(step) * self.step_mm))
            .collect()
    }
}

/// How the screws get their origin: the index pulse off the negative limit switch.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatformZeroConfig {
    /// Speed of homing one screw (method 1: negative limit switch and index pulse).
    #[schemars(range(min = 0.001, max = 1000.0))]
    #[schemars(extend("x-own" = true))]
    pub search_speed_mm_per_s: f64,
    /// Longest homing of one screw.
    #[schemars(range(min = 0.1, max = 100000.0))]
    pub time_limit_s: f64,
    /// With it you confirm that the platform is not damaged when one screw is homed while the
    /// others stand still: until all screws have found their index, the program cannot know how far
    /// they contradict each other.
    #[serde(default)]
    #[schemars(extend("x-range" = "`true` with four screws, absent with three"))]
    pub lone_homing: bool,
}

/// How the screws' errors are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScrewMethodName {
    /// Means at the ends and over all.
    Patent,
    /// Least squares over all strokes, with what is periodic in the lead.
    LeastSquares,
}

/// The calibration run of a platform.
///
/// One screw moves while the others stand, which four refuse: give those models measured elsewhere
/// (`truestage fit screw --save`).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatformCalibrateConfig {
    /// All strokes with periodic terms where significant, or the means of the patent (over strokes
    /// reached in reverse).
    pub method: ScrewMethodName,
    /// The first stroke of each screw that has no `strokes` of its own.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub first_mm: f64,
    /// The last one.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub last_mm: f64,
    /// From one to the next.
    pub step_mm: f64,
    /// How often each, from both sides.
    #[schemars(range(min = 1, max = 1000))]
    pub runs: u32,
    /// How far beyond the ends a run turns round.
    #[schemars(extend("x-range" = "at least `lost_motion_max_um`"))]
    pub overrun_mm: f64,
    /// How far the zero may have moved at the end.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub closure_limit_um: f64,
    /// The highest harmonic of the lead looked for.
    #[serde(default = "harmonics_max")]
    #[schemars(range(min = 0, max = 32))]
    pub harmonics_max: u32,
    /// The chance accepted of finding a periodic term where there is none.
    #[serde(default = "significance")]
    #[schemars(range(min = 1e-09, max = 0.5))]
    pub significance: f64,
}

impl PlatformCalibrateConfig {
    /// The strokes of screws that have none of their own.
    pub(crate) const fn strokes_of_all(&self) -> StrokesConfig {
        StrokesConfig {
            first_mm: self.first_mm,
            last_mm: self.last_mm,
            step_mm: self.step_mm,
        }
    }

    /// What this screw is calibrated at: its own strokes, or those of all.
    pub(crate) fn strokes_of(&self, actuator: &ActuatorConfig) -> StrokesConfig {
        actuator.strokes.unwrap_or(self.strokes_of_all())
    }
}

const fn harmonics_max() -> u32 {
    4
}

const fn significance() -> f64 {
    0.01
}

/// The verification of a platform: moves from pose to pose over the whole range, each looked at.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlatformVerifyConfig {
    /// So many poses, spread over the work range.
    #[schemars(range(min = 1, max = 1000000))]
    pub poses: u32,
    /// Which ones.
    pub seed: u64,
    /// The largest error allowed in x, y and of the angle at the edge.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub tolerance_um: f64,
}

/// Moving until the image agrees (`move --align`).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlignConfig {
    /// The largest error that is left, in x, y and of the angle at the edge.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub tolerance_um: f64,
    /// So many moves at most.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations_max: u32,
}

/// When lost motion is compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LostMotionRule {
    /// As far as it is not taken up, by what is remembered of each screw.
    Engagement,
    /// All of it on each reverse move, as the patent says.
    Patent,
}

/// How a screw's model is applied, and its limits.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScrewCompensationConfig {
    /// Lost motion by the remembered state of each screw, or all of it on each reverse move.
    pub rule: LostMotionRule,
    /// A model with larger deviations is refused.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub size_limit_um: f64,
    /// A model with a steeper deviation is refused; dimensionless.
    #[schemars(range(min = 1e-09, max = 0.5))]
    pub slope_limit: f64,
    /// How far beyond the strokes measured a model may be used.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub extrapolation_mm: f64,
    /// A travel this long settles the engagement of any screw.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub lost_motion_max_um: f64,
}
