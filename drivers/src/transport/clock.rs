//! The clock of live ports: `CLOCK_MONOTONIC`, real or scaled, or one that both ends share.

use core::time::Duration;
use std::sync::Arc;
use std::time::Instant;
use units::Time;

use super::lockstep::Participant;

/// Monotonic time since the clock was made, optionally faster or slower than the wall's; or
/// the time of an emulated machine, which passes only when both ends have nothing left to do.
///
/// An emulated machine may live ten times as fast as the wall; controller and emulator then
/// use the same factor, and every time-out and period means the same to both. With a shared
/// clock nothing depends on the wall's.
///
/// # Example
///
/// ```
/// use drivers::transport::clock::Clock;
/// use std::time::Duration;
///
/// let clock = Clock::scaled(10.0);
/// assert_eq!(clock.wall_span(Duration::from_secs(5)), Duration::from_millis(500));
/// assert_eq!(clock.span_of_wall(Duration::from_millis(3)), Duration::from_millis(30));
/// let earlier = clock.now();
/// assert_eq!(clock.until(earlier), Duration::ZERO, "that moment is over");
/// ```
#[derive(Clone, Debug)]
pub struct Clock(Pace);

#[derive(Clone, Debug)]
enum Pace {
    Wall { start: Instant, speed: f64 },
    Lockstep(Arc<Participant>),
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
        Self(Pace::Wall {
            start: Instant::now(),
            speed,
        })
    }

    /// The emulated machine's, in which `participant` takes part.
    pub const fn lockstep(participant: Arc<Participant>) -> Self {
        Self(Pace::Lockstep(participant))
    }

    /// Who takes part in the clock that both ends share; `None` on the wall's clock.
    pub const fn participant(&self) -> Option<&Arc<Participant>> {
        match &self.0 {
            Pace::Wall { .. } => None,
            Pace::Lockstep(participant) => Some(participant),
        }
    }

    /// How many times as fast as the wall this clock runs; 1 for a shared one, which has no
    /// speed of its own.
    pub const fn speed(&self) -> f64 {
        match &self.0 {
            Pace::Wall { speed, .. } => *speed,
            Pace::Lockstep(_) => 1.0,
        }
    }

    /// The present moment.
    pub fn now(&self) -> Time {
        self.at_wall(self.wall_elapsed())
    }

    /// How long to wait on the wall until this clock shows `moment`; zero when it has.
    pub fn until(&self, moment: Time) -> Duration {
        self.wall_span(moment.since(self.now()))
    }

    /// How long a span of this clock takes on the wall.
    pub fn wall_span(&self, span: Duration) -> Duration {
        scale(span, 1.0 / self.speed())
    }

    /// How long a span of the wall is on this clock.
    pub fn span_of_wall(&self, wall: Duration) -> Duration {
        scale(wall, self.speed())
    }

    /// Wall time since the clock's start; a shared clock is its own wall.
    pub(super) fn wall_elapsed(&self) -> Duration {
        match &self.0 {
            Pace::Wall { start, .. } => start.elapsed(),
            Pace::Lockstep(participant) => participant.now().since(Time::ZERO),
        }
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
