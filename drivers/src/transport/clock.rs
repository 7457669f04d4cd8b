//! The clock of live ports: `CLOCK_MONOTONIC`, real or scaled.

use core::time::Duration;
use std::time::Instant;
use units::Time;

/// Monotonic time since the clock was made, optionally faster or slower than the wall's.
///
/// An emulated machine may live ten times as fast as the wall; controller and emulator then
/// use the same factor, and every time-out and period means the same to both.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: Instant,
    speed: f64,
}

impl Clock {
    /// As fast as the wall.
    pub fn real() -> Self {
        Self::scaled(1.0)
    }

    /// `speed` times as fast as the wall.
    ///
    /// # Panics
    /// When `speed` is not a positive number.
    pub fn scaled(speed: f64) -> Self {
        assert!(
            speed.is_finite() && speed > 0.0,
            "a clock's speed is positive, not {speed}"
        );
        Self {
            start: Instant::now(),
            speed,
        }
    }

    /// How many times as fast as the wall this clock runs.
    pub const fn speed(&self) -> f64 {
        self.speed
    }

    /// The present moment.
    pub fn now(&self) -> Time {
        self.at_wall(self.start.elapsed())
    }

    /// How long to wait on the wall until this clock shows `moment`; zero when it has.
    pub fn until(&self, moment: Time) -> Duration {
        self.wall_span(moment.since(self.now()))
    }

    /// How long a span of this clock takes on the wall.
    pub fn wall_span(&self, span: Duration) -> Duration {
        scale(span, 1.0 / self.speed)
    }

    /// How long a span of the wall is on this clock.
    pub fn span_of_wall(&self, wall: Duration) -> Duration {
        scale(wall, self.speed)
    }

    /// Wall time since the clock's start.
    pub(super) fn wall_elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// What this clock shows `wall` after its start.
    pub(super) fn at_wall(&self, wall: Duration) -> Time {
        Time::ZERO + self.span_of_wall(wall)
    }
}

/// Exact at factor 1; saturates instead of overflowing.
fn scale(span: Duration, factor: f64) -> Duration {
    if factor == 1.0 {
        return span;
    }
    Duration::try_from_secs_f64(span.as_secs_f64() * factor).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_ten_times_as_fast_shortens_waiting_tenfold() {
        let clock = Clock::scaled(10.0);
        assert_eq!(
            clock.wall_span(Duration::from_secs(5)),
            Duration::from_millis(500)
        );
        assert_eq!(clock.at_wall(Duration::from_millis(3)), Time(30_000_000));
        assert!(clock.until(Time(10_000_000_000_000)) <= Duration::from_secs(1_000));
    }

    #[test]
    fn time_never_runs_backwards_and_a_past_moment_needs_no_waiting() {
        let clock = Clock::real();
        let earlier = clock.now();
        assert!(clock.now() >= earlier);
        assert_eq!(clock.until(earlier), Duration::ZERO);
    }

    #[test]
    fn waiting_for_never_saturates() {
        assert!(Clock::scaled(0.001).until(Time::NEVER) > Duration::from_secs(1 << 32));
    }
}
