//! What axes do at one moment.

use units::{Metres, MetresPerSecond, MetresPerSecondSquared};

use super::PerAxis;

/// What the axes do at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Where they are.
    pub position: PerAxis<Metres>,
    /// How fast they go.
    pub speed: PerAxis<MetresPerSecond>,
    /// How their speed changes.
    pub acceleration: PerAxis<MetresPerSecondSquared>,
}

impl Moment {
    /// At rest.
    pub fn at_rest(position: PerAxis<Metres>) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }

    pub(super) fn is_rest(&self) -> bool {
        let Self {
            position: _,
            speed,
            acceleration,
        } = self;
        *speed == PerAxis::default() && *acceleration == PerAxis::default()
    }
}
