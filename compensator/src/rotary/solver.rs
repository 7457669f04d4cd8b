//! One evaluation after the other: all readings, then without the outliers found so far.

use std::borrow::Cow;

use units::Radians;

use super::closed_form::{ClosedForm, Estimate};
use super::design::Design;
use super::lanes::sum;
use super::missing::{Gaps, Unbridged};
use super::outliers::{Judge, Scan};
use super::solution::{Outlier, Reading, Solution, SolveError, SolveOptions};
use crate::rotary::RotarySeries;

pub(super) fn evaluate(
    design: &Design,
    series: &RotarySeries,
    options: &SolveOptions,
) -> Result<Solution, SolveError> {
    let form = ClosedForm::new(design);
    let (readings, missing) = readings_of(series);
    Solver::new(design, &form, options, missing).run(&readings)
}

/// Readings freed of outliers as far as these may be left out, and how they scatter then.
pub(super) struct Freed {
    /// With what the others predict in the place of outliers and of what is missing.
    pub(super) readings: Vec<f64>,
    /// Σ r².
    pub(super) squares: f64,
    /// Readings − unknowns.
    pub(super) degrees_of_freedom: usize,
    /// The outliers, increasing: placement · lines + line.
    pub(super) outliers: Vec<usize>,
}

/// What is left of `readings`, of which `missing` (increasing) were not made, at offsets that may leave
/// harmonics of the table unobservable and may repeat. The outliers are searched for, or are the ones
/// `given`. `None` when nothing is determined.
pub(super) fn freed(
    design: &Design,
    readings: &[f64],
    missing: &[usize],
    options: &SolveOptions,
    given: Option<&[usize]>,
) -> Option<Freed> {
    let form = ClosedForm::new(design);
    let solver = Solver::new(design, &form, options, missing.to_vec());
    let fit = solver.fit(readings, given.unwrap_or_default()).ok()?;
    let fit = match solver.judge(&fit) {
        Some(judge) if given.is_none() => solver.search(&judge, readings, fit).0,
        _ => fit,
    };
    Some(Freed {
        squares: fit.scan.squares,
        degrees_of_freedom: solver.degrees_of_freedom(&fit),
        outliers: solver.outliers(&fit),
        readings: fit.readings.into_owned(),
    })
}

/// All readings, placement by placement, and the indices of those missing, which hold the mean
/// of their placement.
pub(super) fn readings_of(series: &RotarySeries) -> (Vec<f64>, Vec<usize>) {
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

pub(super) struct Solver<'a> {
    pub(super) design: &'a Design,
    form: &'a ClosedForm,
    covariance: Vec<f64>,
    pub(super) options: &'a SolveOptions,
    pub(super) missing: Vec<usize>,
}

/// One evaluation: what was left out, and what the rest says.
pub(super) struct Fit<'a, 'r> {
    pub(super) gaps: Option<Gaps<'a>>,
    /// With the predictions in the gaps.
    pub(super) readings: Cow<'r, [f64]>,
    estimate: Estimate,
    pub(super) scan: Scan,
    pub(super) left_out: Vec<usize>,
}

impl Fit<'_, '_> {
    pub(super) fn is_out(&self, at: usize) -> bool {
        self.left_out.binary_search(&at).is_ok()
    }

    pub(super) fn prediction_variance(&self, at: usize) -> Option<f64> {
        self.gaps.as_ref()?.prediction_variance(at)
    }
}

impl<'a> Solver<'a> {
    fn new(
        design: &'a Design,
        form: &'a ClosedForm,
        options: &'a SolveOptions,
        missing: Vec<usize>,
    ) -> Self {
        Self {
            covariance: form.covariance(),
            design,
            form,
            options,
            missing,
        }
    }

    fn run(&self, readings: &[f64]) -> Result<Solution, SolveError> {
        let mut fit = self.fit(readings, &[])?;
        if let Some(judge) = self.judge(&fit) {
            let (found, doubt) = self.search(&judge, readings, fit);
            if let Some(doubt) = doubt {
                return Err(doubt);
            }
            fit = self.settled(&judge, readings, found)?;
        }
        self.solution(readings, fit)
    }

    fn judge(&self, fit: &Fit<'_, '_>) -> Option<Judge<'a>> {
        Judge::new(
            self.design,
            &self.covariance,
            self.degrees_of_freedom(fit),
            self.options.outlier_threshold,
        )
    }

    pub(super) fn fit<'r>(
        &self,
        readings: &'r [f64],
        outliers: &[usize],
    ) -> Result<Fit<'a, 'r>, SolveError> {
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

    pub(super) fn residuals(&self, fit: &Fit<'_, '_>) -> Vec<f64> {
        let mut residuals = self.form.residuals(&fit.readings, &fit.estimate);
        fit.left_out.iter().for_each(|&at| residuals[at] = 0.0);
        residuals
    }

    /// Readings less unknowns: N − 1 table errors, N − 1 plate errors and P constants of complete
    /// readings, less what of the table is left with the plate, and one for each gap but the one
    /// that a line never read has for itself.
    pub(super) fn degrees_of_freedom(&self, fit: &Fit<'_, '_>) -> usize {
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
        let outliers = self.outliers(&fit);
        Ok(Solution {
            plate_error: self.plate_error(&fit),
            amplification,
            degrees_of_freedom: freedom,
            residual_rms: Radians((squares / used as f64).sqrt()),
            reading_noise_seen: (freedom > 0).then(|| Radians((squares / freedom as f64).sqrt())),
            reading_noise_given: self.options.reading_noise,
            missing: self.missing.iter().map(|at| self.name(*at)).collect(),
            outliers: outliers.iter().map(outlier).collect(),
            table_error: fit.estimate.table.iter().copied().map(Radians).collect(),
            design: self.design.clone(),
        })
    }

    /// A with the zero that makes the sum over the lines read vanish.
    fn plate_error(&self, fit: &Fit<'_, '_>) -> Vec<Option<Radians>> {
        let lines = self.design.lines();
        let mut left = vec![self.design.offsets().len(); lines];
        fit.left_out.iter().for_each(|at| left[at % lines] -= 1);
        let mut bad = vec![0; lines];
        let outliers = self.outliers(fit);
        outliers.iter().for_each(|at| bad[at % lines] += 1);
        // Of which half is bad, nobody can tell which half.
        let seen = |line: &usize| left[*line] > bad[*line];
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

    pub(super) fn name(&self, at: usize) -> Reading {
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
