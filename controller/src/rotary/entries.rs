//! What a journal says of the plate of a rotary table. Angles are radians.

use serde::{Deserialize, Serialize};

/// How the plate is to be read: what a run that is continued must have in common with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlatePlanEntry {
    /// The plate's serial number.
    pub plate: String,
    /// Its lines.
    pub lines: u32,
    /// By how many lines it is turned in each placement.
    pub offsets: Vec<f64>,
    /// Passes in each direction and placement.
    pub passes: u32,
    /// Speed of a pass, radians per second.
    pub speed_rad_per_s: f64,
    /// Where the table is while a person reads a line; `None`: a detector reads them as they pass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sighted: Option<SightedAt>,
}

/// Where the table is while a person reads a line, and where its error is therefore seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SightedAt {
    /// At the line's nominal position; how far the line is from there was read.
    Position,
    /// Where the line lies under the cross-hair.
    Line,
}

/// What a person read of one line in one pass. The last one counts: a line may be read again until its
/// placement is closed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SightedEntry {
    /// By how many lines the plate was to be turned.
    pub offset: f64,
    /// Which pass of this placement, from 1; one beyond the last is the first repeated.
    pub pass: u32,
    /// `+` or `-`.
    pub approach: char,
    /// Which line of the plate.
    pub line: u32,
    /// Reading minus nominal at its table position, as in a pass; `None` when the line cannot be read.
    pub deviation_rad: Option<f64>,
    /// When, UTC, RFC 3339.
    pub at: String,
}

/// One pass over all lines. Lists count table positions, in line spacings from the zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepEntry {
    /// By how many lines the plate was to be turned.
    pub offset: f64,
    /// Which pass of this placement, from 1; one beyond the last is the first repeated.
    pub pass: u32,
    /// `+` or `-`.
    pub approach: char,
    /// What the deviations have in common, roughly.
    pub phase_rad: f64,
    /// Reading minus nominal at each table position; `None` where no single line was read.
    pub deviations_rad: Vec<Option<f64>>,
    /// Positions at which no line was seen.
    pub missing: Vec<u32>,
    /// Positions at which more than one edge came, or a pulse too wide for one line.
    pub doubled: Vec<u32>,
    /// Positions at which an edge was overwritten before it was read, or samples of a voltage were lost.
    pub overwritten: Vec<u32>,
    /// Readings near no line.
    pub strays_rad: Vec<f64>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// A placement was read, and the plate still lies where it lay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementEntry {
    /// By how many lines the plate was to be turned.
    pub offset: f64,
    /// What the first pass had moved by when it was repeated: of eight parts of the turn, the most.
    pub closure_rad: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

/// What a verification found. Deviations are actual − target, less their mean, by line of the plate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JudgedEntry {
    /// Whether a calibration knew the plate's errors; they are in the deviations otherwise.
    pub plate_known: bool,
    /// Of the table without its calibration.
    pub found_rad: Vec<Option<f64>>,
    /// Of the table with it, where that was wanted.
    pub left_rad: Option<Vec<Option<f64>>>,
    /// The tolerance.
    pub tolerance_rad: f64,
    /// What of the deviations is the scatter of the readings, rms; `None` where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_rad: Option<f64>,
}
