//! Whether the plate was turned as was entered: a mistake that no single reading shows.
//!
//! Two models of all readings are compared, both freed of outliers first: as entered, and with one
//! placement turned by another number of lines. Two mistakes look different:
//!
//! - the offset is wrong and the lines are right, as when lines are told apart by their numbers:
//!   the readings are G\[n + s\] + A\[n\] for another s;
//! - the lines are wrong and their positions right, as when lines are told apart by where the table
//!   finds them: they are those of the plate's line p − s at position p, for another s.
//!
//! `turns` finds the most likely turns. The best of them is believed only if S₀/S₁, the ratio of the
//! sums of squares that both models leave, is too large for noise. Let d₀ and d₁ be the degrees of freedom.
//! If the readings are as entered, S₀/σ² is χ² of d₀, and whatever table and plate are like, S₁ is
//! larger than noise alone makes it. For a ratio r > d₀/d₁ Chernoff's bound (Ann. Math. Stat. 23
//! (1952) 493) of independent S₀ and S₁ is
//!
//! ```text
//! P(S₀/S₁ > r) ≤ (d₀(1 + r)/(r(d₀ + d₁)))^(−d₀/2) · (d₁(1 + r)/(d₀ + d₁))^(−d₁/2)
//! ```
//!
//! and S₀ and S₁, which share noise, are nearer to each other than independent ones. The bound times the turns
//! that were tried is the false-alarm rate: it holds for any table, plate, offsets and noise level,
//! so that a wrong turn is told as far as it makes the readings scatter beyond their noise.
//!
//! Two placements cannot judge each other: they leave no residuals.

use realfft::RealFftPlanner;
use units::Radians;
use units::portable::ln;

use super::design::Design;
use super::outliers::SIGMA_MIN;
use super::solution::SolveOptions;
use super::solver::{Freed, freed, readings_of};
use super::turns::{Turn, likely_turns};
use crate::rotary::RotarySeries;

/// How often, at most, a plate is suspected that was turned as entered: once in so many
/// calibrations, all placements of a calibration together that are judged one after the other.
const CALIBRATIONS: f64 = 1e4;

/// How often turns are looked for again, with what the last one says of bad readings.
const AGAIN_MAX: usize = 3;

/// A placement that fits another turn of the plate than was entered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the placement at plate offset {offset} fits offset {likely} far better: the readings of all \
     placements scatter by {:.3} arcsec about one table and one plate, but by {:.3} as entered; \
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
    /// Standard deviation of all readings but outliers about table and plate, as entered.
    pub residual: Radians,
    /// The same with the offset that the placement fits.
    pub residual_likely: Radians,
}

/// The placement that was turned otherwise than entered, if the readings prove that one was: of sound
/// calibrations at most one in 10 000 is doubted, those included whose readings are judged after
/// each placement.
pub fn misplaced(series: &RotarySeries, options: &SolveOptions) -> Option<Misplaced> {
    let (lines, offsets) = (series.lines(), series.offsets());
    if offsets.len() < 3 {
        return None;
    }
    let (readings, missing) = readings_of(series);
    let design = Design::of_any(lines, &offsets);
    let mut entered = freed(&design, &readings, &missing, options, None)?;
    let with = |turn: Turn| {
        let (offsets, readings, missing) = turn.applied(lines, &offsets, &readings, &missing);
        let design = Design::of_any(lines, &offsets);
        Some((turn, freed(&design, &readings, &missing, options, None)?))
    };
    let best_of = |readings: &[f64]| {
        let turns = likely_turns(lines, &offsets, readings);
        let fits = turns.into_iter().filter_map(with);
        fits.min_by(|a, b| scatter(&a.1).total_cmp(&scatter(&b.1)))
    };
    let (mut turn, mut likely) = best_of(&entered.readings)?;
    for _ in 0..AGAIN_MAX {
        // Bad readings that the wrong turn hid are now known, and may hide the right one no longer.
        let (next, fit) = best_of(&turn.undone(lines, &likely.readings))?;
        if scatter(&fit) >= scatter(&likely) {
            break;
        }
        (turn, likely) = (next, fit);
    }
    // What is no fault of the turn is left out as entered, too.
    let outliers = turn.undone_at(lines, &likely.outliers);
    let alike = freed(&design, &readings, &missing, options, Some(&outliers));
    if let Some(alike) = alike.filter(|it| scatter(it) < scatter(&entered)) {
        entered = alike;
    }
    let placements = offsets.len() as f64;
    let tried = 2.0 * placements * (lines - 1) as f64;
    // Summed over 3, 4, 5, … placements the shares make one.
    let share = 1.0 / ((placements - 1.0) * (placements - 2.0));
    let proven = ln_chance(&entered, &likely) < ln(share / CALIBRATIONS / tried);
    proven.then(|| Misplaced {
        placement: turn.placement,
        offset: offsets[turn.placement],
        likely: turn.offset,
        residual: Radians(scatter(&entered)),
        residual_likely: Radians(scatter(&likely)),
    })
}

fn scatter(it: &Freed) -> f64 {
    (it.squares / it.degrees_of_freedom.max(1) as f64).sqrt()
}

/// ln of the bound of P(S₀/S₁ > what was seen) when the readings are as entered.
fn ln_chance(entered: &Freed, likely: &Freed) -> f64 {
    let (d0, d1) = (
        entered.degrees_of_freedom as f64,
        likely.degrees_of_freedom as f64,
    );
    // Rounding is no evidence.
    let squares = |it: &Freed, freedom: f64| it.squares + freedom * SIGMA_MIN * SIGMA_MIN;
    let ratio = squares(entered, d0) / squares(likely, d1);
    let usual = d0 > 0.0 && d1 > 0.0 && ratio * d1 > d0;
    if !usual {
        return 0.0;
    }
    let (of0, of1) = (
        d0 * (1.0 + ratio) / (ratio * (d0 + d1)),
        d1 * (1.0 + ratio) / (d0 + d1),
    );
    -(d0 * ln(of0) + d1 * ln(of1)) / 2.0
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
    use crate::rotary::Placement;

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
                assert!(found.residual > found.residual_likely * 3.0, "{found}");
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
