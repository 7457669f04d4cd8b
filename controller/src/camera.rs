//! Image controllers of a machine: from the configuration to a driver.

use core::time::Duration;
use std::collections::BTreeMap;

use drivers::device::PoseInstrument;
use drivers::device::in_sight::{CameraFrame, InSight, InSightSettings};
use units::{Metres, Radians};
use wire::Port;
use wire::in_sight::Cell;

use crate::config::{CameraConfig, CameraDevice, MachineConfig};
use machine::Patience;
use machine::Unit;

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

/// How long one picture may take.
pub(crate) fn inspection_timeout(camera: &CameraConfig) -> Duration {
    Duration::from_secs_f64(camera.inspection_timeout_ms * 1e-3)
}
