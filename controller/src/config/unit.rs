//! Numbers with a unit behind them, as people write them and a file does not take them.

/// The number at the beginning of `text`, and what follows it, if anything does.
pub(super) fn split_unit(text: &str) -> Option<(&str, Option<&str>)> {
    let is_digit = |it: char| it.is_ascii_digit() || "+-._".contains(it);
    let end = text.find(|it| !is_digit(it)).unwrap_or(text.len());
    // `1e-6`, but not the e of a unit.
    let end = match text[end..].strip_prefix(['e', 'E']) {
        Some(rest) => {
            let digits = rest.trim_start_matches(['+', '-']);
            let count = digits
                .find(|it: char| !it.is_ascii_digit())
                .unwrap_or(digits.len());
            match count {
                0 => end,
                count => text.len() - digits.len() + count,
            }
        }
        None => end,
    };
    let (number, rest) = text.split_at(end);
    number.parse::<f64>().ok()?;
    let rest = rest.trim();
    Some((number, (!rest.is_empty()).then_some(rest)))
}

/// Whether it looks like a unit: `mm`, `µm/s`, `mm/s2`, `°`.
pub(super) fn is_unit(text: &str) -> bool {
    let begins = text.starts_with(|it: char| it.is_alphabetic() || "°%″′".contains(it));
    // `0x1F` is a number that was mistyped, and `12,5` another one.
    let is_prefix = text.len() > 1
        && text.starts_with(['x', 'o', 'b'])
        && text[1..].starts_with(|it: char| it.is_ascii_hexdigit());
    let is_rest = |it: char| it.is_alphanumeric() || "/°²³%″′^".contains(it);
    // A letter that looks like a digit is one; digits are exponents.
    let is_digit = ["l", "I", "O", "o", "S", "B"].contains(&text);
    let has_digits = text.contains(|it: char| it.is_ascii_digit());
    let is_known = !has_digits || size(&text.replace('^', "")).is_some();
    begins && !is_prefix && !is_digit && is_known && text.chars().all(is_rest)
}

/// Whether it is one of the units that keys end with, or another of the same quantities.
pub(super) fn is_known(unit: &str) -> bool {
    size(unit).is_some()
}

/// `5k` is five thousand, where the key is no temperature.
pub(super) fn magnified(written: &str, key: &str) -> Option<String> {
    let (number, unit) = split_unit(written)?;
    // Behind a blank it is another unit.
    let unit = unit.filter(|_| !written.contains(' '))?;
    let factor = match unit {
        // Kelvin, whatever the scale.
        _ if ["_k", "_c", "kelvin"].iter().any(|it| key.ends_with(it)) => return None,
        "k" | "K" => 1e3,
        "M" => 1e6,
        _ => return None,
    };
    let value = number.parse::<f64>().ok()? * factor;
    Some(match number.contains('.') || value.fract() != 0.0 {
        true => format!("{value:?}"),
        false => format!("{value}"),
    })
}

/// Whether nobody knows how much of the key's own unit it is: another quantity, or a unit that is not known.
pub(super) fn is_another(unit: &str, key: &str) -> bool {
    // A letter by itself was a slip of the hand.
    let is_other = |own: (String, f64)| match size(unit) {
        Some(it) => it.0 != own.0,
        None => unit.chars().nth(1).is_some(),
    };
    unit_of(key).is_some_and(is_other)
}

/// `number` of `unit` in the unit that `key` ends with: 0.05 mm are 50.0 of `position_window_um`.
pub(super) fn converted(number: &str, unit: &str, key: &str) -> Option<String> {
    let unit = unit.replace('²', "2").replace('³', "3").replace('^', "");
    let written = size(&unit)?;
    // A share has no unit.
    let is_temperature = ["_c", "_k", "_kelvin"].iter().any(|it| key.ends_with(it));
    let is_share = unit == "%" && !is_temperature;
    let wanted = unit_of(key).or_else(|| is_share.then(|| ("share".to_owned(), 1.0)))?;
    if written.0 != wanted.0 {
        return None;
    }
    let value = number.parse::<f64>().ok()? * written.1 / wanted.1;
    // Without what the factors leave behind the last digit.
    let value: f64 = format!("{value:.11e}").parse().ok()?;
    Some(format!("{value:?}"))
}

/// The unit that a key ends with. Temperatures are none: they have another zero each.
fn unit_of(key: &str) -> Option<(String, f64)> {
    let words: Vec<&str> = key.split('_').collect();
    let unit = match words[..] {
        [.., above, "per", below] => format!("{above}/{below}"),
        [.., last] => last.to_owned(),
        [] => return None,
    };
    size(&unit)
}

/// What a unit measures, and how much of it.
fn size(unit: &str) -> Option<(String, f64)> {
    let unit = unit.trim_end_matches('.');
    if let Some((above, below)) = unit.split_once('/') {
        let (above, below) = (size(above)?, size(below)?);
        return Some((format!("{}/{}", above.0, below.0), above.1 / below.1));
    }
    const ARC_SECOND: f64 = core::f64::consts::PI / 648_000.0;
    let (what, size) = match unit {
        "m" => ("length", 1.0),
        "cm" => ("length", 1e-2),
        "mm" => ("length", 1e-3),
        "um" | "µm" | "μm" | "micron" | "microns" => ("length", 1e-6),
        "nm" => ("length", 1e-9),
        "in" | "inch" | "inches" => ("length", 0.0254),
        "s" | "sec" | "second" | "seconds" => ("time", 1.0),
        "ms" => ("time", 1e-3),
        "us" | "µs" | "μs" => ("time", 1e-6),
        "min" | "minutes" => ("time", 60.0),
        "h" | "hr" => ("time", 3600.0),
        "s2" => ("time2", 1.0),
        "s3" => ("time3", 1.0),
        "%" | "percent" => ("share", 1e-2),
        "ppm" => ("share", 1e-6),
        "V" | "v" | "volt" | "volts" => ("voltage", 1.0),
        "mV" | "mv" => ("voltage", 1e-3),
        "deg" | "°" | "degree" | "degrees" => ("angle", 3600.0 * ARC_SECOND),
        "arcsec" | "″" => ("angle", ARC_SECOND),
        "arcmin" | "′" => ("angle", 60.0 * ARC_SECOND),
        "rad" => ("angle", 1.0),
        "mrad" => ("angle", 1e-3),
        "urad" | "µrad" | "μrad" => ("angle", 1e-6),
        "bit" => ("data", 1.0),
        "kbit" => ("data", 1e3),
        "Mbit" => ("data", 1e6),
        "Hz" | "hz" => ("frequency", 1.0),
        "kHz" | "khz" => ("frequency", 1e3),
        "Pa" | "pa" => ("pressure", 1.0),
        "hPa" | "hpa" | "mbar" => ("pressure", 1e2),
        "kPa" | "kpa" => ("pressure", 1e3),
        _ => return None,
    };
    Some((what.to_owned(), size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_unit_is_converted_to_that_of_the_key() {
        for (number, unit, key, value) in [
            ("0.05", "mm", "position_window_um", Some("50.0")),
            ("200000", "um/s", "speed_mm_per_s", Some("200.0")),
            ("3", "m/s²", "acceleration_mm_per_s2", Some("3000.0")),
            ("90", "°", "sector_deg", Some("90.0")),
            ("1", "deg", "reach_arcsec", Some("3600.0")),
            ("5", "ms", "speed_mm_per_s", None),
            ("5", "mm", "samples", None),
            ("10", "%", "low_c", None),
        ] {
            assert_eq!(
                converted(number, unit, key).as_deref(),
                value,
                "{number} {unit}"
            );
        }
    }

    #[test]
    fn a_unit_behind_a_number_is_known_and_anything_else_is_none() {
        for (text, number, unit) in [
            ("12.5 mm", "12.5", Some("mm")),
            ("200mm/s", "200", Some("mm/s")),
            ("-1e-6m", "-1e-6", Some("m")),
            ("5 e", "5", Some("e")),
            ("90°", "90", Some("°")),
            ("3", "3", None),
        ] {
            assert_eq!(split_unit(text), Some((number, unit)), "{text}");
            assert!(unit.is_none_or(is_unit), "{text}");
        }
        assert_eq!(split_unit("twelve"), None);
        for text in ["12,5", "0x0002019G", "0b12", "1.5 # mm", "3 \""] {
            let split = split_unit(text);
            assert!(
                split.is_none_or(|(_, unit)| !unit.is_some_and(is_unit)),
                "{text}"
            );
        }
    }
}
