//! Phase refractive index of moist air.
//!
//! Source: P. E. Ciddor, "Refractive index of air: new equations for the visible and near
//! infrared", Appl. Opt. 35, 1566 (1996), in the form of the NIST Engineering Metrology Toolbox
//! (J. A. Stone and J. H. Zimmerman, appendix A-I to A-III), whose saturation vapour pressure
//! over water is IAPWS-IF97's instead of Ciddor's own. Below 0 °C the humidity counts over ice, as there: W. Wagner,
//! A. Saul, A. Pruss, "International equations for the pressure along the melting and along the sublimation curve
//! of ordinary water substance", J. Phys. Chem. Ref. Data 23, 515 (1994). Ciddor states his equation from −40 °C on.
//! A sensor whose humidity counts over water down there, as many do, makes the index at most 1.2e-8 larger.
//!
//! | symbol | name here |
//! |---|---|
//! | S = 1/λ² (µm⁻²) | `wavenumber_squared` |
//! | x_v | `vapour_fraction` |
//! | r_as, r_axs, r_vs | `dry_standard`, `vapour_standard` refractivities |
//! | ρ_axs, ρ_vs, ρ_a, ρ_v | densities in kg/m³ |
//! | Z, Z_a | `compressibility`, `Z_STANDARD` |
//!
//! Absent: the group index, gases other than CO₂ and water.

use units::portable::{exp, ln};
use units::{Celsius, Metres, Pascals, RelativeHumidity};

const GAS_CONSTANT: f64 = 8.314_472;
const MOLAR_MASS_WATER: f64 = 0.018_015;
const Z_STANDARD: f64 = 0.999_592_211_5;
const DENSITY_VAPOUR_STANDARD: f64 = 0.009_859_38;
const PRESSURE_STANDARD: f64 = 101_325.0;
const KELVIN_STANDARD: f64 = 288.15;
const KELVIN: f64 = 273.15;
const TRIPLE_POINT_KELVIN: f64 = 273.16;
const TRIPLE_POINT_PRESSURE: f64 = 611.657;

/// Standard uncertainty of the equation itself, beside that of its inputs (Ciddor's estimate).
pub const EQUATION_STANDARD_UNCERTAINTY: f64 = 1e-8;

/// An input outside the range for which the equation is used here.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("refractive index of air: {input} {seen} is outside {low} to {high} {unit}",
    seen = units::Short(*seen), low = units::Short(*low), high = units::Short(*high))]
pub struct OutOfRange {
    /// Which input.
    pub input: Input,
    /// Its value, in `unit`.
    pub seen: f64,
    /// Lowest accepted value.
    pub low: f64,
    /// Highest accepted value.
    pub high: f64,
    /// Unit of the three numbers.
    pub unit: &'static str,
}

/// The inputs of the equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Wavelength in vacuum.
    VacuumWavelength,
    /// Air temperature.
    Temperature,
    /// Air pressure.
    Pressure,
    /// Relative humidity.
    Humidity,
    /// CO₂ content.
    CarbonDioxide,
}

impl core::fmt::Display for Input {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::VacuumWavelength => "vacuum wavelength",
            Self::Temperature => "temperature",
            Self::Pressure => "pressure",
            Self::Humidity => "relative humidity",
            Self::CarbonDioxide => "CO2 content",
        })
    }
}

/// How the index changes with each input, at one state of the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensitivities {
    /// dn/dT in 1/K.
    pub per_kelvin: f64,
    /// dn/dp in 1/Pa.
    pub per_pascal: f64,
    /// dn/dRH for a change of the humidity fraction by 1.
    pub per_humidity: f64,
    /// dn/d(CO₂) per µmol/mol.
    pub per_co2_umol_per_mol: f64,
}

/// The phase refractive index of air.
///
/// `co2_umol_per_mol` is the CO₂ content in µmol/mol (450 is usual indoors).
///
/// # Errors
/// When an input is outside 300…1700 nm, −40…100 °C, 10…140 kPa, 0…1, 0…2000 µmol/mol, or NaN.
///
/// # Example
///
/// ```
/// use compensator::air::refractive_index;
/// use units::{Celsius, Metres, Pascals, RelativeHumidity};
///
/// let (wavelength, half) = (Metres(633e-9), RelativeHumidity(0.5));
/// let n = refractive_index(wavelength, Celsius(20.0), Pascals(101_325.0), half, 450.0)?;
/// assert!((n - 1.000_271_373).abs() <= 1e-9, "NIST Engineering Metrology Toolbox");
/// let hectopascals = Pascals(1013.25);
/// let refused = refractive_index(wavelength, Celsius(20.0), hectopascals, half, 450.0);
/// assert!(refused.is_err_and(|it| it.unit == "Pa"));
/// # Ok::<(), compensator::air::OutOfRange>(())
/// ```
pub fn refractive_index(
    vacuum_wavelength: Metres,
    t: Celsius,
    p: Pascals,
    rh: RelativeHumidity,
    co2_umol_per_mol: f64,
) -> Result<f64, OutOfRange> {
    let wavelength_um = vacuum_wavelength.um();
    within(
        Input::VacuumWavelength,
        wavelength_um * 1e3,
        300.0,
        1700.0,
        "nm",
    )?;
    within(Input::Temperature, t.value(), -40.0, 100.0, "°C")?;
    within(Input::Pressure, p.value(), 10e3, 140e3, "Pa")?;
    within(Input::Humidity, rh.value(), 0.0, 1.0, "(fraction)")?;
    within(
        Input::CarbonDioxide,
        co2_umol_per_mol,
        0.0,
        2000.0,
        "umol/mol",
    )?;
    let wavenumber_squared = 1.0 / (wavelength_um * wavelength_um);
    Ok(ciddor(
        wavenumber_squared,
        t.value(),
        p.value(),
        rh.value(),
        co2_umol_per_mol,
    ))
}

/// The derivatives of [`refractive_index`], by central differences.
///
/// # Errors
/// As [`refractive_index`].
///
/// # Example
///
/// ```
/// use compensator::air::sensitivities;
/// use units::{Celsius, Metres, Pascals, RelativeHumidity};
///
/// let (p, rh) = (Pascals(101_325.0), RelativeHumidity(0.5));
/// let s = sensitivities(Metres(633e-9), Celsius(20.0), p, rh, 450.0)?;
/// assert!((s.per_kelvin + 0.95e-6).abs() < 0.03e-6, "a length grows by 0.95 µm/m for 1 K");
/// assert!((s.per_pascal - 2.68e-9).abs() < 0.03e-9);
/// # Ok::<(), compensator::air::OutOfRange>(())
/// ```
pub fn sensitivities(
    vacuum_wavelength: Metres,
    t: Celsius,
    p: Pascals,
    rh: RelativeHumidity,
    co2_umol_per_mol: f64,
) -> Result<Sensitivities, OutOfRange> {
    refractive_index(vacuum_wavelength, t, p, rh, co2_umol_per_mol)?;
    let s = 1.0 / (vacuum_wavelength.um() * vacuum_wavelength.um());
    let (t, p, h, c) = (t.value(), p.value(), rh.value(), co2_umol_per_mol);
    let slope = |high: f64, low: f64, step: f64| (high - low) / (2.0 * step);
    let (dt, dp, dh, dc) = (0.1, 100.0, 0.01, 10.0);
    Ok(Sensitivities {
        per_kelvin: slope(ciddor(s, t + dt, p, h, c), ciddor(s, t - dt, p, h, c), dt),
        per_pascal: slope(ciddor(s, t, p + dp, h, c), ciddor(s, t, p - dp, h, c), dp),
        per_humidity: slope(ciddor(s, t, p, h + dh, c), ciddor(s, t, p, h - dh, c), dh),
        per_co2_umol_per_mol: slope(ciddor(s, t, p, h, c + dc), ciddor(s, t, p, h, c - dc), dc),
    })
}

fn within(
    input: Input,
    seen: f64,
    low: f64,
    high: f64,
    unit: &'static str,
) -> Result<(), OutOfRange> {
    if seen >= low && seen <= high {
        Ok(())
    } else {
        Err(OutOfRange {
            input,
            seen,
            low,
            high,
            unit,
        })
    }
}

/// The bare equation: µm⁻², °C, Pa, fraction, µmol/mol.
fn ciddor(wavenumber_squared: f64, t: f64, p: f64, rh: f64, co2: f64) -> f64 {
    let s = wavenumber_squared;
    let kelvin = t + KELVIN;
    let enhancement = 1.000_62 + 3.14e-8 * p + 5.6e-7 * t * t;
    let vapour_fraction = rh * enhancement * saturation_pressure(t) / p;
    let dry_standard = 1e-8 * (5_792_105.0 / (238.0185 - s) + 167_917.0 / (57.362 - s));
    let dry_standard = dry_standard * (1.0 + 5.34e-7 * (co2 - 450.0));
    let vapour_standard =
        1.022e-8 * (295.235 + 2.6422 * s - 0.032_38 * s * s + 0.004_028 * s * s * s);
    let molar_mass_dry = 0.028_963_5 + 1.2011e-8 * (co2 - 400.0);
    let molar_volume = GAS_CONSTANT * kelvin * compressibility(t, p, vapour_fraction) / p;
    let density_standard =
        PRESSURE_STANDARD * molar_mass_dry / (Z_STANDARD * GAS_CONSTANT * KELVIN_STANDARD);
    let density_vapour = vapour_fraction * MOLAR_MASS_WATER / molar_volume;
    let density_dry = (1.0 - vapour_fraction) * molar_mass_dry / molar_volume;
    1.0 + density_dry / density_standard * dry_standard
        + density_vapour / DENSITY_VAPOUR_STANDARD * vapour_standard
}

fn compressibility(t: f64, p: f64, vapour_fraction: f64) -> f64 {
    let x = vapour_fraction;
    let ratio = p / (t + KELVIN);
    let first = 1.581_23e-6 - 2.9331e-8 * t
        + 1.1043e-10 * t * t
        + (5.707e-6 - 2.051e-8 * t) * x
        + (1.9898e-4 - 2.376e-6 * t) * x * x;
    1.0 - ratio * first + ratio * ratio * (1.83e-11 - 0.765e-8 * x * x)
}

/// Saturation vapour pressure in Pa, over ice below 0 °C.
fn saturation_pressure(t: f64) -> f64 {
    if t < 0.0 {
        saturation_pressure_over_ice(t)
    } else {
        saturation_pressure_over_water(t)
    }
}

/// In Pa (Wagner, Saul and Pruss, as the Toolbox prints it).
fn saturation_pressure_over_ice(t: f64) -> f64 {
    let theta = (t + KELVIN) / TRIPLE_POINT_KELVIN;
    let power = |exponent: f64| 1.0 - exp(exponent * ln(theta));
    TRIPLE_POINT_PRESSURE * exp(-13.928_169 * power(-1.5) + 34.707_823_8 * power(-1.25))
}

/// In Pa (IAPWS-IF97 region 4, as the Toolbox prints it).
fn saturation_pressure_over_water(t: f64) -> f64 {
    let kelvin = t + KELVIN;
    let omega = kelvin - 2.385_555_756_78e-1 / (kelvin - 6.501_753_484_48e2);
    let a = omega * omega + 1.167_052_145_28e3 * omega - 7.242_131_670_32e5;
    let b = -1.707_384_694_01e1 * omega * omega + 1.202_082_470_25e4 * omega - 3.232_555_032_23e6;
    let c = 1.491_510_861_35e1 * omega * omega - 4.823_265_736_16e3 * omega + 4.051_134_054_21e5;
    let root = 2.0 * c / (-b + (b * b - 4.0 * a * c).sqrt());
    1e6 * root * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed by the NIST Engineering Metrology Toolbox (Ciddor), printed to 1e-9: vacuum
    /// wavelength in nm, °C, Pa, %RH, µmol/mol CO₂, index.
    const NIST: [[f64; 6]; 9] = [
        [321.456, 20.0, 101325.0, 50.0, 450.0, 1.000283543],
        [633.0, 20.0, 101325.0, 50.0, 450.0, 1.000271373],
        [1500.8, 20.0, 101325.0, 50.0, 450.0, 1.000268190],
        [633.0, 0.0, 101325.0, 50.0, 450.0, 1.000291647],
        [633.0, 40.123, 101325.0, 50.0, 450.0, 1.000253031],
        [633.0, 20.0, 50123.0, 50.0, 450.0, 1.000133999],
        [633.0, 20.0, 101325.0, 0.0, 450.0, 1.000271800],
        [633.0, 20.0, 101325.0, 50.9876, 450.0, 1.000271364],
        [633.0, 20.0, 101325.0, 100.0, 450.0, 1.000270949],
    ];

    fn check(row: &[f64]) {
        let n = refractive_index(
            Metres(row[0] * 1e-9),
            Celsius(row[1]),
            Pascals(row[2]),
            RelativeHumidity(row[3] / 100.0),
            row[4],
        )
        .unwrap();
        assert!((n - row[5]).abs() <= 1e-9, "{row:?}: {n:.12}");
    }

    #[test]
    fn the_index_agrees_with_nist_to_the_last_printed_digit() {
        for row in &NIST {
            check(row);
        }
    }

    #[test]
    fn the_index_agrees_with_the_shared_reference_file_where_it_is_present() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../shared/data/air_index_ciddor.csv"
        );
        let Ok(text) = std::fs::read_to_string(path) else {
            return;
        };
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows.len(), 9);
        rows.iter().for_each(|row| check(row));
    }

    /// Vapour over ice: 8.947 Pa at 230 K, 12.84 Pa at −40 °C, 103.3 Pa at −20 °C, 259.9 Pa at −10 °C (tables).
    #[test]
    fn vapour_over_ice_has_the_pressure_of_the_tables() {
        for (t, pascals, off) in [
            (-43.15, 8.947, 0.001),
            (-40.0, 12.84, 0.01),
            (-20.0, 103.3, 0.05),
            (-10.0, 259.9, 0.05),
        ] {
            let seen = saturation_pressure_over_ice(t);
            assert!((seen - pascals).abs() <= off, "{t}: {seen}");
        }
        let [ice, water] =
            [saturation_pressure_over_ice, saturation_pressure_over_water].map(|it| it(0.01));
        assert!(
            (ice - water).abs() < 0.01,
            "they meet at the triple point: {ice}, {water}"
        );
    }

    /// Of dry air the index less one is as the density: p/(ZT), with Z 0.99960 at 20 °C and 0.99870 at −40 °C
    /// (Picard and others, Metrologia 45, 149 (2008)).
    #[test]
    fn the_index_goes_on_below_the_freezing_point() {
        let dry = |t: f64| {
            let (wavelength, p) = (Metres(633e-9), Pascals(100e3));
            refractive_index(wavelength, Celsius(t), p, RelativeHumidity(0.0), 450.0).unwrap() - 1.0
        };
        // Ciddor's own figure, 26824.4e-8.
        assert!((dry(20.0) - 26_824.4e-8).abs() < 0.1e-8);
        let expected = 26_824.4e-8 * (293.15 / 233.15) * (0.99960 / 0.99870);
        assert!((dry(-40.0) / expected - 1.0).abs() < 2e-5, "{}", dry(-40.0));
        let wet = |t: f64| {
            let (wavelength, p) = (Metres(633e-9), Pascals(101_325.0));
            refractive_index(wavelength, Celsius(t), p, RelativeHumidity(1.0), 450.0).unwrap()
        };
        let slope = (wet(1.0) - wet(-1.0)) / 2.0;
        let step = wet(1e-9) - wet(-1e-9);
        assert!(step.abs() < 0.02 * slope.abs(), "no step at 0 °C: {step}");
    }

    #[test]
    fn the_sensitivities_are_the_well_known_ones_of_a_helium_neon_laser() {
        let s = sensitivities(
            Metres(633e-9),
            Celsius(20.0),
            Pascals(101_325.0),
            RelativeHumidity(0.5),
            450.0,
        )
        .unwrap();
        // NIST: 1 °C changes the index by about -0.95e-6, 1 kPa by 2.7e-6, 10 %RH by -0.85e-7.
        assert!((s.per_kelvin + 0.95e-6).abs() < 0.03e-6, "{s:?}");
        assert!((s.per_pascal - 2.68e-9).abs() < 0.03e-9, "{s:?}");
        assert!((s.per_humidity + 8.5e-7).abs() < 0.2e-7, "{s:?}");
        assert!((s.per_co2_umol_per_mol - 1.45e-10).abs() < 0.1e-10, "{s:?}");
    }

    #[test]
    fn an_input_out_of_range_or_nan_is_named_with_its_limits() {
        let index = |t: f64, p: f64, h: f64| {
            refractive_index(
                Metres(633e-9),
                Celsius(t),
                Pascals(p),
                RelativeHumidity(h),
                450.0,
            )
        };
        for t in [-40.1, 100.1] {
            assert_eq!(index(t, 101e3, 0.5).unwrap_err().input, Input::Temperature);
        }
        assert_eq!(
            index(20.0, 1013.25, 0.5).unwrap_err().input,
            Input::Pressure
        );
        assert_eq!(
            index(20.0, 101e3, f64::NAN).unwrap_err().input,
            Input::Humidity
        );
        assert_eq!(
            index(20.0, 101e3, 50.0).unwrap_err().to_string(),
            "refractive index of air: relative humidity 50 is outside 0 to 1 (fraction)"
        );
    }
}
