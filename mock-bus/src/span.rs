//! Spans of time that a configuration states as numbers.

use core::time::Duration;

/// So many seconds; none for what is no span of time (negative, NaN or too long).
pub(crate) fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO)
}
