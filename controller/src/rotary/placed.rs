//! What was read of a plate in one placement, and whether it lay still meanwhile.

use core::f64::consts::TAU;

use compensator::uncertainty::{mean, median, robust_sigma, standard_deviation};
use units::Radians;

use crate::rotary::failure::RotaryFailure;
use crate::rotary::plate_run::PlateRun;
use crate::rotary::{PlacementEntry, PlatePlanEntry, SightedAt, SweepEntry};

/// The parts of a turn in which a plate may have moved.
const SECTORS: usize = 8;
/// A part has at least so many lines, where there are as many.
const SECTOR_LINES: usize = 8;
/// From how many standard deviations on a difference of two passes is no noise.
const WILD: f64 = 5.0;
/// So many neighbours on each side say whether a line that differs is dirty or the plate has moved.
const NEIGHBOURS: usize = 2;
/// By how much the mean of such medians scatters more than the mean of the lines, at most: 1.18 of one part
/// of twelve lines, 1.05 to 1.11 of eight parts.
#[cfg(feature = "program")]
const MEDIAN_LOSS: f64 = 1.15;

/// What was read in one placement. Lists count table positions.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placed {
    pub(super) offset: f64,
    /// Mean of both directions, in which what the detector is late by cancels; of one, less what it
    /// is late by on the others; `None` where a line was not read.
    pub(super) deviations: Vec<Option<Radians>>,
    /// Standard deviation of one line in one pass, by what the directions differ.
    pub(super) scatter: Option<Radians>,
    pub(super) closure: Radians,
    /// Where a plate at offset 0 would have its lines, from the table positions; of a plate that was
    /// read from the positions, how far these were beside.
    pub(super) phase: Radians,
    /// Where the table stood when a person read the lines, from the table positions; `None`: where each
    /// line was read.
    pub(super) stood: Option<Radians>,
}

impl Placed {
    /// What `sweeps` of one placement say that was read as `plan` has it.
    pub(crate) fn in_plan(
        placement: &PlacementEntry,
        sweeps: &[SweepEntry],
        plan: &PlatePlanEntry,
    ) -> Self {
        let stood = |beside: f64| (plan.sighted? == SightedAt::Position).then_some(Radians(beside));
        Self {
            stood: stood(placement.offset.fract() * TAU / f64::from(plan.lines.max(1))),
            ..Self::of(placement, sweeps, plan.passes)
        }
    }

    /// What `sweeps` of one placement, `passes` in each direction, say.
    pub(super) fn of(placement: &PlacementEntry, sweeps: &[SweepEntry], passes: u32) -> Self {
        let own = |approach: char, passes: core::ops::RangeInclusive<u32>| {
            let own = sweeps.iter().filter(|it| it.offset == placement.offset);
            let own = own.filter(|it| it.approach == approach && passes.contains(&it.pass));
            mean_of(own)
        };
        let (mut forward, reverse) = (own('+', 1..=passes), own('-', 1..=passes));
        let both = |forward: &[Option<f64>]| -> Vec<f64> {
            let pairs = forward.iter().zip(&reverse);
            pairs.filter_map(|(f, r)| Some((*f)? - (*r)?)).collect()
        };
        let apart = both(&forward);
        let late = median(&apart).unwrap_or(0.0) / 2.0;
        let scatter = scatter_of(apart).map(|it| it * (f64::from(passes) / 2.0).sqrt());
        // A line that was missed may have been read in the repeated pass, or in one direction only.
        let again = own('+', passes + 1..=passes + 1);
        for (first, again) in forward.iter_mut().zip(again) {
            *first = first.or(again);
        }
        let pairs = forward.iter().zip(&reverse);
        let deviations = pairs.map(|(forward, reverse)| match (forward, reverse) {
            (Some(forward), Some(reverse)) => Some(Radians((forward + reverse) / 2.0)),
            (Some(forward), None) => Some(Radians(forward - late)),
            (None, Some(reverse)) => Some(Radians(reverse + late)),
            (None, None) => None,
        });
        let spacing = TAU / reverse.len().max(1) as f64;
        let first = sweeps.iter().find(|it| it.offset == placement.offset);
        let phase = first.map_or(0.0, |it| it.phase_rad - it.offset.fract() * spacing);
        Self {
            offset: placement.offset,
            deviations: deviations.collect(),
            scatter: scatter.map(Radians),
            closure: Radians(placement.closure_rad),
            phase: Radians(phase),
            stood: None,
        }
    }

    /// By line of the plate: line n is read at position n + offset, its whole part.
    pub(super) fn by_line(&self) -> Vec<Option<Radians>> {
        let mut readings = self.deviations.clone();
        let whole = self.offset.floor() as usize % readings.len().max(1);
        readings.rotate_left(whole);
        readings
    }
}

/// By how much the plate moved in the worst placement.
pub(crate) fn largest_closure(closures: impl Iterator<Item = Radians>) -> Radians {
    closures.map(Radians::abs).fold(Radians::ZERO, Radians::max)
}

/// The standard deviation of values of which some are wild.
fn scatter_of(mut values: Vec<f64>) -> Option<f64> {
    let middle = median(&values)?;
    values.iter_mut().for_each(|it| *it -= middle);
    // The median of a coarse encoder's counts is coarse itself: it only tells what is wild.
    let wild = WILD * robust_sigma(&values)?;
    values.retain(|it| it.abs() <= wild);
    standard_deviation(&values)
}

fn mean_of<'a>(sweeps: impl Iterator<Item = &'a SweepEntry>) -> Vec<Option<f64>> {
    let mut sums: Vec<(f64, u32)> = Vec::new();
    for sweep in sweeps {
        sums.resize(sweep.deviations_rad.len(), (0.0, 0));
        for (sum, value) in sums.iter_mut().zip(&sweep.deviations_rad) {
            if let Some(value) = value {
                *sum = (sum.0 + value, sum.1 + 1);
            }
        }
    }
    let mean = |(sum, count): (f64, u32)| (count > 0).then(|| sum / f64::from(count));
    sums.into_iter().map(mean).collect()
}

/// By how much the second of two equal passes differs from the first: the mean over a part of the
/// turn, of that part where it is largest. A plate that slips in the middle of a pass shows, too:
/// all lines after that differ, whereas a dirty line leaves its neighbours what they are.
fn closure(first: &[Option<f64>], again: &[Option<f64>]) -> f64 {
    let apart: Vec<Option<f64>> = first
        .iter()
        .zip(again)
        .map(|(first, again)| Some((*again)? - (*first)?))
        .collect();
    let apart = without_dirt(&apart);
    let of_sector = |lines: &[Option<f64>]| {
        let seen: Vec<f64> = lines.iter().flatten().copied().collect();
        mean(&seen).unwrap_or(0.0)
    };
    let means = apart.chunks(lines_of_a_part(apart.len()));
    means
        .map(of_sector)
        .fold(0.0, |a, b| if b.abs() > f64::abs(a) { b } else { a })
}

fn lines_of_a_part(lines: usize) -> usize {
    let parts = (lines / SECTOR_LINES).clamp(1, SECTORS);
    lines.div_ceil(parts).max(1)
}

/// The standard deviation of what a part of a plate that lies still seems to have moved by, when one line
/// in one pass scatters by `noise`. Of eight parts one is beyond four times as much in one placement of two
/// thousand.
#[cfg(feature = "program")]
pub(crate) fn closure_noise(lines: usize, noise: Radians) -> Radians {
    let mean = noise * core::f64::consts::SQRT_2 / (lines_of_a_part(lines) as f64).sqrt();
    mean * MEDIAN_LOSS
}

/// The median of each line and its neighbours, as many at the ends as elsewhere.
fn without_dirt(apart: &[Option<f64>]) -> Vec<Option<f64>> {
    let width = apart.len().min(2 * NEIGHBOURS + 1);
    let middle = |at: usize| {
        let start = at.saturating_sub(NEIGHBOURS).min(apart.len() - width);
        let around = apart[start..start + width].iter().flatten();
        median(&around.copied().collect::<Vec<_>>())
    };
    let each = apart.iter().enumerate();
    each.map(|(at, own)| own.and(middle(at))).collect()
}

/// That the plate lies where it lay when the first of `sweeps` was made.
pub(super) fn closed(
    axis: &str,
    run: &PlateRun,
    (offset, at_s): (f64, f64),
    sweeps: &[SweepEntry],
) -> Result<PlacementEntry, RotaryFailure> {
    let (first, again) = (&sweeps[0], &sweeps[sweeps.len() - 1]);
    let closure_rad = closure(&first.deviations_rad, &again.deviations_rad);
    let placement = PlacementEntry {
        offset,
        closure_rad,
        at_s,
    };
    let seen = Radians(closure_rad);
    match run.closure_limit {
        Some(limit) if seen.abs() > limit => Err(RotaryFailure::Slipped {
            axis: axis.to_owned(),
            offset,
            seen,
            limit,
        }),
        _ => Ok(placement),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(pass: u32, approach: char, values: &[Option<f64>]) -> SweepEntry {
        SweepEntry {
            offset: 2.0,
            pass,
            approach,
            deviations_rad: values.to_vec(),
            ..SweepEntry::default()
        }
    }

    #[test]
    fn what_the_detector_is_late_by_cancels_and_is_known_where_one_direction_is_missing() {
        let sweeps = [
            sweep(1, '+', &[Some(1.5), Some(2.5), None, Some(4.5), None, None]),
            sweep(
                1,
                '-',
                &[Some(0.5), None, Some(2.5), Some(3.5), None, Some(5.5)],
            ),
            sweep(2, '+', &[Some(9.0), None, None, Some(9.0), None, Some(6.5)]),
        ];
        let placement = PlacementEntry {
            offset: 2.0,
            closure_rad: 0.0,
            at_s: 0.0,
        };
        let placed = Placed::of(&placement, &sweeps, 1);
        let some = |value| Some(Radians(value));
        let expected = [some(1.0), some(2.0), some(3.0), some(4.0), None, some(6.0)];
        assert_eq!(placed.deviations, expected);
        let turned = [some(3.0), some(4.0), None, some(6.0), some(1.0), some(2.0)];
        assert_eq!(placed.by_line(), turned);
    }

    #[test]
    fn a_slip_within_the_last_lines_of_a_pass_shows() {
        let first: Vec<Option<f64>> = (0..360)
            .map(|at| Some(if at < 350 { 1.0 } else { 6.0 }))
            .collect();
        let again = vec![Some(6.0); 360];
        assert!((closure(&first, &again) - 5.0).abs() < 1e-12);
        let late: Vec<Option<f64>> = (0..360)
            .map(|at| Some(if at < 350 { 1.0 } else { 6.0 }))
            .collect();
        let closed = closure(&vec![Some(1.0); 360], &late);
        assert!((closed - 5.0 * 10.0 / 45.0).abs() < 1e-12, "{closed}");
        assert_eq!(closure(&first, &first), 0.0);
    }

    #[test]
    #[cfg(feature = "program")]
    fn a_plate_that_lies_still_seems_to_move_as_much_as_its_noise_is_said_to_make_it() {
        const PLACEMENTS: u32 = 3000;
        let mut state = 20_261_125_u64;
        // Twelve uniform numbers between 0 and 1, less 6: a standard deviation of 1.
        let mut normal = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum
        };
        for lines in [12, 24, 36, 72, 360] {
            let expected = closure_noise(lines, Radians(1.0)).value();
            let mut beyond = [0_u32; 2];
            for _ in 0..PLACEMENTS {
                let mut pass = || (0..lines).map(|_| Some(normal())).collect::<Vec<_>>();
                let moved = closure(&pass(), &pass()).abs();
                beyond[0] += u32::from(moved > 2.0 * expected);
                beyond[1] += u32::from(moved > 4.0 * expected);
            }
            println!(
                "{lines} lines: {beyond:?} of {PLACEMENTS} beyond 2 and 4 standard deviations"
            );
            // One in two thousand beyond four; the estimate is none that nothing ever reaches.
            assert!(beyond[1] <= 6, "{lines} lines: {beyond:?}");
            assert!(beyond[0] > PLACEMENTS / 50, "{lines} lines: {beyond:?}");
        }
    }

    #[test]
    fn one_dirty_line_is_no_plate_that_moved() {
        let clean = vec![Some(1.0); 36];
        for dirty in 0..36 {
            let mut again = clean.clone();
            again[dirty] = Some(1001.0);
            assert_eq!(closure(&clean, &again), 0.0, "line {dirty}");
            again[(dirty + 1) % 36] = None;
            assert_eq!(closure(&clean, &again), 0.0, "line {dirty}");
        }
        let slipped: Vec<Option<f64>> = (0..36)
            .map(|at| Some(if at < 33 { 1.0 } else { 9.0 }))
            .collect();
        assert!(closure(&clean, &slipped) > 2.0);
    }
}
