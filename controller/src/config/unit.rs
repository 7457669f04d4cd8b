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
    begins && !is_prefix && text.chars().all(is_rest)
}

#[cfg(test)]
mod tests {
    use super::*;

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
