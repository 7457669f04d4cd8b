//! How well the strokes decide the pose: gains from small motions to strokes.

use core::f64::consts::PI;
use core::fmt;

use nalgebra::SMatrix;
use units::portable::{atan2, hypot, powi, sin_cos};
use units::{Metres, Radians};

use super::{Actuator, Platform, PlatformError, Point};

/// One row per actuator (a row of zeros for a missing fourth), columns x, y and turn.
pub(super) type Gains = SMatrix<f64, 4, 3>;

/// From this condition number on the smallest gain is nothing but rounding.
const SINGULAR: f64 = 1e10;

/// How finely the turns are searched for the one at which the condition limit is exceeded.
const ANGLE_STEP: f64 = PI / 360.0;

/// A small motion of the platform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// All points the same way.
    Shift {
        /// The way, from x to y; its opposite is the same motion backwards.
        direction: Radians,
    },
    /// A turn.
    Turn {
        /// The point that stays.
        about: Point,
    },
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shift { direction } => {
                let degrees = direction.value().to_degrees();
                write!(f, "shift the platform along {degrees:.1}° from x")
            }
            Self::Turn { about } => {
                // Rounded first, and without the sign of a zero that rounding left.
                let rounded = |length: Metres| (length.um().round() + 0.0) / 1e3;
                let (x, y) = (rounded(about.x), rounded(about.y));
                write!(f, "turn the platform about ({x:.3}, {y:.3}) mm")
            }
        }
    }
}

/// The centre of the points and their rms distance from it, metres.
pub(super) fn extent(actuators: &[Actuator]) -> ([f64; 2], f64) {
    let count = actuators.len() as f64;
    let points = || {
        actuators
            .iter()
            .map(|a| [a.point.x.value(), a.point.y.value()])
    };
    let mean = |axis: usize| points().map(|p| p[axis]).sum::<f64>() / count;
    let centre = [mean(0), mean(1)];
    let squares: f64 = points()
        .map(|p| powi(p[0] - centre[0], 2) + powi(p[1] - centre[1], 2))
        .sum();
    (centre, (squares / count).sqrt())
}

impl Platform {
    /// Condition number at pose zero, or why it is not good enough.
    pub(super) fn judged(&self, limit: f64) -> Result<f64, PlatformError> {
        let (condition, motion) = self.weakest(0.0);
        // Written so that a NaN is singular.
        if condition <= limit {
            Ok(condition)
        } else if condition < SINGULAR {
            Err(PlatformError::IllConditioned {
                condition,
                limit,
                motion,
            })
        } else {
            Err(PlatformError::Singular { motion })
        }
    }

    /// Condition number at `angle` and the motion with the smallest gain.
    fn weakest(&self, angle: f64) -> (f64, Motion) {
        // Points that all coincide: any length will do, the turn about them has no gain.
        let size = if self.size > 0.0 { self.size } else { 1.0 };
        let (sin, cos) = sin_cos(angle);
        let [cx, cy] = self.centre;
        let turned_centre = [cos * cx - sin * cy, sin * cx + cos * cy];
        let mut gains = Gains::zeros();
        for (i, row) in self.rows.iter().enumerate() {
            let [dx, dy] = row.direction;
            gains[(i, 0)] = dx;
            gains[(i, 1)] = dy;
            // About the centre of the points instead of the origin of the frame.
            let about_centre =
                row.per_radian(angle) - dy * turned_centre[0] + dx * turned_centre[1];
            gains[(i, 2)] = about_centre / size;
        }
        let svd = gains.svd(false, true);
        let values = svd.singular_values;
        let (mut low, mut high) = (0, 0);
        for i in 1..3 {
            low = if values[i] < values[low] { i } else { low };
            high = if values[i] > values[high] { i } else { high };
        }
        let right = svd.v_t.expect("the right vectors were asked for");
        let motion = motion_of(
            [right[(low, 0)], right[(low, 1)], right[(low, 2)] / size],
            turned_centre,
        );
        (values[high] / values[low], motion)
    }

    /// The largest interval of turns around zero, within ±180°, on which the limit holds.
    pub(super) fn well_conditioned_angles(&self, limit: f64) -> (f64, f64) {
        let good_at = |angle: f64| self.weakest(angle).0 <= limit;
        let end = |sign: f64| {
            let mut good = 0.0;
            let mut probes: Vec<f64> = (1..=360).map(|k| f64::from(k) * ANGLE_STEP).collect();
            probes.extend(self.singular_angle().map(|a| (sign * a).rem_euclid(PI)));
            probes.sort_by(f64::total_cmp);
            for probe in probes {
                if !good_at(sign * probe) {
                    return sign * bisected(good, probe, |angle| good_at(sign * angle));
                }
                good = probe;
            }
            sign * PI
        };
        (end(-1.0), end(1.0))
    }

    /// The turn at which three actuators lose their hold (it repeats every 180°): the
    /// determinant of their gains is a pure sine of the turn, so it is known exactly and no
    /// search can step over it. Four have none in general.
    fn singular_angle(&self) -> Option<f64> {
        let [r0, r1, r2] = self.rows.as_slice() else {
            return None;
        };
        let cross = |a: &[f64; 2], b: &[f64; 2]| a[0] * b[1] - a[1] * b[0];
        let (d0, d1, d2) = (&r0.direction, &r1.direction, &r2.direction);
        let minors = [cross(d1, d2), cross(d2, d0), cross(d0, d1)];
        let rows = [r0, r1, r2];
        let sum = |of: fn(&super::Row) -> f64| -> f64 {
            minors.iter().zip(rows).map(|(m, r)| m * of(r)).sum()
        };
        // det = lever·cos θ − radial·sin θ, each summed with its minor.
        let (lever, radial) = (sum(|r| r.lever), sum(|r| r.radial));
        Some(atan2(lever, radial))
    }
}

/// The place between a good and a bad angle where it turns bad; the good side of it.
fn bisected(mut good: f64, mut bad: f64, good_at: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = good + (bad - good) / 2.0;
        if good_at(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// A velocity (of the centre, and of turning, per metre) as a motion.
fn motion_of([vx, vy, turn]: [f64; 3], centre: [f64; 2]) -> Motion {
    // A turn about a point a kilometre away is a shift for any platform.
    if turn.abs() * 1e3 <= hypot(vx, vy) {
        let mut direction = atan2(vy, vx);
        if direction < -1e-9 {
            direction += PI;
        }
        return Motion::Shift {
            direction: Radians(direction.max(0.0)),
        };
    }
    Motion::Turn {
        about: Point {
            x: Metres(centre[0] - vy / turn),
            y: Metres(centre[1] + vx / turn),
        },
    }
}
