//! From an interferometer's optical displacement to the length at 20 °C.
//!
//! The instrument counts wavelengths; multiplied by the vacuum wavelength they are a length as if
//! there were no air. Up to four corrections follow, each switchable and each on record:
//!
//! 1. air: divide by the refractive index of air n ([`crate::air`]);
//! 2. dead path: the D of air between interferometer and reflector at the datum did not move,
//!    but its index did: subtract D·(n − n₀)/n;
//! 3. cosine: the beam leans by θ against the travel: divide by cos θ;
//! 4. material: the part has expanded: divide by 1 + α·(T − 20 °C).
//!
//! Source: J. A. Stone, S. D. Phillips and G. A. Mandolfo, "Corrections for wavelength variations
//! in precision interferometric displacement measurements", J. Res. NIST 101 (1996), for 1 and 2;
//! ISO 1 for the reference temperature; GUM 5.1 for the budget and F.2.4.4 for the cosine term
//! of an angle known only to be small. The phase is n(D + L) − n₀D, hence L of 1 and 2 together.
//!
//! | symbol | name here |
//! |---|---|
//! | n, n₀ | [`Corrected::index`], index at the datum |
//! | D | [`DeadPath::length`] |
//! | θ | [`Cosine::angle`] |
//! | α | [`MaterialExpansion::per_kelvin`] |
//!
//! Absent: gradients of temperature along the beam or the part, Abbe offsets, plane-mirror
//! optics (whose cosine error differs).

mod environment;

use units::portable::{cos, tan};
use units::{Celsius, Metres, Pascals, Radians, RelativeHumidity};

use crate::air;
use crate::budget::{self, Correlation, Evaluation};
use crate::uncertainty::combine;
use environment::check_channels;
pub use environment::{
    Channel, Environment, EnvironmentError, EnvironmentWatch, check_environment,
};

/// Reference temperature of lengths (ISO 1).
pub const REFERENCE_TEMPERATURE: Celsius = Celsius(20.0);

/// How the part expands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialExpansion {
    /// Coefficient of linear expansion in 1/K (steel about 11.5e-6).
    pub per_kelvin: f64,
    /// Its standard uncertainty in 1/K.
    pub u_per_kelvin: f64,
}

/// The air that does not move with the reflector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadPath {
    /// Distance from interferometer to reflector at the datum.
    pub length: Metres,
    /// Its standard uncertainty.
    pub u_length: Metres,
}

/// The lean of the beam against the travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cosine {
    /// The angle.
    pub angle: Radians,
    /// Its standard uncertainty.
    pub u_angle: Radians,
}

/// Which corrections are made, and with what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Whether the refractive index of air is divided out; without it n = 1.
    pub air: bool,
    /// Wavelength of the laser in vacuum.
    pub vacuum_wavelength: Metres,
    /// Its relative standard uncertainty.
    pub u_relative_wavelength: f64,
    /// CO₂ in µmol/mol.
    pub co2_umol_per_mol: f64,
    /// Expansion of the part, if it is corrected.
    pub material_expansion: Option<MaterialExpansion>,
    /// Dead path, if it is corrected (needs `air`).
    pub dead_path: Option<DeadPath>,
    /// Lean of the beam, if it is corrected.
    pub cosine: Option<Cosine>,
    /// Standard uncertainties of the environment's sensors.
    pub u_environment: EnvironmentUncertainty,
}

/// Standard uncertainties of the sensors; the temperatures are differences (1 °C = 1 K).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnvironmentUncertainty {
    /// Of the air temperature.
    pub air_temperature: Celsius,
    /// Of the pressure.
    pub pressure: Pascals,
    /// Of the humidity.
    pub humidity: RelativeHumidity,
    /// Of the material temperature.
    pub material_temperature: Celsius,
    /// Of the CO₂ content in µmol/mol.
    pub co2_umol_per_mol: f64,
}

/// What each correction changed; `None` where it is switched off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Division by n.
    pub air: Option<Metres>,
    /// The dead path's change.
    pub dead_path: Option<Metres>,
    /// Division by cos θ.
    pub cosine: Option<Metres>,
    /// Reduction to 20 °C.
    pub material: Option<Metres>,
}

/// A displacement at 20 °C and how it came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// The displacement from the datum.
    pub displacement: Metres,
    /// The index of air used; 1 when air is switched off.
    pub index: f64,
    /// What each correction changed, in the order made.
    pub terms: Terms,
}

/// A source of uncertainty of a corrected length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The laser's vacuum wavelength.
    Wavelength,
    /// The equation for the index of air itself.
    AirEquation,
    /// Air temperature through the index.
    AirTemperature,
    /// Pressure through the index.
    Pressure,
    /// Humidity through the index.
    Humidity,
    /// CO₂ through the index.
    CarbonDioxide,
    /// Length of the dead path.
    DeadPath,
    /// Angle of the beam.
    Cosine,
    /// Temperature of the part.
    MaterialTemperature,
    /// Coefficient of expansion.
    ExpansionCoefficient,
}

impl Source {
    /// What a budget calls it, and the unit that it is stated in.
    pub const fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Wavelength => ("wavelength or scale", "m/m"),
            Self::AirEquation => ("equation for the index of air", "m/m"),
            Self::AirTemperature => ("air temperature", "K"),
            Self::Pressure => ("air pressure", "Pa"),
            Self::Humidity => ("relative humidity", "1"),
            Self::CarbonDioxide => ("carbon dioxide", "umol/mol"),
            Self::DeadPath => ("dead path", "m"),
            Self::Cosine => ("angle of the beam", "rad"),
            Self::MaterialTemperature => ("material temperature", "K"),
            Self::ExpansionCoefficient => ("coefficient of expansion", "1/K"),
        }
    }
}

/// One line of an uncertainty budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Where it comes from.
    pub source: Source,
    /// Its share of the standard uncertainty of the length.
    pub standard_uncertainty: Metres,
}

/// Turns optical displacements since a datum into lengths at 20 °C.
///
/// # Example
///
/// ```
/// use compensator::length_correction::{
///     Environment, EnvironmentUncertainty, LengthCorrection, MaterialExpansion, Settings,
/// };
/// use units::{Celsius, Metres, Pascals, RelativeHumidity};
///
/// let environment = Environment {
///     air_temperature: Celsius(20.0),
///     pressure: Pascals(101_325.0),
///     humidity: RelativeHumidity(0.5),
///     material_temperature: Celsius(22.0),
/// };
/// let settings = Settings {
///     air: true,
///     vacuum_wavelength: Metres(633e-9),
///     u_relative_wavelength: 2e-8,
///     co2_umol_per_mol: 450.0,
///     material_expansion: Some(MaterialExpansion { per_kelvin: 11.5e-6, u_per_kelvin: 1e-6 }),
///     dead_path: None,
///     cosine: None,
///     u_environment: EnvironmentUncertainty::default(),
/// };
/// let correction = LengthCorrection::new(settings, &environment)?;
/// let terms = correction.correct(Metres::from_mm(60.0), &environment)?.terms;
/// let air = terms.air.map_or(0.0, Metres::nm);
/// assert!((air + 16_277.96).abs() < 0.1, "60 mm/n − 60 mm");
/// let material = terms.material.map_or(0.0, Metres::nm);
/// assert!((material + 1379.6).abs() < 0.1, "2 K of steel");
/// # Ok::<(), compensator::length_correction::EnvironmentError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthCorrection {
    settings: Settings,
    index_at_datum: f64,
}

impl LengthCorrection {
    /// Prepares the corrections; `datum` is the environment when the instrument was set to zero.
    ///
    /// # Errors
    /// When a setting is impossible or the environment is out of range.
    pub fn new(settings: Settings, datum: &Environment) -> Result<Self, EnvironmentError> {
        check_settings(&settings)?;
        let index_at_datum = index(&settings, datum)?;
        Ok(Self {
            settings,
            index_at_datum,
        })
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Corrects `optical`, the displacement since the datum in vacuum metres, signed; it grows
    /// as the reflector moves away from the interferometer.
    ///
    /// # Errors
    /// When the environment is out of range or `optical` is not finite.
    pub fn correct(
        &self,
        optical: Metres,
        environment: &Environment,
    ) -> Result<Corrected, EnvironmentError> {
        finite("optical displacement", optical.value())?;
        let index = index(&self.settings, environment)?;
        let mut terms = Terms::default();
        let mut length = optical;
        if self.settings.air {
            terms.air = Some(replace(&mut length, optical / index));
            if let Some(dead) = self.settings.dead_path {
                let change = dead.length * ((index - self.index_at_datum) / index);
                let corrected = length - change;
                terms.dead_path = Some(replace(&mut length, corrected));
            }
        }
        if let Some(cosine) = self.settings.cosine {
            let corrected = length / cos(cosine.angle.value());
            terms.cosine = Some(replace(&mut length, corrected));
        }
        if let Some(material) = self.settings.material_expansion {
            let excess = environment.material_temperature - REFERENCE_TEMPERATURE;
            let corrected = length / (1.0 + material.per_kelvin * excess.value());
            terms.material = Some(replace(&mut length, corrected));
        }
        Ok(Corrected {
            displacement: length,
            index,
            terms,
        })
    }

    /// The standard uncertainty of a corrected length, line by line; combine them with
    /// [`combined`].
    ///
    /// # Errors
    /// As [`correct`](Self::correct).
    pub fn budget(
        &self,
        optical: Metres,
        environment: &Environment,
    ) -> Result<Vec<Contribution>, EnvironmentError> {
        let length = self.correct(optical, environment)?.displacement;
        let lines = self.contributions(environment)?;
        let line = |(source, it): (Source, budget::Contribution)| Contribution {
            source,
            standard_uncertainty: it.share(length),
        };
        Ok(lines.into_iter().map(line).collect())
    }

    /// What contributes to the uncertainty of every length corrected in `environment`: most of it as
    /// the same share of all lengths, since one sensor and one coefficient correct them all.
    ///
    /// # Errors
    /// As [`correct`](Self::correct).
    pub fn contributions(
        &self,
        environment: &Environment,
    ) -> Result<Vec<(Source, budget::Contribution)>, EnvironmentError> {
        let (s, u) = (&self.settings, &self.settings.u_environment);
        let index = index(s, environment)?;
        let mut lines = vec![scale(Source::Wavelength, s.u_relative_wavelength, 1.0)];
        if s.air {
            lines.extend(air_lines(s, environment)?);
        }
        if let Some(dead) = s.dead_path.filter(|_| s.air) {
            let change = (index - self.index_at_datum) / index;
            let mut line = scale(Source::DeadPath, dead.u_length.value(), change);
            line.1.correlation = Correlation::CommonOffset;
            lines.push(line);
        }
        if let Some(cosine) = s.cosine {
            let (angle, u) = (cosine.angle.value(), cosine.u_angle.value());
            // First order, and the second order that is left when the angle itself is zero.
            let relative = combine(&[tan(angle) * u, u * u / 2.0_f64.sqrt()]);
            let per_radian = if u > 0.0 { relative / u } else { 0.0 };
            lines.push(scale(Source::Cosine, u, per_radian));
        }
        if let Some(material) = s.material_expansion {
            let excess = (environment.material_temperature - REFERENCE_TEMPERATURE).value();
            let u_temperature = u.material_temperature.value();
            lines.extend([
                scale(
                    Source::MaterialTemperature,
                    u_temperature,
                    material.per_kelvin,
                ),
                scale(Source::ExpansionCoefficient, material.u_per_kelvin, excess),
            ]);
        }
        Ok(lines)
    }
}

fn air_lines(
    s: &Settings,
    environment: &Environment,
) -> Result<[(Source, budget::Contribution); 5], EnvironmentError> {
    let (u, it) = (&s.u_environment, environment);
    let d = air::sensitivities(
        s.vacuum_wavelength,
        it.air_temperature,
        it.pressure,
        it.humidity,
        s.co2_umol_per_mol,
    )?;
    Ok([
        scale(Source::AirEquation, air::EQUATION_STANDARD_UNCERTAINTY, 1.0),
        scale(
            Source::AirTemperature,
            u.air_temperature.value(),
            d.per_kelvin,
        ),
        scale(Source::Pressure, u.pressure.value(), d.per_pascal),
        scale(Source::Humidity, u.humidity.value(), d.per_humidity),
        scale(
            Source::CarbonDioxide,
            u.co2_umol_per_mol,
            d.per_co2_umol_per_mol,
        ),
    ])
}

/// An input that stretches every length: so many metres per metre for one of its units.
fn scale(source: Source, value: f64, sensitivity: f64) -> (Source, budget::Contribution) {
    let (name, unit) = source.name();
    let input = (value, unit);
    let line = budget::Contribution {
        sensitivity,
        ..budget::Contribution::new(name, Evaluation::B, input, Correlation::CommonScale)
    };
    (source, line)
}

/// The combined standard uncertainty of a budget.
pub fn combined(budget: &[Contribution]) -> Metres {
    let lines: Vec<f64> = budget
        .iter()
        .map(|c| c.standard_uncertainty.value())
        .collect();
    Metres(combine(&lines))
}

/// The part of [`combined`] that is the same share of every length corrected by the same sensors and coefficients: one error
/// of theirs stretches all of them alike.
pub fn in_common(budget: &[Contribution]) -> Metres {
    let shares = budget.iter().filter(|it| it.source != Source::DeadPath);
    combined(&shares.copied().collect::<Vec<_>>())
}

/// Puts `new` into `length` and returns the change.
fn replace(length: &mut Metres, new: Metres) -> Metres {
    let change = new - *length;
    *length = new;
    change
}

fn index(settings: &Settings, environment: &Environment) -> Result<f64, EnvironmentError> {
    // What no correction uses need not be measured, either.
    if settings.material_expansion.is_some() {
        check_channels(&[Channel::MaterialTemperature], environment)?;
    }
    if !settings.air {
        return Ok(1.0);
    }
    let air = [
        Channel::AirTemperature,
        Channel::Pressure,
        Channel::Humidity,
    ];
    check_channels(&air, environment)?;
    Ok(air::refractive_index(
        settings.vacuum_wavelength,
        environment.air_temperature,
        environment.pressure,
        environment.humidity,
        settings.co2_umol_per_mol,
    )?)
}

fn finite(setting: &'static str, seen: f64) -> Result<(), EnvironmentError> {
    if seen.is_finite() {
        Ok(())
    } else {
        Err(EnvironmentError::Setting { setting, seen })
    }
}

fn check_settings(settings: &Settings) -> Result<(), EnvironmentError> {
    let refuse = |setting, seen| Err(EnvironmentError::Setting { setting, seen });
    if let Some(material) = settings.material_expansion {
        // Nothing solid expands by more than 1e-3 per kelvin: that is a number given in ppm.
        let possible = material.per_kelvin.abs() < 1e-3;
        if !possible {
            return refuse("expansion coefficient (1/K)", material.per_kelvin);
        }
    }
    if let Some(dead) = settings.dead_path {
        if !(dead.length >= Metres::ZERO && dead.length.is_finite()) {
            return refuse("dead path (m)", dead.length.value());
        }
        if !settings.air {
            return refuse("dead path without air correction (m)", dead.length.value());
        }
    }
    if let Some(cosine) = settings.cosine {
        // Beyond 0.1 rad the beam has long left the detector: that is an angle in degrees.
        let possible = cosine.angle.abs().value() < 0.1;
        if !possible {
            return refuse("beam angle (rad)", cosine.angle.value());
        }
    }
    finite(
        "relative wavelength uncertainty",
        settings.u_relative_wavelength,
    )
}

#[cfg(test)]
mod tests;
