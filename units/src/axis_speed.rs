//! How fast an axis moves, whichever kind it is.

use core::fmt;

use crate::{Approach, MetresPerSecond, RadiansPerSecond};

/// The speed of an axis whose kind is known only when the program runs. Its sign says which way.
///
/// Displayed in mm/s or °/s.
///
/// # Example
///
/// ```
/// use units::{Approach, AxisSpeed, MetresPerSecond, RadiansPerSecond};
///
/// let along = AxisSpeed::from(MetresPerSecond(-0.002));
/// let round = AxisSpeed::from(RadiansPerSecond(core::f64::consts::PI));
/// assert_eq!(format!("{along:.1}, {round:.0}"), "-2.0 mm/s, 180°/s");
/// assert_eq!([along, round].map(AxisSpeed::approach), [Approach::Reverse, Approach::Forward]);
/// assert_eq!(along.abs(), MetresPerSecond(0.002).into());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisSpeed {
    /// Of a linear axis.
    Linear(MetresPerSecond),
    /// Of a rotary axis.
    Angular(RadiansPerSecond),
}

impl AxisSpeed {
    /// The bare number in the SI unit: metres or radians per second.
    pub const fn value(self) -> f64 {
        match self {
            Self::Linear(it) => it.value(),
            Self::Angular(it) => it.value(),
        }
    }

    /// Which way coordinates change; forward when they do not.
    pub const fn approach(self) -> Approach {
        if self.value() < 0.0 {
            Approach::Reverse
        } else {
            Approach::Forward
        }
    }

    /// The magnitude.
    #[must_use]
    pub const fn abs(self) -> Self {
        match self {
            Self::Linear(it) => Self::Linear(it.abs()),
            Self::Angular(it) => Self::Angular(it.abs()),
        }
    }
}

impl From<MetresPerSecond> for AxisSpeed {
    fn from(speed: MetresPerSecond) -> Self {
        Self::Linear(speed)
    }
}

impl From<RadiansPerSecond> for AxisSpeed {
    fn from(speed: RadiansPerSecond) -> Self {
        Self::Angular(speed)
    }
}

impl fmt::Display for AxisSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear(it) => {
                fmt::Display::fmt(&(it.value() * 1e3), f)?;
                f.write_str(" mm/s")
            }
            Self::Angular(it) => {
                fmt::Display::fmt(&it.value().to_degrees(), f)?;
                f.write_str("°/s")
            }
        }
    }
}
