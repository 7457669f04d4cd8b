//! Places that a homing finds (CiA 402, 11; 0x6098).

use units::Approach;

/// Where the home is, and how fast it is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HomingPlace<S> {
    /// Where the axis stands.
    Here,
    /// Where it leaves its negative limit switch.
    NegativeLimit(S),
    /// At the first index pulse off that switch.
    Index(S),
    /// At the next index pulse in this direction.
    NextIndex(S, Approach),
}

impl<S: Copy> HomingPlace<S> {
    /// 0x6098. The negative end of the axis is the drive's positive one when the drive counts
    /// against the axis.
    pub(super) const fn method(&self, reversed: bool) -> i8 {
        use Approach::{Forward, Reverse};
        match (self, reversed) {
            (Self::Here, _) => 37,
            (Self::NegativeLimit(_), false) => 17,
            (Self::NegativeLimit(_), true) => 18,
            (Self::Index(_), false) => 1,
            (Self::Index(_), true) => 2,
            (Self::NextIndex(_, Reverse), false) | (Self::NextIndex(_, Forward), true) => 33,
            (Self::NextIndex(_, Forward), false) | (Self::NextIndex(_, Reverse), true) => 34,
        }
    }

    /// Which way the axis goes when its home is found: off the negative switch, or as asked.
    pub(super) const fn ends_forward(&self) -> bool {
        !matches!(self, Self::NextIndex(_, Approach::Reverse))
    }

    pub(super) const fn speed(&self) -> Option<S> {
        match self {
            Self::Here => None,
            Self::NegativeLimit(speed) | Self::Index(speed) | Self::NextIndex(speed, _) => {
                Some(*speed)
            }
        }
    }
}
