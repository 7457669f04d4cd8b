//! Motions that end at rest: time-optimal, limited in speed, acceleration and jerk, all axes
//! together, from whatever the axes do now.
//!
//! Source: the method of L. Berscheid and T. Kröger, "Jerk-limited Real-time Trajectory
//! Generation with Arbitrary Target States", Robotics: Science and Systems 2021, by the package
//! rsruckig. It judges positions to 1e-8 of its unit, so it is given millimetres.
//!
//! A motion that is planned anew on the fly begins with the position, speed and acceleration of
//! the moment: nothing steps. A stop brings every axis to rest as soon as its own limits allow;
//! all begin in the same period. Planning and looking up ask for no memory, except for the text of a refusal.

use core::time::Duration;

use rsruckig::prelude::{
    ControlInterface, InputParameter, Ruckig, RuckigResult, Synchronization, ThrowErrorHandler,
    Trajectory,
};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};

use super::{AXES_MAX, AxisLimits, PerAxis};

const MM: f64 = 1e3;

/// What the axes do at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Where they are.
    pub position: PerAxis<Metres>,
    /// How fast they go.
    pub speed: PerAxis<MetresPerSecond>,
    /// How their speed changes.
    pub acceleration: PerAxis<MetresPerSecondSquared>,
}

impl Moment {
    /// At rest.
    pub fn at_rest(position: PerAxis<Metres>) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }
}

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

/// Plans and looks up one motion at a time.
pub struct Motion {
    axes: usize,
    limits: PerAxis<AxisLimits>,
    planner: Ruckig<AXES_MAX, ThrowErrorHandler>,
    input: InputParameter<AXES_MAX>,
    plan: Trajectory<AXES_MAX>,
    /// Where the plan ends, when that was asked for; a stop ends where it ends.
    target: Option<PerAxis<Metres>>,
}

impl Motion {
    /// Of the first `axes` of `limits`, at most [`AXES_MAX`].
    pub fn new(axes: usize, limits: PerAxis<AxisLimits>) -> Self {
        let axes = axes.min(AXES_MAX);
        let mut input = InputParameter::new(None);
        for (axis, limit) in limits.iter().enumerate() {
            input.enabled[axis] = axis < axes;
            input.max_velocity[axis] = limit.speed.value() * MM;
            input.max_acceleration[axis] = limit.acceleration.value() * MM;
            input.max_jerk[axis] = limit.jerk.value() * MM;
        }
        Self {
            axes,
            limits,
            // Only motions that are looked up by time are made: the step counts for nothing.
            planner: Ruckig::new(None, 1.0),
            input,
            plan: Trajectory::new(None),
            target: None,
        }
    }

    fn begin_at(&mut self, from: &Moment) {
        for axis in 0..self.axes {
            let limit = &self.limits[axis];
            let within = |value: f64, limit: f64| value.clamp(-limit, limit) * MM;
            self.input.current_position[axis] = from.position[axis].value() * MM;
            // What was reckoned from differences may exceed a limit by its rounding.
            self.input.current_velocity[axis] =
                within(from.speed[axis].value(), limit.speed.value());
            self.input.current_acceleration[axis] =
                within(from.acceleration[axis].value(), limit.acceleration.value());
        }
    }

    fn calculate(&mut self) -> Result<Duration, MotionError> {
        let refused = |why: String| MotionError::NotPlanned { why };
        match self.planner.calculate(&self.input, &mut self.plan) {
            Ok(RuckigResult::Working | RuckigResult::Finished) => {
                let seconds = self.plan.get_duration();
                Duration::try_from_secs_f64(seconds).map_err(|error| refused(error.to_string()))
            }
            Ok(other) => Err(refused(format!("{other:?}"))),
            Err(error) => Err(refused(error.to_string())),
        }
    }

    /// Plans the way from `from` to rest at `target`, along a straight line where the axes come
    /// from rest; returns how long it takes.
    ///
    /// # Errors
    /// When the target is outside the soft limits or there is no such way; the plan before is
    /// lost then.
    pub fn plan_to(
        &mut self,
        from: &Moment,
        target: &PerAxis<Metres>,
    ) -> Result<Duration, MotionError> {
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
            self.input.target_position[axis] = wanted.value() * MM;
        }
        self.begin_at(from);
        self.input.control_interface = ControlInterface::Position;
        self.input.synchronization = Synchronization::Phase;
        self.target = Some(*target);
        self.calculate()
    }

    /// Plans the way from `from` to rest as soon as possible, each axis by itself; returns how
    /// long the slowest takes.
    ///
    /// # Errors
    /// When there is none, which numbers that are finite and limits above zero do not bring about.
    pub fn plan_stop(&mut self, from: &Moment) -> Result<Duration, MotionError> {
        self.begin_at(from);
        self.input.control_interface = ControlInterface::Velocity;
        // Where axes that are made to stop at one moment have a speed near zero and an
        // acceleration, rsruckig 3.0.1 lets them jerk beyond the limit; and the shortest way is
        // wanted in any case.
        self.input.synchronization = Synchronization::None;
        self.target = None;
        self.calculate()
    }

    /// What the axes do `after` the plan's beginning; at its end when it is over.
    pub fn at(&self, after: Duration) -> Moment {
        let over = after.as_secs_f64() >= self.plan.get_duration();
        let seconds = after.as_secs_f64().min(self.plan.get_duration());
        let mut position = self.input.current_position.clone();
        let mut speed = self.input.current_velocity.clone();
        let mut acceleration = self.input.current_acceleration.clone();
        self.plan.at_time(
            seconds,
            &mut Some(&mut position),
            &mut Some(&mut speed),
            &mut Some(&mut acceleration),
            &mut None,
            &mut None,
        );
        let mut moment = Moment::default();
        for axis in 0..self.axes {
            moment.position[axis] = Metres(position[axis] / MM);
            if !over {
                moment.speed[axis] = MetresPerSecond(speed[axis] / MM);
                moment.acceleration[axis] = MetresPerSecondSquared(acceleration[axis] / MM);
            }
        }
        if let Some(target) = self.target.filter(|_| over) {
            moment.position = target;
        }
        moment
    }

    /// Whether the plan is over `after` its beginning.
    pub fn is_over(&self, after: Duration) -> bool {
        after.as_secs_f64() >= self.plan.get_duration()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use units::MetresPerSecondCubed;

    const SPEED: f64 = 0.2;
    const ACCELERATION: f64 = 2.0;
    const JERK: f64 = 100.0;
    const STEP: f64 = 1e-3;

    fn motion() -> Motion {
        let limits = AxisLimits {
            min: Metres(-1.0),
            max: Metres(1.0),
            speed: MetresPerSecond(SPEED),
            acceleration: MetresPerSecondSquared(ACCELERATION),
            jerk: MetresPerSecondCubed(JERK),
            deviation: Metres::ZERO,
        };
        Motion::new(3, [limits; AXES_MAX])
    }

    /// From what an axis can do: the speed at which its acceleration has gone is within limits.
    fn begin(shares: [[f64; 3]; 3]) -> Moment {
        let mut moment = Moment::default();
        for (axis, [position, speed, acceleration]) in shares.into_iter().enumerate() {
            let acceleration = acceleration * ACCELERATION;
            let gained = 0.5 * acceleration * acceleration.abs() / JERK;
            moment.position[axis] = Metres(0.5 * position);
            moment.speed[axis] = MetresPerSecond(speed * (SPEED - gained.abs()));
            moment.acceleration[axis] = MetresPerSecondSquared(acceleration);
        }
        moment
    }

    /// The plan begins as it was told and keeps its limits at every step.
    fn check(motion: &Motion, from: &Moment, duration: Duration) {
        let count = (duration.as_secs_f64() / STEP) as u32 + 2;
        let mut before = *from;
        for at in 0..=count {
            let now = motion.at(Duration::from_secs_f64(f64::from(at) * STEP));
            for axis in 0..3 {
                let (speed, was) = (now.speed[axis].value(), before.speed[axis].value());
                let acceleration = now.acceleration[axis].value();
                let jerked = (acceleration - before.acceleration[axis].value()).abs();
                let moved = (now.position[axis] - before.position[axis]).value();
                prop_assert_near(jerked, JERK * STEP, "acceleration", at);
                prop_assert_near(
                    acceleration.abs(),
                    ACCELERATION,
                    "limit of acceleration",
                    at,
                );
                prop_assert_near(speed.abs(), SPEED, "limit of speed", at);
                prop_assert_near((speed - was).abs(), ACCELERATION * STEP, "speed", at);
                prop_assert_near(moved.abs(), SPEED * STEP, "position", at);
            }
            before = now;
        }
        assert_eq!(before.speed, Moment::default().speed);
        assert!(motion.is_over(duration + Duration::from_nanos(1)));
    }

    #[track_caller]
    fn prop_assert_near(seen: f64, most: f64, what: &str, at: u32) {
        assert!(
            seen <= most * 1.0001 + 1e-9,
            "{what} at step {at}: {seen} > {most}"
        );
    }

    fn shares() -> impl Strategy<Value = [[f64; 3]; 3]> {
        let one = || prop_oneof![3 => -1.0..1.0_f64, 1 => Just(0.0)];
        let axis = move || [one(), one(), one()];
        [axis(), axis(), axis()]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn a_stop_keeps_its_limits_from_whatever_the_axes_do(from in shares()) {
            let (mut motion, from) = (motion(), begin(from));
            let duration = motion.plan_stop(&from).unwrap();
            check(&motion, &from, duration);
        }

        #[test]
        fn a_move_keeps_its_limits_from_whatever_the_axes_do(from in shares(), to in shares()) {
            let (mut motion, from) = (motion(), begin(from));
            let target = begin(to).position;
            let duration = motion.plan_to(&from, &target).unwrap();
            check(&motion, &from, duration);
            prop_assert_eq!(motion.at(duration + Duration::from_secs(1)).position, target);
        }
    }
}
