//! Where the platform is when its screws have made their strokes.
//!
//! Each screw pushes one point of the platform along one direction of the base, and a passive
//! slide lets the point move across it. In the plane of complex numbers, with p the point, d
//! the direction (of length 1), t the displacement and ω = e^{iθ} the turn, its stroke is
//! Re(d̄·(t + (ω − 1)·p)). For a given turn the displacement is a linear least-squares problem;
//! what it leaves is a function of the turn alone, and that is brought to zero (or, with four
//! screws, to its least) by Gauss and Newton's iteration in this one unknown: variable
//! projection (G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
//!
//! Absent: bending of the platform, which four screws that disagree would cause.

use super::Pose;
use super::config::ActuatorConfig;
use units::portable::{hypot, sin_cos};
use units::{Metres, Radians};

const ITERATIONS_MAX: usize = 50;
const SETTLED_RAD: f64 = 1e-15;
/// Screws that hold the turn no better than at this arm, or a direction no better than at
/// this share of a screw, do not hold the platform.
const ARM_MIN_M: f64 = 1e-3;
const SHARE_MIN: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    fn turn(angle: f64) -> Self {
        let (sin, cos) = sin_cos(angle);
        Self::new(cos, sin)
    }

    fn times(self, other: Self) -> Self {
        Self::new(
            self.re * other.re - self.im * other.im,
            self.re * other.im + self.im * other.re,
        )
    }

    /// Re(self̄ · other).
    fn along(self, other: Self) -> f64 {
        self.re * other.re + self.im * other.im
    }
}

#[derive(Clone, Debug)]
struct Joint {
    point: Complex,
    direction: Complex,
}

/// The arrangement of the screws.
#[derive(Clone, Debug)]
pub(super) struct Kinematics {
    joints: Vec<Joint>,
}

impl Kinematics {
    /// `None` when the screws do not hold all of x, y and angle.
    pub(super) fn new(actuators: &[ActuatorConfig]) -> Option<Self> {
        let joints = actuators
            .iter()
            .map(|actuator| {
                let [x, y] = actuator.direction;
                let length = hypot(x, y);
                let [px, py] = actuator.point_mm.map(|mm| mm * 1e-3);
                Joint {
                    point: Complex::new(px, py),
                    direction: Complex::new(x / length, y / length),
                }
            })
            .collect();
        let kinematics = Self { joints };
        kinematics.holds_the_platform().then_some(kinematics)
    }

    fn holds_the_platform(&self) -> bool {
        let [xx, xy, yy] = self.moments();
        let weakest = f64::midpoint(xx, yy) - hypot(f64::midpoint(xx, -yy), xy);
        if weakest.is_nan() || weakest <= SHARE_MIN {
            return false;
        }
        self.grip_m() > ARM_MIN_M
    }

    /// The arm at which the screws hold the turn.
    pub(super) fn grip_m(&self) -> f64 {
        let mut arms: Vec<f64> = self.turned(0.0).map(|(_, arm)| arm).collect();
        self.displace(&mut arms);
        arms.iter().map(|arm| arm * arm).sum::<f64>().sqrt()
    }

    /// Sums of d dᵀ.
    fn moments(&self) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for Joint { direction: d, .. } in &self.joints {
            for (sum, product) in sums.iter_mut().zip([d.re * d.re, d.re * d.im, d.im * d.im]) {
                *sum += product;
            }
        }
        sums
    }

    /// Per joint: the stroke of the turn alone, and what a small further turn adds to it.
    fn turned(&self, angle: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let turn = Complex::turn(angle);
        let swing = Complex::new(turn.re - 1.0, turn.im);
        let onwards = Complex::new(-turn.im, turn.re);
        self.joints.iter().map(move |Joint { point, direction }| {
            let stroke = direction.along(swing.times(*point));
            (stroke, direction.along(onwards.times(*point)))
        })
    }

    /// The displacement that explains most of the strokes; leaves in them what it does not.
    fn displace(&self, strokes: &mut [f64]) -> Complex {
        let (mut re, mut im) = (0.0, 0.0);
        for (Joint { direction, .. }, stroke) in self.joints.iter().zip(&*strokes) {
            re += direction.re * stroke;
            im += direction.im * stroke;
        }
        let [xx, xy, yy] = self.moments();
        let determinant = xx * yy - xy * xy;
        let displacement = Complex::new(
            (yy * re - xy * im) / determinant,
            (xx * im - xy * re) / determinant,
        );
        for (Joint { direction, .. }, stroke) in self.joints.iter().zip(strokes) {
            *stroke -= direction.along(displacement);
        }
        displacement
    }

    /// The pose that strokes from the middle of the screws lead to.
    pub(super) fn pose(&self, strokes_m: &[f64]) -> Pose {
        let mut angle = 0.0;
        for _ in 0..ITERATIONS_MAX {
            let (_, mut left) = self.after_turn(strokes_m, angle);
            let mut arms: Vec<f64> = self.turned(angle).map(|(_, arm)| arm).collect();
            self.displace(&mut left);
            self.displace(&mut arms);
            let product: f64 = left.iter().zip(&arms).map(|(a, b)| a * b).sum();
            let square: f64 = arms.iter().map(|arm| arm * arm).sum();
            let further = product / square;
            angle += further;
            if further.abs() < SETTLED_RAD {
                break;
            }
        }
        let (displacement, _) = self.after_turn(strokes_m, angle);
        Pose {
            x: Metres(displacement.re),
            y: Metres(displacement.im),
            angle: Radians(angle),
        }
    }

    /// The displacement at a given turn, and the strokes that the turn leaves.
    fn after_turn(&self, strokes_m: &[f64], angle: f64) -> (Complex, Vec<f64>) {
        let left: Vec<f64> = strokes_m
            .iter()
            .zip(self.turned(angle))
            .map(|(stroke, (turned, _))| stroke - turned)
            .collect();
        let displacement = self.displace(&mut left.clone());
        (displacement, left)
    }
}
