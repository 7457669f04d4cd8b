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
/// What only an interferometer has.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Umd2Config {
    /// How often the beam passes the measured length there and back: one count is λ/2 divided by
    /// it. 1 linear (corner cube), 2 plane mirror.
    #[schemars(range(min = 1, max = 16))]
    #[schemars(extend("x-own" = true))]
    pub optics_factor: u8,
    /// The firmware's rate.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub sample_rate_hz: f64,
    /// Whether readings are corrected for the refractive index of air, by the instrument's own
    /// weather sensors.
    pub correct_air: bool,
    /// Whether for the expansion to 20 °C.
    pub correct_material: bool,
    /// Of the machine's material.
    #[schemars(range(min = -0.0001, max = 0.0001))]
    #[schemars(extend("x-own" = true))]
    pub expansion_per_kelvin: f64,
    /// Whether for the dead path; needs `correct_air`.
    pub correct_dead_path: bool,
    /// Path in air between optic and reflector at the axis's zero.
    #[schemars(range(min = 0.0, max = 100000.0))]
    #[schemars(extend("x-own" = true))]
    pub dead_path_mm: f64,
    /// A sensor of air or material that shows the very same digits for longer is broken, and stops
    /// the run.
    #[serde(default = "half_an_hour")]
    #[schemars(range(min = 1.0, max = 1000000.0))]
    pub environment_frozen_s: f64,
    /// What else it can be set up with.
    #[serde(default)]
    pub optics: OpticsConfig,
    /// How uncertain that is which its readings are corrected with.
    #[serde(default)]
    pub uncertainty: UncertaintyConfig,
}

/// Standard uncertainties (k = 1) of what an interferometer's readings are corrected with; they enter the
/// budget of each calibration.
///
/// The defaults are those of good sensors beside the beam and on the machine, without certificates:
/// where a certificate states U with k = 2, write half of it, and add in squares what the place of the
/// sensor makes uncertain (a gradient of 0.2 K across the stage is more than its thermometer's own).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintyConfig {
    /// Of the air temperature along the beam; by default that of a class A thermometer (IEC 60751: within
    /// 0.15 K + 0.2 %, a rectangle) beside it.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub air_temperature_k: f64,
    /// Of the air pressure; by default that of a silicon barometer a year after its adjustment.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub pressure_pa: f64,
    /// Of the relative humidity; by default that of a capacitive sensor.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub humidity_percent: f64,
    /// Of the carbon dioxide in the air, taken as 450 µmol/mol; by default what people in a room change.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub co2_umol_per_mol: f64,
    /// Of the mean temperature of what expands: its sensor, and where that sits; by default as for air.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub material_temperature_k: f64,
    /// Of `expansion_per_kelvin`; where it is missing a tenth of that, which is what handbooks differ by for
    /// one kind of steel, glass or granite.
    #[schemars(range(min = 0.0, max = 0.0001))]
    pub expansion_per_kelvin: Option<f64>,
    /// Of the wavelength in vacuum, relative to it; by default that of a stabilised helium-neon laser.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub wavelength_ppm: f64,
    /// Of `dead_path_mm`; by default that of a rule.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub dead_path_mm: f64,
}

impl Default for UncertaintyConfig {
    fn default() -> Self {
        Self {
            air_temperature_k: 0.1,
            pressure_pa: 20.0,
            humidity_percent: 3.0,
            co2_umol_per_mol: 100.0,
            material_temperature_k: 0.1,
            expansion_per_kelvin: None,
            wavelength_ppm: 0.02,
            dead_path_mm: 1.0,
        }
    }
}

/// What handbooks differ by for one kind of material.
const EXPANSION_U: f64 = 0.1;

impl UncertaintyConfig {
    fn environment(&self) -> EnvironmentUncertainty {
        EnvironmentUncertainty {
            air_temperature: Celsius(self.air_temperature_k),
            pressure: Pascals(self.pressure_pa),
            humidity: RelativeHumidity(self.humidity_percent * 1e-2),
            material_temperature: Celsius(self.material_temperature_k),
            co2_umol_per_mol: self.co2_umol_per_mol,
        }
    }
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
        let every = self.every_correction();
        let has_dead_path = self.correct_dead_path && self.correct_air;
        length_correction::Settings {
            air: self.correct_air,
            material_expansion: every.material_expansion.filter(|_| self.correct_material),
            dead_path: every.dead_path.filter(|_| has_dead_path),
            ..every
        }
    }

    fn every_correction(&self) -> length_correction::Settings {
        let u = &self.uncertainty;
        let of_coefficient = self.expansion_per_kelvin.abs() * EXPANSION_U;
        length_correction::Settings {
            air: true,
            vacuum_wavelength: Umd2Settings::default().vacuum_wavelength,
            u_relative_wavelength: u.wavelength_ppm * 1e-6,
            co2_umol_per_mol: CO2_UMOL_PER_MOL,
            material_expansion: Some(MaterialExpansion {
                per_kelvin: self.expansion_per_kelvin,
                u_per_kelvin: u.expansion_per_kelvin.unwrap_or(of_coefficient),
            }),
            dead_path: Some(DeadPath {
                length: Metres::from_mm(self.dead_path_mm),
                u_length: Metres::from_mm(u.dead_path_mm),
            }),
            cosine: None,
            u_environment: u.environment(),
        }
    }

    fn environment_frozen(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(self.environment_frozen_s))
    }

    fn optics(&self) -> OpticsConfig {
        self.optics
    }
}
