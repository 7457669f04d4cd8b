//! From readings to the table error with its uncertainty.

use std::borrow::Cow;

use units::Radians;

use super::closed_form::{ClosedForm, Estimate};
use super::design::{Design, DesignError};
use super::lanes::sum;
use super::missing::{Gaps, UNKNOWNS_MAX, Unbridged};
use super::outliers::{Judge, Scan};
use crate::rotary::RotarySeries;
use crate::uncertainty::rms;

/// Rounds of the search for outliers; each takes out many at once.
const ROUNDS_MAX: usize = 20;

/// How readings are evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveOptions {
    /// The standard uncertainty of one reading, where known: it is then propagated.
    pub reading_noise: Option<Radians>,
    /// The largest amplification of the noise of a harmonic, or of a table error, accepted.
    pub amplification_max: f64,
    /// From how many scatters on a reading is an outlier; infinity searches none.
    pub outlier_threshold: f64,
    /// The largest share of outliers believed.
    pub outlier_share_max: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            reading_noise: None,
            amplification_max: 1e4,
            outlier_threshold: 5.5,
            outlier_share_max: 0.05,
        }
    }
}

/// One reading: a line of the plate in one placement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reading {
    /// Which placement, counted from 0 in the order of the series.
    pub placement: usize,
    /// Its offset.
    pub offset: usize,
    /// Which line.
    pub line: usize,
}

/// A reading that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Which one.
    pub reading: Reading,
    /// Reading less what all others predict for it.
    pub residual: Radians,
}

/// Why readings give no table error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The offsets are of no use.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// So much is missing that one reading decides alone.
    #[error(
        "line {} at plate offset {} is needed: without it and the others that are missing or left \
         out, part of the table has no connection to the rest; read that line again",
        reading.line, reading.offset
    )]
    Unobservable {
        /// The reading that would help.
        reading: Reading,
    },
    /// More is missing than can be evaluated.
    #[error(
        "{seen} readings are missing, {UNKNOWNS_MAX} can be bridged; clean the plate and read again"
    )]
    TooManyMissing {
        /// How many.
        seen: usize,
    },
    /// A table error is known too badly.
    #[error(
        "the table error at position {position} has {seen:.1} times the standard uncertainty of a \
         reading, the limit is {limit:.1}; too many readings are missing there"
    )]
    Amplified {
        /// Where, in lines.
        position: usize,
        /// The amplification.
        seen: f64,
        /// The largest allowed.
        limit: f64,
    },
    /// So many readings disagree that it is not clear which are wrong.
    #[error(
        "{seen} of {readings} readings disagree with the others, first line {} at plate offset {}; \
         at most {limit} may be outliers: was the plate clamped firmly, and was each offset \
         entered correctly?",
        first.line, first.offset
    )]
    TooManyOutliers {
        /// How many disagree.
        seen: usize,
        /// Of how many.
        readings: usize,
        /// How many would be accepted.
        limit: usize,
        /// One of them.
        first: Reading,
    },
}

/// What readings say about the table and the plate.
///
/// Sign: a table error is reading − true angle, so the deviation (actual − target) of a table
/// that is moved by its readings is the negative of it: [`Solution::deviations`].
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// What the offsets make of noise when nothing is missing.
    pub design: Design,
    /// G at each position of the table (in line spacings); its sum is zero.
    pub table_error: Vec<Radians>,
    /// A of each line, `None` where it was never read; the sum of the others is zero.
    pub plate_error: Vec<Option<Radians>>,
    /// The standard uncertainty of each table error in units of that of one reading.
    pub amplification: Vec<f64>,
    /// Readings − unknowns, outliers and missing ones not counted.
    pub degrees_of_freedom: usize,
    /// Scatter of the readings about the model.
    pub residual_rms: Radians,
    /// The standard uncertainty of one reading by the residuals; `None` without freedom.
    pub reading_noise_seen: Option<Radians>,
    /// The standard uncertainty of one reading as it was given.
    pub reading_noise_given: Option<Radians>,
    /// Readings that were not made.
    pub missing: Vec<Reading>,
    /// Readings that were left out.
    pub outliers: Vec<Outlier>,
}

impl Solution {
    /// The rms of the amplification over the table: [`Design::rms_amplification`], enlarged by
    /// what is missing.
    pub fn noise_amplification(&self) -> f64 {
        rms(&self.amplification)
    }

    /// The standard uncertainty of each table error by the residuals; `None` without freedom.
    pub fn uncertainty_seen(&self) -> Option<Vec<Radians>> {
        self.reading_noise_seen.map(|noise| self.spread(noise))
    }

    /// The standard uncertainty of each table error propagated from the noise that was given.
    pub fn uncertainty_propagated(&self) -> Option<Vec<Radians>> {
        self.reading_noise_given.map(|noise| self.spread(noise))
    }

    /// The best statement there is: by the residuals, else propagated.
    pub fn standard_uncertainty(&self) -> Option<Vec<Radians>> {
        self.uncertainty_seen()
            .or_else(|| self.uncertainty_propagated())
    }

    /// Deviation (actual − target) of the table at each position: −[`Self::table_error`].
    pub fn deviations(&self) -> Vec<Radians> {
        self.table_error.iter().map(|error| -*error).collect()
    }

    /// What line by line is expected of a further placement at `offset`, but for its constant:
    /// G\[n + s\] + A\[n\]; `None` for lines never read.
    pub fn expected(&self, offset: usize) -> Vec<Option<Radians>> {
        let lines = self.table_error.len();
        let table = |line: usize| self.table_error[(line + offset) % lines];
        let plate = self.plate_error.iter().enumerate();
        plate
            .map(|(line, it)| it.map(|error| table(line) + error))
            .collect()
    }

    fn spread(&self, noise: Radians) -> Vec<Radians> {
        self.amplification.iter().map(|it| noise * *it).collect()
    }
}

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

/// The same for offsets that may leave harmonics of the table unobservable: those are zero.
pub(super) fn solve_what_is_seen(
    series: &RotarySeries,
    options: &SolveOptions,
) -> Result<Solution, SolveError> {
    let design = Design::of_any(series.lines(), &series.offsets())?;
    evaluate(&design, series, options)
}

fn evaluate(
    design: &Design,
    series: &RotarySeries,
    options: &SolveOptions,
) -> Result<Solution, SolveError> {
    let form = ClosedForm::new(design);
    let (readings, missing) = readings_of(series);
    let solver = Solver {
        covariance: form.covariance(),
        design,
        form: &form,
        options,
        missing,
    };
    solver.run(&readings)
}

/// All readings, placement by placement, and the indices of those missing, which hold the mean
/// of their placement.
fn readings_of(series: &RotarySeries) -> (Vec<f64>, Vec<usize>) {
    let mut readings = Vec::with_capacity(series.placements().len() * series.lines());
    let mut missing = Vec::new();
    for placement in series.placements() {
        let start = readings.len();
        let value = |it: &Option<Radians>| it.map_or(f64::NAN, Radians::value);
        readings.extend(placement.readings.iter().map(value));
        let own = &mut readings[start..];
        // One NaN makes the whole sum one.
        if !sum(own).is_nan() {
            continue;
        }
        let gaps: Vec<usize> = (0..own.len()).filter(|at| own[*at].is_nan()).collect();
        let read: f64 = own.iter().filter(|it| !it.is_nan()).sum();
        let mean = read / (own.len() - gaps.len()).max(1) as f64;
        gaps.iter().for_each(|&at| own[at] = mean);
        missing.extend(gaps.iter().map(|at| start + at));
    }
    (readings, missing)
}

struct Solver<'a> {
    design: &'a Design,
    form: &'a ClosedForm,
    covariance: Vec<f64>,
    options: &'a SolveOptions,
    missing: Vec<usize>,
}

/// One evaluation: what was left out, and what the rest says.
struct Fit<'a, 'r> {
    gaps: Option<Gaps<'a>>,
    /// With the predictions in the gaps.
    readings: Cow<'r, [f64]>,
    estimate: Estimate,
    scan: Scan,
    left_out: Vec<usize>,
}

impl<'a> Solver<'a> {
    fn run(&self, readings: &[f64]) -> Result<Solution, SolveError> {
        let mut fit = self.fit(readings, &[])?;
        let judge = Judge::new(
            self.design,
            &self.covariance,
            self.degrees_of_freedom(&fit),
            self.options.outlier_threshold,
        );
        if let Some(judge) = judge {
            fit = self.search(&judge, readings, fit)?;
        }
        self.solution(readings, fit)
    }

    fn fit<'r>(&self, readings: &'r [f64], outliers: &[usize]) -> Result<Fit<'a, 'r>, SolveError> {
        let mut readings = Cow::Borrowed(readings);
        let mut left_out = [&self.missing[..], outliers].concat();
        left_out.sort_unstable();
        let gaps = if left_out.is_empty() {
            None
        } else {
            let gaps = Gaps::new(self.design, &self.covariance, &left_out);
            let gaps = gaps.map_err(|why| self.unbridged(why))?;
            gaps.fill(self.form, readings.to_mut());
            Some(gaps)
        };
        let estimate = self.form.estimate(&readings);
        let scan = self.scan(&readings, &estimate, &left_out);
        Ok(Fit {
            gaps,
            readings,
            estimate,
            scan,
            left_out,
        })
    }

    /// One placement at a time, which stays in the processor's cache.
    fn scan(&self, readings: &[f64], estimate: &Estimate, left_out: &[usize]) -> Scan {
        let lines = self.design.lines();
        let placements = self.design.offsets().len();
        let (mut scan, mut row) = (Scan::default(), Vec::with_capacity(lines));
        for placement in 0..placements {
            self.form
                .residuals_of(placement, readings, estimate, &mut row);
            let own = left_out.iter().filter(|at| **at / lines == placement);
            own.for_each(|at| row[at % lines] = 0.0);
            scan.add(&row, placements);
        }
        scan
    }

    fn residuals(&self, fit: &Fit<'_, '_>) -> Vec<f64> {
        let mut residuals = self.form.residuals(&fit.readings, &fit.estimate);
        fit.left_out.iter().for_each(|&at| residuals[at] = 0.0);
        residuals
    }

    fn search<'r>(
        &self,
        judge: &Judge<'_>,
        readings: &'r [f64],
        mut fit: Fit<'a, 'r>,
    ) -> Result<Fit<'a, 'r>, SolveError> {
        let total = readings.len() - self.missing.len();
        let limit = (total as f64 * self.options.outlier_share_max) as usize;
        let mut outliers: Vec<usize> = Vec::new();
        for round in 0.. {
            let suspects = judge.suspects(&fit.scan, || self.residuals(&fit));
            let Some(&first) = suspects.first() else {
                break;
            };
            outliers.extend(suspects);
            // A single bad reading is believed even where few were made.
            if outliers.len() > limit.max(1) || round == ROUNDS_MAX {
                return Err(SolveError::TooManyOutliers {
                    seen: outliers.len(),
                    readings: total,
                    limit: limit.max(1),
                    first: self.name(first),
                });
            }
            fit = self.fit(readings, &outliers)?;
        }
        if outliers.is_empty() {
            return Ok(fit);
        }
        let scatter = judge.scatter(&fit.scan);
        // Whether a reading fits what the others predict for it after all.
        let belongs = |at: &usize| {
            let variance = fit.gaps.as_ref().and_then(|it| it.prediction_variance(*at));
            let apart = readings[*at] - fit.readings[*at];
            variance.is_some_and(|variance| judge.fits(apart, variance, scatter))
        };
        let left = outliers.len();
        let kept: Vec<usize> = outliers.into_iter().filter(|at| !belongs(at)).collect();
        if kept.len() == left {
            Ok(fit)
        } else {
            self.fit(readings, &kept)
        }
    }

    /// Readings less unknowns: N − 1 table errors, N − 1 plate errors and P constants of complete
    /// readings, less what of the table is left with the plate, and one for each gap but the one
    /// that a line never read has for itself.
    fn degrees_of_freedom(&self, fit: &Fit<'_, '_>) -> usize {
        let (lines, placements) = (self.design.lines(), self.design.offsets().len());
        let unknowns = fit.gaps.as_ref().map_or(0, Gaps::unknowns);
        let complete = (placements - 2) * (lines - 1) + self.design.unseen();
        // As many gaps as that have no factor; should rounding have found one, nothing is free.
        complete.saturating_sub(unknowns)
    }

    fn solution(&self, readings: &[f64], fit: Fit<'_, '_>) -> Result<Solution, SolveError> {
        let extra = fit.gaps.as_ref().map(Gaps::variances);
        let extra = extra.unwrap_or_else(|| vec![0.0; self.design.lines()]);
        let own = self.covariance[0];
        let amplification: Vec<f64> = extra.iter().map(|it| (own + it).sqrt()).collect();
        self.check_amplification(&amplification)?;
        let squares = fit.scan.squares;
        let freedom = self.degrees_of_freedom(&fit);
        let used = readings.len() - fit.left_out.len();
        let outlier = |at: &usize| Outlier {
            reading: self.name(*at),
            residual: Radians(readings[*at] - fit.readings[*at]),
        };
        let outliers = fit
            .left_out
            .iter()
            .filter(|at| self.missing.binary_search(at).is_err());
        Ok(Solution {
            plate_error: self.plate_error(&fit),
            amplification,
            degrees_of_freedom: freedom,
            residual_rms: Radians((squares / used as f64).sqrt()),
            reading_noise_seen: (freedom > 0).then(|| Radians((squares / freedom as f64).sqrt())),
            reading_noise_given: self.options.reading_noise,
            missing: self.missing.iter().map(|at| self.name(*at)).collect(),
            outliers: outliers.map(outlier).collect(),
            table_error: fit.estimate.table.iter().copied().map(Radians).collect(),
            design: self.design.clone(),
        })
    }

    /// A with the zero that makes the sum over the lines read vanish.
    fn plate_error(&self, fit: &Fit<'_, '_>) -> Vec<Option<Radians>> {
        let lines = self.design.lines();
        let mut left = vec![self.design.offsets().len(); lines];
        fit.left_out.iter().for_each(|at| left[at % lines] -= 1);
        let seen = |line: &usize| left[*line] > 0;
        let count = (0..lines).filter(seen).count() as f64;
        let sum: f64 = (0..lines)
            .filter(seen)
            .map(|it| fit.estimate.plate[it])
            .sum();
        let error = |line: usize| Radians(fit.estimate.plate[line] - sum / count);
        (0..lines)
            .map(|line| seen(&line).then(|| error(line)))
            .collect()
    }

    fn check_amplification(&self, amplification: &[f64]) -> Result<(), SolveError> {
        let limit = self.options.amplification_max;
        // Written so that NaN is refused too.
        let accepted = |it: &f64| *it <= limit;
        let beyond = amplification.iter().position(|it| !accepted(it));
        match beyond {
            None => Ok(()),
            Some(position) => Err(SolveError::Amplified {
                position,
                seen: amplification[position],
                limit,
            }),
        }
    }

    fn name(&self, at: usize) -> Reading {
        let placement = at / self.design.lines();
        Reading {
            placement,
            offset: self.design.offsets()[placement],
            line: at % self.design.lines(),
        }
    }

    fn unbridged(&self, why: Unbridged) -> SolveError {
        match why {
            Unbridged::Many { seen } => SolveError::TooManyMissing { seen },
            Unbridged::Needed { reading } => SolveError::Unobservable {
                reading: self.name(reading),
            },
        }
    }
}

#[cfg(test)]
#[path = "solve_tests.rs"]
mod tests;
