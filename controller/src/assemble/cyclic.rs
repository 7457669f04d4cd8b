//! What an axis needs to follow cyclic set-points.

use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

use crate::config::{AxisConfig, CyclicConfig};
use crate::engine::{AxisLimits, CorrectionLimits};

/// The limits of an axis and of what is added to its set-points.
pub(crate) fn cyclic_settings(
    axis: &AxisConfig,
    cyclic: &CyclicConfig,
) -> (AxisLimits, CorrectionLimits) {
    let limits = AxisLimits {
        min: Metres::from_mm(axis.soft_min_mm),
        max: Metres::from_mm(axis.soft_max_mm),
        speed: MetresPerSecond(axis.speed_max_mm_per_s * 1e-3),
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
