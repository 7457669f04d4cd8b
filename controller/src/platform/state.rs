//! What is known of a platform: its kinematics, its screws, and where it was put last.

use compensator::platform::{Actuator, Platform, PlatformError, Point, Pose};
use compensator::screw::{Engagement, ScrewCompensation, ScrewMemory};
use units::portable::hypot;
use units::{Metres, Radians};

use crate::config::MachineConfig;
use crate::memories::Memory;
use crate::platform::PlatformConfig;

/// One screw of a platform.
#[derive(Clone, Debug)]
pub(crate) struct Screw {
    /// Its axis.
    pub(crate) axis: String,
    /// Coordinate of its index pulse.
    pub(crate) index: Metres,
    /// Its calibration in use.
    pub(crate) compensation: Option<ScrewCompensation>,
    /// The name of that calibration.
    pub(crate) calibration: Option<String>,
    /// Where it was commanded to and how its nut stands; `None` when it was out of our hands.
    pub(crate) memory: Option<ScrewMemory>,
}

/// A platform, as far as it is known.
#[derive(Clone, Debug)]
pub(crate) struct PlatformState {
    pub(crate) kinematics: Platform,
    pub(crate) screws: Vec<Screw>,
    /// Where it was last told to be; `None` while it is anywhere.
    pub(crate) pose: Option<Pose>,
    /// What the camera said with all screws at their zero.
    pub(crate) datum: Option<Pose>,
}

impl PlatformState {
    /// The platform of a configuration that has been checked.
    pub(crate) fn of(platform: &PlatformConfig, config: &MachineConfig) -> Self {
        let kinematics =
            kinematics(platform, config).expect("the configuration was checked when it was loaded");
        let screws = platform.actuator.iter().map(|it| Screw {
            axis: it.axis.clone(),
            index: Metres::from_mm(it.index_mm),
            compensation: None,
            calibration: None,
            memory: None,
        });
        Self {
            kinematics,
            screws: screws.collect(),
            pose: None,
            datum: None,
        }
    }
}

impl Memory for PlatformState {
    /// Nothing that was known of where it is holds any more.
    fn forget(&mut self) {
        self.pose = None;
        self.datum = None;
        for screw in &mut self.screws {
            screw.memory = None;
        }
    }

    /// A move begins: should it not end, nobody knows where it stopped; the zero and the datum
    /// hold. What is known is set again when it has ended.
    fn interrupted_before_it_ends(&mut self) {
        self.pose = None;
        for screw in &mut self.screws {
            screw.memory = None;
        }
    }
}

/// The arrangement of a configuration.
///
/// # Errors
/// When it does not hold the platform.
pub(crate) fn kinematics(
    platform: &PlatformConfig,
    config: &MachineConfig,
) -> Result<Platform, PlatformError> {
    let actuators = platform
        .actuator
        .iter()
        .map(|it| {
            let [x, y] = it.direction;
            let length = hypot(x, y);
            let limits = config.axis.get(&it.axis);
            Actuator {
                name: it.axis.clone(),
                point: Point {
                    x: Metres::from_mm(it.point_mm[0]),
                    y: Metres::from_mm(it.point_mm[1]),
                },
                direction: [x / length, y / length],
                stroke_min: Metres::from_mm(limits.map_or(-1.0, |axis| axis.motion.soft_min_mm)),
                stroke_max: Metres::from_mm(limits.map_or(1.0, |axis| axis.motion.soft_max_mm)),
            }
        })
        .collect();
    Platform::new(actuators, platform.condition_max)
}

/// What a travel of a screw without a calibration leaves of its engagement: known once it is
/// longer than any lost motion may be.
pub(crate) fn engaged_by(
    travel: Metres,
    lost_motion_max: Metres,
    before: Engagement,
) -> Engagement {
    if travel.abs() < lost_motion_max {
        match (before, travel > Metres::ZERO, travel < Metres::ZERO) {
            (Engagement::Forward, true, _) => Engagement::Forward,
            (Engagement::Reverse, _, true) => Engagement::Reverse,
            (before, false, false) => before,
            _ => Engagement::Unknown,
        }
    } else if travel > Metres::ZERO {
        Engagement::Forward
    } else {
        Engagement::Reverse
    }
}

/// The largest of the errors in x, in y, and of the angle at the edge.
pub(crate) fn largest_error(error: Pose, edge: Metres) -> Metres {
    let turned = Metres(error.angle.value().abs() * edge.value());
    error.x.abs().max(error.y.abs()).max(turned)
}

/// `seen` − `target`, coordinate by coordinate.
pub(crate) fn difference(seen: Pose, target: Pose) -> Pose {
    Pose {
        x: seen.x - target.x,
        y: seen.y - target.y,
        angle: Radians(seen.angle.value() - target.angle.value()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(x_um: f64, y_um: f64, arcsec: f64) -> Pose {
        Pose {
            x: Metres::from_um(x_um),
            y: Metres::from_um(y_um),
            angle: Radians::from_arcsec(arcsec),
        }
    }

    #[test]
    fn the_largest_error_counts_the_angle_at_the_edge() {
        let edge = Metres::from_mm(100.0);
        let seen = largest_error(pose(0.5, -0.7, 2.0), edge);
        assert!((seen.um() - 0.1e6 * 2.0 / 206_264.806).abs() < 1e-6);
        assert!((largest_error(pose(0.5, -1.7, 2.0), edge).um() - 1.7).abs() < 1e-12);
    }

    #[test]
    fn only_a_travel_beyond_any_lost_motion_settles_the_engagement() {
        let most = Metres::from_um(5.0);
        let after = |um: f64, before| engaged_by(Metres::from_um(um), most, before);
        assert_eq!(after(6.0, Engagement::Unknown), Engagement::Forward);
        assert_eq!(after(-6.0, Engagement::Forward), Engagement::Reverse);
        assert_eq!(after(-1.0, Engagement::Forward), Engagement::Unknown);
        assert_eq!(after(1.0, Engagement::Forward), Engagement::Forward);
        assert_eq!(after(0.0, Engagement::Reverse), Engagement::Reverse);
    }
}
