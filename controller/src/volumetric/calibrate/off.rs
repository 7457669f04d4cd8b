//! What a reading of a line is off by, as people read it.

use core::fmt;

use compensator::volumetric::identify::Reading;
use units::{Metres, Radians};

/// What a reading is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Off {
    /// A displacement.
    Length(Metres),
    /// A tilt.
    Angle(Radians),
}

impl fmt::Display for Off {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(it) => write!(f, "{:+.2} um", it.um()),
            Self::Angle(it) => write!(f, "{:+.2} arcsec", it.arcsec()),
        }
    }
}

impl Off {
    /// So many metres or radians of a reading like this one.
    pub(super) const fn of(reading: Reading, si: f64) -> Self {
        match reading {
            Reading::Length { .. } => Self::Length(Metres(si)),
            Reading::Angle { .. } => Self::Angle(Radians(si)),
        }
    }

    /// What is left without `other`, which is of the same kind.
    pub(super) fn less(&self, other: &Self) -> Self {
        match (*self, *other) {
            (Self::Length(a), Self::Length(b)) => Self::Length(a - b),
            (Self::Angle(a), Self::Angle(b)) => Self::Angle(a - b),
            (Self::Length(_), Self::Angle(_)) | (Self::Angle(_), Self::Length(_)) => *self,
        }
    }
}
