//! Numbers that no machine can have.

use super::error::positive;
use super::{ConfigError, MachineConfig, PortConfig};
use crate::plant::config::PlantConfig;
use crate::plant::platform::config::PlatformConfig;
use crate::plant::volumetric::config::VolumetricConfig;

impl MachineConfig {
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        let (stage, hall) = (&self.plant.stage, &self.plant.hall);
        let (motion, deviation) = (&stage.motion, &stage.deviation);
        for (key, seen) in [
            ("power_off_ms", self.power_off_ms),
            ("resolution_nm", stage.encoder.resolution_nm),
            ("cyclic_period_um", deviation.cyclic_period_um),
            ("lost_motion_take_up_um", deviation.lost_motion_take_up_um),
            ("servo_bandwidth_hz", motion.servo_bandwidth_hz),
            (
                "acceleration_max_m_per_s2",
                motion.acceleration_max_m_per_s2,
            ),
            (
                "friction_deceleration_m_per_s2",
                motion.friction_deceleration_m_per_s2,
            ),
            ("swing_period_min", self.plant.climate.swing_period_min),
            ("gap_mm", hall.gap_mm),
            ("magnet_width_mm", hall.magnet_width_mm),
            ("magnet_height_mm", hall.magnet_height_mm),
            ("magnet_spacing_mm", hall.magnet_spacing_mm),
            ("rail_v", hall.rail_v),
            (
                "work_max_mm - work_min_mm",
                deviation.work_max_mm - deviation.work_min_mm,
            ),
            (
                "hard_stop_max_mm - start_max_mm",
                motion.hard_stop_max_mm - motion.start_max_mm,
            ),
            (
                "start_min_mm - hard_stop_min_mm",
                motion.start_min_mm - motion.hard_stop_min_mm,
            ),
        ] {
            positive(key, seen)?;
        }
        for port in &self.ports {
            if let PortConfig::Can(can) = port {
                positive("bitrate_kbit_per_s", f64::from(can.bitrate_kbit_per_s))?;
            }
        }
        if let Some(platform) = &self.plant.platform {
            check_platform(platform)?;
            positive("field_mm", self.plant.camera.field_mm)?;
        }
        let plant = &self.plant;
        if let Some(table) = &plant.table {
            for (key, seen) in table.positive_numbers() {
                positive(key, seen)?;
            }
        }
        if let Some(volumetric) = &plant.volumetric {
            check_volumetric(volumetric)?;
        }
        one_machine(plant)?;
        self.nodes
            .iter()
            .try_for_each(|node| node.device.check(plant))
    }
}

/// A machine is one thing or the other.
fn one_machine(plant: &PlantConfig) -> Result<(), ConfigError> {
    let others = [
        plant.platform.is_some(),
        plant.table.is_some(),
        plant.volumetric.is_some(),
    ];
    let others = others.into_iter().filter(|there| *there).count();
    if others <= 1 {
        return Ok(());
    }
    Err(ConfigError::Value {
        key: "platform and table and volumetric",
        seen: others as f64,
        expected: "at most one of them",
    })
}

fn check_platform(platform: &PlatformConfig) -> Result<(), ConfigError> {
    let screw = &platform.screw;
    for (key, seen) in [
        ("lead_mm", screw.lead_mm),
        ("resolution_nm", screw.resolution_nm),
        ("work_range_mm", screw.work_range_mm),
        ("servo_bandwidth_hz", screw.servo_bandwidth_hz),
        ("acceleration_max_m_per_s2", screw.acceleration_max_m_per_s2),
        (
            "friction_deceleration_m_per_s2",
            screw.friction_deceleration_m_per_s2,
        ),
        (
            "hard_stop_mm - work_range_mm",
            screw.hard_stop_mm - screw.work_range_mm,
        ),
        (
            "hard_stop_mm - start_mm",
            screw.hard_stop_mm - screw.start_mm,
        ),
    ] {
        positive(key, seen)?;
    }
    if platform.holds_the_platform() {
        return Ok(());
    }
    Err(ConfigError::Value {
        key: "actuators",
        seen: platform.actuators.len() as f64,
        expected: "three or four screws that hold x, y and angle",
    })
}

fn check_volumetric(volumetric: &VolumetricConfig) -> Result<(), ConfigError> {
    for (key, seen) in volumetric.positive_numbers() {
        positive(key, seen)?;
    }
    if volumetric.is_a_chain() {
        return Ok(());
    }
    Err(ConfigError::Value {
        key: "chain and roll.axis",
        seen: volumetric.roll.axis as f64,
        expected: "F, X, Y and Z once each, and an axis from 0 to 2",
    })
}
