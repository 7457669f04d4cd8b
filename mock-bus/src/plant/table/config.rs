//! What a rotary table is made of, as a configuration file says it. Every key ends in its unit.

use serde::Deserialize;

use crate::config::error::{ConfigError, positive};
use crate::plant::parts::servo::Dynamics;
use crate::plant::parts::weight::Weight;

const ARCSEC: f64 = core::f64::consts::PI / 648_000.0;

/// A rotary table that turns endlessly, a glass plate with lines on it and a detector over them.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TableConfig {
    /// How the servo moves it.
    pub motion: TableMotionConfig,
    /// Its encoder, and how that errs.
    pub encoder: TableEncoderConfig,
    /// Its bearing.
    pub bearing: BearingConfig,
    /// The plate that lies on it.
    pub plate: PlateConfig,
    /// What sees the plate's lines pass.
    pub detector: DetectorConfig,
    /// What gives a voltage in its place.
    pub signal: SignalConfig,
    /// What a person reads them with.
    pub microscope: MicroscopeConfig,
}

/// A photodiode behind a slit, at analog input 0: each line gives a pulse of a bell's shape.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SignalConfig {
    /// Between the lines.
    pub dark_v: f64,
    /// Of a line above that.
    pub height_v: f64,
    /// At half of the height.
    pub width_arcsec: f64,
    /// From the light to the voltage.
    pub latency_us: f64,
}

impl Default for SignalConfig {
    fn default() -> Self {
        Self {
            dark_v: 0.2,
            height_v: 4.0,
            width_arcsec: 600.0,
            latency_us: 50.0,
        }
    }
}

/// A microscope with a cross-hair beside the table, and the person at it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MicroscopeConfig {
    /// Standard deviation of one reading of one line.
    pub noise_arcsec: f64,
}

impl Default for MicroscopeConfig {
    fn default() -> Self {
        Self { noise_arcsec: 0.05 }
    }
}

/// Inertia and servo.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct TableMotionConfig {
    pub servo_bandwidth_hz: f64,
    pub servo_damping: f64,
    /// 1 follows a constant speed without error.
    pub feed_forward_fraction: f64,
    pub acceleration_max_deg_per_s2: f64,
    pub friction_deceleration_deg_per_s2: f64,
    /// Standard deviation of where the settled servo stands.
    pub rest_error_arcsec: f64,
    /// A power cycle turns the table by up to this much either way.
    pub power_cycle_shift_deg: f64,
}

impl Default for TableMotionConfig {
    fn default() -> Self {
        Self {
            servo_bandwidth_hz: 40.0,
            servo_damping: 0.9,
            feed_forward_fraction: 0.98,
            acceleration_max_deg_per_s2: 2000.0,
            friction_deceleration_deg_per_s2: 60.0,
            rest_error_arcsec: 0.01,
            power_cycle_shift_deg: 3.0,
        }
    }
}

impl TableMotionConfig {
    pub(super) const fn dynamics(&self) -> Dynamics {
        Dynamics {
            servo_bandwidth_hz: self.servo_bandwidth_hz,
            servo_damping: self.servo_damping,
            feed_forward_fraction: self.feed_forward_fraction,
            acceleration_max: self.acceleration_max_deg_per_s2.to_radians(),
            friction_deceleration: self.friction_deceleration_deg_per_s2.to_radians(),
            rest_error: self.rest_error_arcsec * ARCSEC,
            hard_stops: None,
            settled: 0.004 * ARCSEC,
            settled_speed: 4.0 * ARCSEC,
            weight: Weight::NONE,
        }
    }
}

/// An incremental ring encoder with an index mark: it counts from wherever it was switched on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct TableEncoderConfig {
    pub counts_per_turn: u32,
    /// Standard deviation of where the index pulse acts.
    pub index_repeatability_arcsec: f64,
    /// The largest error; the harmonics below are scaled to reach it.
    pub error_peak_arcsec: f64,
    /// What the error is made of; the phases are drawn from the seed.
    pub harmonics: Vec<HarmonicConfig>,
}

/// One harmonic of an error over the turn.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct HarmonicConfig {
    /// Periods in a turn; 1 is an eccentricity.
    pub order: u32,
    pub amplitude_arcsec: f64,
}

const fn harmonic(order: u32, amplitude_arcsec: f64) -> HarmonicConfig {
    HarmonicConfig {
        order,
        amplitude_arcsec,
    }
}

impl Default for TableEncoderConfig {
    fn default() -> Self {
        Self {
            counts_per_turn: 129_600_000,
            index_repeatability_arcsec: 0.01,
            error_peak_arcsec: 10.0,
            harmonics: vec![
                harmonic(1, 7.0),
                harmonic(2, 2.0),
                harmonic(3, 0.6),
                harmonic(4, 0.5),
                harmonic(8, 0.3),
                harmonic(18, 0.3),
                harmonic(36, 0.4),
                harmonic(72, 0.2),
            ],
        }
    }
}

/// A bearing whose balls or rollers do not come back to the same places after a turn.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BearingConfig {
    /// Amplitude of the error that does not repeat from turn to turn.
    pub asynchronous_arcsec: f64,
}

impl Default for BearingConfig {
    fn default() -> Self {
        Self {
            asynchronous_arcsec: 0.01,
        }
    }
}

/// A glass plate with radial lines.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct PlateConfig {
    pub lines: u32,
    /// The largest error of a line; the parts below are scaled to reach it.
    pub error_peak_arcsec: f64,
    /// Of the lines' circle against the middle of the plate: it turns with the plate.
    pub eccentricity_arcsec: f64,
    /// Standard deviation of each line's own error.
    pub division_arcsec: f64,
    /// By how many lines the plate is turned against the table to begin with.
    pub placement_lines: i64,
    /// Whenever the plate is placed it is off by up to this much either way.
    pub placement_error_arcsec: f64,
    /// Lines that cannot be seen.
    pub smudged_lines: Vec<u32>,
    /// By how many lines somebody turns it, one after the other, each time that the drive is
    /// switched off after more than two and a half turns since the time before.
    pub hand_lines: Vec<f64>,
}

impl Default for PlateConfig {
    fn default() -> Self {
        Self {
            lines: 360,
            error_peak_arcsec: 30.0,
            eccentricity_arcsec: 15.0,
            division_arcsec: 6.0,
            placement_lines: 0,
            placement_error_arcsec: 60.0,
            smudged_lines: Vec::new(),
            hand_lines: Vec::new(),
        }
    }
}

/// A detector that gives a pulse for each line that passes. Its positive edge is at the line's
/// middle in either direction; the negative one comes a fixed time later.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct DetectorConfig {
    /// Standard deviation of where it sees a line.
    pub noise_arcsec: f64,
    /// From the line in its middle to the edge at its output.
    pub latency_us: f64,
    pub pulse_us: f64,
}

impl Default for DetectorConfig {
    fn default() -> Self {
        Self {
            noise_arcsec: 0.05,
            latency_us: 2.0,
            pulse_us: 100.0,
        }
    }
}

impl TableConfig {
    /// What makes no table.
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        let mut numbers = self.positive_numbers().into_iter();
        numbers.try_for_each(|(key, seen)| positive(key, seen))
    }

    /// What must be more than 0 for the rest to make sense.
    fn positive_numbers(&self) -> [(&'static str, f64); 7] {
        let (motion, plate) = (&self.motion, &self.plate);
        let spacing_arcsec = 1_296_000.0 / f64::from(plate.lines);
        [
            ("servo_bandwidth_hz", motion.servo_bandwidth_hz),
            (
                "acceleration_max_deg_per_s2",
                motion.acceleration_max_deg_per_s2,
            ),
            (
                "friction_deceleration_deg_per_s2",
                motion.friction_deceleration_deg_per_s2,
            ),
            ("counts_per_turn", f64::from(self.encoder.counts_per_turn)),
            ("lines", f64::from(plate.lines)),
            ("width_arcsec", self.signal.width_arcsec),
            // Lines stay in their order, and the placement is known to the line.
            (
                "half the line spacing - error_peak_arcsec - placement_error_arcsec",
                spacing_arcsec / 2.0 - plate.error_peak_arcsec - plate.placement_error_arcsec,
            ),
        ]
    }
}
