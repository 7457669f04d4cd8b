//! Trajectories and stops by rsruckig, in units that suit it.
//!
//! rsruckig 3.0.1 compares with fixed numbers: positions and speeds to 1e-8, accelerations to
//! 1e-10 and their limits to 1e-12. In millimetres and seconds it refused one way in two thousand,
//! stops and ways from rest among them, because 24 000 mm/s² cannot be told to 1e-12; in metres it
//! would end 10 nm short. In the units of [`Scale`] it refused no stop and no straight line of
//! twelve million random ones within limits of 1 mm/s to 3 m/s, 10 mm/s² to 30 m/s² and 0.1 to
//! 10 000 m/s³. What is left are ways of axes that are almost at rest almost at their target: one
//! in a hundred of those is refused, and a few in a million go beyond their limits.

use rsruckig::prelude::{
    ControlInterface, DataArrayOrVec, InputParameter, Ruckig, RuckigResult, Synchronization,
    ThrowErrorHandler, Trajectory,
};
use units::portable::{power_of_two_below, powi};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};

use super::moment::Moment;
use super::{AXES_MAX, AxisLimits, PerAxis};

/// What the planner said when it found no way.
pub(super) type Refusal = String;

/// Greatest speed, acceleration and jerk, in metres and seconds.
#[derive(Clone, Copy, Debug)]
struct Rates {
    speed: f64,
    acceleration: f64,
    jerk: f64,
}

impl Rates {
    fn of(limits: &AxisLimits) -> Self {
        Self {
            speed: limits.speed.value(),
            acceleration: limits.acceleration.value(),
            jerk: limits.jerk.value(),
        }
    }

    fn of_move(limits: &AxisLimits) -> Self {
        Self {
            speed: limits.move_speed.value(),
            ..Self::of(limits)
        }
    }

    /// Of what goes so many times as fast as what these belong to.
    fn shared_by(self, share: f64) -> Self {
        Self {
            speed: self.speed / share,
            acceleration: self.acceleration / share,
            jerk: self.jerk / share,
        }
    }

    fn least(self, other: Self) -> Self {
        Self {
            speed: self.speed.min(other.speed),
            acceleration: self.acceleration.min(other.acceleration),
            jerk: self.jerk.min(other.jerk),
        }
    }

    /// Where the jerk is small, the greatest speed comes before the greatest acceleration.
    fn reached_acceleration(&self) -> f64 {
        self.acceleration.min((self.speed * self.jerk).sqrt())
    }
}

/// Units in which the planner reckons: powers of two of metres and seconds, so that nothing is
/// rounded on the way there and back.
#[derive(Clone, Copy, Debug)]
struct Scale {
    /// Seconds of its unit of time.
    time: f64,
}

impl Scale {
    /// Its units of length in a metre.
    const LENGTH: f64 = 256.0;
    /// At most, and more than a quarter of it.
    const ACCELERATION: f64 = 128.0;
    /// At most where the unit of time is that of a long way.
    const JERK: f64 = 1e6;
    /// rsruckig 3.0.1 refuses what lasts longer than 7600 of its units of time.
    const LASTING: f64 = 7000.0;

    fn of(reached_acceleration: f64) -> Self {
        let time = (Self::ACCELERATION / (Self::LENGTH * reached_acceleration)).sqrt();
        Self {
            time: power_of_two_below(time),
        }
    }

    /// The scale of a way of so many metres at `rates`. One that lasts for hours begins and ends more gently, so that the
    /// planner takes its numbers.
    fn of_way(length: f64, rates: &mut Rates) -> Self {
        let usual = Self::of(rates.reached_acceleration());
        let long = Self {
            time: power_of_two_below(2.0 * length / rates.speed / Self::LASTING),
        };
        if long.time <= usual.time {
            return usual;
        }
        rates.acceleration = rates.acceleration.min(Self::ACCELERATION / long.factor(2));
        rates.jerk = rates.jerk.min(Self::JERK / long.factor(3));
        long
    }

    /// Of a quantity that has so many seconds below its fraction bar.
    fn factor(self, seconds: i32) -> f64 {
        Self::LENGTH * powi(self.time, seconds)
    }
}

/// A straight line from rest to rest: where each axis begins, and how far it goes for every metre
/// of the one that goes farthest.
#[derive(Clone, Copy, Debug)]
struct Line {
    from: PerAxis<Metres>,
    shares: PerAxis<f64>,
}

/// A planned way.
pub(super) struct Leg {
    axes: usize,
    scale: Scale,
    trajectory: Trajectory<AXES_MAX>,
    /// `None` where every axis has a trajectory of its own.
    line: Option<Line>,
}

impl Leg {
    /// With places for so many axes; there is no way yet.
    pub(super) fn new(axes: usize) -> Self {
        Self {
            axes,
            scale: Scale { time: 1.0 },
            trajectory: Trajectory::new(None),
            line: None,
        }
    }

    /// How long it takes.
    pub(super) fn seconds(&self) -> f64 {
        self.trajectory.get_duration() * self.scale.time
    }

    /// What the axes do so many seconds after its beginning.
    pub(super) fn at(&self, seconds: f64) -> Moment {
        let mut position = DataArrayOrVec::new(None, 0.0);
        let mut speed = DataArrayOrVec::new(None, 0.0);
        let mut acceleration = DataArrayOrVec::new(None, 0.0);
        self.trajectory.at_time(
            seconds / self.scale.time,
            &mut Some(&mut position),
            &mut Some(&mut speed),
            &mut Some(&mut acceleration),
            &mut None,
            &mut None,
        );
        let mut moment = Moment::default();
        for axis in 0..self.axes {
            let (of, from, share) = match &self.line {
                Some(line) => (0, line.from[axis], line.shares[axis]),
                None => (axis, Metres::ZERO, 1.0),
            };
            let told = |value: f64, seconds: i32| share * value / self.scale.factor(seconds);
            moment.position[axis] = from + Metres(told(position[of], 0));
            moment.speed[axis] = MetresPerSecond(told(speed[of], 1));
            moment.acceleration[axis] = MetresPerSecondSquared(told(acceleration[of], 2));
        }
        moment
    }
}

/// Plans ways of some axes. Asks for no memory, except for the text of a refusal.
pub(super) struct Planner {
    axes: usize,
    /// Of a stop, which may begin on a path.
    rates: PerAxis<Rates>,
    /// Of a motion that is no path.
    move_rates: PerAxis<Rates>,
    ruckig: Ruckig<AXES_MAX, ThrowErrorHandler>,
    /// In which the ways of all axes are reckoned.
    scale: Scale,
    /// For these, with what does not change from way to way.
    input: InputParameter<AXES_MAX>,
    /// For lines, which the first axis stands for.
    line_input: InputParameter<AXES_MAX>,
}

impl Planner {
    /// Of the first `axes` of `limits`, at most [`AXES_MAX`].
    pub(super) fn new(axes: usize, limits: PerAxis<AxisLimits>) -> Self {
        let rates = limits.each_ref().map(Rates::of);
        let move_rates = limits.each_ref().map(Rates::of_move);
        let reached = rates[..axes].iter().map(Rates::reached_acceleration);
        let scale = Scale::of(reached.fold(0.0, f64::max));
        let mut input = InputParameter::new(None);
        let mut line_input = InputParameter::new(None);
        for (axis, rates) in rates.iter().enumerate() {
            input.enabled[axis] = axis < axes;
            limit(&mut input, axis, rates, scale);
            line_input.enabled[axis] = axis == 0;
        }
        Self {
            axes,
            rates,
            move_rates,
            // Only motions that are looked up by time are made: the step counts for nothing.
            ruckig: Ruckig::new(None, 1.0),
            scale,
            input,
            line_input,
        }
    }

    /// Along the straight line from rest at `from` to rest at `to`, as fast as no axis goes beyond
    /// its limits, and all together no faster than `speed`.
    pub(super) fn line(
        &mut self,
        from: &PerAxis<Metres>,
        to: &PerAxis<Metres>,
        speed: Option<MetresPerSecond>,
        leg: &mut Leg,
    ) -> Result<(), Refusal> {
        let goes = |axis: usize| (to[axis] - from[axis]).value();
        let length = (0..self.axes).map(|axis| goes(axis).abs());
        let length = length.fold(0.0, f64::max);
        let mut shares = [0.0; AXES_MAX];
        let mut rates = self.move_rates[0];
        if length > 0.0 {
            for (axis, share) in shares.iter_mut().enumerate().take(self.axes) {
                *share = goes(axis) / length;
            }
            let unlimited = Rates {
                speed: f64::INFINITY,
                acceleration: f64::INFINITY,
                jerk: f64::INFINITY,
            };
            rates = (0..self.axes)
                .map(|axis| self.move_rates[axis].shared_by(shares[axis].abs()))
                .fold(unlimited, Rates::least);
        }
        if let Some(speed) = speed {
            let along = shares.iter().map(|share| share * share).sum::<f64>().sqrt();
            rates.speed = rates.speed.min(speed.value() / along.max(1.0));
        }
        leg.scale = Scale::of_way(length, &mut rates);
        leg.line = Some(Line {
            from: *from,
            shares,
        });
        limit(&mut self.line_input, 0, &rates, leg.scale);
        self.line_input.target_position[0] = length * leg.scale.factor(0);
        calculate(&mut self.ruckig, &self.line_input, leg)
    }

    /// From whatever the axes do to rest at `to`, all at the same time. What the planner found is
    /// not taken where it goes beyond the limits. There is none for axes that are faster than a move.
    pub(super) fn way(
        &mut self,
        from: &Moment,
        to: &PerAxis<Metres>,
        leg: &mut Leg,
    ) -> Result<(), Refusal> {
        let is_faster =
            |axis: &usize| from.speed[*axis].value().abs() > self.move_rates[*axis].speed;
        if let Some(axis) = (0..self.axes).find(is_faster) {
            return Err(format!("axis {axis} is faster than a move may be"));
        }
        self.limit_speeds(self.move_rates);
        self.begin_at(from, leg);
        for (axis, wanted) in to.iter().enumerate().take(self.axes) {
            self.input.target_position[axis] = wanted.value() * leg.scale.factor(0);
        }
        self.input.control_interface = ControlInterface::Position;
        self.input.synchronization = Synchronization::Phase;
        calculate(&mut self.ruckig, &self.input, leg)?;
        match (0..self.axes).find(|axis| !self.keeps_limits(*axis, leg)) {
            Some(axis) => Err(format!(
                "the trajectory that was found leaves the limits of axis {axis}"
            )),
            None => Ok(()),
        }
    }

    /// From whatever the axes do to rest as soon as possible, each axis by itself.
    pub(super) fn stop(&mut self, from: &Moment, leg: &mut Leg) -> Result<(), Refusal> {
        self.limit_speeds(self.rates);
        self.begin_at(from, leg);
        self.input.control_interface = ControlInterface::Velocity;
        // Where axes that are made to stop at one moment have a speed near zero and an
        // acceleration, rsruckig 3.0.1 lets them jerk beyond the limit; and the shortest way is
        // wanted in any case.
        self.input.synchronization = Synchronization::None;
        calculate(&mut self.ruckig, &self.input, leg)
    }

    fn limit_speeds(&mut self, rates: PerAxis<Rates>) {
        for (axis, rates) in rates.iter().enumerate() {
            limit(&mut self.input, axis, rates, self.scale);
        }
    }

    fn begin_at(&mut self, from: &Moment, leg: &mut Leg) {
        leg.scale = self.scale;
        leg.line = None;
        for axis in 0..self.axes {
            let rates = self.rates[axis];
            self.input.current_position[axis] = from.position[axis].value() * leg.scale.factor(0);
            // What was reckoned from differences may exceed a limit by its rounding.
            let within = |value: f64, limit: f64, seconds: i32| {
                value.clamp(-limit, limit) * leg.scale.factor(seconds)
            };
            self.input.current_velocity[axis] = within(from.speed[axis].value(), rates.speed, 1);
            self.input.current_acceleration[axis] =
                within(from.acceleration[axis].value(), rates.acceleration, 2);
        }
    }

    /// Whether every phase of constant jerk does.
    fn keeps_limits(&self, axis: usize, leg: &Leg) -> bool {
        let within = |value: f64, most: f64| value.abs() <= most * (1.0 + 1e-6);
        let Some(profile) = leg.trajectory.get_profiles().first().map(|all| &all[axis]) else {
            return false;
        };
        let brake = &profile.brake;
        let phases = (0..2).map(|n| (brake.t[n], brake.j[n], brake.a[n], brake.v[n]));
        let rest = (0..7).map(|n| (profile.t[n], profile.j[n], profile.a[n], profile.v[n]));
        let mut phases = phases.chain(rest).filter(|(time, ..)| *time > 0.0);
        phases.all(|(time, jerk, acceleration, speed)| {
            let after = |time: f64| speed + time * (acceleration + time * jerk / 2.0);
            // Where the acceleration is zero the speed is greatest.
            let turn = (-acceleration / jerk).clamp(0.0, time);
            let turn = if turn.is_nan() { 0.0 } else { turn };
            within(jerk, self.input.max_jerk[axis])
                && within(acceleration, self.input.max_acceleration[axis])
                && within(
                    acceleration + jerk * time,
                    self.input.max_acceleration[axis],
                )
                && [speed, after(turn), after(time)]
                    .into_iter()
                    .all(|speed| within(speed, self.input.max_velocity[axis]))
        })
    }
}

fn limit(input: &mut InputParameter<AXES_MAX>, axis: usize, rates: &Rates, scale: Scale) {
    input.max_velocity[axis] = rates.speed * scale.factor(1);
    input.max_acceleration[axis] = rates.acceleration * scale.factor(2);
    input.max_jerk[axis] = rates.jerk * scale.factor(3);
}

fn calculate(
    ruckig: &mut Ruckig<AXES_MAX, ThrowErrorHandler>,
    input: &InputParameter<AXES_MAX>,
    leg: &mut Leg,
) -> Result<(), Refusal> {
    match ruckig.calculate(input, &mut leg.trajectory) {
        Ok(RuckigResult::Working | RuckigResult::Finished) => Ok(()),
        Ok(other) => Err(format!("{other:?}")),
        Err(error) => Err(error.to_string()),
    }
}
