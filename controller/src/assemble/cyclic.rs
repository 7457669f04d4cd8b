//! What an axis needs to follow cyclic set-points.

use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

use crate::config::{AxisConfig, CyclicConfig};
use machine::engine::{AxisLimits, CorrectionLimits};

/// The share of a drive's speed that is left to catch up what a SYNC that came early left short.
const CATCHING_UP: f64 = 0.02;
/// A correction never takes more than this share.
const CORRECTING_MAX: f64 = 0.5;

/// How fast a path may be: the drive itself goes no faster than its 0x607F, and what is added to
/// the path and what jitter leaves short must fit below that too, or they pile up as following
/// error.
fn path_speed(axis: &AxisConfig, cyclic: &CyclicConfig) -> MetresPerSecond {
    let own_mm_per_s = axis.speed_max_mm_per_s;
    let correcting = cyclic.correction_rate_um_per_s * 1e-3;
    let correcting = correcting.min(own_mm_per_s * CORRECTING_MAX);
    MetresPerSecond((own_mm_per_s * (1.0 - CATCHING_UP) - correcting) * 1e-3)
}

/// The limits of an axis and of what is added to its set-points.
pub(crate) fn cyclic_settings(
    axis: &AxisConfig,
    cyclic: &CyclicConfig,
) -> (AxisLimits, CorrectionLimits) {
    let limits = AxisLimits {
        min: Metres::from_mm(axis.soft_min_mm),
        max: Metres::from_mm(axis.soft_max_mm),
        speed: path_speed(axis, cyclic),
        acceleration: MetresPerSecondSquared(axis.acceleration_mm_per_s2 * 1e-3),
        jerk: MetresPerSecondCubed(cyclic.jerk_mm_per_s3 * 1e-3),
        deviation: Metres::from_um(cyclic.deviation_limit_um),
    };
    let correction = CorrectionLimits {
        size: Metres::from_um(cyclic.correction_limit_um),
        rate: MetresPerSecond(cyclic.correction_rate_um_per_s * 1e-6),
    };
    (limits, correction)
}
