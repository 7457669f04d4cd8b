//! Motions that end at rest: time-optimal, limited in speed, acceleration and jerk, all axes
//! together, from whatever the axes do now.
//!
//! Source: the method of L. Berscheid and T. Kröger, "Jerk-limited Real-time Trajectory
//! Generation with Arbitrary Target States", Robotics: Science and Systems 2021, by the package
//! rsruckig.
//!
//! A motion that is planned anew on the fly begins with the position, speed and acceleration of
//! the moment: nothing steps. A stop brings every axis to rest as soon as its own limits allow;
//! all begin in the same period. Planning and looking up ask for no memory, except for the text of a refusal.

use core::time::Duration;

use units::{Metres, MetresPerSecond};

use super::moment::Moment;
use super::planner::{Leg, Planner, Refusal};
use super::{AXES_MAX, AxisLimits, PerAxis};

/// Why there is no such motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// The target is outside the soft limits.
    #[error(
        "target {:.6} mm of axis number {axis} is outside the soft limits {:.3} to {:.3} mm; \
         nothing was moved",
        target.mm(), min.mm(), max.mm()
    )]
    SoftLimit {
        /// Which axis, in the order of the engine's axes.
        axis: usize,
        /// Where it should have gone.
        target: Metres,
        /// The lower limit.
        min: Metres,
        /// The upper limit.
        max: Metres,
    },
    /// The planner found none within the limits.
    #[error("no motion within the limits of speed, acceleration and jerk: {why}")]
    NotPlanned {
        /// What the planner said.
        why: String,
    },
}

impl From<Refusal> for MotionError {
    fn from(why: Refusal) -> Self {
        Self::NotPlanned { why }
    }
}

/// Plans and looks up one motion at a time.
///
/// # Example
///
/// ```
/// use machine::engine::{AXES_MAX, AxisLimits, Moment, Motion, MotionError};
/// use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};
///
/// let x = AxisLimits {
///     max: Metres(0.1),
///     speed: MetresPerSecond(0.1),
///     move_speed: MetresPerSecond(0.1),
///     acceleration: MetresPerSecondSquared(1.0),
///     jerk: MetresPerSecondCubed(10.0),
///     ..AxisLimits::default()
/// };
/// let mut motion = Motion::new(1, [x; AXES_MAX]);
/// let (rest, target) = (Moment::default(), [Metres(0.05); AXES_MAX]);
/// let takes = motion.plan_to(&rest, &target)?;
/// // 0.05 m at 0.1 m/s, a tenth of a second more to get there, and another for the jerk.
/// assert!((takes.as_secs_f64() - 0.7).abs() < 1e-9);
/// assert!((motion.at(takes / 2).position[0].mm() - 25.0).abs() < 1e-9);
/// let refused = motion.plan_to(&rest, &[Metres(0.2); AXES_MAX]);
/// assert!(matches!(refused, Err(MotionError::SoftLimit { axis: 0, .. })));
/// # Ok::<(), MotionError>(())
/// ```
pub struct Motion {
    axes: usize,
    limits: PerAxis<AxisLimits>,
    /// Boxed for its 42 KB: an engine is moved about while it is made, and without optimisation each move is a copy
    /// on the stack, of which threads have 2 MB.
    planner: Box<Planner>,
    way: Leg,
    /// Where the way ends, when that was asked for; a stop ends where it ends.
    target: Option<PerAxis<Metres>>,
    /// Made before the way where there is no direct one.
    pause: Leg,
    /// How many seconds that takes; 0 where the way is direct.
    pausing: f64,
}

impl Motion {
    /// Of the first `axes` of `limits`, at most [`AXES_MAX`].
    pub fn new(axes: usize, limits: PerAxis<AxisLimits>) -> Self {
        let axes = axes.min(AXES_MAX);
        Self {
            axes,
            limits,
            planner: Box::new(Planner::new(axes, limits)),
            way: Leg::new(axes),
            target: None,
            pause: Leg::new(axes),
            pausing: 0.0,
        }
    }

    /// Plans the way from `from` to rest at `target`, along a straight line where the axes come
    /// from rest; returns how long it takes. Where the planner knows no way from what the axes
    /// do, they stop first.
    ///
    /// # Errors
    /// When the target is outside the soft limits or there is no such way; the plan before is
    /// lost then.
    pub fn plan_to(
        &mut self,
        from: &Moment,
        target: &PerAxis<Metres>,
    ) -> Result<Duration, MotionError> {
        self.plan_within(from, target, None)
    }

    /// The same, with all axes together no faster than `speed`.
    ///
    /// # Errors
    /// As [`Self::plan_to`].
    pub fn plan_within(
        &mut self,
        from: &Moment,
        target: &PerAxis<Metres>,
        speed: Option<MetresPerSecond>,
    ) -> Result<Duration, MotionError> {
        self.check(target)?;
        self.target = Some(*target);
        self.pausing = 0.0;
        if from.is_rest() {
            let (planner, way) = (&mut self.planner, &mut self.way);
            planner.line(&from.position, target, speed, way)?;
        } else if speed.is_some() || self.planner.way(from, target, &mut self.way).is_err() {
            self.planner.stop(from, &mut self.pause)?;
            self.pausing = self.pause.seconds();
            let rest = self.pause.at(self.pausing).position;
            self.planner.line(&rest, target, speed, &mut self.way)?;
        }
        self.lasts()
    }

    fn check(&self, target: &PerAxis<Metres>) -> Result<(), MotionError> {
        for (axis, wanted) in target.iter().copied().enumerate().take(self.axes) {
            let AxisLimits { min, max, .. } = self.limits[axis];
            if !(min <= wanted && wanted <= max) {
                return Err(MotionError::SoftLimit {
                    axis,
                    target: wanted,
                    min,
                    max,
                });
            }
        }
        Ok(())
    }

    /// Plans the way from `from` to rest as soon as possible, each axis by itself; returns how
    /// long the slowest takes.
    ///
    /// # Errors
    /// When there is none, which numbers that are finite and limits above zero do not bring about.
    pub fn plan_stop(&mut self, from: &Moment) -> Result<Duration, MotionError> {
        self.target = None;
        self.pausing = 0.0;
        self.planner.stop(from, &mut self.way)?;
        self.lasts()
    }

    fn lasts(&self) -> Result<Duration, MotionError> {
        Duration::try_from_secs_f64(self.seconds()).map_err(|error| MotionError::NotPlanned {
            why: error.to_string(),
        })
    }

    fn seconds(&self) -> f64 {
        self.pausing + self.way.seconds()
    }

    /// What the axes do `after` the plan's beginning; at its end when it is over.
    pub fn at(&self, after: Duration) -> Moment {
        let seconds = after.as_secs_f64();
        if seconds < self.pausing {
            return self.pause.at(seconds);
        }
        if !self.is_over(after) {
            return self.way.at(seconds - self.pausing);
        }
        let end = self.way.at(self.way.seconds());
        Moment::at_rest(self.target.unwrap_or(end.position))
    }

    /// Whether the plan is over `after` its beginning.
    pub fn is_over(&self, after: Duration) -> bool {
        after.as_secs_f64() >= self.seconds()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use units::MetresPerSecondCubed;
    use units::{MetresPerSecond, MetresPerSecondSquared};

    const AXES: usize = 3;

    /// Whatever precision stages may be set to, each axis by itself.
    fn limits() -> impl Strategy<Value = PerAxis<AxisLimits>> {
        let share = prop_oneof![Just(0.0), -3.0..0.0_f64];
        let one = (-3.0..0.5_f64, share, -2.0..1.5_f64, -1.0..4.0_f64);
        [one.clone(), one.clone(), one].prop_map(|axes| {
            let mut limits = PerAxis::default();
            for (limit, (speed, move_share, acceleration, jerk)) in limits.iter_mut().zip(axes) {
                let power = |exponent: f64| 10.0_f64.powf(exponent);
                *limit = AxisLimits {
                    min: Metres(-2.0),
                    max: Metres(2.0),
                    speed: MetresPerSecond(power(speed)),
                    move_speed: MetresPerSecond(power(speed + move_share)),
                    acceleration: MetresPerSecondSquared(power(acceleration)),
                    jerk: MetresPerSecondCubed(power(jerk)),
                    deviation: Metres::ZERO,
                };
            }
            limits
        })
    }

    /// Of the greatest: often nothing, often next to nothing, where planners have their seams.
    fn share() -> impl Strategy<Value = f64> {
        let small = (-12.0..0.0_f64, any::<bool>());
        prop_oneof![
            3 => -1.0..1.0_f64,
            1 => Just(0.0),
            2 => small.prop_map(|(power, up)| 10.0_f64.powf(power) * if up { 1.0 } else { -1.0 }),
        ]
    }

    type Shares = [[f64; 3]; AXES];

    fn shares() -> impl Strategy<Value = Shares> {
        let axis = || [share(), share(), share()];
        [axis(), axis(), axis()]
    }

    /// From what an axis can do: the speed at which its acceleration has gone is within limits.
    fn begin(limits: &PerAxis<AxisLimits>, shares: Shares) -> Moment {
        let mut moment = Moment::default();
        for (axis, [position, speed, acceleration]) in shares.into_iter().enumerate() {
            let (most, jerk) = (limits[axis].speed.value(), limits[axis].jerk.value());
            let reached = (2.0 * most * jerk).sqrt();
            let acceleration = acceleration * reached.min(limits[axis].acceleration.value());
            let gained = 0.5 * acceleration * acceleration / jerk;
            moment.position[axis] = Metres(0.5 * position);
            moment.speed[axis] = MetresPerSecond(speed * (most - gained));
            moment.acceleration[axis] = MetresPerSecondSquared(acceleration);
        }
        moment
    }

    /// The plan begins as it was told and keeps its limits at every step.
    fn check(motion: &Motion, from: &Moment, duration: Duration) {
        const STEPS: u32 = 500;
        let step = duration / STEPS;
        let seconds = step.as_secs_f64();
        let mut before = motion.at(Duration::ZERO);
        for axis in 0..AXES {
            let stepped = (before.position[axis] - from.position[axis]).value();
            assert_most(stepped, 0.0, "position", 0);
            let stepped = (before.speed[axis] - from.speed[axis]).value();
            assert_most(stepped, 0.0, "speed", 0);
        }
        for at in 1..=STEPS {
            let now = motion.at(step * at);
            for (axis, limit) in motion.limits.iter().enumerate().take(AXES) {
                let AxisLimits {
                    speed,
                    move_speed,
                    acceleration,
                    jerk,
                    ..
                } = limit;
                let turned = now.acceleration[axis] - before.acceleration[axis];
                let gained = now.speed[axis] - before.speed[axis];
                let moved = now.position[axis] - before.position[axis];
                assert_most(turned.value(), jerk.value() * seconds, "jerk", at);
                assert_most(
                    now.acceleration[axis].value(),
                    acceleration.value(),
                    "a",
                    at,
                );
                assert_most(gained.value(), acceleration.value() * seconds, "gain", at);
                assert_most(now.speed[axis].value(), speed.value(), "speed", at);
                assert_most(moved.value(), speed.value() * seconds, "way", at);
                // A stop may begin on a path, which is faster than a move.
                if motion.target.is_some() && (step * at).as_secs_f64() >= motion.pausing {
                    assert_most(now.speed[axis].value(), move_speed.value(), "move", at);
                }
            }
            before = now;
        }
        let after = duration + Duration::from_nanos(1);
        assert!(motion.is_over(after) && motion.at(after).is_rest());
    }

    #[track_caller]
    fn assert_most(seen: f64, most: f64, what: &str, at: u32) {
        assert!(
            seen.abs() <= most * 1.0001 + 1e-9,
            "{what} at step {at}: {seen} > {most}"
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4_000))]

        #[test]
        fn a_stop_keeps_its_limits_from_whatever_the_axes_do(
            limits in limits(),
            from in shares(),
        ) {
            let (mut motion, from) = (Motion::new(AXES, limits), begin(&limits, from));
            let duration = motion.plan_stop(&from).unwrap();
            check(&motion, &from, duration);
        }

        #[test]
        fn a_move_keeps_its_limits_from_whatever_the_axes_do(
            limits in limits(),
            from in shares(),
            go in shares(),
        ) {
            let (mut motion, from) = (Motion::new(AXES, limits), begin(&limits, from));
            let mut target = begin(&limits, go).position;
            for (target, from) in target.iter_mut().zip(from.position) {
                *target += from;
            }
            let duration = motion.plan_to(&from, &target).unwrap();
            check(&motion, &from, duration);
            prop_assert_eq!(motion.at(duration + Duration::from_secs(1)).position, target);
        }

        #[test]
        fn from_rest_the_axes_go_straight(limits in limits(), from in shares(), to in shares()) {
            let from = Moment::at_rest(begin(&limits, from).position);
            let target = begin(&limits, to).position;
            let mut motion = Motion::new(AXES, limits);
            let duration = motion.plan_to(&from, &target).unwrap();
            check(&motion, &from, duration);
            let goes = |to: &PerAxis<Metres>, axis: usize| (to[axis] - from.position[axis]).value();
            let length = (0..AXES).map(|axis| goes(&target, axis).abs()).fold(0.0, f64::max);
            for at in 0..10 {
                let now = motion.at(duration * at / 10).position;
                for (one, other) in [(0, 1), (1, 2), (2, 0)] {
                    let beside = goes(&now, one) * goes(&target, other)
                        - goes(&now, other) * goes(&target, one);
                    prop_assert!(beside.abs() <= 1e-12 * length, "{} of {}", beside, length);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn axes_together_keep_the_speed_that_is_asked_for(
            limits in limits(),
            from in shares(),
            to in shares(),
            speed in -6.0..0.5_f64,
        ) {
            let from = begin(&limits, from);
            let target = begin(&limits, to).position;
            let speed = 10.0_f64.powf(speed);
            let mut motion = Motion::new(AXES, limits);
            let within = Some(MetresPerSecond(speed));
            let duration = motion.plan_within(&from, &target, within).unwrap();
            check(&motion, &from, duration);
            let pausing = Duration::from_secs_f64(motion.pausing);
            for at in 0..100 {
                let now = motion.at(pausing + (duration - pausing) * at / 100);
                let squares = (0..AXES).map(|axis| now.speed[axis].value().powi(2));
                assert_most(squares.sum::<f64>().sqrt(), speed, "together", at);
            }
            prop_assert_eq!(motion.at(duration + Duration::from_secs(1)).position, target);
        }
    }

    /// Found by chance: rsruckig 3.0.1 lets the first axis jerk beyond its limit.
    #[test]
    fn where_the_planner_knows_no_way_the_axes_stop_first() {
        let limit = |speed, acceleration, jerk| AxisLimits {
            min: Metres(-1.0),
            max: Metres(1.0),
            speed: MetresPerSecond(speed),
            move_speed: MetresPerSecond(speed),
            acceleration: MetresPerSecondSquared(acceleration),
            jerk: MetresPerSecondCubed(jerk),
            deviation: Metres::ZERO,
        };
        let mut limits = PerAxis::default();
        limits[0] = limit(0.037_053_585_510_715_26, 1.0, 4.318_099_797_526_457_5);
        limits[1] = limit(1.0, 0.015_517_567_210_934_705, 1.0);
        limits[2] = limit(1.0, 0.125_947_662_427_676_02, 664.528_664_947_563_7);
        let shares = [
            [0.0, -3.722_108_021_916_534e-8, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 0.0, -0.000_943_155_709_149_820_8],
        ];
        let from = begin(&limits, shares);
        let mut target = PerAxis::default();
        target[0] = Metres(-1.331_057_963_109_336_3e-12);
        target[2] = Metres(2.863_832_754_328_517_5e-11);
        let mut motion = Motion::new(AXES, limits);
        let duration = motion.plan_to(&from, &target).unwrap();
        assert!(motion.pausing > 0.0);
        check(&motion, &from, duration);
    }
}
