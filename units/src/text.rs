//! Quantities as a person types them: the unit is never guessed.

use crate::{Metres, MetresPerSecond, Radians};

const LENGTHS: [(&str, f64); 5] = [
    ("mm", 1e-3),
    ("um", 1e-6),
    ("µm", 1e-6),
    ("nm", 1e-9),
    ("m", 1.0),
];

const SPEEDS: [(&str, f64); 4] = [("mm/s", 1e-3), ("um/s", 1e-6), ("µm/s", 1e-6), ("m/s", 1.0)];

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
    let degree = 1.0_f64.to_radians();
    let units = [
        ("arcsec", degree / 3600.0),
        ("arcmin", degree / 60.0),
        ("deg", degree),
        ("mrad", 1e-3),
        ("rad", 1.0),
    ];
    measure(text, &units).map(Radians)
}

fn measure(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (digits, scale) = units
        .iter()
        .find_map(|(unit, scale)| Some((text.strip_suffix(unit)?, *scale)))?;
    let value: f64 = digits.trim().parse().ok()?;
    value.is_finite().then_some(value * scale)
}
