//! How a position display is used.

use core::time::Duration;
use units::MetresPerSecond;

use crate::device::Direction;

/// How a position display is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nd287Settings {
    /// Which way the displacement counts.
    pub direction: Direction,
    /// From one value to the next; slower if the display is.
    pub period: Duration,
    /// The fastest that the stage can move, and so the farthest that a value can be from the one before.
    pub speed_max: MetresPerSecond,
    /// How long an answer may take.
    pub answer_timeout: Duration,
    /// How many answers may be missing in a start.
    pub retries: u32,
    /// This many damaged lines in a row raise an alarm.
    pub garbage_lines_max: u64,
    /// When a value has been due for this long it is not just late: the count is considered lost.
    pub silent_after: Duration,
}

impl Default for Nd287Settings {
    /// Of a display at 9600 baud: a value takes 50 ms at most, and 20 ms on the line.
    fn default() -> Self {
        Self {
            direction: Direction::AsCounted,
            period: Duration::from_millis(100),
            speed_max: MetresPerSecond(1.0),
            answer_timeout: Duration::from_millis(300),
            // Three seconds in all: who has just been switched on says nothing.
            retries: 5,
            garbage_lines_max: 5,
            silent_after: Duration::from_secs(1),
        }
    }
}
