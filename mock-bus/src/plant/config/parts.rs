//! What the configurations of several machines are put together from. Every key ends in its unit.

use serde::Deserialize;

use crate::config::error::{ConfigError, positive};

/// A linear-motor stage.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StageConfig {
    /// How the servo moves it.
    pub motion: MotionConfig,
    /// Its encoder.
    pub encoder: EncoderConfig,
    /// How its true position departs from its encoder.
    pub deviation: DeviationConfig,
    /// Its limit switches.
    pub limits: LimitConfig,
}

impl StageConfig {
    /// Numbers that no such stage has.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let (motion, deviation) = (&self.motion, &self.deviation);
        for (key, seen) in [
            ("resolution_nm", self.encoder.resolution_nm),
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
        Ok(())
    }
}

/// Mass, servo and mechanical ends.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct MotionConfig {
    pub servo_bandwidth_hz: f64,
    pub servo_damping: f64,
    /// 1 follows a constant speed without error.
    pub feed_forward_fraction: f64,
    pub acceleration_max_m_per_s2: f64,
    pub friction_deceleration_m_per_s2: f64,
    /// Standard deviation of where the settled servo stands.
    pub rest_error_nm: f64,
    pub hard_stop_min_mm: f64,
    pub hard_stop_max_mm: f64,
    /// Where the stage stands when first switched on: uniform between these two.
    pub start_min_mm: f64,
    pub start_max_mm: f64,
    /// A power cycle moves the stage by up to this much either way.
    pub power_cycle_shift_um: f64,
    /// What pulls at the stage while its drive is off; none where it lies flat.
    pub weight: Option<WeightConfig>,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            servo_bandwidth_hz: 60.0,
            servo_damping: 0.9,
            feed_forward_fraction: 0.95,
            acceleration_max_m_per_s2: 20.0,
            friction_deceleration_m_per_s2: 2.0,
            rest_error_nm: 4.0,
            hard_stop_min_mm: -7.0,
            hard_stop_max_mm: 67.0,
            start_min_mm: -1.5,
            start_max_mm: 1.5,
            power_cycle_shift_um: 200.0,
            weight: None,
        }
    }
}

/// A weight, and the brake that holds it without torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WeightConfig {
    /// The acceleration without torque and brake; negative towards the negative end.
    pub gravity_m_per_s2: f64,
    /// Whether there is a brake.
    pub has_brake: bool,
    /// From the drive's output, or the loss of torque, to the brake that holds.
    pub brake_engage_ms: f64,
    /// From the torque to the brake that is open.
    pub brake_release_ms: f64,
}

impl Default for WeightConfig {
    fn default() -> Self {
        Self {
            gravity_m_per_s2: -9.81,
            has_brake: true,
            brake_engage_ms: 30.0,
            brake_release_ms: 50.0,
        }
    }
}

/// An incremental encoder: it counts from wherever it was switched on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct EncoderConfig {
    pub resolution_nm: f64,
    /// Linear expansion of the scale, per kelvin.
    pub scale_expansion_ppm_per_k: f64,
}

impl Default for EncoderConfig {
    fn default() -> Self {
        Self {
            resolution_nm: 10.0,
            scale_expansion_ppm_per_k: 12.0,
        }
    }
}

/// The deviation of the true position from the encoder.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct DeviationConfig {
    /// Half the width of the band that holds the smooth deviation over the work range.
    pub peak_um: f64,
    pub work_min_mm: f64,
    pub work_max_mm: f64,
    pub lost_motion_um: f64,
    /// After a reversal, 63 % of the lost motion is taken up over this travel.
    pub lost_motion_take_up_um: f64,
    pub cyclic_amplitude_nm: f64,
    pub cyclic_period_um: f64,
    /// Standard deviation of a stop's own error.
    pub repeatability_nm: f64,
}

impl Default for DeviationConfig {
    fn default() -> Self {
        Self {
            peak_um: 10.0,
            work_min_mm: 0.0,
            work_max_mm: 60.0,
            lost_motion_um: 1.0,
            lost_motion_take_up_um: 20.0,
            cyclic_amplitude_nm: 30.0,
            cyclic_period_um: 20.0,
            repeatability_nm: 25.0,
        }
    }
}

/// Limit switches, at true positions.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct LimitConfig {
    pub negative_mm: f64,
    pub positive_mm: f64,
    /// Where a switch acts varies by up to this much either way.
    pub repeatability_um: f64,
    pub hysteresis_um: f64,
}

impl Default for LimitConfig {
    fn default() -> Self {
        Self {
            negative_mm: -6.0,
            positive_mm: 66.0,
            repeatability_um: 20.0,
            hysteresis_um: 50.0,
        }
    }
}

/// Two magnet groups on the stage over two Hall sensors on the base (patent CN 004, system S5).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct HallConfig {
    pub magnet_width_mm: f64,
    pub magnet_height_mm: f64,
    /// From magnet centre to magnet centre.
    pub magnet_spacing_mm: f64,
    pub gap_mm: f64,
    /// Sensor 2's slope at zero, and the steepest slope of sensor 1.
    pub slope_v_per_mm: f64,
    pub offset_v: f64,
    pub noise_mv: f64,
    /// The sensors and their inputs saturate at plus and minus this.
    pub rail_v: f64,
}

impl Default for HallConfig {
    fn default() -> Self {
        Self {
            magnet_width_mm: 2.0,
            magnet_height_mm: 3.0,
            magnet_spacing_mm: 4.0,
            gap_mm: 1.5,
            slope_v_per_mm: 1.0,
            offset_v: 0.0,
            noise_mv: 0.2,
            rail_v: 5.0,
        }
    }
}

/// Air and machine, each a value with a slow swing around it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct ClimateConfig {
    pub air_temperature_c: f64,
    pub air_temperature_swing_k: f64,
    pub pressure_hpa: f64,
    pub pressure_swing_hpa: f64,
    pub humidity_percent: f64,
    pub humidity_swing_percent: f64,
    pub stage_temperature_c: f64,
    pub stage_temperature_swing_k: f64,
    pub swing_period_min: f64,
}

impl Default for ClimateConfig {
    fn default() -> Self {
        Self {
            air_temperature_c: 21.3,
            air_temperature_swing_k: 0.15,
            pressure_hpa: 1002.0,
            pressure_swing_hpa: 0.3,
            humidity_percent: 46.0,
            humidity_swing_percent: 1.5,
            stage_temperature_c: 20.8,
            stage_temperature_swing_k: 0.03,
            swing_period_min: 40.0,
        }
    }
}

/// The interferometer's optics and sensors.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct InterferometerConfig {
    /// Path in air between the optic and the reflector when the stage is at its true zero.
    pub dead_path_mm: f64,
    /// Angle between beam and travel.
    pub misalignment_mrad: f64,
    pub noise_nm: f64,
    /// Amplitude of the error that repeats with each half wavelength of path: of polarisations that mix.
    pub nonlinearity_nm: f64,
    /// Faster than this the counter loses count.
    pub speed_max_m_per_s: f64,
    /// How far the wavelength in vacuum is off that of every helium-neon laser, relative to it.
    pub wavelength_offset_ppm: f64,
    /// Constant errors of the instrument's own sensors.
    pub air_temperature_error_k: f64,
    pub pressure_error_hpa: f64,
    pub humidity_error_percent: f64,
    pub stage_temperature_error_k: f64,
}

impl Default for InterferometerConfig {
    fn default() -> Self {
        Self {
            dead_path_mm: 50.0,
            misalignment_mrad: 0.2,
            noise_nm: 3.0,
            nonlinearity_nm: 0.0,
            speed_max_m_per_s: 0.4,
            wavelength_offset_ppm: 0.0,
            air_temperature_error_k: 0.0,
            pressure_error_hpa: 0.0,
            humidity_error_percent: 0.0,
            stage_temperature_error_k: 0.0,
        }
    }
}
