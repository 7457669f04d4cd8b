//! What the camera says of the platform.

use core::time::Duration;

use compensator::platform::Pose;
use drivers::device::PoseReading;

use super::failure::PlatformFailure;
use super::state::from_datum;
use crate::failure::Failure;
use crate::machine::Machine;

/// The longest one picture and its judgement may take.
const PICTURE_LIMIT: Duration = Duration::from_secs(5);

impl Machine {
    /// Where the platform is, seen from where its screws' zeros put it.
    ///
    /// # Errors
    /// Not zeroed, or the camera sees nothing it can judge.
    pub fn measure_pose(&mut self) -> Result<Pose, Failure> {
        let datum = self.platform_state()?.datum;
        let datum = datum.ok_or(PlatformFailure::NotZeroed)?;
        let exposures = self.platform_config()?.exposures;
        let seen = self.look(exposures)?;
        Ok(from_datum(pose_of(&seen), datum))
    }

    /// Where the camera sees the platform, in the machine's frame.
    pub(super) fn look(&mut self, exposures: u32) -> Result<PoseReading, Failure> {
        let camera = self.platform_config()?.camera.clone();
        self.use_camera(&camera)?;
        let at = self.camera_index(&camera);
        let now = self.now();
        self.cameras[at].device.begin_pose(now, exposures);
        let device = self.camera_device(at);
        let looked = self.await_outcome(device, "pose", PICTURE_LIMIT * exposures);
        self.instrument_in_use = None;
        looked?;
        Ok(self.cameras[at]
            .device
            .pose()
            .expect("a pose that ended well is there"))
    }
}

pub(super) const fn pose_of(reading: &PoseReading) -> Pose {
    Pose {
        x: reading.x,
        y: reading.y,
        angle: reading.angle,
    }
}
