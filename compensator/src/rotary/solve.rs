//! From readings to the table error with its uncertainty.

use super::design::Design;
use super::solution::{Solution, SolveError, SolveOptions};
use super::solver::evaluate;
use crate::rotary::RotarySeries;

/// Evaluates `series`.
///
/// # Errors
/// When the offsets or what is left of the readings leave something unobservable, noise would be
/// amplified beyond the limit, or too many readings disagree.
///
/// # Example
///
/// A table with errors of 2″, −1″, −1″ and a plate with errors of 1″, 0″, −1″ make these readings.
///
/// ```
/// use compensator::rotary::{RotarySeries, SolveOptions, solve};
///
/// let csv = "offset,line,deviation_arcsec\n0,0,8\n0,1,4\n0,2,3\n1,0,-2\n1,1,-3\n1,2,-1\n";
/// let series = RotarySeries::from_csv(csv, "table.csv", Some(3))?;
/// let solution = solve(&series, &SolveOptions::default())?;
/// for (seen, expected) in solution.table_error.iter().zip([2.0, -1.0, -1.0]) {
///     assert!((seen.arcsec() - expected).abs() < 1e-9);
/// }
/// assert_eq!(solution.deviations()[0], -solution.table_error[0], "actual − target");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(series: &RotarySeries, options: &SolveOptions) -> Result<Solution, SolveError> {
    let design = Design::new(series.lines(), &series.offsets(), options.amplification_max)?;
    evaluate(&design, series, options)
}

#[cfg(test)]
#[path = "solve_tests.rs"]
mod tests;
