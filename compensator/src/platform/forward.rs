//! From strokes to the pose: Newton's method, for four actuators in the least-squares sense.
//!
//! The steps are Gauss-Newton's (for three actuators Newton's) and are halved until the misfit
//! of the strokes shrinks. Two poses may belong to one set of strokes, on both sides of the turn
//! at which the actuators lose their hold; the one on the start's side is found, and that side
//! is the whole of [`Platform::angles`]. Four actuators decide the turn alone, but away from it
//! their misfit may have another least, at which they contradict each other by far: where they
//! do, other starts are tried and the least misfit of all is taken.

use nalgebra::SVector;
use units::portable::{hypot, powi};
use units::{Metres, Radians};

use super::condition::Gains;
use super::{Platform, Pose};

/// Newton's steps at most; five do for any pose of a real platform.
const STEPS_MAX: usize = 60;

/// Halvings of one step at most.
const HALVINGS_MAX: i32 = 40;

/// The longest turn of one step, radians: beyond it the linear picture is worth nothing.
const TURN_MAX: f64 = 0.5;

/// A step below this share of the platform's size is the last: the error after it is its square.
const LAST_STEP: f64 = 1e-11;

/// The misfit, as a share of the lengths involved, that three strokes may keep by rounding.
const ROUNDING: f64 = 1e-9;

/// Four actuators that contradict each other are looked at from so many turns.
const STARTS: u32 = 8;

/// A pose and how well the strokes agree on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward {
    /// The pose.
    pub pose: Pose,
    /// The largest difference between a stroke given and the pose's own. Rounding for three
    /// actuators; for four it says how far they contradict each other.
    pub inconsistency: Metres,
    /// Steps taken.
    pub iterations: usize,
}

/// Why strokes give no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForwardError {
    /// Not one stroke per actuator.
    #[error("platform: {seen} strokes for {expected} actuators")]
    Count {
        /// Strokes given.
        seen: usize,
        /// Strokes wanted.
        expected: usize,
    },
    /// A NaN or an infinity.
    #[error("platform: the stroke of actuator `{name}` or the start is not finite")]
    NotFinite {
        /// Which actuator.
        name: String,
    },
    /// No pose has these strokes.
    #[error(
        "platform: no pose with these strokes was found in {iterations} steps; the nearest, at \
         {:.4}°, misses them by {:.3} um", angle.value().to_degrees(), misfit.um()
    )]
    NoConvergence {
        /// Steps taken.
        iterations: usize,
        /// Largest misfit of a stroke at the last pose.
        misfit: Metres,
        /// The turn of that pose.
        angle: Radians,
    },
}

impl Platform {
    /// The pose that has these strokes, found from pose zero.
    ///
    /// # Errors
    /// When the strokes are not one finite value per actuator, or no pose has them.
    ///
    /// # Example
    ///
    /// ```
    /// use compensator::platform::{Platform, Pose};
    /// use units::{Metres, Radians};
    ///
    /// let mm = Metres::from_mm;
    /// let platform = Platform::xxy(mm(150.0), mm(10.0))?;
    /// let wanted = Pose { x: mm(3.0), y: mm(-4.0), angle: Radians::from_degrees(0.3) };
    /// let found = platform.forward(&platform.strokes(wanted))?;
    /// assert!((found.pose.x - wanted.x).abs().nm() < 1e-6);
    /// assert!((found.pose.angle - wanted.angle).abs().arcsec() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn forward(&self, strokes: &[Metres]) -> Result<Forward, ForwardError> {
        self.forward_near(strokes, Pose::default())
    }

    /// The pose that has these strokes, found from `start`.
    ///
    /// # Errors
    /// When the strokes are not one finite value per actuator, or no pose has them.
    pub fn forward_near(&self, strokes: &[Metres], start: Pose) -> Result<Forward, ForwardError> {
        if strokes.len() != self.rows.len() {
            return Err(ForwardError::Count {
                seen: strokes.len(),
                expected: self.rows.len(),
            });
        }
        let mut wanted = [0.0; 4];
        for (i, (slot, stroke)) in wanted.iter_mut().zip(strokes).enumerate() {
            if !stroke.is_finite() || start.raw().iter().any(|v| !v.is_finite()) {
                return Err(ForwardError::NotFinite {
                    name: self.actuators[i].name.clone(),
                });
            }
            *slot = stroke.value();
        }
        let found = self.newton(&wanted, start.raw());
        if self.rows.len() == 3 {
            return found;
        }
        match found {
            Ok(found) if found.inconsistency.value() <= ROUNDING * self.reach(found.pose.raw()) => {
                Ok(found)
            }
            found => self.least_misfit(&wanted, start, found),
        }
    }

    /// The best of `found` and of what is found from other turns.
    fn least_misfit(
        &self,
        wanted: &[f64; 4],
        start: Pose,
        found: Result<Forward, ForwardError>,
    ) -> Result<Forward, ForwardError> {
        let (min, max) = self.angles;
        let from = |at: u32| {
            let [x, y, _] = start.raw();
            let share = (f64::from(at) + 0.5) / f64::from(STARTS);
            self.newton(wanted, [x, y, min + share * (max - min)]).ok()
        };
        let is_held = |it: &Forward| (min..=max).contains(&it.pose.angle.value());
        let others = (0..STARTS).filter_map(from).filter(is_held);
        others.fold(found, |best, it| match best {
            Ok(best) if best.inconsistency <= it.inconsistency => Ok(best),
            _ => Ok(it),
        })
    }

    fn newton(&self, wanted: &[f64; 4], start: [f64; 3]) -> Result<Forward, ForwardError> {
        let mut pose = start;
        let mut misfit = self.misfit(wanted, pose);
        for iterations in 1..=STEPS_MAX {
            let Some(step) = self.step(pose, &misfit) else {
                return Err(self.lost(iterations, pose, &misfit));
            };
            let length = hypot(hypot(step[0], step[1]), step[2] * self.size);
            if length <= LAST_STEP * self.size {
                pose = [0, 1, 2].map(|i| pose[i] + step[i]);
                misfit = self.misfit(wanted, pose);
                return self.found(iterations, pose, &misfit);
            }
            // Where no part of the step shrinks the misfit there is no better pose.
            let Some(next) = self.shortened(wanted, pose, step, &misfit) else {
                return self.found(iterations, pose, &misfit);
            };
            pose = next;
            misfit = self.misfit(wanted, pose);
        }
        Err(self.lost(STEPS_MAX, pose, &misfit))
    }

    /// The pose after the step, halved until the misfit shrinks.
    fn shortened(
        &self,
        wanted: &[f64; 4],
        pose: [f64; 3],
        step: [f64; 3],
        misfit: &SVector<f64, 4>,
    ) -> Option<[f64; 3]> {
        let whole = (TURN_MAX / step[2].abs()).min(1.0);
        (0..HALVINGS_MAX)
            .map(|halvings| whole * powi(0.5, halvings))
            .map(|share| [0, 1, 2].map(|i| pose[i] + share * step[i]))
            .find(|next| self.misfit(wanted, *next).norm() < misfit.norm())
    }

    fn misfit(&self, wanted: &[f64; 4], pose: [f64; 3]) -> SVector<f64, 4> {
        let mut misfit = SVector::zeros();
        for (i, row) in self.rows.iter().enumerate() {
            misfit[i] = wanted[i] - row.stroke(pose);
        }
        misfit
    }

    /// The motion that would undo `misfit` if the platform were linear.
    fn step(&self, [.., angle]: [f64; 3], misfit: &SVector<f64, 4>) -> Option<[f64; 3]> {
        let mut gains = Gains::zeros();
        for (i, row) in self.rows.iter().enumerate() {
            gains[(i, 0)] = row.direction[0];
            gains[(i, 1)] = row.direction[1];
            gains[(i, 2)] = row.per_radian(angle) / self.size;
        }
        let (q, r) = gains.qr().unpack();
        let step = r.solve_upper_triangular(&(q.transpose() * misfit))?;
        let step = [step[0], step[1], step[2] / self.size];
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    fn found(
        &self,
        iterations: usize,
        pose: [f64; 3],
        misfit: &SVector<f64, 4>,
    ) -> Result<Forward, ForwardError> {
        let inconsistency = misfit.amax();
        // Three strokes decide the pose: a misfit means that none has them.
        if self.rows.len() == 3 && inconsistency > ROUNDING * self.reach(pose) {
            return Err(self.lost(iterations, pose, misfit));
        }
        Ok(Forward {
            pose: Pose::of_raw(pose),
            inconsistency: Metres(inconsistency),
            iterations,
        })
    }

    /// The largest length that took part in the arithmetic.
    fn reach(&self, [x, y, _]: [f64; 3]) -> f64 {
        let arms = self.rows.iter().map(|r| hypot(r.radial, r.lever));
        arms.fold(self.size + hypot(x, y), f64::max)
    }

    fn lost(&self, iterations: usize, pose: [f64; 3], misfit: &SVector<f64, 4>) -> ForwardError {
        ForwardError::NoConvergence {
            iterations,
            misfit: Metres(misfit.amax()),
            angle: Radians(pose[2]),
        }
    }
}
