//! The part of a configuration that is about the cycle of linear axes. Each key's suffix is its unit.

mod gantry;

use schemars::JsonSchema;
use serde::Deserialize;

pub(crate) use gantry::GantryConfig;

/// The drift-free origin of an axis, by two Hall sensors (system S5).
///
/// The relations among voltages, and those with the noise, are judged when the search starts
/// (`compensator/src/hall_zero/settings.rs`), the others by `check`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZeroConfig {
    /// The Hall sensors.
    #[schemars(extend("x-range" = "an `[analog.NAME]` with two channels"))]
    pub analog: String,
    /// Nominal coordinate of the negative limit switch.
    #[schemars(extend("x-own" = true))]
    pub negative_limit_mm: f64,
    /// Speed of the coarse reference; its last part runs at a fifth.
    #[schemars(range(min = 0.001, max = 1000.0))]
    #[schemars(extend("x-own" = true))]
    pub reference_speed_mm_per_s: f64,
    /// Speed of the Hall search.
    #[schemars(range(min = 0.001, max = 100.0))]
    #[schemars(extend("x-own" = true))]
    pub search_speed_mm_per_s: f64,
    /// Farthest from the nominal zero, on either side.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub search_limit_mm: f64,
    /// Longest search.
    #[schemars(range(min = 0.1, max = 100000.0))]
    pub time_limit_s: f64,
    /// Samples taken standing, at each of the three places.
    #[schemars(range(min = 2, max = 100000))]
    pub samples: usize,
    /// V<sub>c</sub>: how far below the peak the two flank points lie.
    #[schemars(extend("x-range" = "above `delta1_mv`"))]
    pub level_below_peak_v: f64,
    /// V<sub>c0</sub>: how far the peak sensor must fall before the search turns.
    #[schemars(extend("x-range" = "with 2 × `delta1_mv` below `level_below_peak_v`"))]
    pub turn_below_peak_v: f64,
    /// How near the voltage must come to the first flank point.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "at least 3 × `noise_mv`"))]
    pub delta1_mv: f64,
    /// Likewise to the second one.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "at least 3 × `noise_mv`"))]
    pub delta2_mv: f64,
    /// Likewise to the origin.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "at least 3 × `noise_mv`"))]
    pub delta3_mv: f64,
    /// How far the peak sensor may be below its peak at the origin.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "at least 3 × `noise_mv`"))]
    pub delta4_mv: f64,
    /// At or below it a sensor counts as saturated.
    #[schemars(extend("x-range" = "below `rail_high_v`"))]
    pub rail_low_v: f64,
    /// At or above it a sensor counts as saturated.
    pub rail_high_v: f64,
    /// Rms noise of one sample.
    #[schemars(range(min = 0.0))]
    pub noise_mv: f64,
    /// A zero that is less certain is refused.
    #[schemars(range(min = 0.0001, max = 10000.0))]
    pub standard_uncertainty_limit_um: f64,
}

/// The calibration run of an axis (system S3).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrateConfig {
    /// What measures.
    #[schemars(extend("x-range" = "an `[instrument.NAME]`"))]
    pub instrument: String,
    /// First position.
    #[schemars(extend("x-range" = "with `overrun_mm` within the soft limits; without `positions_mm`, only then"))]
    pub start_mm: Option<f64>,
    /// Last position.
    #[schemars(extend("x-range" = "with `overrun_mm` within the soft limits; without `positions_mm`, only then"))]
    pub end_mm: Option<f64>,
    /// Distance of positions; the last one is stretched or split so that the end is measured and no step is
    /// shorter than half of it.
    #[schemars(range(min = 0.001), extend("x-range" = "at most the range; without `positions_mm`, only then"))]
    pub step_mm: Option<f64>,
    /// Every position, in place of `start_mm`, `end_mm` and `step_mm`: at unequal steps, closer where the stage is
    /// rougher. A stage arrives otherwise after a move that is much shorter than the others.
    #[schemars(extend("x-range" = "2 to 10000 of them, increasing by 0.001 or more, the ends with `overrun_mm` within the soft limits"))]
    pub positions_mm: Option<Vec<f64>>,
    /// Bidirectional runs.
    #[schemars(range(min = 2, max = 1000))]
    pub runs: u32,
    /// How far beyond the ends a run turns round.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub overrun_mm: f64,
    /// Standing time before each reading.
    pub settle_ms: u32,
    /// Instrument samples averaged for one reading.
    #[schemars(range(min = 1, max = 1000000))]
    pub average_samples: u32,
    /// How far the zero, measured first and after each run, may differ.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub closure_limit_um: f64,
    /// How far instrument and encoder may differ over a run; in `verify` too.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub scale_limit_ppm: f64,
    /// Standard uncertainty of errors that repeat within less than the steps, so that no position shows them,
    /// such as the interpolation of a scale's signal: its maker's limit divided by √2. By default 0: none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub short_period_standard_uncertainty_nm: f64,
}

/// The verification run of an axis (ISO 230-2).
///
/// How far instrument and encoder may differ over a run, `scale_limit_ppm` of `calibrate` says;
/// without that, 1000 ppm.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerifyConfig {
    /// What measures.
    #[schemars(extend("x-range" = "an `[instrument.NAME]`"))]
    pub instrument: String,
    /// First position.
    #[schemars(extend("x-range" = "with `overrun_mm` within the soft limits"))]
    pub start_mm: f64,
    /// Last position.
    #[schemars(extend("x-range" = "with `overrun_mm` within the soft limits"))]
    pub end_mm: f64,
    /// Positions, evenly from `start_mm` to `end_mm`; put them between the calibrated ones.
    #[schemars(range(min = 2, max = 10000))]
    pub targets: u32,
    /// Bidirectional runs.
    #[schemars(range(min = 2, max = 1000))]
    pub runs: u32,
    /// How far beyond the ends a run turns round.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub overrun_mm: f64,
    /// Standing time before each reading.
    pub settle_ms: u32,
    /// Instrument samples averaged for one reading.
    #[schemars(range(min = 1, max = 1000000))]
    pub average_samples: u32,
    /// Largest bidirectional accuracy A.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub accuracy_tolerance_um: f64,
}

/// How the curve between calibrated positions is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InterpolationName {
    /// The patent's.
    PiecewiseConstant,
    /// Straight lines.
    Linear,
    /// Cubic without overshoot.
    MonotoneCubic,
}

/// What holds outside the calibrated range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndPolicyName {
    /// A target outside is refused.
    Refuse,
    /// The end's value holds on.
    Hold,
    /// The end's value fades to zero over `fade_out_mm`.
    FadeOut,
}

/// How a calibration of an axis is applied, and its limits.
///
/// A table is refused when one of its positions does not belong to the curve of the others. How far
/// a good one stands off is a matter of the stage, its noise and its step, so the table itself says
/// it: over every 3 and every 5 neighbouring positions the line or cubic through them is taken out,
/// and what is left of the largest is compared with the rest (Student's t, both approaches
/// together). The limit is set for one good table in 10 000, and is never below half of what the
/// instrument counts (0.158 µm with a linear interferometer). `calibrate` prints which error of one
/// position would have been noticed; a refusal names position, error and limit.
/// Give `jump_limit_um` only where finer positions have shown that the
/// stage is like that: a wrong position within it is corrected like a right one. Tables of fewer
/// than some ten positions say little about one of them; the limits of size and slope hold for them
/// all the same.
///
/// Counted in virtual time on the shipped stage (`wrong_position.rs`): of 250 fresh seeds none was
/// refused, where a fixed 5 µm between neighbours refused one in eight. One position wrong in every
/// run, from both sides, was refused on 250 of them when it was wrong by 3.2 µm (ten half
/// wavelengths), on 248 by 1.6 µm, 233 by 0.95 µm, 189 by 0.63 µm, 51 by 0.32 µm; by twice what the
/// table says it would notice, on all. What is noticed grows with the roughness of the stage and
/// the fewness of its positions: tables of six to ten positions notice little more than the slope
/// limit refuses.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompensationConfig {
    /// The curve between calibrated positions.
    pub interpolation: InterpolationName,
    /// What holds for targets outside the calibrated range.
    pub end_policy: EndPolicyName,
    /// Over which distance it fades.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "with `fade_out`, only then"))]
    pub fade_out_mm: Option<f64>,
    /// Largest deviation corrected.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub size_limit_um: f64,
    /// Largest slope of the deviation, dimensionless.
    #[schemars(range(min = 1e-09, max = 0.5))]
    pub slope_limit: f64,
    /// Largest change of the correction in time. Kept with the compensation; profile position moves
    /// correct the end of a move only, so nothing is limited by it yet.
    #[schemars(range(min = 0.001, max = 1000000000.0))]
    pub rate_limit_um_per_s: f64,
    /// Each stop of `calibrate` and `verify` and each corrected move ends with an approach over this distance,
    /// from the side that the move comes from, or from the other one where the soft limits leave no room:
    /// the axis arrives as it did when it was calibrated, whatever it did before. To be longer than what
    /// takes up the lost motion. Without it a move arrives as it happens to, and its uncertainty counts the
    /// whole lost motion.
    #[schemars(range(min = 0.001, max = 10000.0), extend("x-range" = "at most half of the soft limits' range"))]
    pub approach_mm: Option<f64>,
    /// So far a position may stand off its neighbours whatever the other positions do; not needed,
    /// see above.
    #[schemars(range(min = 0.001, max = 100000.0), extend("x-range" = "at most `slope_limit` × the largest step"))]
    pub jump_limit_um: Option<f64>,
}
