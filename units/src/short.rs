//! Numbers in sentences.

use core::fmt;
use core::time::Duration;

/// A number as people read it: nine significant digits at most, and no zeros behind the last one.
/// 0.036 m in millimetres is 36, not 36.00000000000001.
///
/// # Example
///
/// ```
/// use units::{Metres, Short};
///
/// let travel = Metres(0.1 + 0.2);
/// assert_eq!(travel.to_string(), "0.30000000000000004 m");
/// assert_eq!(Short(travel.value()).to_string(), "0.3");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = format!("{:.8e}", self.0).parse().unwrap_or(self.0);
        // Adding zero turns -0 into 0.
        fmt::Display::fmt(&(rounded + 0.0), f)
    }
}

/// Shows a number with its noun: `1 attempt`, `3 attempts`. For nouns whose plural ends in an s.
///
/// ```
/// use units::Several;
///
/// assert_eq!(Several(1, "row").to_string(), "1 row");
/// assert_eq!(Several(0, "row").to_string(), "0 rows");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Several<N>(pub N, pub &'static str);

impl<N: fmt::Display + Copy + PartialEq + From<u8>> fmt::Display for Several<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, noun) = *self;
        let ending = if number == N::from(1) { "" } else { "s" };
        write!(f, "{number} {noun}{ending}")
    }
}

/// A span of time as people read it: four significant digits at most, in the unit that fits.
///
/// # Example
///
/// ```
/// use std::time::Duration;
/// use units::ShortSpan;
///
/// assert_eq!(ShortSpan(Duration::from_nanos(1_234_567_890)).to_string(), "1.235s");
/// assert_eq!(ShortSpan(Duration::from_nanos(750_000_177_210)).to_string(), "750s");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShortSpan(pub Duration);

impl fmt::Display for ShortSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        let digits = nanos.checked_ilog10().unwrap_or(0);
        let unit = 10_u128.pow(digits.saturating_sub(3));
        let rounded = (nanos + unit / 2) / unit * unit;
        let whole = u64::try_from(rounded / 1_000_000_000).unwrap_or(u64::MAX);
        let rest = (rounded % 1_000_000_000) as u32;
        write!(f, "{:?}", Duration::new(whole, rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_arithmetic_leaves_behind_is_not_shown() {
        for (value, expected) in [
            (36.000_000_000_000_01, "36"),
            (0.1 + 0.2, "0.3"),
            (-0.0, "0"),
            (5e-6, "0.000005"),
            (1_234.567_891_234, "1234.56789"),
            (-2.5, "-2.5"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(Short(value).to_string(), expected);
        }
    }

    #[test]
    fn nobody_waits_for_nanoseconds() {
        for (nanos, expected) in [
            (750_000_177_210, "750s"),
            (40_000_000, "40ms"),
            (1_234_567_890, "1.235s"),
            (999_999, "1ms"),
            (0, "0ns"),
            (86_400_000_000_000, "86400s"),
        ] {
            assert_eq!(ShortSpan(Duration::from_nanos(nanos)).to_string(), expected);
        }
    }
}
