//! From the readings of all placements to the table's error.
//!
//! A line is read where it is, not where it should be: the placement is a little off, and the line
//! has an error. The table's error is therefore read a little beside the nominal position, which
//! matters where it is steep. Once it is known roughly, each reading is brought to its nominal
//! position, and the whole evaluated again.

use compensator::rotary::{
    self, PeriodicCompensation, PeriodicInterpolation, PeriodicLimits, PeriodicTable, Solution,
    SolveOptions,
};
use compensator::rotary::{Placement, RotarySeries};
use core::f64::consts::TAU;
use units::Radians;

use crate::rotary::failure::RotaryFailure;
use crate::rotary::placed::Placed;
use crate::rotary::plate_run::PlateRun;

/// A calibration that scatters more than so many times what is stated is refused.
const NOISE_FACTOR_MAX: f64 = 2.0;
/// How often readings are brought to their nominal positions; the error shrinks each time by the
/// table's slope, 1e-3 and less.
const ROUNDS: usize = 2;
/// Beyond these a table error cannot be undone anyway.
const LIMITS: PeriodicLimits = PeriodicLimits {
    size: Radians(0.5),
    slope: 0.5,
};

pub(super) fn series(
    axis: &str,
    lines: u32,
    placed: &[Placed],
) -> Result<RotarySeries, RotaryFailure> {
    let placements = placed.iter().map(|it| Placement {
        offset: it.offset as usize,
        readings: it.by_line(),
    });
    let series = RotarySeries::new(lines as usize, placements.collect());
    series.map_err(|source| RotaryFailure::Series {
        axis: axis.to_owned(),
        source,
    })
}

/// The table's error.
pub(super) fn evaluate(
    axis: &str,
    run: &PlateRun,
    amplification_max: f64,
    placed: &[Placed],
) -> Result<Solution, RotaryFailure> {
    check_passes(axis, run, placed)?;
    let options = SolveOptions {
        reading_noise: Some(run.noise_of_mean()),
        amplification_max,
        ..SolveOptions::default()
    };
    let (solution, _) = fit(axis, run.lines, &options, placed)?;
    check_residuals(axis, run, &solution)?;
    Ok(at_table_positions(solution, common_phase(placed)))
}

/// The same of a run that was evaluated before: nothing is refused that was not then.
#[cfg(feature = "program")]
pub(crate) fn fit_whole(
    axis: &str,
    lines: u32,
    options: &SolveOptions,
    placed: &[Placed],
) -> Result<Solution, RotaryFailure> {
    let (solution, _) = fit(axis, lines, options, placed)?;
    Ok(at_table_positions(solution, common_phase(placed)))
}

/// The solution, and the readings at their nominal positions that it was made from.
pub(crate) fn fit(
    axis: &str,
    lines: u32,
    options: &SolveOptions,
    placed: &[Placed],
) -> Result<(Solution, RotarySeries), RotaryFailure> {
    let solve = |series: &RotarySeries| {
        rotary::solve(series, options).map_err(|source| RotaryFailure::Estimate {
            axis: axis.to_owned(),
            source,
        })
    };
    let read = series(axis, lines, placed)?;
    let (mut solution, mut moved) = (solve(&read)?, read.clone());
    let phase = common_phase(placed);
    // A table that stood at its positions showed its error there.
    let rounds = match placed.iter().all(|it| it.stood.is_some()) {
        true => 0,
        false => ROUNDS,
    };
    for _ in 0..rounds {
        let Some(nominal) = at_nodes(&read, phase, &solution) else {
            break;
        };
        solution = solve(&nominal)?;
        moved = nominal;
    }
    Ok((solution, moved))
}

/// Where the plate lay from the table positions, of all placements: the nodes at which the table's
/// error is found. Bringing readings from there to the table positions in the rounds would amplify
/// the noise of the highest harmonics instead of converging.
fn common_phase(placed: &[Placed]) -> Radians {
    let phases = placed.iter().map(|it| it.phase);
    phases.sum::<Radians>() / placed.len().max(1) as f64
}

/// The error of `solution` between its nodes. `None` when it is too rough to be told there.
fn curve_of(solution: &Solution) -> Option<PeriodicCompensation> {
    let table = PeriodicTable::new(solution.deviations(), None).ok()?;
    PeriodicCompensation::new(table, PeriodicInterpolation::BandLimited, LIMITS).ok()
}

/// `solution`, whose nodes lie by `phase` beside the table positions, at these: once, and without
/// losing anything but the sine of the highest harmonic, which half a spacing hides.
fn at_table_positions(mut solution: Solution, phase: Radians) -> Solution {
    let Some(curve) = curve_of(&solution) else {
        return solution;
    };
    let lines = solution.table_error.len();
    for (at, error) in solution.table_error.iter_mut().enumerate() {
        let position = Radians(TAU * at as f64 / lines as f64);
        if let Ok(deviation) = curve.deviation(position - phase) {
            *error = -deviation;
        }
    }
    solution
}

/// The readings less what the table's error changes between where a line is and its node. `None`
/// when the table is too rough to say that.
fn at_nodes(read: &RotarySeries, phase: Radians, solution: &Solution) -> Option<RotarySeries> {
    let curve = curve_of(solution)?;
    let lines = read.lines();
    let moved = |offset: usize, line: usize, reading: Radians| {
        let nominal = Radians(TAU * ((line + offset) % lines) as f64 / lines as f64);
        let there = curve.deviation(nominal + reading - phase).ok()?;
        // A deviation is the negative of the table's error.
        Some(reading + (there - curve.deviation(nominal).ok()?))
    };
    let placements = read.placements().iter().map(|it| Placement {
        offset: it.offset,
        readings: (0..)
            .zip(&it.readings)
            .map(|(line, reading)| moved(it.offset, line, (*reading)?))
            .collect(),
    });
    RotarySeries::new(lines, placements.collect()).ok()
}

/// Before anything is fitted the directions of a pass must agree.
pub(super) fn check_passes(
    axis: &str,
    run: &PlateRun,
    placed: &[Placed],
) -> Result<(), RotaryFailure> {
    let scatter = placed.iter().filter_map(|it| it.scatter);
    let seen = scatter.fold(Radians::ZERO, Radians::max);
    judge(axis, run, seen, "between the directions")
}

fn check_residuals(axis: &str, run: &PlateRun, solution: &Solution) -> Result<(), RotaryFailure> {
    let share = run.noise / run.noise_of_mean();
    let seen = solution.reading_noise_seen.map(|it| it * share);
    judge(axis, run, seen.unwrap_or(Radians::ZERO), "about the model")
}

fn judge(
    axis: &str,
    run: &PlateRun,
    seen: Radians,
    about: &'static str,
) -> Result<(), RotaryFailure> {
    if seen <= run.noise * NOISE_FACTOR_MAX {
        return Ok(());
    }
    Err(RotaryFailure::Noise {
        axis: axis.to_owned(),
        about,
        seen,
        expected: run.noise,
    })
}
