//! Whether a path can be driven: point by point, before anything of it is.

use core::time::Duration;

use units::{Metres, MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

use super::moment::Moment;
use super::motion::Motion;
use super::{AXES_MAX, AxisLimits, PerAxis};

/// Differences may exceed a limit by this share: positions are rounded.
const ROUNDING: f64 = 1.01;

/// Why a point cannot be driven.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("path point {point} (at {at_s:.4} s), axis {axis}: {fault}")]
pub struct PathError {
    /// Which point, counted from 1.
    pub point: u64,
    /// When it would be reached, in seconds from the path's beginning.
    pub at_s: f64,
    /// The axis.
    pub axis: String,
    /// What is wrong.
    pub fault: PathFault,
}

/// What is wrong with a point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the Display text says what each field is")]
pub enum PathFault {
    /// NaN or infinite.
    #[error("the position is not a number")]
    NotANumber,
    /// Outside the soft limits.
    #[error("{:.6} mm is outside the soft limits {:.3} to {:.3} mm", at.mm(), min.mm(), max.mm())]
    SoftLimit {
        at: Metres,
        min: Metres,
        max: Metres,
    },
    /// Inside, but too fast to stop inside.
    #[error(
        "a stop from here would end at {:.6} mm, outside the soft limits {:.3} to {:.3} mm; \
         slow down before the limit",
        at.mm(), min.mm(), max.mm()
    )]
    NoStop {
        at: Metres,
        min: Metres,
        max: Metres,
    },
    /// Too fast.
    #[error("{:.3} mm/s, the limit is {:.3} mm/s", seen.value() * 1e3, limit.value() * 1e3)]
    Speed {
        seen: MetresPerSecond,
        limit: MetresPerSecond,
    },
    /// Speeds up or slows down too much.
    #[error("{:.3} mm/s², the limit is {:.3} mm/s²", seen.value() * 1e3, limit.value() * 1e3)]
    Acceleration {
        seen: MetresPerSecondSquared,
        limit: MetresPerSecondSquared,
    },
    /// Jerks too much.
    #[error(
        "{:.1} mm/s³, the limit is {:.1} mm/s³; smooth the path, or begin and end it slowly",
        seen.value() * 1e3, limit.value() * 1e3
    )]
    Jerk {
        seen: MetresPerSecondCubed,
        limit: MetresPerSecondCubed,
    },
}

/// The last points, and what their differences say: speed, acceleration and jerk are the first,
/// second and third backward difference over the period.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Differences {
    pub(super) moment: Moment,
    jerk: PerAxis<MetresPerSecondCubed>,
}

impl Differences {
    /// At rest at `position`.
    pub(super) fn at_rest(position: PerAxis<Metres>) -> Self {
        Self::of(Moment::at_rest(position))
    }

    /// A motion that is known otherwise.
    pub(super) fn of(moment: Moment) -> Self {
        Self {
            moment,
            jerk: [MetresPerSecondCubed::ZERO; AXES_MAX],
        }
    }

    /// The same after one more point.
    pub(super) fn next(&self, point: &PerAxis<Metres>, axes: usize, period_s: f64) -> Self {
        let mut next = Self::at_rest(*point);
        let before = &self.moment;
        for (axis, at) in point.iter().enumerate().take(axes) {
            let speed = (*at - before.position[axis]).value() / period_s;
            let acceleration = (speed - before.speed[axis].value()) / period_s;
            let jerk = (acceleration - before.acceleration[axis].value()) / period_s;
            next.moment.speed[axis] = MetresPerSecond(speed);
            next.moment.acceleration[axis] = MetresPerSecondSquared(acceleration);
            next.jerk[axis] = MetresPerSecondCubed(jerk);
        }
        next
    }

    /// The motion at the last point itself, by Newton's backward differences: a first difference
    /// alone is true half a period earlier, a second one a whole period.
    pub(super) fn at_the_point(&self, axes: usize, period_s: f64) -> Moment {
        let mut moment = self.moment;
        for axis in 0..axes {
            let second = moment.acceleration[axis].value() * period_s;
            let third = self.jerk[axis].value() * period_s * period_s;
            moment.speed[axis] += MetresPerSecond(second / 2.0 + third / 3.0);
            moment.acceleration[axis] += MetresPerSecondSquared(third / period_s);
        }
        moment
    }
}

/// Judges the points of one path in their order.
pub(super) struct Judge {
    names: Vec<String>,
    period: Duration,
    limits: PerAxis<AxisLimits>,
    stop: Motion,
    last: Option<Differences>,
    points: u64,
}

impl Judge {
    pub(super) fn new(names: Vec<String>, period: Duration, limits: PerAxis<AxisLimits>) -> Self {
        Self {
            stop: Motion::new(names.len(), limits),
            names,
            period,
            limits,
            last: None,
            points: 0,
        }
    }

    /// Of a path of the same axes, from its first point.
    pub(super) fn anew(&self) -> Self {
        Self::new(self.names.clone(), self.period, self.limits)
    }

    /// The axes, in the order of a point's positions.
    pub(super) fn axes(&self) -> &[String] {
        &self.names
    }

    /// From one point to the next.
    pub(super) const fn period(&self) -> Duration {
        self.period
    }

    /// Whether there was a point already.
    pub(super) const fn has_begun(&self) -> bool {
        self.last.is_some()
    }

    /// Forgets the path: another one begins.
    pub(super) const fn begin(&mut self) {
        self.last = None;
        self.points = 0;
    }

    /// What was judged is part of the path.
    pub(super) const fn accept(&mut self, next: Differences) {
        self.last = Some(next);
        self.points += 1;
    }

    /// Whether the axes can be at `point` one period after the last one.
    pub(super) fn judge(&mut self, point: &PerAxis<Metres>) -> Result<Differences, PathError> {
        let axes = self.names.len();
        let period_s = self.period.as_secs_f64();
        for (axis, at) in point.iter().enumerate().take(axes) {
            if !at.is_finite() {
                return Err(self.fault(axis, PathFault::NotANumber));
            }
        }
        let Some(last) = self.last else {
            let first = Differences::at_rest(*point);
            return self.judge_place(&first.moment).map(|()| first);
        };
        let next = last.next(point, axes, period_s);
        for axis in 0..axes {
            if let Some(fault) = self.judge_motion(axis, &next) {
                return Err(self.fault(axis, fault));
            }
        }
        self.judge_place(&next.at_the_point(axes, period_s))?;
        Ok(next)
    }

    fn judge_motion(&self, axis: usize, seen: &Differences) -> Option<PathFault> {
        let limits = &self.limits[axis];
        let (speed, jerk) = (seen.moment.speed[axis], seen.jerk[axis]);
        let acceleration = seen.moment.acceleration[axis];
        if speed.abs() > limits.speed * ROUNDING {
            let (seen, limit) = (speed, limits.speed);
            return Some(PathFault::Speed { seen, limit });
        }
        if acceleration.abs() > limits.acceleration * ROUNDING {
            let (seen, limit) = (acceleration, limits.acceleration);
            return Some(PathFault::Acceleration { seen, limit });
        }
        if jerk.abs() > limits.jerk * ROUNDING {
            let (seen, limit) = (jerk, limits.jerk);
            return Some(PathFault::Jerk { seen, limit });
        }
        None
    }

    /// Whether the axes are, and can stop, within their limits.
    fn judge_place(&mut self, moment: &Moment) -> Result<(), PathError> {
        let axes = self.names.len();
        // A stop that cannot be planned ends nowhere.
        let stopped = match self.stop.plan_stop(moment) {
            Ok(duration) => self.stop.at(duration).position,
            Err(_) => [Metres(f64::NAN); AXES_MAX],
        };
        for (axis, stopped) in stopped.into_iter().enumerate().take(axes) {
            let AxisLimits { min, max, .. } = self.limits[axis];
            let at = moment.position[axis];
            if !(min <= at && at <= max) {
                return Err(self.fault(axis, PathFault::SoftLimit { at, min, max }));
            }
            if !(min <= stopped && stopped <= max) {
                let at = stopped;
                return Err(self.fault(axis, PathFault::NoStop { at, min, max }));
            }
        }
        Ok(())
    }

    fn fault(&self, axis: usize, fault: PathFault) -> PathError {
        PathError {
            point: self.points + 1,
            at_s: self.period.as_secs_f64() * self.points as f64,
            axis: self.names[axis].clone(),
            fault,
        }
    }
}
