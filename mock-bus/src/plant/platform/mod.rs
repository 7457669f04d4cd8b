//! An alignment platform that moves in x, y and angle on three (or four) ball screws (the UVW
//! platform of patent CN 000, system S1).
//!
//! What is systematic: each screw's lead error and lost motion. What is not: the error of each
//! stop, the servo's rest, the repeatability of the index pulse. Encoders are incremental: they
//! lose their origin with their power, and an index pulse once a turn gives it back.
//!
//! Absent: errors of the arrangement (points and directions are those configured), heat, and
//! everything elastic.

pub mod config;
mod kinematics;
mod lead_error;
mod screw;
mod truth;

#[cfg(test)]
mod tests;

use units::portable::sin_cos;
use units::{Metres, Radians, Time};

pub use truth::PlatformTruth;

use super::config::InterferometerConfig;
use super::mechanics::{Mechanics, Section};
use super::parts::actuator::Actuator;
use crate::config::error::ConfigError;
use config::PlatformConfig;
use kinematics::Kinematics;
use screw::Screw;

/// Where a body is in the plane, from where it was built.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Displacement of its frame's origin along x.
    pub x: Metres,
    /// Displacement of its frame's origin along y.
    pub y: Metres,
    /// Turn about its frame's origin, counter-clockwise.
    pub angle: Radians,
}

impl Pose {
    /// Where a point of the body is now, by its place in the body's frame.
    pub(super) fn place_of(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = sin_cos(self.angle.value());
        [
            self.x.value() + cos * x_m - sin * y_m,
            self.y.value() + sin * x_m + cos * y_m,
        ]
    }
}

#[derive(Clone, Debug)]
pub(super) struct Platform {
    screws: Vec<Screw>,
    kinematics: Kinematics,
}

impl Platform {
    /// # Panics
    /// When the arrangement does not hold the platform, which reading a file refuses.
    pub(super) fn new(config: &PlatformConfig, seed: u64) -> Self {
        let kinematics = Kinematics::new(&config.actuators);
        Self {
            screws: (0..config.actuators.len())
                .map(|number| Screw::new(&config.screw, seed, number))
                .collect(),
            kinematics: kinematics.expect("the screws hold the platform"),
        }
    }

    /// Where the platform really is.
    pub(super) fn pose(&self, now: Time) -> Pose {
        self.pose_by(|screw| screw.stroke_m(now))
    }

    fn pose_by(&self, stroke_m: impl Fn(&Screw) -> f64) -> Pose {
        let strokes: Vec<f64> = self.screws.iter().map(stroke_m).collect();
        self.kinematics.pose(&strokes)
    }
}

impl Section for PlatformConfig {
    fn check(&self) -> Result<(), ConfigError> {
        self.check_numbers()
    }

    fn resolution_nm(&self) -> Option<f64> {
        Some(self.screw.resolution_nm)
    }

    fn build(&self, _: &InterferometerConfig, seed: u64) -> Box<dyn Mechanics> {
        Box::new(Platform::new(self, seed))
    }
}

impl Mechanics for Platform {
    fn advance(&mut self, now: Time) {
        for screw in &mut self.screws {
            screw.advance(now);
        }
    }

    fn actuator(&self, number: usize) -> Option<&dyn Actuator> {
        self.screws.get(number).map(|screw| screw as &dyn Actuator)
    }

    fn actuator_mut(&mut self, number: usize) -> Option<&mut dyn Actuator> {
        let screw = self.screws.get_mut(number);
        screw.map(|screw| screw as &mut dyn Actuator)
    }

    fn power_cycle(&mut self) {
        for screw in &mut self.screws {
            screw.push_a_little();
        }
    }

    fn boxed(&self) -> Box<dyn Mechanics> {
        Box::new(self.clone())
    }
}

impl PlatformConfig {
    /// Whether the screws hold all of x, y and angle.
    pub(crate) fn holds_the_platform(&self) -> bool {
        matches!(self.actuators.len(), 3 | 4) && Kinematics::new(&self.actuators).is_some()
    }
}
