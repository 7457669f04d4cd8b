//! How uncertain an input is, in the unit in which its number is easily read. Records and `--json` keep SI units.

use units::Short;

use super::ARCSECONDS;

/// Of a unit of a record: what is shown instead, the smallest first, each with what one of it is in that unit.
type Shown = [(f64, &'static str)];

const LENGTHS: &Shown = &[(1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m")];
const SHARES_OF_A_LENGTH: &Shown = &[(1e-9, "nm/m"), (1e-6, "µm/m"), (1e-3, "mm/m")];
const EXPANSIONS: &Shown = &[(1e-9, "nm/(m·K)"), (1e-6, "µm/(m·K)")];
const ANGLES: &Shown = &[(1.0 / ARCSECONDS, "″")];
const SHARES_OF_A_GAS: &Shown = &[(1.0, "µmol/mol")];

fn shown_for(unit: &str) -> &'static Shown {
    match unit {
        "m" => LENGTHS,
        "m/m" => SHARES_OF_A_LENGTH,
        "1/K" => EXPANSIONS,
        "rad" => ANGLES,
        "umol/mol" => SHARES_OF_A_GAS,
        _ => &[],
    }
}

/// With four digits (more are not known of any uncertainty), in the largest unit of which it is one at least.
pub(super) fn told(value: f64, unit: &str) -> (String, &str) {
    let shown = shown_for(unit);
    let fits = shown.iter().rev().find(|it| value >= it.0);
    let (one, unit) = *fits.or(shown.first()).unwrap_or(&(1.0, unit));
    let four = format!("{:.3e}", value / one);
    (Short(four.parse().unwrap_or(value)).to_string(), unit)
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn a_number_has_few_zeros_whatever_its_unit() {
        for (value, unit, expected) in [
            (3.7868e-7, "m", ("378.7", "nm")),
            (1.446e-6, "m", ("1.446", "µm")),
            (0.001, "m", ("1", "mm")),
            (2e-10, "m", ("0.2", "nm")),
            (1.15e-6, "1/K", ("1.15", "µm/(m·K)")),
            (3.464e-8, "m/m", ("34.64", "nm/m")),
            (6.668e-7, "rad", ("0.1375", "″")),
            (100.0, "umol/mol", ("100", "µmol/mol")),
            (0.03, "1", ("0.03", "1")),
            (0.0, "m", ("0", "nm")),
            (0.1, "K", ("0.1", "K")),
        ] {
            let (number, shown) = told(value, unit);
            assert_eq!((number.as_str(), shown), expected, "{value} {unit}");
        }
    }
}
