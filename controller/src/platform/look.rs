//! What the camera says of the platform.

use compensator::platform::Pose;
use drivers::device::PoseReading;

use crate::failure::Failure;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;

impl AlignmentPlatform<'_> {
    /// Where the platform is, seen from where its screws' zeros put it.
    ///
    /// # Errors
    /// Not zeroed, or the camera sees nothing it can judge.
    pub fn measure_pose(&mut self) -> Result<Pose, Failure> {
        let datum = self.state.datum;
        let datum = datum.ok_or(PlatformFailure::NotZeroed)?;
        let exposures = self.config.exposures;
        Ok(self.camera_pose(exposures)?.since(datum))
    }

    /// Where the camera sees the platform, in the machine's frame.
    pub(super) fn camera_pose(&mut self, exposures: u32) -> Result<Pose, Failure> {
        let camera = self.config.camera.clone();
        let PoseReading { x, y, angle, .. } = self.core.look(&camera, exposures)?;
        Ok(Pose { x, y, angle })
    }
}
