//! Numbers that no machine can have.

use super::error::positive;
use super::{ConfigError, MachineConfig, PortConfig};

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
        self.plant.check()?;
        self.nodes
            .iter()
            .try_for_each(|node| node.device.check(&self.plant))
    }
}
