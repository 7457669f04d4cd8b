//! What no device knows about a platform: for tests and reports that judge.

use units::{Approach, Metres, Time};

use super::{Platform, Pose};
use crate::plant::truth::Truth;

/// A look at a platform behind all sensors. Screws are numbered like the machine's axes.
#[derive(Clone, Copy, Debug)]
pub struct PlatformTruth<'a> {
    platform: &'a Platform,
    now: Time,
}

impl<'a> Truth<'a> {
    /// The platform, where the machine is one.
    pub fn platform(&self) -> Option<PlatformTruth<'a>> {
        let plant = self.plant;
        let platform = plant.machine.of::<Platform>()?;
        Some(PlatformTruth::new(platform, plant.now))
    }
}

impl<'a> PlatformTruth<'a> {
    const fn new(platform: &'a Platform, now: Time) -> Self {
        Self { platform, now }
    }

    /// Where the platform is.
    pub fn pose(&self) -> Pose {
        self.platform.pose(self.now)
    }

    /// Where the turns of its screws say that it is.
    pub fn nominal_pose(&self) -> Pose {
        self.platform.pose_by(|screw| screw.screw_m(self.now))
    }

    /// Where strokes of the screws, fully engaged in these directions, would take it: the
    /// systematic part, without the errors of single stops.
    ///
    /// # Panics
    /// When there are fewer places than screws.
    pub fn systematic_pose(&self, screws: &[(Metres, Approach)]) -> Pose {
        let strokes: Vec<f64> = self
            .platform
            .screws
            .iter()
            .zip(screws)
            .map(|(screw, (at, approach))| {
                at.value() + screw.systematic_deviation_m(at.value(), approach.sign())
            })
            .collect();
        assert_eq!(strokes.len(), self.screws(), "one place for each screw");
        self.platform.kinematics.pose(&strokes)
    }

    /// How many screws there are.
    pub const fn screws(&self) -> usize {
        self.platform.screws.len()
    }

    /// How far the turns of a screw say that it has gone, from its middle.
    pub fn screw_position(&self, screw: usize) -> Metres {
        Metres(self.platform.screws[screw].screw_m(self.now))
    }

    /// How far it has really pushed the table.
    pub fn stroke(&self, screw: usize) -> Metres {
        Metres(self.platform.screws[screw].stroke_m(self.now))
    }

    /// Stroke minus screw position at a place, fully engaged after coming there in a direction,
    /// without the error of a single stop.
    pub fn deviation(&self, screw: usize, at: Metres, approach: Approach) -> Metres {
        let screw = &self.platform.screws[screw];
        Metres(screw.systematic_deviation_m(at.value(), approach.sign()))
    }

    /// The same between both directions: the lead error.
    pub fn mean_deviation(&self, screw: usize, at: Metres) -> Metres {
        Metres(self.platform.screws[screw].systematic_deviation_m(at.value(), 0.0))
    }

    /// How far the nut turns back before it takes the table along.
    pub fn lost_motion(&self, screw: usize) -> Metres {
        Metres(self.platform.screws[screw].lost_motion_m())
    }

    /// Where within the lost motion the table lies now: minus half of it after a full forward
    /// move, plus half of it after a reverse one.
    pub fn engagement(&self, screw: usize) -> Metres {
        Metres(self.platform.screws[screw].engagement_m(self.now))
    }

    /// The screw position of the encoder's present count 0.
    pub fn count_zero(&self, screw: usize) -> Metres {
        Metres(self.platform.screws[screw].count_zero_m())
    }
}
