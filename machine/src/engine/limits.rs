//! Within which an axis follows set-points, and what may be added to them.

use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

/// Within which an axis is moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisLimits {
    /// The lower soft limit.
    pub min: Metres,
    /// The upper soft limit.
    pub max: Metres,
    /// The greatest speed.
    pub speed: MetresPerSecond,
    /// The greatest speed of a motion that is no path: a move, the way to the first point of a path.
    pub move_speed: MetresPerSecond,
    /// The greatest acceleration, and deceleration of a controlled stop.
    pub acceleration: MetresPerSecondSquared,
    /// The greatest jerk.
    pub jerk: MetresPerSecondCubed,
    /// How far the axis may be from its latest set-points.
    pub deviation: Metres,
}

/// How large a correction may be, and how fast it may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrectionLimits {
    /// Beyond this it is cut off.
    pub size: Metres,
    /// Faster it does not change.
    pub rate: MetresPerSecond,
}
