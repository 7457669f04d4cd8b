//! Encoder counts, and the scale that turns them into metres.

use core::fmt;
use core::ops::{Add, Neg, Sub};

use crate::Metres;

/// A position or distance in encoder counts, exact.
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

/// How many metres one count is. Its sign is the direction in which counts grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    metres_per_count: f64,
}

impl Scale {
    /// A scale of `metres_per_count`; `None` when it is zero or not finite.
    pub fn new(metres_per_count: Metres) -> Option<Self> {
        let value = metres_per_count.value();
        (value.is_finite() && value != 0.0).then_some(Self {
            metres_per_count: value,
        })
    }

    /// The length of one count, signed.
    pub const fn resolution(self) -> Metres {
        Metres(self.metres_per_count)
    }

    /// Exact counts to metres.
    pub const fn to_metres(self, counts: Counts) -> Metres {
        Metres(counts.0 as f64 * self.metres_per_count)
    }

    /// Metres to the nearest count.
    pub fn to_counts(self, length: Metres) -> Counts {
        Counts((length.value() / self.metres_per_count).round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_rounds_to_the_nearest_count_and_back() {
        let scale = Scale::new(Metres(10e-9)).unwrap();
        assert_eq!(scale.to_counts(Metres(12.344e-9)), Counts(1));
        assert_eq!(scale.to_counts(Metres(-0.06)), Counts(-6_000_000));
        assert!((scale.to_metres(Counts(6_000_000)).value() - 0.06).abs() < 1e-15);
    }

    #[test]
    fn a_scale_of_zero_or_nan_is_refused() {
        assert_eq!(Scale::new(Metres(0.0)), None);
        assert_eq!(Scale::new(Metres(f64::NAN)), None);
    }
}
