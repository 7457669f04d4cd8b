//! What a platform is made of, as a configuration file says it.

use serde::Deserialize;

use crate::config::error::{ConfigError, positive};
use crate::plant::config::{LimitConfig, MotionConfig};

/// A platform on three or four screws.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlatformConfig {
    /// Where each screw pushes, and which way; axis 0 of the machine is the first of them.
    pub actuators: Vec<ActuatorConfig>,
    /// How the screws are made.
    pub screw: ScrewConfig,
}

impl PlatformConfig {
    /// What makes no platform.
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        let screw = &self.screw;
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
        if self.holds_the_platform() {
            return Ok(());
        }
        Err(ConfigError::Value {
            key: "actuators",
            seen: self.actuators.len() as f64,
            expected: "three or four screws that hold x, y and angle",
        })
    }
}

/// Where one screw acts on the platform.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorConfig {
    /// The point it pushes, x and y in the platform's own frame.
    pub point_mm: [f64; 2],
    /// The direction it pushes in, x and y; its length does not matter.
    pub direction: [f64; 2],
}

impl Default for PlatformConfig {
    /// U and V push along x on both sides of the middle, W along y through the middle.
    fn default() -> Self {
        let actuator = |point_mm, direction| ActuatorConfig {
            point_mm,
            direction,
        };
        Self {
            actuators: vec![
                actuator([-80.0, 80.0], [1.0, 0.0]),
                actuator([-80.0, -80.0], [1.0, 0.0]),
                actuator([0.0, -80.0], [0.0, 1.0]),
            ],
            screw: ScrewConfig::default(),
        }
    }
}

/// A ball screw with its motor; each screw of a platform draws its own errors.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct ScrewConfig {
    /// Travel of one turn.
    pub lead_mm: f64,
    /// Travel of one encoder count.
    pub resolution_nm: f64,
    /// Standard deviation of where the index pulse acts, once a turn.
    pub index_repeatability_nm: f64,
    /// The work range goes this far to both sides of the middle.
    pub work_range_mm: f64,
    /// The largest deviation within the work range, half the lost motion included; each screw
    /// is within a tenth of it. The platform between the screws is a little better.
    pub peak_um: f64,
    /// The lost motion of each screw is drawn between these two.
    pub lost_motion_min_um: f64,
    pub lost_motion_max_um: f64,
    /// Largest amplitude at one cycle a lead; two cycles a lead have up to a quarter of it.
    pub cyclic_amplitude_um: f64,
    /// Standard deviation, over the work range, of what is neither linear nor cyclic.
    pub walk_um: f64,
    /// Standard deviation of a stop's own error.
    pub repeatability_nm: f64,
    pub limit_mm: f64,
    pub limit_repeatability_um: f64,
    pub limit_hysteresis_um: f64,
    pub hard_stop_mm: f64,
    /// Where a screw stands when first switched on: up to this far from the middle.
    pub start_mm: f64,
    /// A power cycle moves a screw by up to this much either way, and leaves it anywhere
    /// within its lost motion.
    pub power_cycle_shift_um: f64,
    pub servo_bandwidth_hz: f64,
    pub servo_damping: f64,
    pub feed_forward_fraction: f64,
    pub acceleration_max_m_per_s2: f64,
    pub friction_deceleration_m_per_s2: f64,
    /// Standard deviation of where the settled servo stands.
    pub rest_error_nm: f64,
}

impl Default for ScrewConfig {
    fn default() -> Self {
        Self {
            lead_mm: 2.0,
            resolution_nm: 10.0,
            index_repeatability_nm: 20.0,
            work_range_mm: 2.5,
            peak_um: 4.4,
            lost_motion_min_um: 1.6,
            lost_motion_max_um: 2.6,
            cyclic_amplitude_um: 0.6,
            walk_um: 0.08,
            repeatability_nm: 60.0,
            limit_mm: 5.0,
            limit_repeatability_um: 20.0,
            limit_hysteresis_um: 50.0,
            hard_stop_mm: 6.0,
            start_mm: 0.5,
            power_cycle_shift_um: 100.0,
            servo_bandwidth_hz: 40.0,
            servo_damping: 1.0,
            feed_forward_fraction: 0.95,
            acceleration_max_m_per_s2: 10.0,
            friction_deceleration_m_per_s2: 5.0,
            rest_error_nm: 5.0,
        }
    }
}

impl ScrewConfig {
    pub(super) const fn motion(&self) -> MotionConfig {
        MotionConfig {
            servo_bandwidth_hz: self.servo_bandwidth_hz,
            servo_damping: self.servo_damping,
            feed_forward_fraction: self.feed_forward_fraction,
            acceleration_max_m_per_s2: self.acceleration_max_m_per_s2,
            friction_deceleration_m_per_s2: self.friction_deceleration_m_per_s2,
            rest_error_nm: self.rest_error_nm,
            hard_stop_min_mm: -self.hard_stop_mm,
            hard_stop_max_mm: self.hard_stop_mm,
            start_min_mm: -self.start_mm,
            start_max_mm: self.start_mm,
            power_cycle_shift_um: self.power_cycle_shift_um,
            weight: None,
        }
    }

    pub(super) const fn limits(&self) -> LimitConfig {
        LimitConfig {
            negative_mm: -self.limit_mm,
            positive_mm: self.limit_mm,
            repeatability_um: self.limit_repeatability_um,
            hysteresis_um: self.limit_hysteresis_um,
        }
    }
}
