//! From the readings of all placements to the table's error.
//!
//! A line is read where it is, not where it should be: the placement is a little off, and the line
//! has an error. The table's error is therefore read a little beside the nominal position, which
//! matters where it is steep. Once it is known roughly, each reading is brought to its nominal
//! position, and the whole evaluated again.

use compensator::measurement::{Placement, RotarySeries};
use compensator::rotary::{
    self, PeriodicCompensation, PeriodicInterpolation, PeriodicLimits, PeriodicTable, Solution,
    SolveOptions,
};
use core::f64::consts::TAU;
use units::Radians;

use super::failure::RotaryFailure;
use super::placement::{Placed, PlateRun};
use crate::failure::Failure;

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
    run: &PlateRun,
    placed: &[Placed],
) -> Result<RotarySeries, Failure> {
    let placements = placed.iter().map(|it| Placement {
        offset: it.offset as usize,
        readings: it.by_line(),
    });
    let series = RotarySeries::new(run.lines as usize, placements.collect());
    Ok(series.map_err(|source| RotaryFailure::Series {
        axis: axis.to_owned(),
        source,
    })?)
}

/// The table's error.
pub(super) fn evaluate(
    axis: &str,
    run: &PlateRun,
    amplification_max: f64,
    placed: &[Placed],
) -> Result<Solution, Failure> {
    check_passes(axis, run, placed)?;
    let options = SolveOptions {
        reading_noise: Some(run.noise_of_mean()),
        amplification_max,
        ..SolveOptions::default()
    };
    let read = series(axis, run, placed)?;
    let mut solution = solve(axis, &read, &options)?;
    for _ in 0..ROUNDS {
        let Some(moved) = at_nominal_positions(&read, &solution) else {
            break;
        };
        solution = solve(axis, &moved, &options)?;
    }
    check_residuals(axis, run, &solution)?;
    Ok(solution)
}

fn solve(axis: &str, series: &RotarySeries, options: &SolveOptions) -> Result<Solution, Failure> {
    let solution = rotary::solve(series, options);
    Ok(solution.map_err(|source| RotaryFailure::Estimate {
        axis: axis.to_owned(),
        source,
    })?)
}

/// The readings less what the table's error changes between where a line is and where it should
/// be. `None` when the table is too rough to say that.
fn at_nominal_positions(read: &RotarySeries, solution: &Solution) -> Option<RotarySeries> {
    let table = PeriodicTable::new(solution.deviations(), None).ok()?;
    let curve =
        PeriodicCompensation::new(table, PeriodicInterpolation::BandLimited, LIMITS).ok()?;
    let lines = read.lines();
    let moved = |offset: usize, line: usize, reading: Radians| {
        let nominal = Radians(TAU * ((line + offset) % lines) as f64 / lines as f64);
        let there = curve.deviation(nominal + reading).ok()?;
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
fn check_passes(axis: &str, run: &PlateRun, placed: &[Placed]) -> Result<(), RotaryFailure> {
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
