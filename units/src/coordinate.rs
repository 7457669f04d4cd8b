//! What an axis moves in: a length or an angle.

use core::fmt;

use crate::{
    AxisSpeed, Metres, MetresPerSecond, MetresPerSecondSquared, Quantity, Radians,
    RadiansPerSecond, RadiansPerSecondSquared,
};

mod sealed {
    pub trait Sealed {}
    impl Sealed for crate::Metres {}
    impl Sealed for crate::Radians {}
}

/// The quantity that an axis positions: [`Metres`] of a linear axis, [`Radians`] of a rotary
/// one. Nothing else moves, so nobody else can implement it.
///
/// # Example
///
/// ```
/// use units::{Coordinate, Metres, Radians};
///
/// fn shown<Q: Coordinate>(position: Q) -> String {
///     format!("{}{}", Q::in_unit(position.value()), Q::UNIT)
/// }
/// assert_eq!(shown(Radians::TURN), "360°");
/// assert_eq!(shown(Metres(0.25)), "0.25m");
/// ```
pub trait Coordinate: Quantity + Into<LengthOrAngle> + sealed::Sealed {
    /// Its change in time.
    type Speed: Quantity + Into<AxisSpeed>;
    /// The change of its speed in time.
    type Acceleration: Quantity;

    /// The unit a person reads positions in where their SI value may be anything.
    const UNIT: &'static str;
    /// Likewise for speeds.
    const SPEED_UNIT: &'static str;
    /// Likewise for accelerations.
    const ACCELERATION_UNIT: &'static str;

    /// An SI value (of a position, a speed or an acceleration) in those units.
    fn in_unit(si: f64) -> f64;
}

impl Coordinate for Metres {
    type Speed = MetresPerSecond;
    type Acceleration = MetresPerSecondSquared;

    const UNIT: &'static str = "m";
    const SPEED_UNIT: &'static str = "m/s";
    const ACCELERATION_UNIT: &'static str = "m/s²";

    fn in_unit(si: f64) -> f64 {
        si
    }
}

impl Coordinate for Radians {
    type Speed = RadiansPerSecond;
    type Acceleration = RadiansPerSecondSquared;

    const UNIT: &'static str = "°";
    const SPEED_UNIT: &'static str = "°/s";
    const ACCELERATION_UNIT: &'static str = "°/s²";

    fn in_unit(si: f64) -> f64 {
        si.to_degrees()
    }
}

/// A coordinate or a distance whose kind is known only when the program runs: what alarms and
/// errors of any axis carry.
///
/// Displayed in millimetres or degrees. The precision of the format counts the decimals of
/// millimetres, degrees get one more; `+` shows the sign.
///
/// # Example
///
/// ```
/// use units::{LengthOrAngle, Metres, Radians};
///
/// let length = LengthOrAngle::from(Metres::from_mm(12.5));
/// let angle = LengthOrAngle::from(-Radians::TURN);
/// assert_eq!(format!("{length:+.1}"), "+12.5 mm");
/// assert_eq!(format!("{angle:.3}"), "-360.0000°");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LengthOrAngle {
    /// Of a linear axis.
    Length(Metres),
    /// Of a rotary axis.
    Angle(Radians),
}

impl From<Metres> for LengthOrAngle {
    fn from(length: Metres) -> Self {
        Self::Length(length)
    }
}

impl From<Radians> for LengthOrAngle {
    fn from(angle: Radians) -> Self {
        Self::Angle(angle)
    }
}

impl fmt::Display for LengthOrAngle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let decimals = f.precision().unwrap_or(3);
        let (number, decimals, unit) = match self {
            Self::Length(length) => (length.mm(), decimals, " mm"),
            Self::Angle(angle) => (angle.degrees(), decimals + 1, "°"),
        };
        if f.sign_plus() {
            write!(f, "{number:+.decimals$}{unit}")
        } else {
            write!(f, "{number:.decimals$}{unit}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_shown_in_millimetres_and_an_angle_in_degrees() {
        let length = LengthOrAngle::from(Metres::from_mm(12.5));
        let angle = LengthOrAngle::from(Radians::from_degrees(12.5));
        assert_eq!(format!("{length:.3}"), "12.500 mm");
        assert_eq!(format!("{length:+.1}"), "+12.5 mm");
        assert_eq!(format!("{angle:.3}"), "12.5000°");
        assert_eq!(
            format!("{:+.2}", LengthOrAngle::from(-Radians::TURN)),
            "-360.000°"
        );
    }
}
