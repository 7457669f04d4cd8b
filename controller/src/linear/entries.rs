//! What a journal says of a linear axis.

use serde::{Deserialize, Serialize};
use units::Approach;

use crate::store::EnvironmentRecord;

/// One measured point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointEntry {
    /// Which run, from 1.
    pub run: u32,
    /// `+` or `-`.
    pub approach: char,
    /// Where it should be, metres.
    pub target_m: f64,
    /// What the drive was sent, metres.
    pub set_point_m: f64,
    /// What the encoder said, metres.
    pub encoder_m: f64,
    /// What the instrument said, corrected, metres.
    pub measured_m: f64,
    /// Standard deviation of the readings averaged, metres.
    pub scatter_m: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
    /// The environment then.
    pub environment: EnvironmentRecord,
}

impl PointEntry {
    /// From which side the stage had come.
    pub(super) const fn side(&self) -> Approach {
        match self.approach {
            '-' => Approach::Reverse,
            _ => Approach::Forward,
        }
    }
}

/// What a zero search found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZeroEntry {
    /// The origin in the drive's coordinates before it became zero, metres.
    pub origin_m: f64,
    /// Its standard uncertainty, metres.
    pub standard_uncertainty_m: f64,
    /// The patent's P0 in the same coordinates, metres.
    pub patent_p0_m: f64,
    /// Highest voltage of the peak sensor, volts.
    pub peak_max_v: f64,
    /// Voltage of the slope sensor at the origin, volts.
    pub mid_v: f64,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}
