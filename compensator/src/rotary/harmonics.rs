//! A table error as harmonics of a turn: what eccentricity (1), ellipticity (2) and the like come to, with how sure
//! each is.
//!
//! The uncertainty of harmonic k is that of one reading times the amplification that the placements give it
//! ([`Design`]) times √(2/N); over all harmonics together that is the uncertainty of a table error at a line.

use core::f64::consts::TAU;

use units::Radians;
use units::portable::{atan2, hypot, ln, sin_cos};

use super::design::{Design, harmonic_max};

/// One harmonic of a table error: amplitude · cos(number · angle − phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableHarmonic {
    /// Periods in a turn.
    pub number: usize,
    /// Half of what it goes up and down.
    pub amplitude: Radians,
    /// Where in its period it is largest.
    pub phase: Radians,
    /// Of the amplitude; `None` where the table error's is not known.
    pub standard_uncertainty: Option<Radians>,
    /// Whether it is larger than noise makes any harmonic in all but one of [`TABLES_PER_FALSE_HARMONIC`] tables; of
    /// unknown certainty none is.
    pub is_significant: bool,
}

/// In so many tables noise passes for a harmonic once.
pub const TABLES_PER_FALSE_HARMONIC: f64 = 100.0;

/// The harmonics of `table_error`, one value a line, up to the highest that its lines tell between them.
///
/// `known` is how the readings were placed, and the standard uncertainty of one; without it no harmonic is
/// significant.
pub fn harmonics(table_error: &[f64], known: Option<(&Design, Radians)>) -> Vec<TableHarmonic> {
    let highest = harmonic_max(table_error.len());
    let limit = noise_limit(highest);
    let each = (1..=highest).map(|number| harmonic(table_error, number));
    each.map(|it| {
        let standard_uncertainty = known.map(|(design, reading)| {
            let of_mean = (2.0 / table_error.len() as f64).sqrt();
            reading * (design.amplification(it.number) * of_mean)
        });
        TableHarmonic {
            is_significant: standard_uncertainty.is_some_and(|u| it.amplitude > u * limit),
            standard_uncertainty,
            ..it
        }
    })
    .collect()
}

/// By how many standard uncertainties noise makes an amplitude that large: of each of `count` harmonics it is
/// distributed as Rayleigh says, P(amplitude > t u) = exp(−t²/2).
fn noise_limit(count: usize) -> f64 {
    (2.0 * ln(TABLES_PER_FALSE_HARMONIC * count.max(1) as f64)).sqrt()
}

fn harmonic(values: &[f64], number: usize) -> TableHarmonic {
    let lines = values.len();
    let each = values.iter().enumerate();
    let (cosine, sine) = each.fold((0.0, 0.0), |(cosine, sine), (line, value)| {
        // Of whole turns nothing is left: the angle stays small.
        let angle = TAU * (line * number % lines) as f64 / lines as f64;
        let (s, c) = sin_cos(angle);
        (cosine + value * c, sine + value * s)
    });
    let (cosine, sine) = (cosine * 2.0 / lines as f64, sine * 2.0 / lines as f64);
    TableHarmonic {
        number,
        amplitude: Radians(hypot(cosine, sine)),
        phase: Radians(atan2(sine, cosine)),
        standard_uncertainty: None,
        is_significant: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINES: usize = 37;

    fn seen() -> Vec<TableHarmonic> {
        let design = Design::new(LINES, &[0, 1, 5], f64::INFINITY).unwrap();
        let error = |line: usize| {
            let angle = TAU * line as f64 / LINES as f64;
            5e-5 * (angle - 0.3).cos() + 2e-6 * (4.0 * angle + 1.0).cos()
        };
        let errors: Vec<f64> = (0..LINES).map(error).collect();
        let reading = Radians(1e-7 / design.rms_amplification());
        harmonics(&errors, Some((&design, reading)))
    }

    #[test]
    fn harmonics_are_those_that_the_error_was_made_of() {
        let all = seen();
        assert_eq!(all.len(), 18);
        let significant: Vec<_> = all.iter().filter(|it| it.is_significant).collect();
        let numbers: Vec<_> = significant.iter().map(|it| it.number).collect();
        assert_eq!(numbers, [1, 4]);
        assert!((significant[0].amplitude.value() - 5e-5).abs() < 1e-15);
        assert!((significant[0].phase.value() - 0.3).abs() < 1e-9);
        assert!((significant[1].amplitude.value() - 2e-6).abs() < 1e-15);
        assert!((significant[1].phase.value() + 1.0).abs() < 1e-9);
    }

    #[test]
    fn all_harmonics_together_are_as_uncertain_as_the_table_error() {
        // Of an odd number of lines every harmonic has a cosine and a sine.
        let all = seen();
        let squares = all.iter().filter_map(|it| it.standard_uncertainty);
        let sum: f64 = squares.map(|it| it.value() * it.value()).sum();
        assert!((sum.sqrt() / 1e-7 - 1.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn nothing_is_significant_of_unknown_certainty() {
        let all = harmonics(&[1.0, -1.0, 1.0, -1.0, 0.5], None);
        assert_eq!(all.len(), 2);
        assert!(all.iter().all(|it| !it.is_significant));
    }
}
