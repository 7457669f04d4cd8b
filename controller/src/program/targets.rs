//! Targets as a person types them: the unit is never guessed.

use units::{Metres, Radians};

use crate::Failure;

/// `x=12.5mm`: the unit is never guessed.
pub(crate) fn axis_target(text: &str) -> Result<(String, Metres), Failure> {
    let usage = || Failure::Usage {
        what: format!("`{text}` is not a target"),
        help: "write AXIS=LENGTH with a unit: x=12.5mm, x=-300um, x=0.1m".into(),
    };
    let (axis, value) = text.split_once('=').ok_or_else(usage)?;
    let length = length(value).ok_or_else(usage)?;
    if axis.is_empty() {
        return Err(usage());
    }
    Ok((axis.to_owned(), length))
}

/// `-300um`.
pub(crate) fn length(text: &str) -> Option<Metres> {
    let units = [
        ("mm", 1e-3),
        ("um", 1e-6),
        ("µm", 1e-6),
        ("nm", 1e-9),
        ("m", 1.0),
    ];
    measure(text, &units).map(Metres)
}

/// `20arcsec`.
pub(crate) fn angle(text: &str) -> Option<Radians> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_needs_an_axis_a_number_and_a_unit() {
        let (axis, target) = axis_target("x=12.5mm").unwrap();
        assert_eq!((axis.as_str(), target), ("x", Metres(12.5 * 1e-3)));
        assert_eq!(axis_target("y=-300um").unwrap().1, Metres(-300.0 * 1e-6));
        for text in [
            "x=12.5", "x", "=1mm", "x=1,5mm", "x=nanmm", "x=infm", "x=mm",
        ] {
            assert!(axis_target(text).is_err(), "{text}");
        }
    }
}
