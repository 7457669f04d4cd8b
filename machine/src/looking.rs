//! Where an image controller sees what it looks at.

use core::time::Duration;

use drivers::device::PoseReading;

use crate::failure::Failure;
use crate::machine::Machine;

impl Machine {
    /// Where image controller `camera` sees the machine's platform now, from `exposures`
    /// pictures. It is started when it has not been. The machine should stand: nothing here
    /// waits for that.
    ///
    /// # Errors
    /// When there is no such camera, it cannot be started, or not enough of its pictures are
    /// good.
    pub fn look(&mut self, camera: &str, exposures: u32) -> Result<PoseReading, Failure> {
        let place = self.devices.camera_index(camera)?;
        let at = self.devices.camera_device(place);
        self.use_device(at, camera)?;
        let now = self.now();
        self.devices.cameras[place]
            .unit
            .device
            .begin_pose(now, exposures);
        // The driver ends by itself; this is the last resort, in a number that a clock can bear.
        let camera = &self.devices.cameras[place];
        let pictures = exposures
            .saturating_add(camera.rejects_max)
            .clamp(1, 10_000);
        let limit = 4 * camera.inspection_timeout + Duration::from_secs(10);
        let outcome = self.await_outcome(at, "pose", limit * pictures);
        self.instrument_in_use = None;
        outcome?;
        let pose = self.devices.cameras[place].unit.device.pose();
        Ok(pose.expect("a pose that ended well can be read"))
    }
}
