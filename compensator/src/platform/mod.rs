//! Planar alignment platform: poses and the strokes of its actuators, both ways, exactly (S1).
//!
//! Each actuator pushes one point of the platform along a fixed direction; a passive slide lets
//! that point move across it. For a pose (t, θ) the stroke is
//!
//! stroke_i = d_i · (t + R(θ) p_i − p_i) = d_i · t − 2 a_i sin²(θ/2) + b_i sin θ
//!
//! with a_i = d_i · p_i and b_i the lever of the line of push about the origin: no small-angle
//! shortcut, and no cancellation at small angles either.
//!
//! Source: plane rigid-body geometry; the arrangement with two screws in a first and one in a
//! second direction is the platform of the error compensation method for alignment platforms
//! whose estimator is in [`crate::screw`].
//!
//! | symbol | name here |
//! |---|---|
//! | t, θ | [`Pose`]: `x`, `y`, `angle` |
//! | p_i, d_i | [`Actuator::point`], [`Actuator::direction`] |
//! | U, V, W; X1, X2, Y; X, Y, θ | [`Platform::uvw`], [`Platform::xxy`], [`Platform::xy_theta`] |
//!
//! Pose zero is where every stroke is zero; there platform frame and machine frame coincide.
//!
//! Absent: motion out of the plane, compliance, the straightness of the passive slides.

pub mod cause;
mod condition;
mod datum;
mod forward;
mod presets;
mod reach;
pub mod worse;

use crate::uncertainty::propagate;
use units::portable::{cos, hypot, sin};
use units::{Metres, Radians};

pub use condition::Motion;
pub use forward::{Forward, ForwardError};
pub use reach::{Beyond, OutOfReach, PathError};

/// A point of the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Along the machine's first direction.
    pub x: Metres,
    /// Along its second direction.
    pub y: Metres,
}

/// Where the platform is: the displacement of its frame's origin, and its turn (mathematically
/// positive, from x to y).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Displacement along x.
    pub x: Metres,
    /// Displacement along y.
    pub y: Metres,
    /// Turn about the origin of the platform's frame.
    pub angle: Radians,
}

/// What pushes one point of the platform.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Its name, for messages: `u`, `x1`.
    pub name: String,
    /// The point it pushes, in the platform's frame.
    pub point: Point,
    /// The direction it pushes along, of length 1, in the machine's frame.
    pub direction: [f64; 2],
    /// The lowest stroke it can make, zero or negative.
    pub stroke_min: Metres,
    /// The highest stroke it can make, zero or positive.
    pub stroke_max: Metres,
}

/// Why actuators do not make a platform.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlatformError {
    /// Neither three nor four.
    #[error("platform: {seen} actuator(s); a plane needs 3, or 4 that agree with each other")]
    Count {
        /// How many.
        seen: usize,
    },
    /// A name twice.
    #[error("platform: two actuators are called `{name}`")]
    SameName {
        /// The name.
        name: String,
    },
    /// A NaN or an infinity.
    #[error("platform: actuator `{name}` has a value that is not finite")]
    NotFinite {
        /// Which actuator.
        name: String,
    },
    /// A direction that is no direction.
    #[error("platform: the direction of actuator `{name}` has the length {length}; it must be 1",
        length = units::Short(*length))]
    Direction {
        /// Which actuator.
        name: String,
        /// Its length.
        length: f64,
    },
    /// A travel that does not contain stroke zero.
    #[error(
        "platform: actuator `{name}` travels from {} to {} mm; strokes count from pose zero, which \
         must lie within this travel",
        units::Short(min.mm()), units::Short(max.mm())
    )]
    Travel {
        /// Which actuator.
        name: String,
        /// Its lowest stroke.
        min: Metres,
        /// Its highest stroke.
        max: Metres,
    },
    /// A condition limit that is no limit.
    #[error("platform: the condition limit is {seen}; it must be above 1",
        seen = units::Short(*seen))]
    ConditionLimit {
        /// The value.
        seen: f64,
    },
    /// Some motion is made by no actuator.
    #[error("platform: no actuator can {motion}; place or direct one so that it can")]
    Singular {
        /// Which motion.
        motion: Motion,
    },
    /// Some motion is made so weakly that strokes hardly decide about it.
    #[error(
        "platform: condition number {condition:.0}, the limit is {limit:.0}: the actuators hardly \
         {motion}; give them more leverage"
    )]
    IllConditioned {
        /// Largest over smallest gain from motion to strokes, turns scaled by the platform's size.
        condition: f64,
        /// The limit.
        limit: f64,
        /// The motion with the smallest gain.
        motion: Motion,
    },
}

/// An actuator, ready to compute with, in metres.
#[derive(Clone, Copy, Debug)]
struct Row {
    direction: [f64; 2],
    /// d · p.
    radial: f64,
    /// The lever of the line of push about the origin: the stroke per radian at pose zero.
    lever: f64,
    min: f64,
    max: f64,
}

impl Row {
    fn new(actuator: &Actuator) -> Self {
        let [dx, dy] = actuator.direction;
        let length = hypot(dx, dy);
        let (dx, dy) = (dx / length, dy / length);
        let (px, py) = (actuator.point.x.value(), actuator.point.y.value());
        Self {
            direction: [dx, dy],
            radial: dx * px + dy * py,
            lever: dy * px - dx * py,
            min: actuator.stroke_min.value(),
            max: actuator.stroke_max.value(),
        }
    }

    fn along(&self, x: f64, y: f64) -> f64 {
        self.direction[0] * x + self.direction[1] * y
    }

    /// The part of the stroke that the turn makes.
    fn turned(&self, angle: f64) -> f64 {
        let half = sin(angle / 2.0);
        self.lever * sin(angle) - 2.0 * self.radial * half * half
    }

    fn stroke(&self, [x, y, angle]: [f64; 3]) -> f64 {
        self.along(x, y) + self.turned(angle)
    }

    /// Standard uncertainty of the stroke of a pose at `angle` with this covariance, row by row.
    fn u_stroke(&self, angle: f64, covariance: &[f64]) -> Metres {
        let [along_x, along_y] = self.direction;
        let gradient = [along_x, along_y, self.per_radian(angle)];
        Metres(propagate(&gradient, covariance).max(0.0).sqrt())
    }

    /// d stroke / d angle.
    fn per_radian(&self, angle: f64) -> f64 {
        self.lever * cos(angle) - self.radial * sin(angle)
    }
}

impl Pose {
    /// Metres, metres, radians.
    fn raw(self) -> [f64; 3] {
        [self.x.value(), self.y.value(), self.angle.value()]
    }

    fn of_raw([x, y, angle]: [f64; 3]) -> Self {
        Self {
            x: Metres(x),
            y: Metres(y),
            angle: Radians(angle),
        }
    }
}

/// A platform whose strokes decide its pose, proven when it is made.
///
/// # Example
///
/// U, V and W of a platform turned by 90°: U's point goes from (0, 100) to (−100, 0).
///
/// ```
/// use compensator::platform::{Platform, Pose};
/// use units::{Metres, Radians};
///
/// let mm = Metres::from_mm;
/// let platform = Platform::uvw(mm(200.0), mm(120.0), mm(10.0))?;
/// let pose = Pose { x: mm(1.0), y: mm(2.0), angle: Radians::from_degrees(90.0) };
/// for (stroke, expected) in platform.strokes(pose).iter().zip([-99.0, 101.0, 122.0]) {
///     assert!((stroke.mm() - expected).abs() < 1e-9);
/// }
/// let refused = platform.check(pose).expect_err("each travels 10 mm");
/// assert_eq!(refused.limits.len(), 4, "three strokes, and the turn");
/// # Ok::<(), compensator::platform::PlatformError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Platform {
    actuators: Vec<Actuator>,
    rows: Vec<Row>,
    /// Rms distance of the points from their centre: what a turn is compared with a shift by.
    size: f64,
    centre: [f64; 2],
    condition: f64,
    /// The turns around zero at which the condition limit holds.
    angles: (f64, f64),
}

impl Platform {
    /// The condition limit most machines are content with: a stroke error grows a hundredfold
    /// in the worst motion.
    pub const CONDITION_MAX: f64 = 100.0;

    /// Checks that every small motion of the platform moves some actuator, and takes them.
    ///
    /// The condition number is that of the map from a shift of the points' centre and a turn,
    /// scaled by the rms distance of the points from that centre, to the strokes; `condition_max`
    /// limits it at pose zero, and the turns allowed are those around zero up to where it is
    /// exceeded.
    ///
    /// # Errors
    /// What is wrong with which actuator, or which motion no actuator makes, or hardly.
    pub fn new(actuators: Vec<Actuator>, condition_max: f64) -> Result<Self, PlatformError> {
        check(&actuators)?;
        if !(condition_max > 1.0 && condition_max.is_finite()) {
            return Err(PlatformError::ConditionLimit {
                seen: condition_max,
            });
        }
        let rows: Vec<Row> = actuators.iter().map(Row::new).collect();
        let (centre, size) = condition::extent(&actuators);
        let mut platform = Self {
            actuators,
            rows,
            size,
            centre,
            condition: 1.0,
            angles: (0.0, 0.0),
        };
        platform.condition = platform.judged(condition_max)?;
        platform.angles = platform.well_conditioned_angles(condition_max);
        Ok(platform)
    }

    /// The actuators, in the order strokes are given.
    pub fn actuators(&self) -> &[Actuator] {
        &self.actuators
    }

    /// The condition number at pose zero (1 is perfect).
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// The turns around zero at which the condition limit holds; beyond them the actuators lose
    /// their hold on some motion.
    pub fn angles(&self) -> (Radians, Radians) {
        (Radians(self.angles.0), Radians(self.angles.1))
    }

    /// The strokes that bring the platform into `pose`, one per actuator, exactly, for any
    /// angle; whether they can be made is [`Platform::check`]'s business.
    pub fn strokes(&self, pose: Pose) -> Vec<Metres> {
        let pose = pose.raw();
        self.rows.iter().map(|r| Metres(r.stroke(pose))).collect()
    }

    /// Standard uncertainties of these strokes, one per actuator, where x, y (m) and angle (rad) of the pose have this
    /// covariance.
    pub fn u_strokes(&self, pose: Pose, covariance: &[[f64; 3]; 3]) -> Vec<Metres> {
        let angle = pose.angle.value();
        let each = self.rows.iter();
        let each = each.map(|it| it.u_stroke(angle, covariance.as_flattened()));
        each.collect()
    }
}

fn check(actuators: &[Actuator]) -> Result<(), PlatformError> {
    if !(3..=4).contains(&actuators.len()) {
        return Err(PlatformError::Count {
            seen: actuators.len(),
        });
    }
    for (index, it) in actuators.iter().enumerate() {
        let name = || it.name.clone();
        if actuators[..index].iter().any(|other| other.name == it.name) {
            return Err(PlatformError::SameName { name: name() });
        }
        let lengths = [it.point.x, it.point.y, it.stroke_min, it.stroke_max];
        let finite = lengths.iter().all(|l| l.is_finite());
        if !finite || it.direction.iter().any(|d| !d.is_finite()) {
            return Err(PlatformError::NotFinite { name: name() });
        }
        let length = hypot(it.direction[0], it.direction[1]);
        // Wide enough for a direction written with four digits, too narrow for a mistaken one.
        if (length - 1.0).abs() > 1e-3 {
            return Err(PlatformError::Direction {
                name: name(),
                length,
            });
        }
        let (min, max) = (it.stroke_min, it.stroke_max);
        if !(min <= Metres::ZERO && Metres::ZERO <= max && min < max) {
            return Err(PlatformError::Travel {
                name: name(),
                min,
                max,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
