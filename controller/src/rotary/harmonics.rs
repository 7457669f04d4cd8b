//! A table error as harmonics of a turn: what eccentricity (1), ellipticity (2) and the like come to, with how sure
//! each is.
//!
//! The uncertainty of harmonic k is that of one reading times the amplification that the placements give it
//! ([`Design`]) times √(2/N); over all harmonics together that is the uncertainty of a table error at a line.

use core::f64::consts::TAU;

use compensator::rotary::Design;
use compensator::uncertainty::rms;
use units::Radians;
use units::portable::{atan2, hypot, ln, sin_cos};

use crate::rotary::RotaryContent;

/// One harmonic of a table error: amplitude · cos(number · angle − phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TableHarmonic {
    /// Periods in a turn.
    pub(crate) number: usize,
    pub(crate) amplitude: Radians,
    pub(crate) phase: Radians,
    /// Of the amplitude; `None` where the table error's is not known.
    pub(crate) standard_uncertainty: Option<Radians>,
    /// Whether it is larger than noise makes any harmonic in all but one of a hundred tables; of unknown certainty
    /// none is.
    pub(crate) is_significant: bool,
}

/// In so many tables noise passes for a harmonic once.
pub(crate) const FALSE_ALARMS: f64 = 100.0;

/// By how many standard uncertainties noise makes an amplitude that large: of each of `count` harmonics it is
/// distributed as Rayleigh says, P(amplitude > t u) = exp(−t²/2).
fn noise_limit(count: usize) -> f64 {
    (2.0 * ln(FALSE_ALARMS * count.max(1) as f64)).sqrt()
}

impl RotaryContent {
    /// The harmonics of the table error, up to the highest that its lines tell between them, too.
    pub(crate) fn harmonics(&self) -> Vec<TableHarmonic> {
        let design = self.design();
        let reading = self.reading_uncertainty();
        let lines = self.table_error_rad.len().max(1) as f64;
        let u_of = |number: usize| {
            let amplification = design.as_ref()?.amplification(number);
            Some(reading? * (amplification * (2.0 / lines).sqrt()))
        };
        let limit = noise_limit(self.harmonic_max());
        let numbers = 1..=self.harmonic_max();
        numbers
            .map(|number| {
                let it = harmonic(&self.table_error_rad, number);
                let standard_uncertainty = u_of(number);
                TableHarmonic {
                    is_significant: standard_uncertainty.is_some_and(|u| it.amplitude > u * limit),
                    standard_uncertainty,
                    ..it
                }
            })
            .collect()
    }

    fn design(&self) -> Option<Design> {
        let offsets: Vec<usize> = self.offsets.iter().map(|it| *it as usize).collect();
        Design::new(self.table_error_rad.len(), &offsets, f64::INFINITY).ok()
    }

    /// Standard uncertainty of one reading, as the table error's stands for it.
    fn reading_uncertainty(&self) -> Option<Radians> {
        let of_table = self.standard_uncertainty_rad.as_ref()?;
        let amplified = self.noise_amplification;
        let is_known = !of_table.is_empty() && amplified > 0.0;
        is_known.then(|| Radians(rms(of_table) / amplified))
    }
}

fn harmonic(values: &[f64], number: usize) -> TableHarmonic {
    let lines = values.len().max(1);
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

    fn content(lines: u32, offsets: Vec<u32>) -> RotaryContent {
        let count = lines as usize;
        let places: Vec<usize> = offsets.iter().map(|it| *it as usize).collect();
        let design = Design::new(count, &places, f64::INFINITY).unwrap();
        let error = |line: u32| {
            let angle = TAU * f64::from(line) / f64::from(lines);
            5e-5 * (angle - 0.3).cos() + 2e-6 * (4.0 * angle + 1.0).cos()
        };
        RotaryContent {
            lines,
            offsets,
            table_error_rad: (0..lines).map(error).collect(),
            noise_amplification: design.rms_amplification(),
            standard_uncertainty_rad: Some(vec![1e-7; count]),
            ..RotaryContent::default()
        }
    }

    #[test]
    fn harmonics_are_those_that_the_error_was_made_of() {
        let all = content(37, vec![0, 1, 5]).harmonics();
        assert_eq!(all.len(), 18);
        let significant: Vec<_> = all.iter().filter(|it| it.is_significant).collect();
        let seen: Vec<_> = significant.iter().map(|it| it.number).collect();
        assert_eq!(seen, [1, 4]);
        assert!((significant[0].amplitude.value() - 5e-5).abs() < 1e-15);
        assert!((significant[0].phase.value() - 0.3).abs() < 1e-9);
        assert!((significant[1].amplitude.value() - 2e-6).abs() < 1e-15);
        assert!((significant[1].phase.value() + 1.0).abs() < 1e-9);
    }

    #[test]
    fn all_harmonics_together_are_as_uncertain_as_the_table_error() {
        // Of an odd number of lines every harmonic has a cosine and a sine.
        let all = content(37, vec![0, 1, 5]).harmonics();
        let squares = all.iter().filter_map(|it| it.standard_uncertainty);
        let sum: f64 = squares.map(|it| it.value() * it.value()).sum();
        assert!((sum.sqrt() / 1e-7 - 1.0).abs() < 1e-9, "{sum}");
    }
}
