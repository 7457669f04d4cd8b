//! How much longer than configured the program waits on a machine whose time runs faster than real
//! time. See docs/decisions/0004-patience.md.

use core::time::Duration;

/// A computer under load takes the processor away for so long, on the wall, and nobody is to blame.
const PAUSE: Duration = Duration::from_secs(1);

/// More is not lived through by anybody, and keeps every limit within what a [`Duration`] holds.
const SPEED_MAX: f64 = 1000.0;

/// How much longer than configured things are waited for.
///
/// Whatever is waited for `t` in real time is waited for `t` and one second *on the wall*, however
/// fast the machine lives: its computer pauses by the wall's clock. So trouble is never told more
/// than a second later than it would be in real time.
///
/// # Example
///
/// ```
/// use machine::Patience;
/// use std::time::Duration;
///
/// let usual = Duration::from_secs(3);
/// assert_eq!(Patience::NONE.of(usual), usual);
/// let fast = Patience::with_clock(10.0);
/// assert_eq!(fast.of(usual), Duration::from_secs(40), "4 s on the wall");
/// assert_eq!(fast.on_the_wall(fast.of(usual)), Duration::from_secs(4));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patience {
    /// Seconds of the machine in one of the wall.
    clock_speed: f64,
}

impl Patience {
    /// In real time, and where time passes only when everybody waits: exactly as configured.
    pub const NONE: Self = Self { clock_speed: 1.0 };

    /// For a machine that lives `clock_speed` times as fast as the wall's clock.
    pub fn with_clock(clock_speed: f64) -> Self {
        Self {
            clock_speed: clock_speed.clamp(1.0, SPEED_MAX),
        }
    }

    /// For how long what usually takes `usual` at most is waited for, by the machine's clock.
    pub fn of(self, usual: Duration) -> Duration {
        if self == Self::NONE {
            usual
        } else {
            (usual + PAUSE).mul_f64(self.clock_speed)
        }
    }

    /// How much longer that is than `usual`.
    pub fn beyond(self, usual: Duration) -> Duration {
        self.of(usual) - usual
    }

    /// How many periods may pass where usually `usual` may.
    pub fn periods(self, usual: u32, period: Duration) -> u32 {
        if self == Self::NONE {
            return usual;
        }
        let periods = self.of(period * usual).as_nanos() / period.as_nanos().max(1);
        u32::try_from(periods).unwrap_or(u32::MAX)
    }

    /// What `span` of the machine's clock is on the wall.
    pub fn on_the_wall(self, span: Duration) -> Duration {
        span.div_f64(self.clock_speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_real_time_and_slower_nothing_is_waited_for_longer() {
        for speed in [0.1, 1.0] {
            let patience = Patience::with_clock(speed);
            let usual = Duration::from_millis(15);
            assert_eq!(patience.of(usual), usual);
            assert_eq!(patience.beyond(usual), Duration::ZERO);
            assert_eq!(patience.periods(3, usual), 3);
        }
    }

    #[test]
    fn on_a_scaled_clock_trouble_is_told_within_a_second_of_the_wall_more_than_in_real_time() {
        for speed in [1.5, 10.0, 50.0, 1000.0] {
            for usual_ms in [6_u32, 15, 150, 3_000, 120_000] {
                let usual = Duration::from_millis(usual_ms.into());
                let patience = Patience::with_clock(speed);
                let wall = patience.on_the_wall(patience.of(usual));
                let more = wall.saturating_sub(usual);
                assert!(
                    more.abs_diff(PAUSE) < Duration::from_micros(1),
                    "{speed} {usual:?}"
                );
                let period = Duration::from_millis(3);
                let periods = patience.periods(usual_ms / 3, period);
                assert!((period * periods).abs_diff(patience.of(usual)) <= period);
            }
        }
    }
}
