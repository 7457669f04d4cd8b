//! Laser interferometers read by a µMD1 or µMD2.

use core::time::Duration;

use compensator::length_correction::{self, DeadPath, EnvironmentUncertainty, MaterialExpansion};
use compensator::uncertainty::combine;
use drivers::device::Environment;
use drivers::device::umd2::{Umd2, Umd2Settings};
use drivers::device::{Direction, DisplacementInstrument};
use machine::Patience;
use schemars::JsonSchema;
use serde::Deserialize;
use units::{Celsius, Metres, Pascals, RelativeHumidity};

use super::{Count, Family, InstrumentConfig, OpticsConfig};
use crate::certificate::{CertificateConfig, Figures, Measurand};
use crate::hardware::certificate::{Beyond, Certificate};

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
    /// Whether for the dead path; without `correct_air` it is not.
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
    /// What of it has a certificate.
    #[serde(default)]
    pub certificate: Box<Umd2CertificatesConfig>,
}

/// Certificates of an interferometer and of its sensors.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Umd2CertificatesConfig {
    /// Of the laser: its vacuum wavelength, or its frequency.
    pub wavelength: Option<CertificateConfig>,
    /// Of the thermometer in the air.
    pub air_temperature: Option<CertificateConfig>,
    /// Of the barometer.
    pub pressure: Option<CertificateConfig>,
    /// Of the hygrometer.
    pub humidity: Option<CertificateConfig>,
    /// Of the thermometer on what expands.
    pub material_temperature: Option<CertificateConfig>,
}

impl Umd2CertificatesConfig {
    fn named(&mut self) -> Vec<Certificate<&mut CertificateConfig>> {
        let all = [
            (WAVELENGTH, Measurand::Wavelength, &mut self.wavelength),
            (
                AIR_TEMPERATURE,
                Measurand::Temperature,
                &mut self.air_temperature,
            ),
            (PRESSURE, Measurand::Pressure, &mut self.pressure),
            (HUMIDITY, Measurand::Humidity, &mut self.humidity),
            (
                MATERIAL_TEMPERATURE,
                Measurand::Temperature,
                &mut self.material_temperature,
            ),
        ];
        let all = all.into_iter();
        all.filter_map(|(of, measurand, own)| Some((of, measurand, own.as_mut()?)))
            .collect()
    }

    fn read(&self) -> Vec<Certificate<&CertificateConfig>> {
        let all = [
            (WAVELENGTH, Measurand::Wavelength, &self.wavelength),
            (
                AIR_TEMPERATURE,
                Measurand::Temperature,
                &self.air_temperature,
            ),
            (PRESSURE, Measurand::Pressure, &self.pressure),
            (HUMIDITY, Measurand::Humidity, &self.humidity),
            (
                MATERIAL_TEMPERATURE,
                Measurand::Temperature,
                &self.material_temperature,
            ),
        ];
        let all = all.into_iter();
        all.filter_map(|(of, measurand, own)| Some((of, measurand, own.as_ref()?)))
            .collect()
    }
}

/// What is known of a sensor, if it has a certificate.
fn certified(own: &Option<CertificateConfig>) -> Option<&Figures> {
    let certified = own.as_ref()?.certified.as_deref()?;
    Some(&certified.figures)
}

/// The standard uncertainty of what is certified, and of what the certificate does not say; by default that of `usual`
/// without one.
fn uncertain(own: &Option<CertificateConfig>, configured: Option<f64>, usual: f64) -> f64 {
    match certified(own) {
        Some(figures) => combine(&[figures.u(), configured.unwrap_or(0.0)]),
        None => configured.unwrap_or(usual),
    }
}

/// Standard uncertainties (k = 1) of what an interferometer's readings are corrected with; they enter the
/// budget of each calibration.
///
/// The defaults are those of good sensors beside the beam and on the machine, without certificates. Where there is
/// a certificate (`certificate`), its uncertainty counts in place of the default; write here, of what it is about,
/// only what it does not say, which is then added in squares: what the place of the sensor makes uncertain (a gradient
/// of 0.2 K across the stage is more than its thermometer's own), and what it has drifted since.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintyConfig {
    /// Of the air temperature along the beam; without a certificate by default 0.1, that of a class A thermometer
    /// (IEC 60751: within 0.15 K + 0.2 %, a rectangle) beside it.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub air_temperature_k: Option<f64>,
    /// Of the air pressure; without a certificate by default 20, that of a silicon barometer a year after its
    /// adjustment.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub pressure_pa: Option<f64>,
    /// Of the relative humidity; without a certificate by default 3, that of a capacitive sensor.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub humidity_percent: Option<f64>,
    /// Of the carbon dioxide in the air, taken as 450 µmol/mol; by default what people in a room change.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub co2_umol_per_mol: f64,
    /// Of the mean temperature of what expands: its sensor, and where that sits; without a certificate by default 0.1,
    /// as for air.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub material_temperature_k: Option<f64>,
    /// Of `expansion_per_kelvin`; where it is missing a tenth of that, which is what handbooks differ by for
    /// one kind of steel, glass or granite.
    #[schemars(range(min = 0.0, max = 0.0001))]
    pub expansion_per_kelvin: Option<f64>,
    /// Of the wavelength in vacuum, relative to it; without a certificate by default 0.02, that of a stabilised
    /// helium-neon laser.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub wavelength_ppm: Option<f64>,
    /// Of `dead_path_mm`; by default that of a rule.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub dead_path_mm: f64,
}

impl Default for UncertaintyConfig {
    fn default() -> Self {
        Self {
            air_temperature_k: None,
            pressure_pa: None,
            humidity_percent: None,
            co2_umol_per_mol: 100.0,
            material_temperature_k: None,
            expansion_per_kelvin: None,
            wavelength_ppm: None,
            dead_path_mm: 1.0,
        }
    }
}

/// What handbooks differ by for one kind of material.
const EXPANSION_U: f64 = 0.1;

/// Of sensors and lasers without certificates.
const AIR_TEMPERATURE_U_K: f64 = 0.1;
const PRESSURE_U_PA: f64 = 20.0;
const HUMIDITY_U: f64 = 0.03;
const MATERIAL_TEMPERATURE_U_K: f64 = 0.1;
const WAVELENGTH_U: f64 = 0.02e-6;

/// What a certificate is of, by its key.
const WAVELENGTH: &str = "wavelength";
const AIR_TEMPERATURE: &str = "air_temperature";
const PRESSURE: &str = "pressure";
const HUMIDITY: &str = "humidity";
const MATERIAL_TEMPERATURE: &str = "material_temperature";

impl Umd2Config {
    fn u_environment(&self) -> EnvironmentUncertainty {
        let (u, of) = (&self.uncertainty, &self.certificate);
        let air = uncertain(
            &of.air_temperature,
            u.air_temperature_k,
            AIR_TEMPERATURE_U_K,
        );
        let humidity = u.humidity_percent.map(|it| it * 1e-2);
        let material = u.material_temperature_k;
        EnvironmentUncertainty {
            air_temperature: Celsius(air),
            pressure: Pascals(uncertain(&of.pressure, u.pressure_pa, PRESSURE_U_PA)),
            humidity: RelativeHumidity(uncertain(&of.humidity, humidity, HUMIDITY_U)),
            material_temperature: Celsius(uncertain(
                &of.material_temperature,
                material,
                MATERIAL_TEMPERATURE_U_K,
            )),
            co2_umol_per_mol: u.co2_umol_per_mol,
        }
    }

    /// The certified one, or that of every helium-neon laser.
    fn vacuum_wavelength(&self) -> Metres {
        match certified(&self.certificate.wavelength) {
            Some(Figures::Value { value, .. }) => Metres(*value),
            _ => Umd2Settings::default().vacuum_wavelength,
        }
    }

    fn u_relative_wavelength(&self) -> f64 {
        let configured = self.uncertainty.wavelength_ppm.map(|it| it * 1e-6);
        match certified(&self.certificate.wavelength) {
            Some(Figures::Value { value, u }) => combine(&[u / value, configured.unwrap_or(0.0)]),
            _ => configured.unwrap_or(WAVELENGTH_U),
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
            vacuum_wavelength: self.vacuum_wavelength(),
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
            length: self.vacuum_wavelength() / 2.0 / f64::from(self.optics_factor),
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
            vacuum_wavelength: self.vacuum_wavelength(),
            u_relative_wavelength: self.u_relative_wavelength(),
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
            u_environment: self.u_environment(),
        }
    }

    fn environment_frozen(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(self.environment_frozen_s))
    }

    fn certificates(&self) -> Vec<Certificate<&CertificateConfig>> {
        self.certificate.read()
    }

    fn certificates_mut(&mut self) -> Vec<Certificate<&mut CertificateConfig>> {
        self.certificate.named()
    }

    fn certified(&self, seen: &Environment) -> Environment {
        let of = &self.certificate;
        let right = |value: f64, own| value + certified(own).map_or(0.0, |it| it.correction(value));
        let celsius = |value: Option<Celsius>, own| Some(Celsius(right(value?.value(), own)));
        Environment {
            air_temperature: celsius(seen.air_temperature, &of.air_temperature),
            material_temperature: celsius(seen.material_temperature, &of.material_temperature),
            pressure: seen
                .pressure
                .map(|it| Pascals(right(it.value(), &of.pressure))),
            humidity: seen
                .humidity
                .map(|it| RelativeHumidity(right(it.value(), &of.humidity))),
        }
    }

    fn beyond_certified(&self, seen: &Environment) -> Vec<Beyond> {
        let of = &self.certificate;
        let sensors = [
            (
                AIR_TEMPERATURE,
                Measurand::Temperature,
                seen.air_temperature.map(Celsius::value),
                &of.air_temperature,
            ),
            (
                PRESSURE,
                Measurand::Pressure,
                seen.pressure.map(Pascals::value),
                &of.pressure,
            ),
            (
                HUMIDITY,
                Measurand::Humidity,
                seen.humidity.map(RelativeHumidity::value),
                &of.humidity,
            ),
            (
                MATERIAL_TEMPERATURE,
                Measurand::Temperature,
                seen.material_temperature.map(Celsius::value),
                &of.material_temperature,
            ),
        ];
        let beyond = sensors
            .into_iter()
            .filter_map(|(of, measurand, reading, own)| {
                Beyond::of(of, measurand, reading?, certified(own)?)
            });
        beyond.collect()
    }

    fn optics(&self) -> OpticsConfig {
        self.optics
    }
}
