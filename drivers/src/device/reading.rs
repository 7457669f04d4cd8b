//! Samples of an axis.

use units::{Coordinate, Counts, LengthOrAngle, Metres, Time};

/// One sample of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisReading<Q: Coordinate = Metres> {
    /// When it arrived.
    pub at: Time,
    /// The encoder, as the drive counts.
    pub counts: Counts,
    /// The same in metres or radians, drive coordinates.
    pub position: Q,
    /// The drive's own following error, where it is mapped.
    pub following_error: Option<Q>,
    /// Whether the drive reports its target reached and no motion pending.
    pub standing: bool,
    /// Whether the last samples lie together: it does not move, whatever the drive says.
    pub at_rest: bool,
}

impl<Q: Coordinate> AxisReading<Q> {
    /// The same whatever the axis moves in. `stands`: the last samples lie together.
    pub(super) fn place(&self, stands: bool) -> Place {
        Place {
            at: self.at,
            position: self.position.into(),
            stands,
        }
    }
}

/// One sample of an axis, whatever it moves in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// When it arrived.
    pub at: Time,
    /// The encoder, drive coordinates.
    pub position: LengthOrAngle,
    /// Whether the last samples lie together, wherever that is.
    pub stands: bool,
}
