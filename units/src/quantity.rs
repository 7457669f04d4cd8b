//! Newtypes over `f64` in SI units.

use core::fmt;
use core::iter::Sum;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// What all quantities have in common, for code that is generic over them.
///
/// # Example
///
/// ```
/// use units::{Metres, Quantity, Volts};
///
/// fn middle<Q: Quantity>(a: Q, b: Q) -> Q {
///     (a + b) / 2.0
/// }
/// assert_eq!(middle(Metres(1.0), Metres(2.0)), Metres(1.5));
/// assert_eq!(middle(Volts(-5.0), Volts(5.0)), Volts::ZERO);
/// ```
pub trait Quantity:
    Copy
    + fmt::Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + Div<Self, Output = f64>
    + Send
    + Sync
    + 'static
{
    /// Zero of this quantity.
    const ZERO: Self;

    /// The quantity of `value` SI units.
    fn from_value(value: f64) -> Self;

    /// The bare number in the SI unit.
    fn value(self) -> f64;

    /// The magnitude.
    fn abs(self) -> Self {
        Self::from_value(self.value().abs())
    }

    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool {
        self.value().is_finite()
    }

    /// The larger of the two.
    fn max(self, other: Self) -> Self {
        Self::from_value(self.value().max(other.value()))
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $symbol:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
        pub struct $name(pub f64);

        impl $name {
            /// Zero of this quantity.
            pub const ZERO: Self = Self(0.0);

            /// The bare number in the SI unit.
            pub const fn value(self) -> f64 {
                self.0
            }

            /// The magnitude.
            pub const fn abs(self) -> Self {
                Self(self.0.abs())
            }

            /// Whether the value is neither infinite nor NaN.
            pub const fn is_finite(self) -> bool {
                self.0.is_finite()
            }

            /// The smaller of the two.
            pub const fn min(self, other: Self) -> Self {
                Self(self.0.min(other.0))
            }

            /// The larger of the two.
            pub const fn max(self, other: Self) -> Self {
                Self(self.0.max(other.0))
            }
        }

        impl Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }

        impl Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }

        impl AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }

        impl SubAssign for $name {
            fn sub_assign(&mut self, other: Self) {
                self.0 -= other.0;
            }
        }

        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl Mul<f64> for $name {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }

        impl Div<f64> for $name {
            type Output = Self;
            fn div(self, divisor: f64) -> Self {
                Self(self.0 / divisor)
            }
        }

        /// The dimensionless ratio of two values.
        impl Div for $name {
            type Output = f64;
            fn div(self, other: Self) -> f64 {
                self.0 / other.0
            }
        }

        impl Sum for $name {
            fn sum<I: Iterator<Item = Self>>(values: I) -> Self {
                values.fold(Self::ZERO, Add::add)
            }
        }

        impl Quantity for $name {
            const ZERO: Self = Self(0.0);

            fn from_value(value: f64) -> Self {
                Self(value)
            }

            fn value(self) -> f64 {
                self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    };
}

quantity!(
    /// Length in metres.
    ///
    /// # Example
    ///
    /// ```
    /// use units::Metres;
    ///
    /// let lengths = [Metres::from_mm(12.5), Metres::from_um(500.0)];
    /// let sum: Metres = lengths.into_iter().sum();
    /// assert_eq!(format!("{sum:.3}"), "0.013 m");
    /// assert!((sum.mm() - 13.0).abs() < 1e-12);
    /// assert_eq!(Metres(6.0) / Metres(2.0), 3.0, "a ratio has no unit");
    /// ```
    Metres,
    "m"
);
quantity!(
    /// Angle in radians.
    ///
    /// # Example
    ///
    /// ```
    /// use units::Radians;
    ///
    /// let angle = Radians::from_degrees(1.0);
    /// assert!((angle.arcsec() - 3600.0).abs() < 1e-9);
    /// let wound = Radians::from_degrees(725.0);
    /// let within_a_turn = wound - wound.whole_turns();
    /// assert!((within_a_turn.degrees() - 5.0).abs() < 1e-12);
    /// ```
    Radians,
    "rad"
);
quantity!(
    /// Electric potential in volts.
    Volts,
    "V"
);
quantity!(
    /// Temperature in degrees Celsius.
    Celsius,
    "°C"
);
quantity!(
    /// Pressure in pascals.
    Pascals,
    "Pa"
);
quantity!(
    /// Relative humidity as a fraction, 0 to 1.
    RelativeHumidity,
    "(RH fraction)"
);
quantity!(
    /// Speed in metres per second.
    MetresPerSecond,
    "m/s"
);
quantity!(
    /// Acceleration in metres per second squared.
    MetresPerSecondSquared,
    "m/s²"
);
quantity!(
    /// Jerk in metres per second cubed.
    MetresPerSecondCubed,
    "m/s³"
);
quantity!(
    /// Angular speed in radians per second.
    RadiansPerSecond,
    "rad/s"
);
quantity!(
    /// Angular acceleration in radians per second squared.
    RadiansPerSecondSquared,
    "rad/s²"
);

impl Metres {
    /// A length given in micrometres.
    pub const fn from_um(um: f64) -> Self {
        Self(um * 1e-6)
    }

    /// A length given in millimetres.
    pub const fn from_mm(mm: f64) -> Self {
        Self(mm * 1e-3)
    }

    /// This length in micrometres.
    pub const fn um(self) -> f64 {
        self.0 * 1e6
    }

    /// This length in millimetres.
    pub const fn mm(self) -> f64 {
        self.0 * 1e3
    }

    /// This length in nanometres.
    pub const fn nm(self) -> f64 {
        self.0 * 1e9
    }
}

impl Radians {
    const PER_ARCSEC: f64 = core::f64::consts::PI / 648_000.0;

    /// One whole turn.
    pub const TURN: Self = Self(core::f64::consts::TAU);

    /// An angle given in seconds of arc.
    pub const fn from_arcsec(arcsec: f64) -> Self {
        Self(arcsec * Self::PER_ARCSEC)
    }

    /// This angle in seconds of arc.
    pub const fn arcsec(self) -> f64 {
        self.0 / Self::PER_ARCSEC
    }

    /// An angle given in degrees.
    pub const fn from_degrees(degrees: f64) -> Self {
        Self(degrees.to_radians())
    }

    /// This angle in degrees.
    pub const fn degrees(self) -> f64 {
        self.0.to_degrees()
    }

    /// The whole turns nearest to this angle: less these, it is within half a turn of 0.
    pub fn whole_turns(self) -> Self {
        Self(Self::TURN.0 * (self.0 / Self::TURN.0).round())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_degree_is_3600_seconds_of_arc() {
        let degree = Radians(1.0_f64.to_radians());
        assert!((degree.arcsec() - 3600.0).abs() < 1e-9);
        assert!((Radians::from_arcsec(3600.0) - degree).abs().value() < 1e-15);
    }

    #[test]
    fn lengths_convert_between_screen_and_si_units() {
        assert_eq!(Metres::from_mm(12.5), Metres(0.0125));
        assert!((Metres(2.5e-6).um() - 2.5).abs() < 1e-12);
        assert!((Metres(2.5e-8).nm() - 25.0).abs() < 1e-12);
    }
}
