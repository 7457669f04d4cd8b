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
        self.state.datum.ok_or(PlatformFailure::NotZeroed)?;
        let seen = self.look()?;
        self.since_zero(seen)
    }

    /// Where the camera sees the platform now, in the machine's frame; the platform needs no zero for that.
    ///
    /// # Errors
    /// The camera sees nothing it can judge.
    pub fn look(&mut self) -> Result<Pose, Failure> {
        self.camera_pose(self.config.exposures)
    }

    /// The place that the camera has `seen`, from where the screws' zeros put the platform.
    ///
    /// # Errors
    /// Not zeroed.
    pub fn since_zero(&self, seen: Pose) -> Result<Pose, Failure> {
        let datum = self.state.datum.ok_or(PlatformFailure::NotZeroed)?;
        Ok(seen.since(datum))
    }

    /// Where the camera sees the platform, in the machine's frame.
    pub(super) fn camera_pose(&mut self, exposures: u32) -> Result<Pose, Failure> {
        let camera = self.config.camera.clone();
        let PoseReading { x, y, angle, .. } = self.core.look(&camera, exposures)?;
        Ok(Pose { x, y, angle })
    }
}
