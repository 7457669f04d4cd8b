//! How errors of the thermometers change the errors found.

use super::design::{Design, error_row};
use super::effect::seen;
use super::{Observation, Plan};
use crate::least_squares::Fit;

/// Adds to the covariance of the first `count` parameters what thermometers that were off in one
/// run, each by itself, make of them. `fit` has the parameters found, `covariance` is by row.
pub(super) fn add_heat(
    plan: &Plan,
    design: &Design,
    observations: &[Observation],
    fit: &Fit,
    covariance: &mut [f64],
) {
    let count = design.errors();
    let all = design.columns();
    let first = count - plan.thermal.count();
    let u = plan.thermal.u;
    for run in 0..plan.runs.len() {
        for thermometer in 0..plan.thermal.references.len() {
            let mut above = vec![0.0; plan.thermal.references.len()];
            above[thermometer] = u;
            // What the readings would then seem to be off.
            let mut off = vec![0.0; observations.len()];
            let own = observations.iter().enumerate();
            for (index, it) in own.filter(|(_, it)| it.run == run) {
                let per_kelvin =
                    error_row(plan, &design.blocks, it.at, it.tool, &above, |effect| {
                        seen(it.reading, effect)
                    });
                let terms = per_kelvin[first..].iter().zip(&fit.coefficients[first..]);
                off[index] = terms.map(|(a, b)| a * b).sum();
            }
            // A's transpose times that.
            let mut pull = vec![0.0; all];
            let off = design.whitening.of_column(&off);
            for (row, off) in design.rows.chunks_exact(all).zip(&off) {
                for (sum, part) in pull.iter_mut().zip(row) {
                    *sum += part * off;
                }
            }
            let moved: Vec<f64> = (0..count)
                .map(|at| {
                    let cofactor = &fit.cofactor[at * all..(at + 1) * all];
                    cofactor.iter().zip(&pull).map(|(a, b)| a * b).sum()
                })
                .collect();
            for (at, sum) in covariance.iter_mut().enumerate() {
                *sum += moved[at / count] * moved[at % count];
            }
        }
    }
}
