//! Trapezoidal motion profiles in drive counts, evaluated analytically at any time.
//!
//! Purpose: the drive's own demand (0x6062). A profile is a handful of phases of constant
//! acceleration; nothing is integrated step by step, so a profile gives the same bits however
//! often and whenever it is asked. A new profile starts from the position and speed that the
//! old one has at that moment (re-planning on the fly); a move too short for its speed is a
//! triangle. Absent: jerk limits (0x6086 = 0, the linear ramp).

use std::time::Duration;

use units::Time;

/// Position and speed of a demand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState {
    /// In counts.
    pub position: f64,
    /// In counts per second.
    pub velocity: f64,
}

/// What a move may use, all positive, in counts and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// 0x6081.
    pub velocity: f64,
    /// 0x6083.
    pub acceleration: f64,
    /// 0x6084.
    pub deceleration: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Phase {
    /// Seconds after the profile's start.
    start_s: f64,
    from: MotionState,
    acceleration: f64,
}

impl Phase {
    fn at(&self, seconds: f64) -> MotionState {
        let t = seconds - self.start_s;
        let MotionState { position, velocity } = self.from;
        MotionState {
            position: position + velocity * t + 0.5 * self.acceleration * t * t,
            velocity: velocity + self.acceleration * t,
        }
    }
}

/// A demand over time, at rest before nothing and after its end.
///
/// # Example
///
/// ```
/// use mock_bus::node::profile::{MotionLimits, MotionState, Profile};
/// use units::Time;
///
/// let rest = MotionState { position: 0.0, velocity: 0.0 };
/// let limits = MotionLimits { velocity: 100.0, acceleration: 100.0, deceleration: 100.0 };
/// let profile = Profile::to_target(Time::ZERO, rest, 300.0, limits);
/// // A second each to speed up and to slow down, and 200 counts between them.
/// assert_eq!(profile.end(), Time::from_seconds(4.0));
/// let half = profile.at(Time::from_seconds(2.0));
/// assert_eq!((half.position, half.velocity), (150.0, 100.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    start: Time,
    phases: Vec<Phase>,
    duration_s: f64,
    end_position: f64,
}

impl Profile {
    /// Stands at `position`.
    pub fn resting(position: f64) -> Self {
        Self {
            start: Time::ZERO,
            phases: Vec::new(),
            duration_s: 0.0,
            end_position: position,
        }
    }

    /// Moves from `from` to `target` and stands there.
    ///
    /// An axis that is too fast to stop in time overshoots and comes back; one that is faster
    /// than the limit slows down first.
    pub fn to_target(start: Time, from: MotionState, target: f64, limits: MotionLimits) -> Self {
        let mut plan = Plan::new(start, from);
        plan.approach(target, limits);
        plan.finish(target)
    }

    /// Slows down from `from` to standstill.
    pub fn stopping(start: Time, from: MotionState, deceleration: f64) -> Self {
        let mut plan = Plan::new(start, from);
        plan.change_speed(0.0, deceleration);
        let end = plan.now.position;
        plan.finish(end)
    }

    /// Goes straight from `from` to `target` in `duration` (interpolation of CSP set-points).
    pub fn interpolating(start: Time, from: f64, target: f64, duration: Duration) -> Self {
        let seconds = duration.as_secs_f64();
        let velocity = (target - from) / seconds;
        let from = MotionState {
            position: from,
            velocity: if velocity.is_finite() { velocity } else { 0.0 },
        };
        let mut plan = Plan::new(start, from);
        plan.phase(seconds, 0.0);
        plan.finish(target)
    }

    /// The demand at `now`.
    pub fn at(&self, now: Time) -> MotionState {
        let seconds = now.since(self.start).as_nanos() as f64 * 1e-9;
        let current = self.phases.iter().rev().find(|p| p.start_s <= seconds);
        match current {
            Some(phase) if seconds < self.duration_s => phase.at(seconds),
            _ => MotionState {
                position: self.end_position,
                velocity: 0.0,
            },
        }
    }

    /// The first moment at which the profile stands.
    pub fn end(&self) -> Time {
        let nanos = (self.duration_s * 1e9).ceil() as u64;
        Time(self.start.0.saturating_add(nanos))
    }

    /// Whether the profile stands at `now`.
    pub fn is_done(&self, now: Time) -> bool {
        self.end() <= now
    }

    /// Where the profile ends.
    pub const fn end_position(&self) -> f64 {
        self.end_position
    }

    /// The same motion in coordinates that were shifted by `counts` (homing moves the zero).
    #[must_use]
    pub fn shifted(mut self, counts: f64) -> Self {
        self.end_position += counts;
        for phase in &mut self.phases {
            phase.from.position += counts;
        }
        self
    }
}

/// A profile in the making: the phases so far and the state they lead to.
struct Plan {
    start: Time,
    phases: Vec<Phase>,
    elapsed_s: f64,
    now: MotionState,
}

impl Plan {
    const fn new(start: Time, from: MotionState) -> Self {
        Self {
            start,
            phases: Vec::new(),
            elapsed_s: 0.0,
            now: from,
        }
    }

    fn phase(&mut self, duration_s: f64, acceleration: f64) {
        if duration_s.is_nan() || duration_s <= 0.0 {
            return;
        }
        let phase = Phase {
            start_s: self.elapsed_s,
            from: self.now,
            acceleration,
        };
        self.elapsed_s += duration_s;
        self.now = phase.at(self.elapsed_s);
        self.phases.push(phase);
    }

    fn change_speed(&mut self, to: f64, rate: f64) {
        let change = to - self.now.velocity;
        self.phase(change.abs() / rate, rate.copysign(change));
        self.now.velocity = to;
    }

    /// `s` is the direction in which the axis must be moving at the end: towards the target
    /// from the point where it could stop now.
    fn approach(&mut self, target: f64, limits: MotionLimits) {
        let MotionState { position, velocity } = self.now;
        let stop = position + velocity * velocity.abs() / (2.0 * limits.deceleration);
        let direction = if target >= stop { 1.0 } else { -1.0 };
        if velocity * direction < 0.0 {
            self.change_speed(0.0, limits.deceleration);
        } else if velocity.abs() > limits.velocity {
            self.change_speed(direction * limits.velocity, limits.deceleration);
        }
        self.trapezoid(direction, (target - self.now.position) * direction, limits);
    }

    /// From a speed of 0 to the limit, in `direction`, over `distance` ≥ the stopping distance.
    fn trapezoid(&mut self, direction: f64, distance: f64, limits: MotionLimits) {
        let MotionLimits {
            velocity: limit,
            acceleration,
            deceleration,
        } = limits;
        let speed = self.now.velocity.abs();
        let reserve = distance + speed * speed / (2.0 * acceleration);
        let per_square = 0.5 / acceleration + 0.5 / deceleration;
        let peak = (reserve.max(0.0) / per_square)
            .sqrt()
            .clamp(speed, limit.max(speed));
        let cruise = reserve - peak * peak * per_square;
        self.change_speed(direction * peak, acceleration);
        self.phase(cruise.max(0.0) / peak, 0.0);
        self.change_speed(0.0, deceleration);
    }

    fn finish(self, end_position: f64) -> Profile {
        Profile {
            start: self.start,
            phases: self.phases,
            duration_s: self.elapsed_s,
            end_position,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: MotionLimits = MotionLimits {
        velocity: 100.0,
        acceleration: 50.0,
        deceleration: 100.0,
    };

    const fn state(position: f64, velocity: f64) -> MotionState {
        MotionState { position, velocity }
    }

    #[track_caller]
    fn check_at(profile: &Profile, seconds: f64, position: f64, velocity: f64) {
        let seen = profile.at(Time::from_seconds(seconds));
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        let fits = near(seen.position, position) && near(seen.velocity, velocity);
        assert!(fits, "at {seconds} s: {seen:?}");
    }

    /// By hand: 2 s up to 100/s (100 counts), 1 s down (50 counts), the rest at 100/s.
    #[test]
    fn a_long_move_is_a_trapezoid() {
        let profile = Profile::to_target(Time::ZERO, state(0.0, 0.0), 250.0, LIMITS);
        check_at(&profile, 1.0, 25.0, 50.0);
        check_at(&profile, 2.0, 100.0, 100.0);
        check_at(&profile, 3.0, 200.0, 100.0);
        check_at(&profile, 3.5, 237.5, 50.0);
        check_at(&profile, 4.0, 250.0, 0.0);
        assert_eq!(profile.end(), Time::from_seconds(4.0));
    }

    /// By hand: peak v with v²/100 + v²/200 = 60, v² = 4000.
    #[test]
    fn a_short_move_is_a_triangle() {
        let profile = Profile::to_target(Time::ZERO, state(10.0, 0.0), -50.0, LIMITS);
        let peak = 4000.0_f64.sqrt();
        check_at(&profile, peak / 50.0, 10.0 - 40.0, -peak);
        check_at(&profile, peak / 50.0 + peak / 100.0, -50.0, 0.0);
    }

    #[test]
    fn a_target_that_was_passed_is_reached_by_coming_back() {
        let profile = Profile::to_target(Time::ZERO, state(0.0, 100.0), 10.0, LIMITS);
        check_at(&profile, 1.0, 50.0, 0.0);
        assert_eq!(profile.end_position(), 10.0);
        let past_the_turn = profile.at(Time::from_seconds(1.2));
        assert!(past_the_turn.velocity < 0.0);
    }

    #[test]
    fn a_stop_takes_its_deceleration_and_nothing_else() {
        let profile = Profile::stopping(Time::from_seconds(1.0), state(5.0, -40.0), 80.0);
        check_at(&profile, 1.25, 5.0 - 7.5, -20.0);
        check_at(&profile, 1.5, -5.0, 0.0);
        check_at(&profile, 9.0, -5.0, 0.0);
    }

    #[test]
    fn a_move_to_where_it_stands_is_over_at_once() {
        let start = Time::from_seconds(3.0);
        let profile = Profile::to_target(start, state(7.0, 0.0), 7.0, LIMITS);
        assert!(profile.is_done(start));
        check_at(&profile, 3.0, 7.0, 0.0);
    }

    prop_compose! {
        fn any_limits()(velocity in 1.0..1e7, acceleration in 1.0..1e8, deceleration in 1.0..1e8)
            -> MotionLimits
        {
            MotionLimits { velocity, acceleration, deceleration }
        }
    }

    /// Samples over the whole profile and a little beyond.
    fn samples(profile: &Profile) -> Vec<(f64, MotionState)> {
        let seconds = profile.duration_s;
        let moments = (0..=400).map(|i| seconds * 1.01 * f64::from(i) / 400.0);
        moments
            .map(|s| (s, profile.at(Time::from_seconds(s))))
            .collect()
    }

    proptest! {
        #[test]
        fn it_ends_at_the_target_within_the_limits_and_without_a_jump(
            position in -1e9..1e9,
            share in -1.0..1.0,
            target in -1e9..1e9,
            limits in any_limits(),
        ) {
            let from = state(position, share * limits.velocity);
            let profile = Profile::to_target(Time::ZERO, from, target, limits);
            let last = profile.at(profile.end());
            prop_assert_eq!(last, state(target, 0.0));
            let steepest = limits.acceleration.max(limits.deceleration);
            let all = samples(&profile);
            for ((t0, a), (t1, b)) in all.iter().zip(&all[1..]) {
                let step = (t1 - t0) + 2e-9;
                prop_assert!(b.velocity.abs() <= limits.velocity * (1.0 + 1e-9));
                let speed_change = (b.velocity - a.velocity).abs();
                prop_assert!(speed_change <= steepest * step * (1.0 + 1e-6) + 1e-3);
                let travel = (b.position - a.position).abs();
                prop_assert!(travel <= limits.velocity * step * (1.0 + 1e-6) + 1e-2);
            }
        }

        #[test]
        fn a_profile_taken_up_on_the_way_continues_where_the_old_one_was(
            target in -1e6..1e6,
            next in -1e6..1e6,
            share in 0.0..1.0,
            limits in any_limits(),
        ) {
            let first = Profile::to_target(Time::ZERO, state(0.0, 0.0), target, limits);
            let moment = Time::from_seconds(first.duration_s * share);
            let state_then = first.at(moment);
            let second = Profile::to_target(moment, state_then, next, limits);
            let resumed = second.at(moment);
            prop_assert!((resumed.position - state_then.position).abs() < 1e-3);
            let soon = second.at(moment + Duration::from_nanos(1));
            prop_assert!((soon.velocity - state_then.velocity).abs() <= 1.0);
            prop_assert_eq!(second.at(second.end()).position, next);
        }
    }
}
