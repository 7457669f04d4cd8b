//! A correction on its way to a moving axis: limited in size and rate, without a bump.
//!
//! Source: none; the limits answer "correction too big, too steep, too fast" at run time, where
//! [`Compensation::new`](crate::error_table::Compensation::new) has answered it for the table.
//!
//! Switching on or off, another table or a reversal with lost motion make the wanted correction
//! jump. Such a jump is announced ([`SlewedCorrection::expect_jump`]) and is then slewed without
//! an alarm; one that comes unannounced is slewed too, but raises [`Alarm::Rate`].
//!
//! Absent: acceleration limits (the drive's own), the choice of what is wanted.

use units::{Approach, Metres, MetresPerSecond, Time};

/// What was wrong with the last wanted correction.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Alarm {
    /// Larger than the size limit; clamped to it.
    #[error("correction of {:.3} um clamped to the limit of {:.3} um", wanted.um(), limit.um())]
    Size {
        /// What was wanted.
        wanted: Metres,
        /// The limit.
        limit: Metres,
    },
    /// Changed faster than the rate limit without notice; follows at the limit.
    #[error("the correction lags behind by {:.3} um: it changes faster than {:.3} um/s",
        lag.um(), limit.value() * 1e6)]
    Rate {
        /// How far it is behind.
        lag: Metres,
        /// The limit.
        limit: MetresPerSecond,
    },
    /// NaN or infinite; the last correction is held.
    #[error("the requested correction is not a number; the last one is held")]
    NotFinite,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// On the way to a value that jumped with notice.
    Blending,
    /// Following it.
    Tracking,
}

/// A correction that changes no faster and grows no larger than its limits.
///
/// # Example
///
/// ```
/// use compensator::apply::{Alarm, SlewedCorrection};
/// use units::{Metres, MetresPerSecond, Time};
///
/// let wanted = Metres::from_um(5.0);
/// // Up to 10 µm, 1 µm each millisecond.
/// let mut correction = SlewedCorrection::new(Metres::from_um(10.0), MetresPerSecond(1e-3));
/// correction.enable();
/// correction.advance(Time::ZERO, wanted);
/// let soon = correction.advance(Time::from_seconds(0.002), wanted);
/// assert!((soon.um() - 2.0).abs() < 1e-9 && !correction.is_settled());
/// correction.advance(Time::from_seconds(0.005), wanted);
/// assert_eq!((correction.is_settled(), correction.alarm()), (true, None));
/// correction.advance(Time::from_seconds(0.006), -wanted);
/// assert!(matches!(correction.alarm(), Some(Alarm::Rate { .. })), "a jump without notice");
/// ```
#[derive(Clone, Debug)]
pub struct SlewedCorrection {
    size: Metres,
    rate: MetresPerSecond,
    slope: f64,
    enabled: bool,
    phase: Phase,
    current: Metres,
    last: Option<Time>,
    alarm: Option<Alarm>,
}

impl SlewedCorrection {
    /// A disabled correction of zero; limits are magnitudes (a NaN limit holds it at zero).
    pub fn new(size: Metres, rate: MetresPerSecond) -> Self {
        Self {
            size: size.abs().max(Metres::ZERO),
            rate: rate.abs().max(MetresPerSecond::ZERO),
            slope: 0.0,
            enabled: false,
            phase: Phase::Tracking,
            current: Metres::ZERO,
            last: None,
            alarm: None,
        }
    }

    /// The same, which may in addition change by `slope` (a magnitude, dimensionless) times the
    /// way the axes make: what depends on position changes as fast as the axes move.
    pub fn with_slope(mut self, slope: f64) -> Self {
        self.slope = slope.abs().max(0.0);
        self
    }

    /// Starts to follow what is wanted, from where the correction is now.
    pub fn enable(&mut self) {
        self.enabled = true;
        self.phase = Phase::Blending;
    }

    /// Starts to return to zero.
    pub fn disable(&mut self) {
        self.enabled = false;
        self.phase = Phase::Blending;
    }

    /// Announces that the wanted value will jump: another table, a reversal.
    pub fn expect_jump(&mut self) {
        self.phase = Phase::Blending;
    }

    /// The correction to apply at `now` when `wanted` is right; nothing changes on the first
    /// call, because no time has passed.
    pub fn advance(&mut self, now: Time, wanted: Metres) -> Metres {
        self.advance_along(now, wanted, Metres::ZERO)
    }

    /// The same after the axes made a way of `moved` (a magnitude) since the last call: the
    /// correction may change by the slope times that on top of what the rate allows.
    pub fn advance_along(&mut self, now: Time, wanted: Metres, moved: Metres) -> Metres {
        let started = self.last.is_some();
        let elapsed = self.last.map_or(0.0, |last| now.since(last).as_secs_f64());
        self.last = Some(now);
        self.alarm = None;
        let wanted = if self.enabled { wanted } else { Metres::ZERO };
        if !wanted.is_finite() {
            self.alarm = Some(Alarm::NotFinite);
            return self.current;
        }
        let goal = wanted.max(-self.size).min(self.size);
        if goal != wanted {
            self.alarm = Some(Alarm::Size {
                wanted,
                limit: self.size,
            });
        }
        let way = if started && moved.is_finite() {
            moved.abs().value() * self.slope
        } else {
            0.0
        };
        let step = Metres(self.rate.value() * elapsed + way);
        let lag = goal - self.current;
        if lag.abs() <= step {
            self.current = goal;
            self.phase = Phase::Tracking;
            return self.current;
        }
        self.current += if lag > Metres::ZERO { step } else { -step };
        if self.phase == Phase::Tracking && self.alarm.is_none() {
            self.alarm = Some(Alarm::Rate {
                lag: goal - self.current,
                limit: self.rate,
            });
        }
        self.current
    }

    /// The correction last given out.
    pub fn current(&self) -> Metres {
        self.current
    }

    /// What was wrong in the last [`advance`](Self::advance), if anything.
    pub fn alarm(&self) -> Option<Alarm> {
        self.alarm
    }

    /// Whether it has reached what is wanted since the last announced jump.
    pub fn is_settled(&self) -> bool {
        self.phase == Phase::Tracking
    }

    /// Whether it follows what is wanted (or returns to zero).
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }
}

/// Remembers from which side the axis last came: lost motion depends on it.
///
/// Feed it commanded positions, not encoder noise: every change of sign counts as a reversal,
/// there is no dead band.
///
/// # Example
///
/// ```
/// use compensator::apply::ApproachTracker;
/// use units::{Approach, Metres};
///
/// let mut tracker = ApproachTracker::new();
/// assert_eq!(tracker.update(Metres(0.0)), None, "it has not moved yet");
/// assert_eq!(tracker.update(Metres(1e-3)), Some(Approach::Forward));
/// assert_eq!(tracker.update(Metres(1e-3)), Some(Approach::Forward), "standing still");
/// assert_eq!(tracker.approach_of(Metres(0.0)), Some(Approach::Reverse));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ApproachTracker {
    last: Option<Metres>,
    approach: Option<Approach>,
}

impl ApproachTracker {
    /// Nothing known.
    pub const fn new() -> Self {
        Self {
            last: None,
            approach: None,
        }
    }

    /// Takes the next commanded position and returns the approach, if it is known by now.
    /// Standing still changes nothing; a position that is not finite is ignored.
    pub fn update(&mut self, position: Metres) -> Option<Approach> {
        if !position.is_finite() {
            return self.approach;
        }
        if let Some(last) = self.last {
            self.approach = Approach::of_move(last, position).or(self.approach);
        }
        self.last = Some(position);
        self.approach
    }

    /// The last commanded position.
    pub const fn last(&self) -> Option<Metres> {
        self.last
    }

    /// The approach, if it is known.
    pub fn approach(&self) -> Option<Approach> {
        self.approach
    }

    /// The approach a move to `target` will have; the remembered one when it is no move.
    pub fn approach_of(&self, target: Metres) -> Option<Approach> {
        self.last
            .and_then(|last| Approach::of_move(last, target))
            .or(self.approach)
    }

    /// Forgets everything: power was off, or somebody pushed the stage.
    pub fn forget(&mut self) {
        *self = Self::new();
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::*;

    const UM: f64 = 1e-6;

    fn ms(ms: u64) -> Time {
        Time::ZERO + Duration::from_millis(ms)
    }

    /// Size limit 10 µm, rate 1 µm/ms.
    fn enabled() -> SlewedCorrection {
        let mut c = SlewedCorrection::new(Metres(10.0 * UM), MetresPerSecond(1e-3));
        c.advance(ms(0), Metres(5.0 * UM));
        c.enable();
        c
    }

    fn check_um(seen: Metres, expected: f64) {
        assert!((seen.um() - expected).abs() < 1e-9, "{} um", seen.um());
    }

    #[test]
    fn switching_on_and_off_makes_no_bump_and_no_alarm() {
        let mut c = enabled();
        for t in 1..=4 {
            check_um(c.advance(ms(t), Metres(5.0 * UM)), t as f64);
            assert!(!c.is_settled() && c.alarm().is_none());
        }
        check_um(c.advance(ms(5), Metres(5.0 * UM)), 5.0);
        assert!(c.is_settled());
        c.disable();
        check_um(c.advance(ms(6), Metres(5.0 * UM)), 4.0);
        check_um(c.advance(ms(20), Metres(5.0 * UM)), 0.0);
        assert_eq!(c.alarm(), None);
    }

    #[test]
    fn a_disabled_correction_stays_zero_whatever_is_wanted() {
        let mut c = SlewedCorrection::new(Metres(10.0 * UM), MetresPerSecond(1e-3));
        for t in 0..10 {
            check_um(c.advance(ms(t), Metres(8.0 * UM)), 0.0);
        }
    }

    #[test]
    fn a_correction_that_is_too_large_is_clamped_with_an_alarm() {
        let mut c = enabled();
        let seen = c.advance(ms(100), Metres(-25.0 * UM));
        check_um(seen, -10.0);
        assert!(matches!(c.alarm(), Some(Alarm::Size { .. })));
        c.advance(ms(200), Metres(3.0 * UM));
        assert_eq!(c.alarm(), None);
    }

    #[test]
    fn a_jump_without_notice_is_slewed_with_an_alarm_and_one_with_notice_without() {
        let mut c = enabled();
        c.advance(ms(100), Metres(5.0 * UM));
        check_um(c.advance(ms(101), Metres(-5.0 * UM)), 4.0);
        assert!(matches!(c.alarm(), Some(Alarm::Rate { .. })));
        c.advance(ms(200), Metres(5.0 * UM));
        c.expect_jump();
        check_um(c.advance(ms(201), Metres(-5.0 * UM)), 4.0);
        assert_eq!(c.alarm(), None);
    }

    /// Slope 1e-3: a way of 2 mm allows 2 µm on top of the 1 µm of a millisecond.
    #[test]
    fn a_way_of_the_axes_allows_its_slope_on_top_of_the_rate() {
        let mut c =
            SlewedCorrection::new(Metres(10.0 * UM), MetresPerSecond(1e-3)).with_slope(1e-3);
        c.enable();
        check_um(c.advance_along(ms(0), Metres(9.0 * UM), Metres(1.0)), 0.0);
        check_um(c.advance_along(ms(1), Metres(9.0 * UM), Metres(2e-3)), 3.0);
        check_um(
            c.advance_along(ms(2), Metres(9.0 * UM), Metres(f64::NAN)),
            4.0,
        );
        check_um(
            c.advance_along(ms(3), Metres(9.0 * UM), Metres(f64::INFINITY)),
            5.0,
        );
        check_um(c.advance_along(ms(4), Metres(9.0 * UM), Metres(-3e-3)), 9.0);
    }

    #[test]
    fn nan_and_time_running_backwards_hold_the_correction() {
        let mut c = enabled();
        c.advance(ms(100), Metres(5.0 * UM));
        check_um(c.advance(ms(101), Metres(f64::NAN)), 5.0);
        assert_eq!(c.alarm(), Some(Alarm::NotFinite));
        check_um(c.advance(ms(50), Metres(4.0 * UM)), 5.0);
    }

    #[test]
    fn the_approach_is_unknown_until_the_first_move_and_survives_standing_still() {
        let mut tracker = ApproachTracker::new();
        assert_eq!(tracker.update(Metres(0.0)), None);
        assert_eq!(tracker.update(Metres(0.0)), None);
        assert_eq!(tracker.update(Metres(1e-9)), Some(Approach::Forward));
        assert_eq!(tracker.update(Metres(1e-9)), Some(Approach::Forward));
        assert_eq!(tracker.approach_of(Metres(0.0)), Some(Approach::Reverse));
        assert_eq!(tracker.update(Metres(f64::NAN)), Some(Approach::Forward));
        assert_eq!(tracker.update(Metres(0.0)), Some(Approach::Reverse));
        tracker.forget();
        assert_eq!(tracker.approach(), None);
    }
}
