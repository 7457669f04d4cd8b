//! Encoders of comparators, read by a position display HEIDENHAIN ND 287.

use core::time::Duration;

use compensator::length_correction::{self, EnvironmentUncertainty};
use drivers::device::nd287::{Nd287, Nd287Settings};
use drivers::device::{Direction, DisplacementInstrument};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Metres, MetresPerSecond};

use super::{Count, Family, InstrumentConfig};
use crate::certificate::{CertificateConfig, Figures, Measurand};
use crate::config::judge::Judge;
use crate::hardware::bus::SerialLine;
use crate::hardware::certificate::Certificate;

/// How long a value may take at 9600 baud, whatever period is asked for.
const SLOWEST: Duration = Duration::from_millis(70);
/// Below this an identification takes longer than its answer is waited for.
const BAUD_MIN: u32 = 2400;

/// What only a position display over an encoder has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Nd287Config {
    /// From one value to the next; a display at 9600 baud takes up to 70 ms for one.
    #[schemars(range(min = 10.0, max = 1000.0))]
    pub poll_period_ms: f64,
    /// Period of the encoder's signal: a count that slips is wrong by a multiple of it.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub signal_period_um: f64,
    /// The fastest that the stage moves under the encoder: a value farther away is not believed.
    #[schemars(range(min = 0.01, max = 100000.0))]
    pub speed_max_mm_per_s: f64,
    /// Standard uncertainty of the scale's length, relative to it.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub scale_standard_uncertainty_ppm: f64,
    /// What of it has a certificate.
    #[serde(default)]
    pub certificate: Nd287CertificatesConfig,
}

/// Certificates of a comparator.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Nd287CertificatesConfig {
    /// Of its scale: positions that it shows, counted from the axis's zero, and their errors.
    pub scale: Option<CertificateConfig>,
}

/// What a certificate is of, by its key.
const SCALE: &str = "scale";

impl Nd287Config {
    fn period(&self) -> Duration {
        Duration::from_secs_f64(self.poll_period_ms * 1e-3)
    }

    /// What its driver is told; the configuration has been checked.
    pub fn settings(&self, common: &InstrumentConfig, patience: Patience) -> Nd287Settings {
        let usual = Nd287Settings::default();
        Nd287Settings {
            direction: if common.reverse {
                Direction::Reversed
            } else {
                Direction::AsCounted
            },
            period: self.period(),
            speed_max: MetresPerSecond(self.speed_max_mm_per_s * 1e-3),
            answer_timeout: patience.of(usual.answer_timeout),
            silent_after: patience.of(usual.silent_after),
            ..usual
        }
    }
}

impl Family for Nd287Config {
    fn check(&self, judge: &mut Judge<'_>, line: Option<&SerialLine>) {
        if let Some(line) = line.filter(|it| it.baud_bit_per_s < BAUD_MIN) {
            judge.say(
                "line",
                format!(
                    "{} bit/s is too slow for a position display",
                    line.baud_bit_per_s
                ),
                format!("set display and line to at least {BAUD_MIN}, better 9600"),
            );
        }
    }

    fn driver(
        &self,
        common: &InstrumentConfig,
        patience: Patience,
    ) -> Box<dyn DisplacementInstrument> {
        Box::new(Nd287::new(self.settings(common, patience)))
    }

    fn readings_per_s(&self) -> f64 {
        self.period().max(SLOWEST).as_secs_f64().recip()
    }

    fn count(&self) -> Count {
        Count {
            length: Metres::from_um(self.signal_period_um),
            name: "signal periods",
            slipped: "counts were lost or gained; clean scale and scanning head, move more slowly",
        }
    }

    fn corrections(&self) -> length_correction::Settings {
        length_correction::Settings {
            air: false,
            // No light: in its place the scale is what the length is measured by.
            vacuum_wavelength: self.count().length,
            u_relative_wavelength: self.scale_standard_uncertainty_ppm * 1e-6,
            co2_umol_per_mol: 0.0,
            material_expansion: None,
            dead_path: None,
            cosine: None,
            u_environment: EnvironmentUncertainty::default(),
        }
    }

    fn environment_frozen(&self) -> Option<Duration> {
        None
    }

    fn certificates(&self) -> Vec<Certificate<&CertificateConfig>> {
        let own = self.certificate.scale.iter();
        own.map(|it| (SCALE, Measurand::Length, it)).collect()
    }

    fn certificates_mut(&mut self) -> Vec<Certificate<&mut CertificateConfig>> {
        let own = self.certificate.scale.iter_mut();
        own.map(|it| (SCALE, Measurand::Length, it)).collect()
    }

    fn scale(&self) -> Option<&Figures> {
        let certified = self.certificate.scale.as_ref()?.certified.as_deref()?;
        Some(&certified.figures)
    }
}
