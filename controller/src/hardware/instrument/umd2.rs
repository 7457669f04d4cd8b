//! Laser interferometers read by a µMD1 or µMD2.

use core::time::Duration;

use compensator::length_correction::{self, DeadPath, EnvironmentUncertainty, MaterialExpansion};
use drivers::device::umd2::{Umd2, Umd2Settings};
use drivers::device::{Direction, DisplacementInstrument};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Celsius, Metres, Pascals, RelativeHumidity};

use super::{Count, Family, InstrumentConfig, OpticsConfig};

/// Carbon dioxide in the air of a hall; its share in the index of air is below 1e-8.
const CO2_UMOL_PER_MOL: f64 = 450.0;
/// Relative standard uncertainty of a stabilised HeNe laser's wavelength.
const WAVELENGTH_U: f64 = 2e-8;
/// Standard uncertainty of a dead path that was measured with a rule.
const DEAD_PATH_U: Metres = Metres(1e-3);

/// What only an interferometer has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Umd2Config {
    /// How often the beam passes the measured length there and back: one count is λ/2 divided by
    /// it. 1 linear (corner cube), 2 plane mirror.
    #[schemars(range(min = 1, max = 16))]
    pub optics_factor: u8,
    /// The firmware's rate.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub sample_rate_hz: f64,
    /// Whether readings are corrected for the refractive index of air, by the instrument's own
    /// weather sensors.
    pub correct_air: bool,
    /// Whether for the expansion to 20 °C.
    pub correct_material: bool,
    /// Of the machine's material; its standard uncertainty is taken as 10 %.
    #[schemars(range(min = -0.0001, max = 0.0001))]
    pub expansion_per_kelvin: f64,
    /// Whether for the dead path; needs `correct_air`.
    pub correct_dead_path: bool,
    /// Path in air between optic and reflector at the axis's zero.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub dead_path_mm: f64,
    /// A sensor of air or material that shows the very same digits for longer is broken, and stops
    /// the run.
    #[serde(default = "half_an_hour")]
    #[schemars(range(min = 1.0, max = 1000000.0))]
    pub environment_frozen_s: f64,
    /// What else it can be set up with.
    #[serde(default)]
    pub optics: OpticsConfig,
}

/// The last digit of a good sensor moves with the air of a good hall.
const fn half_an_hour() -> f64 {
    1800.0
}

/// What one count is where nobody says with which optics.
pub(crate) fn half_wavelength() -> Metres {
    Umd2Settings::default().vacuum_wavelength / 2.0
}

impl Umd2Config {
    /// What its driver is told.
    pub fn settings(&self, common: &InstrumentConfig, patience: Patience) -> Umd2Settings {
        let usual = Umd2Settings::default();
        Umd2Settings {
            optics_factor: self.optics_factor,
            direction: if common.reverse {
                Direction::Reversed
            } else {
                Direction::AsCounted
            },
            sample_rate_hz: self.sample_rate_hz,
            stream_timeout: patience.of(usual.stream_timeout),
            start_timeout: patience.of(usual.start_timeout),
            environment_age_max: patience.of(usual.environment_age_max),
            ..usual
        }
    }
}

impl Family for Umd2Config {
    fn driver(
        &self,
        common: &InstrumentConfig,
        patience: Patience,
    ) -> Box<dyn DisplacementInstrument> {
        Box::new(Umd2::new(self.settings(common, patience)))
    }

    fn readings_per_s(&self) -> f64 {
        self.sample_rate_hz
    }

    fn count(&self) -> Count {
        Count {
            length: half_wavelength() / f64::from(self.optics_factor),
            name: "half wavelengths",
            slipped: "fringes were lost or gained; keep the beam free and steady",
        }
    }

    fn corrections(&self) -> length_correction::Settings {
        let material = MaterialExpansion {
            per_kelvin: self.expansion_per_kelvin,
            u_per_kelvin: self.expansion_per_kelvin.abs() * 0.1,
        };
        let dead_path = DeadPath {
            length: Metres::from_mm(self.dead_path_mm),
            u_length: DEAD_PATH_U,
        };
        let has_dead_path = self.correct_dead_path && self.correct_air;
        length_correction::Settings {
            air: self.correct_air,
            vacuum_wavelength: Umd2Settings::default().vacuum_wavelength,
            u_relative_wavelength: WAVELENGTH_U,
            co2_umol_per_mol: CO2_UMOL_PER_MOL,
            material_expansion: self.correct_material.then_some(material),
            dead_path: has_dead_path.then_some(dead_path),
            cosine: None,
            u_environment: EnvironmentUncertainty {
                air_temperature: Celsius(0.1),
                pressure: Pascals(20.0),
                humidity: RelativeHumidity(0.03),
                material_temperature: Celsius(0.1),
                co2_umol_per_mol: 100.0,
            },
        }
    }

    fn environment_frozen(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(self.environment_frozen_s))
    }

    fn optics(&self) -> OpticsConfig {
        self.optics
    }
}
