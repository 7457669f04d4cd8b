//! The file of a job, as a person writes it.

use schemars::JsonSchema;
use serde::Deserialize;

/// A job of one linear axis: places to go to, one after the other, each corrected by the calibration in use.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobConfig {
    /// Of this file.
    #[schemars(range(min = 1, max = 1))]
    #[expect(dead_code, reason = "the schema judges it")]
    pub(crate) schema_version: u32,
    /// Which linear axis.
    #[schemars(extend("x-range" = "an `[axis.NAME]` that is moved by itself"))]
    pub(crate) axis: String,
    /// How often the points are gone through.
    #[serde(default = "once")]
    #[schemars(range(min = 1, max = 10000))]
    pub(crate) repetitions: u32,
    /// How long the axis stands at a point before its place is read.
    #[serde(default = "settle_ms")]
    #[schemars(range(min = 1, max = 60000))]
    pub(crate) settle_ms: u32,
    /// When to go on from points that do not say it themselves; at once, when not given.
    pub(crate) go_on: Option<GoOnConfig>,
    /// Where the axis goes when all is done; it stays at the last point, when not given.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub(crate) end_mm: Option<f64>,
    /// The points, in the order in which they are gone to.
    #[schemars(length(min = 1, max = 10000))]
    pub(crate) point: Vec<JobPointConfig>,
}

/// A point, or several at equal intervals.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobPointConfig {
    /// What it is called in the journal; `P1`, `P2` and so on, when not given.
    pub(crate) name: Option<String>,
    /// Where the point of the axis shall be.
    #[schemars(extend("x-range" = "within the soft limits"))]
    pub(crate) position_mm: f64,
    /// From each of `count` points to the next.
    #[schemars(extend("x-range" = "not 0; with `count`, only then"))]
    pub(crate) interval_mm: Option<f64>,
    /// How many points, the one at `position_mm` included.
    #[schemars(range(min = 2, max = 10000), extend("x-range" = "with `interval_mm`, only then"))]
    pub(crate) count: Option<u32>,
    /// When to go on from here.
    pub(crate) go_on: Option<GoOnConfig>,
}

/// When to go on: after a time, on the operator's key, or when an input shows a voltage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GoOnConfig {
    /// After so long at the point.
    #[schemars(range(min = 0.0, max = 86400.0), extend("x-range" = "or `operator`, or `analog`"))]
    pub(crate) after_s: Option<f64>,
    /// What the operator is asked to do; it goes on when a key is pressed.
    #[schemars(extend("x-range" = "or `after_s`, or `analog`"))]
    pub(crate) operator: Option<String>,
    /// The module whose voltage says it.
    #[schemars(extend("x-range" = "an `[analog.NAME]`; or `after_s`, or `operator`"))]
    pub(crate) analog: Option<String>,
    /// Which of the module's `channels`.
    #[schemars(extend("x-range" = "one of its `channels`; with `analog`, only then"))]
    pub(crate) channel: Option<u8>,
    /// It goes on once the voltage is above this.
    #[schemars(extend("x-range" = "with `analog`: this or `below_v`"))]
    pub(crate) above_v: Option<f64>,
    /// It goes on once the voltage is below this.
    #[schemars(extend("x-range" = "with `analog`: this or `above_v`"))]
    pub(crate) below_v: Option<f64>,
    /// How long the input is waited for; the job fails then.
    #[schemars(range(min = 0.001, max = 86400.0), extend("x-range" = "with `analog`, always"))]
    pub(crate) within_s: Option<f64>,
}

const fn once() -> u32 {
    1
}

const fn settle_ms() -> u32 {
    20
}
