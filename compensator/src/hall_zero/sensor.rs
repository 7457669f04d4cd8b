//! The two Hall sensors of the patent.

use core::fmt;

/// The two sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Sensor 1 over N-S-N: even.
    Peak,
    /// Sensor 2 over S-N: odd.
    Slope,
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Peak => "peak sensor",
            Self::Slope => "slope sensor",
        })
    }
}
