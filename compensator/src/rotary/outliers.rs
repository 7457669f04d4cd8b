//! Which readings do not belong: dirt on a line, a slammed door.
//!
//! The residual of a reading has the variance R_jj σ². Of all residuals in units of √R_jj that
//! of a single bad reading is the largest, because R is a projection; so the largest are taken
//! out first, at most one for a line and one for a position of the table in a round (a bad
//! reading throws its shadow on those), and the rest is fitted and judged again. In the end each
//! is compared with what the others predict for it, and comes back when it fits.

use std::collections::BTreeSet;

use super::design::Design;
use super::lanes::{dot, largest};
use crate::uncertainty::robust_sigma;

/// Below so many degrees of freedom the scatter is too uncertain to judge anything by.
const JUDGED_MIN: usize = 8;

/// As many residuals as give the scatter to two parts in a hundred.
const SAMPLE: usize = 4096;

/// In one round only readings with at least this share of the largest residual are taken out.
const ROUND_SHARE: f64 = 0.5;

/// A scatter below it is rounding of the data: 0.2 µas.
pub(super) const SIGMA_MIN: f64 = 1e-12;

/// What is needed of residuals to see whether there are outliers.
#[derive(Default)]
pub(super) struct Scan {
    /// Σ r².
    pub(super) squares: f64,
    /// max |r| of each placement.
    largest: Vec<f64>,
    /// Some residuals, with their placements.
    sample: Vec<(usize, f64)>,
}

impl Scan {
    /// Adds the residuals of the next placement of `placements`.
    pub(super) fn add(&mut self, residuals: &[f64], placements: usize) {
        let placement = self.largest.len();
        let stride = (residuals.len() * placements).div_ceil(SAMPLE);
        let sample = residuals.iter().step_by(stride);
        self.sample
            .extend(sample.map(|residual| (placement, *residual)));
        self.largest.push(largest(residuals));
        self.squares += dot(residuals, residuals);
    }
}

/// The judge of one design.
pub(super) struct Judge<'a> {
    design: &'a Design,
    /// √R_jj for each placement; infinite where a reading determines itself.
    scales: Vec<f64>,
    /// The largest residual in units of the scatter that still belongs.
    limit: f64,
}

impl<'a> Judge<'a> {
    /// `threshold` holds for many readings; few have an uncertain scatter and are given room.
    /// `None` where nothing can be judged.
    pub(super) fn new(
        design: &'a Design,
        covariance: &[f64],
        degrees_of_freedom: usize,
        threshold: f64,
    ) -> Option<Self> {
        if degrees_of_freedom < JUDGED_MIN {
            return None;
        }
        Some(Self {
            design,
            scales: scales(design, covariance),
            limit: threshold * (1.0 + 3.0 / (degrees_of_freedom as f64).sqrt()),
        })
    }

    /// The scatter of a reading, robust against bad ones.
    pub(super) fn scatter(&self, scan: &Scan) -> f64 {
        let scaled = |(placement, residual): &(usize, f64)| residual / self.scales[*placement];
        let sample: Vec<f64> = scan.sample.iter().map(scaled).collect();
        robust_sigma(&sample).unwrap_or(0.0).max(SIGMA_MIN)
    }

    /// The readings to take out in this round, by index; `residuals` are asked for only when
    /// there are any. Those that are out already have residual 0.
    pub(super) fn suspects(&self, scan: &Scan, residuals: impl FnOnce() -> Vec<f64>) -> Vec<usize> {
        let limit = self.limit * self.scatter(scan);
        let mut largest = scan.largest.iter().zip(&self.scales);
        if largest.all(|(largest, scale)| *largest <= limit * scale) {
            return Vec::new();
        }
        self.beyond(limit, &residuals())
    }

    /// The reading with the largest residual in units of √R_jj.
    pub(super) fn worst(&self, residuals: &[f64]) -> Option<usize> {
        let lines = self.design.lines();
        let scaled = |(at, it): (usize, &f64)| (at, it.abs() / self.scales[at / lines]);
        let each = residuals.iter().enumerate().map(scaled);
        each.max_by(|a, b| a.1.total_cmp(&b.1)).map(|it| it.0)
    }

    fn beyond(&self, limit: f64, residuals: &[f64]) -> Vec<usize> {
        let lines = self.design.lines();
        let mut found = Vec::new();
        for (placement, residuals) in residuals.chunks_exact(lines).enumerate() {
            let limit = limit * self.scales[placement];
            let beyond = residuals
                .iter()
                .enumerate()
                .filter(|(_, it)| it.abs() > limit);
            found.extend(
                beyond.map(|(line, it)| (it.abs() / self.scales[placement], placement, line)),
            );
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let least = found
            .first()
            .map_or(0.0, |(largest, ..)| largest * ROUND_SHARE);
        let (mut used_lines, mut used_positions) = (BTreeSet::new(), BTreeSet::new());
        found.retain(|&(size, placement, line)| {
            let position = (line + self.design.offsets()[placement]) % lines;
            size >= least && used_lines.insert(line) && used_positions.insert(position)
        });
        found
            .iter()
            .map(|(_, placement, line)| placement * lines + line)
            .collect()
    }

    /// Whether a reading that differs by `apart` from its prediction belongs to the others.
    pub(super) fn fits(&self, apart: f64, prediction_variance: f64, scatter: f64) -> bool {
        apart.abs() <= self.limit * scatter * prediction_variance.sqrt()
    }
}

/// √R_jj: what is left of 1 in a reading of placement j as its own residual.
fn scales(design: &Design, covariance: &[f64]) -> Vec<f64> {
    let (lines, offsets) = (design.lines(), design.offsets());
    let (n, count) = (lines as f64, offsets.len() as f64);
    let at = |a: &usize, b: &usize| covariance[(a + lines - b) % lines];
    let sums: Vec<f64> = offsets
        .iter()
        .map(|a| offsets.iter().map(|b| at(a, b)).sum::<f64>() / count)
        .collect();
    let mean = sums.iter().sum::<f64>() / count;
    sums.iter()
        .map(|sum| {
            let table = covariance[0] - 2.0 * sum + mean;
            let left = 1.0 - 1.0 / n - (1.0 - 1.0 / n) / count - table;
            if left > 1e-9 {
                left.sqrt()
            } else {
                f64::INFINITY
            }
        })
        .collect()
}
