//! Units as D-SI writes them: `\nano\metre`, `\degreecelsius`.

/// What a unit is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    Length,
    Frequency,
    Temperature,
    Pressure,
    Ratio,
}

/// A unit, and how its numbers become those of the SI (temperatures: degrees Celsius).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    pub(super) dimension: Dimension,
    /// What one of it is.
    pub(super) factor: f64,
    /// What is taken away from a temperature (not from a difference).
    zero: f64,
}

const PREFIXES: [(&str, f64); 12] = [
    ("femto", 1e-15),
    ("pico", 1e-12),
    ("nano", 1e-9),
    ("micro", 1e-6),
    ("milli", 1e-3),
    ("centi", 1e-2),
    ("deci", 1e-1),
    ("hecto", 1e2),
    ("kilo", 1e3),
    ("mega", 1e6),
    ("giga", 1e9),
    ("tera", 1e12),
];

const UNITS: [(&str, Dimension, f64, f64); 9] = [
    ("metre", Dimension::Length, 1.0, 0.0),
    ("hertz", Dimension::Frequency, 1.0, 0.0),
    ("kelvin", Dimension::Temperature, 1.0, 273.15),
    ("degreecelsius", Dimension::Temperature, 1.0, 0.0),
    ("pascal", Dimension::Pressure, 1.0, 0.0),
    ("bar", Dimension::Pressure, 1e5, 0.0),
    ("one", Dimension::Ratio, 1.0, 0.0),
    ("percent", Dimension::Ratio, 1e-2, 0.0),
    ("ppm", Dimension::Ratio, 1e-6, 0.0),
];

impl Unit {
    /// The unit of this name; `None` for one that nothing here is measured in.
    pub(super) fn named(text: &str) -> Option<Self> {
        let mut words = text.trim().strip_prefix('\\')?.split('\\');
        let (first, second) = (words.next()?, words.next());
        if words.next().is_some() {
            return None;
        }
        let (prefix, name) = match second {
            Some(name) => (PREFIXES.iter().find(|it| it.0 == first)?.1, name),
            None => (1.0, first),
        };
        let (_, dimension, one, zero) = *UNITS.iter().find(|it| it.0 == name)?;
        // Kilodegrees are nobody's.
        let is_plain = prefix == 1.0 || name != "degreecelsius";
        is_plain.then_some(Self {
            dimension,
            factor: prefix * one,
            zero,
        })
    }

    /// A value in this unit.
    pub(super) fn value(self, number: f64) -> f64 {
        number * self.factor - self.zero
    }

    /// A difference in this unit, or an uncertainty.
    pub(super) fn difference(self, number: f64) -> f64 {
        number * self.factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(name: &str, number: f64, expected: f64) {
        let seen = Unit::named(name).expect(name).value(number);
        assert!(
            (seen - expected).abs() <= 1e-12 * expected.abs(),
            "{name}: {seen}"
        );
    }

    #[test]
    fn units_become_those_of_the_si_and_what_is_none_of_them_is_not_known() {
        check("\\nano\\metre", 632.99, 632.99e-9);
        check("\\tera\\hertz", 473.6, 473.6e12);
        check("\\kelvin", 293.15, 20.0);
        check("\\degreecelsius", 20.0, 20.0);
        check("\\hecto\\pascal", 1013.25, 101_325.0);
        check("\\milli\\bar", 1013.25, 101_325.0);
        check("\\percent", 45.0, 0.45);
        let milli = Unit::named("\\milli\\kelvin").expect("a unit");
        assert_eq!(milli.difference(5.0), 0.005, "a difference has no zero");
        for other in [
            "",
            "nm",
            "metre",
            "\\volt",
            "\\nano",
            "\\foo\\metre",
            "\\metre\\second\\tothe{-1}",
            "\\milli\\degreecelsius",
        ] {
            assert_eq!(Unit::named(other), None, "{other}");
        }
    }
}
