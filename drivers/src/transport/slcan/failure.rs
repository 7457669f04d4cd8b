//! What can go wrong while an adapter is brought to work.

use core::fmt;
use core::time::Duration;

/// Why an adapter could not be brought to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlcanFailure {
    /// It answered nothing.
    Silent {
        /// To which step.
        step: &'static str,
        /// For how long (wall time).
        waited: Duration,
    },
    /// It refused a step.
    Refused {
        /// Which.
        step: &'static str,
    },
    /// Its device vanished meanwhile.
    Gone,
}

impl fmt::Display for SlcanFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent { step, waited } => write!(
                f,
                "did not answer `{step}` within {waited:?}; is it an SLCAN adapter (or are two \
                 serial ports swapped), and is its baud rate right?"
            ),
            Self::Refused { step } => write!(f, "refused `{step}`; unplug it and try again"),
            Self::Gone => f.write_str("disappeared while it was being set up"),
        }
    }
}
