//! Encoder counts, and the scale that turns them into metres or radians.

use core::fmt;
use core::ops::{Add, Neg, Sub};

use crate::{Coordinate, Metres};

/// A position or distance in encoder counts, exact.
///
/// # Example
///
/// ```
/// use units::Counts;
///
/// let (from, to) = (Counts(1_000), Counts(-250));
/// assert_eq!(to - from, Counts(-1_250));
/// assert_eq!((to - from).to_string(), "-1250 counts");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Counts(pub i64);

impl Add for Counts {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Counts {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Neg for Counts {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} counts", self.0)
    }
}

/// How much one count is: metres of a linear axis, radians of a rotary one. Its sign is the
/// direction in which counts grow.
///
/// # Example
///
/// ```
/// use units::{Counts, Metres, Radians, Scale};
///
/// let scale = Scale::new(Metres(10e-9)).expect("a count is some length");
/// assert_eq!(scale.to_counts(Metres(-0.06)), Counts(-6_000_000));
/// let reversed = Scale::new(Radians::from_arcsec(-0.01)).expect("a count is some angle");
/// let quarter = reversed.to_coordinate(Counts(-32_400_000));
/// assert!((quarter.degrees() - 90.0).abs() < 1e-12);
/// assert_eq!(Scale::new(Metres(0.0)), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale<Q = Metres> {
    per_count: Q,
}

impl<Q: Coordinate> Scale<Q> {
    /// A scale of `per_count`; `None` when it is zero or not finite.
    pub fn new(per_count: Q) -> Option<Self> {
        (per_count.is_finite() && per_count != Q::ZERO).then_some(Self { per_count })
    }

    /// What one count is, signed.
    pub const fn resolution(self) -> Q {
        self.per_count
    }

    /// Exact counts to where they are.
    pub fn to_coordinate(self, counts: Counts) -> Q {
        Q::from_value(counts.0 as f64 * self.per_count.value())
    }

    /// A coordinate to the nearest count.
    pub fn to_counts(self, coordinate: Q) -> Counts {
        Counts((coordinate.value() / self.per_count.value()).round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Radians;

    #[test]
    fn a_length_rounds_to_the_nearest_count_and_back() {
        let scale = Scale::new(Metres(10e-9)).unwrap();
        assert_eq!(scale.to_counts(Metres(12.344e-9)), Counts(1));
        assert_eq!(scale.to_counts(Metres(-0.06)), Counts(-6_000_000));
        assert!((scale.to_coordinate(Counts(6_000_000)).value() - 0.06).abs() < 1e-15);
    }

    #[test]
    fn an_angle_has_a_scale_too() {
        let scale = Scale::new(Radians::from_arcsec(-0.01)).unwrap();
        assert_eq!(scale.to_counts(Radians::TURN), Counts(-129_600_000));
        let quarter = scale.to_coordinate(Counts(-32_400_000));
        assert!((quarter.degrees() - 90.0).abs() < 1e-12);
    }

    #[test]
    fn a_scale_of_zero_or_nan_is_refused() {
        assert_eq!(Scale::new(Metres(0.0)), None);
        assert_eq!(Scale::new(Metres(f64::NAN)), None);
    }
}
