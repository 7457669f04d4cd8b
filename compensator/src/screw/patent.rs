//! The patent's own estimator and its rule, with its golden numbers.
//!
//! Test step: strokes m, n and between are made many times and their errors averaged: over
//! everything (ΔX, taken for the mean lost motion), at m and at n. Every row counts, whatever
//! its approach. Compensation step: a forward move of length L is made longer by k·L, a reverse
//! move by k·L + ΔX, with k = (mean at n − mean at m)/(n − m) of each direction's own n and m
//! (the text prints n1 − m1 for both).
//!
//! What the method leaves to its user: ΔX is the lost motion only when it is averaged over
//! strokes reached in reverse from a zero set forward, and then contains k times the mean
//! stroke; with both approaches mixed it is about half of it.

use std::collections::BTreeMap;

use units::portable::hypot;
use units::{Approach, Metres};

use super::budget::{SIDES, ScatterPart, ScatterParts};
use super::problem::SCATTER_FLOOR_M;
use super::{FitError, ScrewModel};
use crate::screw::Stroke;
use crate::uncertainty;

/// The patent's means of the deviations, in the deviations' own sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatentEstimate {
    /// m: the lowest stroke.
    pub at_m: Metres,
    /// n: the highest stroke.
    pub at_n: Metres,
    /// Mean deviation at m.
    pub mean_at_m: Metres,
    /// Mean deviation at n.
    pub mean_at_n: Metres,
    /// Mean of all deviations.
    pub mean_all: Metres,
    /// (mean at n − mean at m)/(n − m), dimensionless.
    pub slope: f64,
    /// Standard uncertainties, where anything was repeated.
    pub uncertainty: Option<PatentUncertainty>,
    /// Standard deviation of the rows about the line through both means.
    pub residual: Metres,
    /// Rows used: all.
    pub rows: usize,
}

/// Standard uncertainties of the patent's quantities, from the scatter of repetitions: rows of
/// one stroke and approach about their mean, pooled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatentUncertainty {
    /// Standard deviation of one measurement.
    pub scatter: Metres,
    /// Degrees of freedom behind it.
    pub degrees_of_freedom: usize,
    /// Of the mean at m.
    pub mean_at_m: Metres,
    /// Of the mean at n.
    pub mean_at_n: Metres,
    /// Of the mean of all.
    pub mean_all: Metres,
    /// Of the slope, dimensionless.
    pub slope: f64,
}

/// Averages the strokes of one axis as the patent does.
///
/// # Errors
/// When there are no two different strokes.
pub fn estimate(strokes: &[Stroke]) -> Result<PatentEstimate, FitError> {
    let ends = |it: &Stroke| it.stroke;
    let at_m = strokes.iter().map(ends).reduce(Metres::min);
    let at_n = strokes.iter().map(ends).reduce(Metres::max);
    let (Some(at_m), Some(at_n)) = (at_m, at_n) else {
        return Err(FitError::OneStroke);
    };
    // Written so that a NaN is refused.
    if at_n.partial_cmp(&at_m) != Some(core::cmp::Ordering::Greater) {
        return Err(FitError::OneStroke);
    }
    let (mean_at_m, rows_at_m) = mean(strokes.iter().filter(|it| it.stroke == at_m));
    let (mean_at_n, rows_at_n) = mean(strokes.iter().filter(|it| it.stroke == at_n));
    let (mean_all, rows) = mean(strokes.iter());
    let slope = (mean_at_n - mean_at_m) / (at_n - at_m);
    let squares: f64 = strokes
        .iter()
        .map(|it| it.deviation - mean_at_m - (it.stroke - at_m) * slope)
        .map(|left| left.value() * left.value())
        .sum();
    let uncertainty = scatter(strokes).map(|(scatter, degrees_of_freedom)| {
        let of = |count: f64| scatter / count.sqrt();
        let (u_m, u_n) = (of(rows_at_m), of(rows_at_n));
        PatentUncertainty {
            scatter,
            degrees_of_freedom,
            mean_at_m: u_m,
            mean_at_n: u_n,
            mean_all: of(rows),
            slope: hypot(u_m.value(), u_n.value()) / (at_n - at_m).value(),
        }
    });
    Ok(PatentEstimate {
        at_m,
        at_n,
        mean_at_m,
        mean_at_n,
        mean_all,
        slope,
        uncertainty,
        residual: Metres((squares / (rows - 2.0).max(1.0)).sqrt()),
        rows: strokes.len(),
    })
}

/// Mean deviation and number of rows.
fn mean<'a>(rows: impl Iterator<Item = &'a Stroke>) -> (Metres, f64) {
    let (sum, count) = rows.fold((0.0, 0.0), |(sum, count), it| {
        (sum + it.deviation.value(), count + 1.0)
    });
    (Metres(sum / count), count)
}

/// The pooled scatter of repetitions and its degrees of freedom.
fn scatter(strokes: &[Stroke]) -> Option<(Metres, usize)> {
    let mut cells: BTreeMap<(Approach, u64), Vec<f64>> = BTreeMap::new();
    for it in strokes {
        cells
            .entry(it.cell())
            .or_default()
            .push(it.deviation.value());
    }
    let degrees_of_freedom = strokes.len() - cells.len();
    let squares: f64 = cells
        .values()
        .map(|values| {
            let centre = uncertainty::mean(values).unwrap_or(0.0);
            let off = values.iter().map(|v| v - centre);
            off.map(|it| it * it).sum::<f64>()
        })
        .sum();
    let variance = squares / degrees_of_freedom as f64;
    (degrees_of_freedom > 0).then(|| (Metres(variance.sqrt()), degrees_of_freedom))
}

impl PatentEstimate {
    /// What the uncertainties of [`Self::model`] are made of; `None` when nothing was repeated.
    pub fn parts(&self) -> Option<ScatterParts> {
        let u = self.uncertainty?;
        Some(ScatterParts {
            of_model: vec![ScatterPart {
                name: SIDES,
                scatter: Metres(u.scatter.value().max(SCATTER_FLOOR_M)),
                degrees_of_freedom: u.degrees_of_freedom,
                covariance: self.model().covariance?,
            }],
            freedom_of_stop: u.degrees_of_freedom,
        })
    }

    /// The model that these means stand for: no offset, `mean_all` as lost motion.
    pub fn model(&self) -> ScrewModel {
        let covariance = self.uncertainty.map(|u| {
            let (slope, mean) = (u.slope, u.mean_all.value());
            // The mean of all rows is equally correlated with both ends' means, so not at all
            // with their difference.
            vec![
                0.0,
                0.0,
                0.0,
                0.0,
                slope * slope,
                0.0,
                0.0,
                0.0,
                mean * mean,
            ]
        });
        ScrewModel {
            offset: Metres::ZERO,
            slope: self.slope,
            lost_motion: self.mean_all,
            lead: None,
            harmonics: Vec::new(),
            first: self.at_m,
            last: self.at_n,
            covariance,
            scatter: self.uncertainty.map(|u| u.scatter),
        }
    }
}

/// The patent's compensation step in its own terms: lengths of moves, and errors as what a move
/// falls short by. This is the door between its sign and the project's.
///
/// # Example
///
/// The figures of the patent: means of 2.02 µm at 500 µm, 2.62 µm at 1500 µm and 2.29 µm over all.
///
/// ```
/// use compensator::screw::patent::PatentRule;
/// use units::{Approach, Metres};
///
/// let um = Metres::from_um;
/// let rule = PatentRule::of_errors(um(500.0), um(1500.0), um(2.02), um(2.62), um(2.29));
/// let forward = rule.addition(um(1600.0), Approach::Forward);
/// assert!((forward.um() - 0.96).abs() < 1e-9);
/// let reverse = rule.addition(um(1600.0), Approach::Reverse);
/// assert!((reverse.um() - 3.25).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatentRule {
    /// k: shortfall per length of the move, dimensionless.
    pub gain: f64,
    /// ΔX: shortfall of every reverse move.
    pub mean_all: Metres,
}

impl PatentRule {
    /// From the patent's printed figures, all as lengths a move falls short by.
    pub fn of_errors(m: Metres, n: Metres, at_m: Metres, at_n: Metres, all: Metres) -> Self {
        Self {
            gain: (at_n - at_m) / (n - m),
            mean_all: all,
        }
    }

    /// From a model of deviations (actual − commanded): a forward move falls short by −deviation,
    /// a reverse move, against which the coordinate runs, by +deviation.
    pub fn of_model(model: &ScrewModel) -> Self {
        Self {
            gain: -model.slope,
            mean_all: model.lost_motion,
        }
    }

    /// The slope of the deviations, and the lost motion (reverse − forward).
    pub fn slope_and_lost_motion(&self) -> (f64, Metres) {
        (-self.gain, self.mean_all)
    }

    /// By how much a move of this length is made longer: step S200.
    pub fn addition(&self, length: Metres, approach: Approach) -> Metres {
        let linear = length.abs() * self.gain;
        match approach {
            Approach::Forward => linear,
            Approach::Reverse => linear + self.mean_all,
        }
    }
}

#[cfg(test)]
#[path = "patent_tests.rs"]
mod tests;
