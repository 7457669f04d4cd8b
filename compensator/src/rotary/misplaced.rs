//! Whether the plate was turned as was entered: a mistake that no single reading shows.
//!
//! The other placements alone give table and plate. With them the readings of a placement fit one
//! turn of the plate, which is found by correlation; when that is another one than was entered,
//! and fits far better, the plate was turned otherwise. Two mistakes look different:
//!
//! - the offset is wrong and the lines are right, as when lines are told apart by their numbers:
//!   reading − A\[n\] is G\[n + s\] for another s;
//! - the lines are wrong and their positions right, as when lines are told apart by where the table
//!   finds them: reading − G\[p\] is A\[p − s\] for another s.
//!
//! Of three placements each is judged by two; two cannot judge each other. Harmonics that the
//! others cannot separate are attributed to the plate, which spoils the prediction by no more than
//! the table's share.

use realfft::RealFftPlanner;
use units::Radians;

use super::solve::{Solution, SolveOptions, solve_what_is_seen};
use crate::rotary::{Placement, RotarySeries};
use crate::uncertainty::rms;

/// How much better another turn must fit.
const BETTER: f64 = 3.0;

/// Of fewer lines a wrong turn may fit by chance.
const LINES_MIN: usize = 12;

/// Residuals below it are rounding.
const RESIDUAL_MIN: f64 = 1e-12;

/// A placement that fits another turn of the plate than was entered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the placement at plate offset {offset} fits offset {likely} far better: its readings differ \
     by {:.3} arcsec (rms) from what the other placements predict there, but by {:.3} as entered; \
     was the plate turned by {likely} lines?",
    residual_likely.arcsec(), residual.arcsec()
)]
pub struct Misplaced {
    /// Which placement, counted from 0 in the order of the series.
    pub placement: usize,
    /// Its offset as entered.
    pub offset: usize,
    /// The offset that it fits.
    pub likely: usize,
    /// rms of reading − prediction by the other placements, as entered.
    pub residual: Radians,
    /// The same for the offset that it fits.
    pub residual_likely: Radians,
}

/// The placement that was most likely turned otherwise than entered, if any was.
pub fn misplaced(series: &RotarySeries, options: &SolveOptions) -> Option<Misplaced> {
    if series.lines() < LINES_MIN {
        return None;
    }
    let each = (0..series.placements().len()).filter_map(|at| judged(series, at, options));
    each.min_by(|a, b| {
        a.residual_likely
            .value()
            .total_cmp(&b.residual_likely.value())
    })
}

fn judged(series: &RotarySeries, at: usize, options: &SolveOptions) -> Option<Misplaced> {
    let (others, own) = without(series, at)?;
    let rest = solve_what_is_seen(&others, options).ok()?;
    let lines = series.lines();
    let table: Vec<f64> = rest.table_error.iter().map(|it| it.value()).collect();
    let plate = |line: usize| rest.plate_error[line].map(Radians::value);
    let residual = residual(&rest, &own, own.offset, 0)?;
    let reading = |line: usize| own.readings[line].map(Radians::value);
    let by_line = (0..lines).map(|line| Some(reading(line)? - plate(line)?));
    let by_position = (0..lines).map(|position| {
        let line = (position + lines - own.offset) % lines;
        Some(reading(line)? - table[position])
    });
    // Against G[n + s], and A[p − s], for all s.
    let offset = shift_between(by_line, table.iter().copied().map(Some));
    let shifted = shift_between((0..lines).map(plate), by_position);
    let candidates = [(offset, 0), (shifted, shifted + lines - own.offset)];
    let fits = candidates
        .into_iter()
        .filter(|(likely, _)| *likely != own.offset);
    let seen = fits
        .filter_map(|(likely, shift)| Some((likely, self::residual(&rest, &own, likely, shift)?)));
    let (likely, residual_likely) = seen.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let better = residual > RESIDUAL_MIN && residual_likely * BETTER < residual;
    better.then_some(Misplaced {
        placement: at,
        offset: own.offset,
        likely,
        residual: Radians(residual),
        residual_likely: Radians(residual_likely),
    })
}

/// The other placements, and this one.
fn without(series: &RotarySeries, at: usize) -> Option<(RotarySeries, Placement)> {
    let mut others = series.placements().to_vec();
    let own = others.remove(at);
    Some((RotarySeries::new(series.lines(), others).ok()?, own))
}

/// rms of the readings of `own` less what `rest` predicts and less their mean, if the plate is at
/// `offset` and its lines are called `shift` lines too high.
fn residual(rest: &Solution, own: &Placement, offset: usize, shift: usize) -> Option<f64> {
    let lines = own.readings.len();
    let expected = rest.expected(offset);
    let apart = |named: usize| {
        let line = (named + lines - shift % lines) % lines;
        Some((own.readings[named]? - expected[line]?).value())
    };
    let apart: Vec<f64> = (0..lines).filter_map(apart).collect();
    let mean = apart.iter().sum::<f64>() / apart.len() as f64;
    let apart: Vec<f64> = apart.iter().map(|it| it - mean).collect();
    (!apart.is_empty()).then(|| rms(&apart))
}

/// Values less the mean of those that are there; zero for the others.
fn centred(values: impl Iterator<Item = Option<f64>>) -> Vec<f64> {
    let values: Vec<Option<f64>> = values.collect();
    let count = values.iter().flatten().count().max(1);
    let mean = values.iter().flatten().sum::<f64>() / count as f64;
    values
        .iter()
        .map(|it| it.map_or(0.0, |it| it - mean))
        .collect()
}

/// The shift s for which a\[n\] is most like b\[n + s\], of two rows of as many values around a
/// circle, each less its mean. Missing values count for nothing. Takes N log N steps.
pub fn shift_between(
    a: impl Iterator<Item = Option<f64>>,
    b: impl Iterator<Item = Option<f64>>,
) -> usize {
    best(&correlation(&centred(a), &centred(b)))
}

/// Σ_n a\[n\] b\[n + s\] for all s, times a constant.
fn correlation(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(a.len());
    let spectrum = |values: &[f64]| {
        let mut output = forward.make_output_vec();
        let transformed = forward.process(&mut values.to_vec(), &mut output);
        transformed.expect("the lengths are the planner's");
        output
    };
    let mut product = spectrum(b);
    for (b, a) in product.iter_mut().zip(spectrum(a)) {
        *b *= a.conj();
    }
    let inverse = planner.plan_fft_inverse(a.len());
    let mut output = inverse.make_output_vec();
    let transformed = inverse.process(&mut product, &mut output);
    transformed.expect("the product of real ends is real");
    output
}

fn best(correlation: &[f64]) -> usize {
    let each = correlation.iter().enumerate();
    each.max_by(|a, b| a.1.total_cmp(b.1))
        .map_or(0, |(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::super::rig::{Noise, Truth};
    use super::*;

    const OFFSETS: [usize; 4] = [0, 1, 8, 26];

    /// Readings of a plate that was placed at `turned` instead of `OFFSETS`; lines told apart by
    /// their numbers, or by their places.
    fn series(turned: [usize; 4], by_place: bool, seed: u64) -> RotarySeries {
        let mut noise = Noise(seed);
        let truth = Truth::new(60, &mut noise);
        let placements = (0..4).map(|at| {
            let mut read = |named: usize| {
                let shift = if by_place {
                    turned[at] + 60 - OFFSETS[at]
                } else {
                    0
                };
                let line = (named + 60 - shift % 60) % 60;
                let reading = 7.0 * at as f64 + truth.reading(turned[at], line);
                (named != 33).then(|| Radians::from_arcsec(reading + 0.05 * noise.normal()))
            };
            let readings = (0..60).map(&mut read).collect();
            Placement {
                offset: OFFSETS[at],
                readings,
            }
        });
        RotarySeries::new(60, placements.collect()).unwrap()
    }

    #[test]
    fn a_row_is_found_again_in_one_that_is_shifted_and_has_holes() {
        let mut noise = Noise(9);
        let row: Vec<f64> = (0..60).map(|_| 3.0 + noise.normal()).collect();
        for shift in [0, 1, 30, 59] {
            let a = row.iter().map(|it| Some(*it));
            let shifted = |n: usize| row[(n + 60 - shift) % 60] + 7.0 + 0.1 * noise.normal();
            let b: Vec<f64> = (0..60).map(shifted).collect();
            let b = (0..60).map(|n| (n % 7 != 3).then_some(b[n]));
            assert_eq!(shift_between(a, b), shift);
        }
    }

    #[test]
    fn a_plate_turned_by_the_wrong_number_of_lines_is_named_with_the_right_one() {
        for (placement, turned) in [(0, 3), (1, 2), (2, 7), (3, 50)] {
            for by_place in [false, true] {
                let mut offsets = OFFSETS;
                offsets[placement] = turned;
                let series = series(offsets, by_place, 5);
                let found = misplaced(&series, &SolveOptions::default()).unwrap();
                assert_eq!(
                    (found.placement, found.offset, found.likely),
                    (placement, OFFSETS[placement], turned),
                    "by place: {by_place}"
                );
                assert!(found.residual_likely.arcsec() < 0.15, "{found}");
                assert!(found.residual.arcsec() > 0.5, "{found}");
            }
        }
    }

    #[test]
    fn a_plate_that_was_not_turned_at_all_is_named() {
        for by_place in [false, true] {
            let series = series([0, 1, 1, 26], by_place, 6);
            let found = misplaced(&series, &SolveOptions::default()).unwrap();
            assert_eq!((found.placement, found.likely), (2, 1));
            assert!(
                found
                    .to_string()
                    .contains("was the plate turned by 1 lines?"),
                "{found}"
            );
        }
    }

    #[test]
    fn right_placements_are_never_doubted() {
        for seed in 0..100 {
            let series = series(OFFSETS, seed % 2 == 0, seed);
            assert_eq!(
                misplaced(&series, &SolveOptions::default()),
                None,
                "seed {seed}"
            );
        }
    }

    /// Without the third placement the others are 12 lines apart, in 12 separate groups of lines.
    #[test]
    fn a_gap_where_the_others_do_not_see_every_harmonic_is_borne() {
        for turned in [7, 9] {
            let mut noise = Noise(3);
            let truth = Truth::new(60, &mut noise);
            let mut read = |offset: usize, named: usize, gap: usize| {
                let reading = truth.reading(offset, named) + 0.05 * noise.normal();
                (named != gap).then(|| Radians::from_arcsec(reading))
            };
            let placements = [(0, 0, 20), (12, 12, 41), (7, turned, 60)];
            let placements = placements.map(|(offset, turned, gap)| Placement {
                offset,
                readings: (0..60).map(|named| read(turned, named, gap)).collect(),
            });
            let series = RotarySeries::new(60, placements.into()).unwrap();
            let found = misplaced(&series, &SolveOptions::default());
            let expected = (turned == 9).then_some((2, 9));
            assert_eq!(found.map(|it| (it.placement, it.likely)), expected);
        }
    }

    #[test]
    fn two_placements_cannot_judge_each_other() {
        let mut noise = Noise(1);
        let truth = Truth::new(60, &mut noise);
        let series = truth.series(&[0, 1], 0.05, &mut noise, |_, _, reading| Some(reading));
        assert_eq!(misplaced(&series, &SolveOptions::default()), None);
    }
}
