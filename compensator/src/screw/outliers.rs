//! Which strokes do not belong: a slammed door, a picture of a fly, a mistyped digit.
//!
//! Where a stroke was made three times and more from one side, each row is compared with the
//! median of its repetitions, in units of the scatter of all repetitions together. A stroke made
//! less often is compared with the model that all observable harmonics make of the others, and
//! then it is an outlier only if no other row of the same stroke stands as far from the model:
//! what repeats is an error of the screw and not of the measurement. The row farthest off is
//! taken out first, the rest fitted and judged again; in the end rows that fit after all come
//! back.
//!
//! Source: the median absolute deviation after Hampel (1974), as for the linear error table.

use std::collections::BTreeMap;

use units::{Approach, Metres};

use super::error::FitError;
use super::options::FitOptions;
use super::problem::{Problem, SCATTER_FLOOR_M};
use super::strata::Variances;
use super::{BASE, design_row};
use crate::screw::Stroke;
use crate::uncertainty::{median, propagate, robust_sigma};

/// From so many repetitions on, the others of a cell say which one is wrong.
const REPEATS_MIN: usize = 3;

/// Below so many rows, or degrees of freedom, the scatter is too uncertain to judge by.
const JUDGED_MIN: usize = 8;

/// A row that was left out of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeOutlier {
    /// Which row, counted from 0 in the order given.
    pub index: usize,
    /// The row.
    pub stroke: Stroke,
    /// How far its deviation is from what the model makes of the others.
    pub residual: Metres,
}

/// The rows to leave out, increasing.
pub(super) fn find(
    strokes: &[Stroke],
    harmonics: &[u32],
    options: &FitOptions,
) -> Result<Vec<usize>, FitError> {
    let mut judge = Judge::new(strokes, harmonics, options);
    judge.by_repetitions();
    judge.by_the_model();
    let found: Vec<usize> = (0..strokes.len()).filter(|&i| judge.is_out[i]).collect();
    let most = options.outlier_share_max * strokes.len() as f64;
    if found.len() as f64 > most {
        return Err(FitError::TooManyOutliers {
            outliers: found.len(),
            rows: strokes.len(),
            share_max: options.outlier_share_max,
        });
    }
    Ok(found)
}

struct Judge<'a> {
    strokes: &'a [Stroke],
    harmonics: &'a [u32],
    options: &'a FitOptions,
    /// Rows of the same stroke and approach.
    cells: BTreeMap<(Approach, u64), Vec<usize>>,
    is_out: Vec<bool>,
}

impl<'a> Judge<'a> {
    fn new(strokes: &'a [Stroke], harmonics: &'a [u32], options: &'a FitOptions) -> Self {
        let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (index, it) in strokes.iter().enumerate() {
            cells.entry(it.cell()).or_default().push(index);
        }
        Self {
            strokes,
            harmonics,
            options,
            cells,
            is_out: vec![false; strokes.len()],
        }
    }

    /// Few rows have an uncertain scatter and are given room.
    fn limit(&self, degrees_of_freedom: usize) -> f64 {
        self.options.outlier_threshold * (1.0 + 3.0 / (degrees_of_freedom as f64).sqrt())
    }

    fn by_repetitions(&mut self) {
        let mut residuals = Vec::new();
        for rows in self.cells.values().filter(|it| it.len() >= REPEATS_MIN) {
            let value = |&i: &usize| self.strokes[i].deviation.value();
            let values: Vec<f64> = rows.iter().map(value).collect();
            let middle = median(&values).unwrap_or(0.0);
            // The median of n rows takes their scatter with it; n/(n − 1) gives most of it back.
            let n = rows.len() as f64;
            let widened = (n / (n - 1.0)).sqrt();
            residuals.extend(rows.iter().map(|&i| (i, (value(&i) - middle) * widened)));
        }
        if residuals.len() < JUDGED_MIN {
            return;
        }
        let limit = self.limit(residuals.len()) * scatter(residuals.iter().map(|it| it.1));
        for (index, residual) in residuals {
            self.is_out[index] = residual.abs() > limit;
        }
    }

    fn by_the_model(&mut self) {
        let repeated = self.is_out.clone();
        for _ in 0..self.strokes.len() {
            let Some((predicted, limit)) = self.predicted() else {
                return;
            };
            let mut worst: Option<(usize, f64)> = None;
            for index in 0..self.strokes.len() {
                let size = predicted[index].abs();
                let is_larger = worst.is_none_or(|(_, most)| size > most);
                if is_larger && size > limit && self.is_alone(index, &predicted, limit) {
                    worst = Some((index, size));
                }
            }
            let Some((index, _)) = worst else { break };
            self.is_out[index] = true;
        }
        if let Some((predicted, limit)) = self.predicted() {
            for index in (0..self.strokes.len()).filter(|&i| !repeated[i]) {
                self.is_out[index] &= predicted[index].abs() > limit;
            }
        }
    }

    /// Whether the row can be judged by the model, and no other row of its stroke is as far off.
    fn is_alone(&self, index: usize, residuals: &[f64], limit: f64) -> bool {
        let own = self.strokes[index];
        if self.is_out[index] || self.cells[&own.cell()].len() >= REPEATS_MIN {
            return false;
        }
        let same_stroke = [Approach::Forward, Approach::Reverse]
            .into_iter()
            .filter_map(|approach| self.cells.get(&(approach, own.cell().1)));
        same_stroke
            .flatten()
            .filter(|&&other| other != index && !self.is_out[other])
            .all(|&other| (residuals[other] - residuals[index]).abs() > limit)
    }

    /// Every row against the model of those that are in, in units of what its difference from it
    /// should scatter by times the scatter, and the limit; `None` where nothing can be judged.
    fn predicted(&self) -> Option<(Vec<f64>, f64)> {
        let lead = self.options.lead;
        let kept: Vec<Stroke> = self
            .strokes
            .iter()
            .zip(&self.is_out)
            .filter(|(_, out)| !**out)
            .map(|(it, _)| *it)
            .collect();
        let degrees_of_freedom = kept
            .len()
            .checked_sub(BASE + 2 * self.harmonics.len())
            .filter(|it| *it >= JUDGED_MIN)?;
        let alike = Variances {
            stroke: 0.0,
            side: 0.0,
            repeat: 1.0,
        };
        let fit = Problem::new(&kept, lead)
            .solve(self.harmonics, &alike)
            .ok()?;
        let scaled = |(index, it): (usize, &Stroke)| {
            let lead = lead.map_or(1.0, Metres::value);
            let row = design_row(it.stroke.value(), it.approach, lead, self.harmonics);
            let model: f64 = row.iter().zip(&fit.coefficients).map(|(a, b)| a * b).sum();
            let leverage = propagate(&row, &fit.cofactor);
            // A row that takes part draws the model to itself; one that does not, does not.
            let spread = if self.is_out[index] {
                1.0 + leverage
            } else {
                (1.0 - leverage).max(1e-9)
            };
            (it.deviation.value() - model) / spread.sqrt()
        };
        let residuals: Vec<f64> = self.strokes.iter().enumerate().map(scaled).collect();
        let taken = residuals.iter().zip(&self.is_out);
        let sigma = scatter(taken.filter(|(_, out)| !**out).map(|(it, _)| *it));
        Some((residuals, self.limit(degrees_of_freedom) * sigma))
    }
}

/// The scatter of residuals, robust; zeros are what coarse digits leave of a small scatter.
fn scatter(residuals: impl Iterator<Item = f64>) -> f64 {
    let residuals: Vec<f64> = residuals.filter(|it| *it != 0.0).collect();
    robust_sigma(&residuals).unwrap_or(0.0).max(SCATTER_FLOOR_M)
}

impl Stroke {
    /// What repetitions have in common; adding zero turns -0 into 0, which is the same stroke.
    pub(super) fn cell(&self) -> (Approach, u64) {
        (self.approach, (self.stroke.value() + 0.0).to_bits())
    }
}

#[cfg(test)]
#[path = "outliers_tests.rs"]
mod tests;
