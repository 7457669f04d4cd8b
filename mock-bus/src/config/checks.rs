//! Numbers that no machine can have.

use super::error::positive;
use super::{ConfigError, MachineConfig, PortConfig};

impl MachineConfig {
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        let hall = &self.plant.hall;
        self.plant.stage.check()?;
        for (key, seen) in [
            ("power_off_ms", self.power_off_ms),
            ("swing_period_min", self.plant.climate.swing_period_min),
            ("gap_mm", hall.gap_mm),
            ("magnet_width_mm", hall.magnet_width_mm),
            ("magnet_height_mm", hall.magnet_height_mm),
            ("magnet_spacing_mm", hall.magnet_spacing_mm),
            ("rail_v", hall.rail_v),
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
