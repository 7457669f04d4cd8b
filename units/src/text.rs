//! Quantities as a person types them: the unit is never guessed.

use crate::{AxisSpeed, Metres, MetresPerSecond, Radians, RadiansPerSecond};

const LENGTHS: [(&str, f64); 5] = [
    ("mm", 1e-3),
    ("um", 1e-6),
    ("µm", 1e-6),
    ("nm", 1e-9),
    ("m", 1.0),
];

const SPEEDS: [(&str, f64); 4] = [("mm/s", 1e-3), ("um/s", 1e-6), ("µm/s", 1e-6), ("m/s", 1.0)];

const DEGREE: f64 = 1.0_f64.to_radians();

const ANGLES: [(&str, f64); 5] = [
    ("arcsec", DEGREE / 3600.0),
    ("arcmin", DEGREE / 60.0),
    ("deg", DEGREE),
    ("mrad", 1e-3),
    ("rad", 1.0),
];

const ANGULAR_SPEEDS: [(&str, f64); 6] = [
    ("arcsec/s", DEGREE / 3600.0),
    ("arcmin/s", DEGREE / 60.0),
    ("deg/s", DEGREE),
    ("mrad/s", 1e-3),
    ("rad/s", 1.0),
    ("rpm", core::f64::consts::TAU / 60.0),
];

/// A length such as `-300um` or `12.5 mm`; `None` for anything else, a bare number included.
///
/// ```
/// use units::{Metres, text};
///
/// assert_eq!(text::length("-300um"), Some(Metres(-300.0 * 1e-6)));
/// assert_eq!(text::length("12.5"), None, "the unit is never guessed");
/// ```
pub fn length(text: &str) -> Option<Metres> {
    measure(text, &LENGTHS).map(Metres)
}

/// A speed such as `20mm/s`.
///
/// ```
/// use units::{MetresPerSecond, text};
///
/// assert_eq!(text::speed("20mm/s"), Some(MetresPerSecond(20.0 * 1e-3)));
/// assert_eq!(text::speed("20mm"), None);
/// ```
pub fn speed(text: &str) -> Option<MetresPerSecond> {
    measure(text, &SPEEDS).map(MetresPerSecond)
}

/// An angle such as `20arcsec` or `90deg`.
///
/// ```
/// use units::{Radians, text};
///
/// assert_eq!(text::angle("180deg"), Some(Radians(core::f64::consts::PI)));
/// assert_eq!(text::angle("1"), None);
/// ```
pub fn angle(text: &str) -> Option<Radians> {
    measure(text, &ANGLES).map(Radians)
}

/// An angular speed such as `5deg/s`, `10arcsec/s` or `2rpm` (turns per minute).
///
/// ```
/// use units::{RadiansPerSecond, text};
///
/// assert_eq!(text::angular_speed("180deg/s"), Some(RadiansPerSecond(core::f64::consts::PI)));
/// assert_eq!(text::angular_speed("30rpm"), text::angular_speed("180deg/s"));
/// assert_eq!(text::angular_speed("5deg"), None);
/// ```
pub fn angular_speed(text: &str) -> Option<RadiansPerSecond> {
    measure(text, &ANGULAR_SPEEDS).map(RadiansPerSecond)
}

/// Whichever of [`speed`] and [`angular_speed`] it is.
///
/// ```
/// use units::{MetresPerSecond, RadiansPerSecond, text};
///
/// assert_eq!(text::axis_speed("-2m/s"), Some(MetresPerSecond(-2.0).into()));
/// assert_eq!(text::axis_speed("2rad/s"), Some(RadiansPerSecond(2.0).into()));
/// assert_eq!(text::axis_speed("2"), None, "the unit is never guessed");
/// ```
pub fn axis_speed(text: &str) -> Option<AxisSpeed> {
    let linear = speed(text).map(AxisSpeed::from);
    linear.or_else(|| angular_speed(text).map(AxisSpeed::from))
}

fn measure(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (digits, scale) = units
        .iter()
        .find_map(|(unit, scale)| Some((text.strip_suffix(unit)?, *scale)))?;
    let value: f64 = digits.trim().parse().ok()?;
    value.is_finite().then_some(value * scale)
}
