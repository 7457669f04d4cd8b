//! Errors of neighbouring strokes that resemble each other.
//!
//! A model with p parameters of the mean, fitted to n strokes, is off at a new place by what the strokes' own errors
//! make of it, p/n of their variance in the mean, on top of the error of the place itself: 1 + p/n. That holds where
//! errors are independent from place to place. What neighbouring strokes share, a place between them shares with them
//! too, as it is nearer to one of them than they are to each other. The model has followed that error then, and what
//! is left of it is what is left at the strokes: 1 − p/n of its variance.
//!
//! What neighbours share is told by the products of what the model leaves of them. Of independent errors it leaves
//! less than nothing in common, which is known (the model's leverage from one to the next) and taken off.

use super::cells::{Cells, Place};
use crate::least_squares::Fit;
use crate::uncertainty::propagate;

/// What neighbouring strokes share, and how much the model follows each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Neighbours {
    /// The mean product of what the model leaves of neighbours, m².
    product: f64,
    /// What it is expected to be for independent errors, by the variance of a row.
    independent: f64,
    /// Mean leverage of the strokes: p/n.
    leverage: f64,
}

/// One stroke: where it is, its rows, their mean design, and what the model leaves of their mean.
struct Left {
    stroke: f64,
    rows: f64,
    design: Vec<f64>,
    left: f64,
}

impl Left {
    fn of(place: &Place, (lead, harmonics): (f64, &[u32]), fit: &Fit) -> Self {
        let (mut rows, mut design, mut left) = (0.0, vec![0.0; fit.coefficients.len()], 0.0);
        for (cell, row) in place.design(lead, harmonics) {
            let expected: f64 = row.iter().zip(&fit.coefficients).map(|(a, b)| a * b).sum();
            rows += cell.count;
            left += cell.count * (cell.mean - expected);
            let each = design.iter_mut().zip(&row);
            each.for_each(|(sum, it)| *sum += cell.count * it);
        }
        design.iter_mut().for_each(|it| *it /= rows);
        Self {
            stroke: place.stroke,
            rows,
            design,
            left: left / rows,
        }
    }
}

impl Neighbours {
    /// About the model that `fit` is, by ordinary least squares over all rows.
    pub(super) fn of(cells: &Cells, model: (f64, &[u32]), fit: &Fit) -> Self {
        let places = cells.places.iter();
        let mut each: Vec<Left> = places.map(|it| Left::of(it, model, fit)).collect();
        each.sort_by(|a, b| a.stroke.total_cmp(&b.stroke));
        let count = each.len() as f64;
        let leverage = |it: &Left| it.rows * propagate(&it.design, &fit.cofactor);
        let mut it = Self {
            leverage: each.iter().map(leverage).sum::<f64>() / count,
            ..Self::default()
        };
        for pair in each.windows(2) {
            let share = 1.0 / (count - 1.0);
            it.product += share * pair[0].left * pair[1].left;
            it.independent -= share * between(&pair[0].design, &pair[1].design, &fit.cofactor);
        }
        it
    }

    /// By how much less a place between strokes scatters about the model, m², than the errors of strokes and of the model
    /// would make of it were they independent; `row` is the variance of a row by what strokes are judged by, `own` that
    /// of the strokes' own errors.
    pub(super) fn followed(&self, row: f64, own: f64) -> f64 {
        let shared = self.product - row * self.independent;
        2.0 * self.leverage * shared.min(own).max(0.0)
    }
}

/// a·C·b.
fn between(a: &[f64], b: &[f64], cofactor: &[f64]) -> f64 {
    let rows = a.iter().zip(cofactor.chunks(b.len()));
    let product = |row: &[f64]| row.iter().zip(b).map(|(c, b)| c * b).sum::<f64>();
    rows.map(|(a, row)| a * product(row)).sum()
}
