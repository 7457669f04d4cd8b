//! What a gantry is made of, as a configuration file says it. Every key ends in its unit.

use serde::Deserialize;

use crate::config::error::{ConfigError, positive};
use crate::plant::config::{MotionConfig, StageConfig};

/// One stage that two linear motors move side by side.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GantryConfig {
    /// Either side: motor, scale and switches, with errors of its own.
    pub side: StageConfig,
    /// From the one side's magnets to the other's, across the travel.
    pub distance_mm: f64,
    /// Where both scales read 0 the stage is turned by up to this, either way.
    pub rotation_max_urad: f64,
    /// When first switched on one side stands ahead of the other by up to this.
    pub start_skew_um: f64,
    /// How far the second side's sensors have drifted, either way, anew with each power cycle.
    pub sensor_offset_max_mv: f64,
    /// The same of their gain.
    pub sensor_gain_max: f64,
}

impl Default for GantryConfig {
    fn default() -> Self {
        Self {
            side: StageConfig {
                motion: MotionConfig {
                    power_cycle_shift_um: 50.0,
                    ..MotionConfig::default()
                },
                ..StageConfig::default()
            },
            distance_mm: 400.0,
            rotation_max_urad: 200.0,
            start_skew_um: 100.0,
            sensor_offset_max_mv: 100.0,
            sensor_gain_max: 0.03,
        }
    }
}

impl GantryConfig {
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        self.side.check()?;
        positive("distance_mm", self.distance_mm)
    }
}
