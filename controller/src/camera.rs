//! Image controllers of a machine: from the configuration to a driver, and to a pose.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::in_sight::{CameraFrame, InSight, InSightSettings};
use drivers::device::{PoseInstrument, PoseReading};
use units::{Metres, Radians};
use wire::Port;
use wire::in_sight::Cell;

use crate::config::{CameraConfig, CameraDevice, MachineConfig};
use crate::failure::Failure;
use crate::machine::{Machine, Unit};
use crate::patience::Patience;

pub(crate) fn cameras(
    config: &MachineConfig,
    ports: &BTreeMap<String, Port>,
    patience: Patience,
) -> Vec<Unit<dyn PoseInstrument>> {
    config
        .camera
        .iter()
        .map(|(name, camera)| {
            let device: Box<dyn PoseInstrument> = match camera.device {
                CameraDevice::InSight => {
                    Box::new(InSight::new(in_sight_settings(camera, patience)))
                }
            };
            Unit {
                name: name.clone(),
                port: ports[&camera.line],
                device,
            }
        })
        .collect()
}

/// An In-Sight vision system, as its driver is told; the configuration has been checked.
///
/// # Panics
/// When the result cell is none.
pub fn in_sight_settings(camera: &CameraConfig, patience: Patience) -> InSightSettings {
    let cell = Cell::parse(&camera.result_cell).expect("the configuration was checked");
    let usual = InSightSettings::new(&camera.job, cell);
    InSightSettings {
        serial_number: camera.serial_number.clone(),
        length_unit: Metres::from_um(camera.length_um_per_unit),
        angle_unit: Radians::from_arcsec(camera.angle_arcsec_per_unit),
        frame: CameraFrame {
            rotation: Radians::from_degrees(camera.rotation_deg),
            mirrored: camera.mirrored,
        },
        targets: camera.targets,
        score_min: camera.score_min_percent / 100.0,
        rejects_max: camera.rejects_max,
        start_timeout: patience.of(usual.start_timeout),
        answer_timeout: patience.of(usual.answer_timeout),
        inspection_timeout: patience.of(inspection_timeout(camera)),
        ..usual
    }
}

fn inspection_timeout(camera: &CameraConfig) -> Duration {
    Duration::from_secs_f64(camera.inspection_timeout_ms * 1e-3)
}

impl Machine {
    /// The names of the image controllers.
    pub fn camera_names(&self) -> Vec<String> {
        self.cameras.iter().map(|unit| unit.name.clone()).collect()
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
        self.cameras[place].device.begin_pose(now, exposures);
        // The driver ends by itself; this is the last resort, in a number that a clock can bear.
        let config = &self.config.camera[camera];
        let pictures = exposures
            .saturating_add(config.rejects_max)
            .clamp(1, 10_000);
        let limit = 4 * inspection_timeout(config) + Duration::from_secs(10);
        let at = self.camera_device(place);
        let outcome = self.await_outcome(at, "pose", limit * pictures);
        self.instrument_in_use = None;
        outcome?;
        let pose = self.cameras[place].device.pose();
        Ok(pose.expect("a pose that ended well can be read"))
    }

    /// Starts a camera, unless it runs already, and counts its alarms from now on.
    fn use_camera(&mut self, name: &str) -> Result<(), Failure> {
        let at = self.camera_device(self.camera_index(name)?);
        self.use_device(at, name)
    }

    fn camera_index(&self, name: &str) -> Result<usize, Failure> {
        let place = self.cameras.iter().position(|unit| unit.name == name);
        place.ok_or_else(|| Failure::NoSuchCamera {
            camera: name.to_owned(),
            known: self.camera_names().join(", "),
        })
    }

    /// The number, among all devices, of camera number `at`.
    fn camera_device(&self, at: usize) -> usize {
        self.device_count() - self.cameras.len() + at
    }
}
