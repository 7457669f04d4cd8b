//! Judging a platform by the plant's truth.

use mock_bus::simulation::Simulation;
use truestage::platform::Pose;
use units::Metres;

/// Where errors of the angle count as lengths, as in the shipped configurations.
pub const EDGE: Metres = Metres(80e-3);

/// Compares the true pose with a target, both counted from the true pose at the datum.
#[derive(Clone, Copy, Debug)]
pub struct PoseJudge {
    datum: Pose,
}

impl PoseJudge {
    /// A judge that counts from where the platform truly is now.
    ///
    /// # Panics
    /// When the machine is no platform.
    pub fn here(simulation: &Simulation) -> Self {
        Self {
            datum: true_pose(simulation),
        }
    }

    /// The largest of the true errors in x, y, and of the angle at the edge.
    ///
    /// # Panics
    /// When the machine is no platform.
    pub fn error(&self, simulation: &Simulation, target: Pose) -> Metres {
        let seen = true_pose(simulation);
        let angle = seen.angle.value() - self.datum.angle.value();
        let (sin, cos) = angle.sin_cos();
        let (x0, y0) = (self.datum.x.value(), self.datum.y.value());
        let x = seen.x.value() - (cos * x0 - sin * y0) - target.x.value();
        let y = seen.y.value() - (sin * x0 + cos * y0) - target.y.value();
        let turned = (angle - target.angle.value()) * EDGE.value();
        Metres(x.abs().max(y.abs()).max(turned.abs()))
    }
}

/// Where the platform of the machine truly is.
///
/// # Panics
/// When the machine is no platform.
pub fn true_pose(simulation: &Simulation) -> Pose {
    let pose = simulation.truth().platform().expect("it is one").pose();
    Pose {
        x: pose.x,
        y: pose.y,
        angle: pose.angle,
    }
}
