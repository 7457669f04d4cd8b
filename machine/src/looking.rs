//! Where an image controller sees what it looks at.

use core::time::Duration;

use drivers::device::PoseReading;

use crate::failure::Failure;
use crate::machine::Machine;

impl Machine {
    /// The names of the image controllers.
    pub fn camera_names(&self) -> Vec<String> {
        let names = self.cameras.iter().map(|it| it.unit.name.clone());
        names.collect()
    }

    /// Where image controller `camera` sees the machine's platform now, from `exposures`
    /// pictures. It is started when it has not been. The machine should stand: nothing here
    /// waits for that.
    ///
    /// # Errors
    /// When there is no such camera, it cannot be started, or not enough of its pictures are
    /// good.
    pub fn look(&mut self, camera: &str, exposures: u32) -> Result<PoseReading, Failure> {
        let place = self.camera_index(camera)?;
        self.use_camera(camera)?;
        let now = self.now();
        self.cameras[place].unit.device.begin_pose(now, exposures);
        // The driver ends by itself; this is the last resort, in a number that a clock can bear.
        let camera = &self.cameras[place];
        let pictures = exposures
            .saturating_add(camera.rejects_max)
            .clamp(1, 10_000);
        let limit = 4 * camera.inspection_timeout + Duration::from_secs(10);
        let at = self.camera_device(place);
        let outcome = self.await_outcome(at, "pose", limit * pictures);
        self.instrument_in_use = None;
        outcome?;
        let pose = self.cameras[place].unit.device.pose();
        Ok(pose.expect("a pose that ended well can be read"))
    }

    /// Starts a camera, unless it runs already, and counts its alarms from now on.
    fn use_camera(&mut self, name: &str) -> Result<(), Failure> {
        let at = self.camera_device(self.camera_index(name)?);
        self.use_device(at, name)
    }

    fn camera_index(&self, name: &str) -> Result<usize, Failure> {
        let place = self.cameras.iter().position(|it| it.unit.name == name);
        place.ok_or_else(|| Failure::NoSuchDevice {
            what: "camera",
            name: name.to_owned(),
            known: self.camera_names().join(", "),
        })
    }

    /// The number, among all devices, of camera number `at`.
    fn camera_device(&self, at: usize) -> usize {
        self.device_count() - self.cameras.len() + at
    }
}
