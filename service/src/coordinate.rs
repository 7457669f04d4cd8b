//! Where axes are: along a way or round a turn.

use truestage::runs::Place;
use units::{Metres, Radians};

/// A place of an axis: a length, or an angle of one that turns. As it goes in: `"12.5mm"`, `"90deg"`,
/// `{"value": 12.5, "unit": "mm"}`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coordinate {
    /// Along a way.
    Length(Metres),
    /// Round a turn; it counts on over the turns.
    Angle(Radians),
}

impl From<Metres> for Coordinate {
    fn from(length: Metres) -> Self {
        Self::Length(length)
    }
}

impl From<Radians> for Coordinate {
    fn from(angle: Radians) -> Self {
        Self::Angle(angle)
    }
}

impl From<Place> for Coordinate {
    fn from(place: Place) -> Self {
        match place {
            Place::Length(it) => Self::Length(it),
            Place::Angle(it) => Self::Angle(it),
        }
    }
}
