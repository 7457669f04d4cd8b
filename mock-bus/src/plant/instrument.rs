//! The laser interferometer's physics: how many half wavelengths pass as the stage moves.
//!
//! The refractive index of air is the modified Edlén equation: K. P. Birch and M. J. Downs,
//! Metrologia 31 (1994) 315, with the constants as the NIST Engineering Metrology Toolbox
//! (J. A. Stone, J. H. Zimmerman) prints them, and the vapour pressure of A. L. Buck (J. Appl.
//! Meteorol. 20 (1981) 1527, 1996 revision). The compensator uses another equation on
//! purpose; the two agree to about 1e-8 in ordinary air.
//!
//! Polarisations that mix make an error that repeats with each half wavelength (N. Bobroff, Meas. Sci. Technol. 4 (1993)
//! 907): the first harmonic of it.
//!
//! Absent: air turbulence, further harmonics of that error, thermal growth of the optics.

use core::f64::consts::TAU;

use crate::random::Stream;
use units::portable::{cos, exp, sin};
use units::{Celsius, Metres, Pascals, RelativeHumidity};

use super::config::InterferometerConfig;
use super::thermal::Environment;
use super::volumetric::Sighting;

/// Iodine-locked or not, the heads are taken to emit exactly this, in vacuum.
const VACUUM_WAVELENGTH_M: f64 = 632.991_372e-9;

/// What becomes of the beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Beam {
    /// Full signal.
    #[default]
    Good,
    /// So little light that the phase is not valid.
    Weak,
    /// None.
    Blocked,
}

/// What the interferometer's detector sees at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fringes {
    /// Half wavelengths of optical path (one way) from the optic to the reflector.
    pub half_wavelengths: f64,
    /// Their rate of change per second.
    pub half_wavelengths_per_s: f64,
    /// What becomes of the beam.
    pub beam: Beam,
    /// Whether the reflector moves too fast for the counter.
    pub too_fast: bool,
}

/// What a scanning head sees of a scale at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scanned {
    /// Where it is along the scale, which is exact.
    pub position: Metres,
    /// How fast it moves along it.
    pub speed_m_per_s: f64,
    /// Whether it sees the scale.
    pub is_clean: bool,
    /// Counts slipped by an injected jump.
    pub slipped: i64,
}

/// Optics and sensors.
#[derive(Clone, Debug)]
pub(super) struct Interferometer {
    config: InterferometerConfig,
    cosine: f64,
    noise: Stream,
    pub(super) beam: Beam,
    /// Counts slipped by an injected fringe jump.
    pub(super) slipped: i64,
    pub(super) frozen: Option<Environment>,
    /// Amplitude of a reflector that shakes, as a standard deviation.
    pub(super) vibration_m: f64,
}

impl Interferometer {
    pub(super) fn new(config: InterferometerConfig, seed: u64) -> Self {
        Self {
            cosine: cos(config.misalignment_mrad * 1e-3),
            config,
            noise: Stream::new(seed, "interferometer"),
            beam: Beam::Good,
            slipped: 0,
            frozen: None,
            vibration_m: 0.0,
        }
    }

    /// The linear stage's reflector at a true position and speed.
    pub(super) fn reflector(&self, position_m: f64, speed: f64) -> Sighting {
        Sighting {
            path_m: self.config.dead_path_mm * 1e-3 + position_m * self.cosine,
            speed_m_per_s: speed * self.cosine,
            is_lit: true,
        }
    }

    /// The fringes of what is seen, if anything is.
    pub(super) fn fringes(&mut self, seen: Option<Sighting>, air: &Environment) -> Fringes {
        let is_lit = seen.is_some_and(|it| it.is_lit);
        let (path_m, speed) = seen.map_or((0.0, 0.0), |it| (it.path_m, it.speed_m_per_s));
        let n = refractive_index(air.air_temperature, air.pressure, air.humidity);
        let wavelength_m = VACUUM_WAVELENGTH_M * (1.0 + self.config.wavelength_offset_ppm * 1e-6);
        let per_m = 2.0 * n / wavelength_m;
        let noise_m = (self.config.noise_nm * 1e-9 + self.vibration_m) * self.noise.gaussian();
        let mixed_m = self.mixed_m(path_m * per_m);
        Fringes {
            half_wavelengths: (path_m + noise_m + mixed_m) * per_m + self.slipped as f64,
            half_wavelengths_per_s: speed * per_m,
            beam: if is_lit { self.beam } else { Beam::Blocked },
            too_fast: speed.abs() > self.config.speed_max_m_per_s,
        }
    }

    /// What polarisations that mix add to a path of so many half wavelengths.
    fn mixed_m(&self, half_wavelengths: f64) -> f64 {
        let amplitude_m = self.config.nonlinearity_nm * 1e-9;
        // A sine for each sample is worth sparing.
        if amplitude_m > 0.0 {
            amplitude_m * sin(TAU * half_wavelengths)
        } else {
            0.0
        }
    }

    /// Dirt on a scale is what a hand in the beam is to an interferometer.
    pub(super) fn scanned(&self, seen: &Sighting) -> Scanned {
        Scanned {
            position: Metres(seen.path_m),
            speed_m_per_s: seen.speed_m_per_s,
            is_clean: seen.is_lit && self.beam != Beam::Blocked,
            slipped: self.slipped,
        }
    }

    /// What the instrument's own sensors say.
    pub(super) fn sensed(&self, truth: Environment) -> Environment {
        let c = &self.config;
        self.frozen.unwrap_or(Environment {
            air_temperature: truth.air_temperature + Celsius(c.air_temperature_error_k),
            pressure: truth.pressure + Pascals(100.0 * c.pressure_error_hpa),
            humidity: truth.humidity + RelativeHumidity(c.humidity_error_percent / 100.0),
            stage_temperature: truth.stage_temperature + Celsius(c.stage_temperature_error_k),
        })
    }

    pub(super) const fn dead_path(&self) -> Metres {
        Metres(self.config.dead_path_mm * 1e-3)
    }
}

/// The phase refractive index of air for the helium-neon wavelength.
fn refractive_index(air: Celsius, pressure: Pascals, humidity: RelativeHumidity) -> f64 {
    let (t, p) = (air.value(), pressure.value());
    let micrometre = VACUUM_WAVELENGTH_M * 1e6;
    let s = 1.0 / (micrometre * micrometre);
    let standard = 1e-8 * (8342.54 + 2_406_147.0 / (130.0 - s) + 15_998.0 / (38.9 - s));
    let density = p / 96_095.43 * (1.0 + 1e-8 * (0.601 - 0.009_72 * t) * p) / (1.0 + 0.003_661 * t);
    let vapour = humidity.value() * saturation_pressure(t);
    let water = 1e-10 * (292.75 / (t + 273.15)) * (3.7345 - 0.0401 * s) * vapour;
    1.0 + standard * density - water
}

/// Over water, in pascals (Buck 1996).
fn saturation_pressure(celsius: f64) -> f64 {
    611.21 * exp((18.678 - celsius / 234.5) * (celsius / (257.14 + celsius)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST Engineering Metrology Toolbox, Ciddor's equation at 633 nm (450 ppm CO2).
    #[test]
    fn the_index_agrees_with_published_values_to_1e_8() {
        for (celsius, pascals, percent, expected) in [
            (20.0, 101_325.0, 50.0, 1.000_271_373),
            (20.0, 50_123.0, 50.0, 1.000_133_999),
            (20.0, 101_325.0, 0.0, 1.000_271_800),
            (20.0, 101_325.0, 100.0, 1.000_270_949),
        ] {
            let humidity = RelativeHumidity(percent / 100.0);
            let n = refractive_index(Celsius(celsius), Pascals(pascals), humidity);
            assert!(
                (n - expected).abs() < 1e-8,
                "{celsius} {pascals} {percent}: {n:.9}"
            );
        }
    }
}
