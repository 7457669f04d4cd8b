//! How far an error function may be from the curve through its nodes, between them.
//!
//! Source: the mean-square error of a linear predictor of a random function (C. E. Rasmussen, C. K. I.
//! Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5). What nobody read is judged
//! by how the values at the nodes differ from polynomials that the curve reproduces. These contrasts are
//! compared with random functions of covariance a²·exp(−d²/2ℓ²): for each length ℓ on a grid, from the
//! distance of the nodes to more than the travel, and each size a. All functions of one axis share their
//! length, and sizes are alike within displacements and within rotations ([`pooled`]); both are weighted by
//! their likelihood, the noise of the nodes included. The mean square over all of them is how far a function
//! likely is from its curve ([`Extent::Likely`]). Whoever refuses something because a function cannot be that
//! far from its curve needs what it is at most ([`Extent::AtMost`]).
//!
//! | symbol | name here |
//! |---|---|
//! | a²·(1 − 2wᵀk + wᵀKw): the mean-square error inside an interval, w the node's weights | [`Between::inside`] |
//! | the polynomial through its roots at three places elsewhere | [`between_at`] |
//! | how alike the errors in the middles of two intervals are, by k − wᵀk′ − w′ᵀk + wᵀKw′ | [`Between::alike`] |
//!
//! Absent: functions of two nodes, of which nothing can be said; what repeats within a step, such as the
//! pitch of a screw or of a scale that is as long as a whole number of steps.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use units::portable::{exp, ln};

use super::Axis;
use super::block::{Block, kernel};
use crate::least_squares::Fit;
use crate::volumetric::function::{INSIDE, Shape, between_at};

mod pooled;

use pooled::{LENGTHS, Pooled, Seen};

/// The longest length that is tried, in units of the travel.
const LONGEST: f64 = 1.5;
/// What rounding leaves of a mean-square error.
const ROUNDING: f64 = 1e-16;

/// Which of all lengths and sizes count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Their mean square.
    Likely,
    /// The one that this share of all is beyond.
    AtMost(f64),
}

/// By block, inside each interval between its nodes, the standard deviation of the function from its curve,
/// in its SI unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Between {
    /// At the [`INSIDE`] of each interval.
    inside: Vec<Vec<[f64; 3]>>,
    /// By block, the correlations of those in the middles.
    alike: Vec<DMatrix<f64>>,
}

impl Between {
    /// By the values of the functions in `fit`; `shape`: how they are drawn.
    pub(super) fn of(blocks: &[Block], fit: &Fit, shape: Shape, extent: Extent) -> Self {
        let mut inside: Vec<Vec<[f64; 3]>> = blocks
            .iter()
            .map(|it| vec![[0.0; 3]; it.nodes.len().saturating_sub(1)])
            .collect();
        let mut alike: Vec<DMatrix<f64>> = inside
            .iter()
            .map(|it| DMatrix::identity(it.len(), it.len()))
            .collect();
        let judged: Vec<(usize, Judged)> = (0..blocks.len())
            .filter_map(|at| Some((at, Judged::new(&blocks[at], fit, shape)?)))
            .collect();
        let lengths = Axis::ALL.map(|axis| lengths_of(axis, &judged));
        let all: Vec<Vec<ByLength>> = judged
            .iter()
            .map(|(_, it)| {
                let lengths = lengths[it.axis.index()].iter();
                lengths.map(|length| it.by_length(*length)).collect()
            })
            .collect();
        let seen = judged.iter().zip(&all).map(|((at, it), by_length)| Seen {
            name: blocks[*at].name,
            nodes: &it.own,
            by_length,
        });
        let pooled = pooled::pooled(&seen.collect::<Vec<_>>());
        for (((at, _), by_length), pooled) in judged.iter().zip(&all).zip(&pooled) {
            inside[*at] = of_intervals(by_length, pooled, extent);
            alike[*at] = correlations(by_length, pooled);
        }
        Self { inside, alike }
    }

    /// At the [`INSIDE`] of each interval of the block of this number.
    pub(super) fn of_block(&self, number: usize, block: &Block) -> Vec<f64> {
        let none = || vec![0.0; INSIDE.len() * block.nodes.len().saturating_sub(1)];
        let own = self.inside.get(number);
        own.map_or_else(none, |it| it.as_flattened().to_vec())
    }

    /// At a position, of the block of this number.
    pub(super) fn at(&self, number: usize, block: &Block, position: f64) -> f64 {
        self.interval(number, block, position).1
    }

    /// Which interval a position is in, and how far the block of this number may be from its curve there.
    fn interval(&self, number: usize, block: &Block, position: f64) -> (usize, f64) {
        let nodes = &block.nodes;
        let after = nodes.partition_point(|it| *it <= position);
        let at = after.clamp(1, nodes.len() - 1) - 1;
        let t = (position - nodes[at]) / (nodes[at + 1] - nodes[at]);
        let inside = self.inside.get(number);
        (at, inside.map_or(0.0, |it| between_at(it[at], t)))
    }

    /// Adds to `covariance`, by reading, what all of them share of the block of this number: `read` is where
    /// each was read and what it sees of the block there.
    pub(super) fn add_shared(
        &self,
        number: usize,
        block: &Block,
        read: &[(f64, f64)],
        covariance: &mut DMatrix<f64>,
    ) {
        let Some(alike) = self.alike.get(number) else {
            return;
        };
        let each = read.iter().enumerate().map(|(reading, (position, seen))| {
            let (interval, u) = self.interval(number, block, *position);
            (reading, interval, seen * u)
        });
        let each: Vec<(usize, usize, f64)> = each.filter(|it| it.2 != 0.0).collect();
        for (i, of_i, a) in &each {
            for (j, of_j, b) in &each {
                covariance[(*i, *j)] += a * b * alike[(*of_i, *of_j)];
            }
        }
    }
}

/// The lengths that are tried for functions of this axis.
fn lengths_of(axis: Axis, judged: &[(usize, Judged)]) -> Vec<f64> {
    let own = || judged.iter().map(|it| &it.1).filter(|it| it.axis == axis);
    let step = own().map(|it| it.step).fold(f64::INFINITY, f64::min);
    let span = own().map(|it| it.span).fold(0.0, f64::max);
    logarithmic(step, (LONGEST * span).max(2.0 * step), LENGTHS)
}

/// What a function may be from its curve, at the [`INSIDE`] of each interval.
fn of_intervals(by_length: &[ByLength], pooled: &Pooled, extent: Extent) -> Vec<[f64; 3]> {
    let at = |interval: usize, place: usize| {
        let of_length = |(it, weights): (&ByLength, &Vec<f64>)| {
            let square = it.squares[interval][place];
            let each = pooled.squares.iter().zip(weights);
            each.map(|(size, weight)| (size * square, *weight))
                .collect::<Vec<_>>()
        };
        let all = by_length.iter().zip(&pooled.weights);
        extent.of(all.flat_map(of_length).collect()).sqrt()
    };
    (0..by_length[0].squares.len())
        .map(|interval| core::array::from_fn(|place| at(interval, place)))
        .collect()
}

/// How alike it is in the middles of two intervals.
fn correlations(by_length: &[ByLength], pooled: &Pooled) -> DMatrix<f64> {
    let size = by_length[0].middles.nrows();
    let weights = pooled.weights.iter();
    let squares: Vec<f64> = weights
        .map(|weights| {
            let each = pooled.squares.iter().zip(weights);
            each.map(|(size, weight)| size * weight).sum()
        })
        .collect();
    let all = by_length.iter().zip(&squares);
    let covariance = all.fold(DMatrix::zeros(size, size), |sum, (it, square)| {
        sum + &it.middles * *square
    });
    let least = ROUNDING * squares.iter().sum::<f64>();
    let own = covariance.map_diagonal(|it: f64| it.max(least).sqrt());
    DMatrix::from_fn(size, size, |m, n| {
        let alike = covariance[(m, n)] / (own[m] * own[n]);
        if m == n { 1.0 } else { alike.clamp(-1.0, 1.0) }
    })
}

impl Extent {
    /// Of values with their weights.
    fn of(self, mut all: Vec<(f64, f64)>) -> f64 {
        let Self::AtMost(beyond) = self else {
            return all.iter().map(|(value, weight)| value * weight).sum();
        };
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut left = beyond;
        let is_beyond = |(_, weight): &&(f64, f64)| {
            left -= weight;
            left > 0.0
        };
        let skipped = all.iter().take_while(is_beyond).count();
        all[skipped.min(all.len() - 1)].0
    }
}

/// A function beside random ones of one length and of size 1.
struct ByLength {
    /// Of each contrast, made independent of the others and its noise 1, the variance.
    powers: DVector<f64>,
    /// What the function's own is.
    seen: DVector<f64>,
    /// For each interval the mean-square error at its [`INSIDE`].
    squares: Vec<[f64; 3]>,
    /// The covariance of the errors in the middles of the intervals.
    middles: DMatrix<f64>,
}

/// One function, made ready to be compared with random ones.
struct Judged {
    axis: Axis,
    nodes: Vec<f64>,
    /// Contrasts × nodes.
    contrasts: DMatrix<f64>,
    /// The function's values at the nodes.
    own: DVector<f64>,
    /// What the contrasts are of them.
    values: DVector<f64>,
    /// L⁻¹ of their noise's covariance LLᵀ.
    whitening: DMatrix<f64>,
    /// By interval its [`INSIDE`], with each node's weight there.
    inside: Vec<[(f64, DVector<f64>); 3]>,
    step: f64,
    span: f64,
}

impl Judged {
    fn new(block: &Block, fit: &Fit, shape: Shape) -> Option<Self> {
        let nodes = block.nodes.clone();
        let count = nodes.len();
        let reproduced = if shape == Shape::Spline { 3 } else { 1 };
        let degree = reproduced.min(count.checked_sub(3)?);
        let contrasts = contrasts(&nodes, degree);
        let (width, all) = (block.basis.ncols(), fit.coefficients.len());
        let own = DVector::from_fn(width, |at, _| fit.coefficients[block.first + at]);
        let cofactor = DMatrix::from_fn(width, width, |i, j| {
            fit.cofactor[(block.first + i) * all + block.first + j]
        });
        let own = &block.basis * own;
        let values = &contrasts * &own;
        let of_contrasts = &contrasts * &block.basis;
        let noise = &of_contrasts * cofactor * of_contrasts.transpose();
        let jitter = noise.trace() * 1e-12;
        let size = noise.nrows();
        let noise = noise + DMatrix::identity(size, size) * jitter;
        let whitening = noise.cholesky()?.l().try_inverse()?;
        let inside = nodes.windows(2).map(|it| {
            INSIDE.map(|share| {
                let place = it[0] + share * (it[1] - it[0]);
                (place, DVector::from_vec(block.weights(place)))
            })
        });
        Some(Self {
            axis: block.axis(),
            inside: inside.collect(),
            step: nodes
                .windows(2)
                .map(|it| it[1] - it[0])
                .fold(f64::INFINITY, f64::min),
            span: nodes[count - 1] - nodes[0],
            nodes,
            own,
            contrasts,
            values,
            whitening,
        })
    }

    fn by_length(&self, length: f64) -> ByLength {
        let count = self.nodes.len();
        let alike = |a: f64, b: f64| {
            let d = (a - b) / length;
            exp(-0.5 * d * d)
        };
        let between = DMatrix::from_fn(count, count, |i, j| alike(self.nodes[i], self.nodes[j]));
        let turned = &self.whitening * &self.contrasts;
        let eigen = SymmetricEigen::new(&turned * &between * turned.transpose());
        let seen = eigen.eigenvectors.transpose() * (&self.whitening * &self.values);
        let of_place = |(at, weights): &(f64, DVector<f64>)| {
            let near = DVector::from_fn(count, |i, _| alike(*at, self.nodes[i]));
            let square = 1.0 - 2.0 * weights.dot(&near) + weights.dot(&(&between * weights));
            square.max(ROUNDING)
        };
        let squares = self.inside.iter().map(|it| it.each_ref().map(of_place));
        ByLength {
            powers: eigen.eigenvalues,
            seen,
            squares: squares.collect(),
            middles: self.of_middles(&alike, &between),
        }
    }

    /// The covariance of how far a function of size 1 is from its curve in the middles of the intervals;
    /// `between`: that of the nodes.
    fn of_middles(&self, alike: &dyn Fn(f64, f64) -> f64, between: &DMatrix<f64>) -> DMatrix<f64> {
        let all: Vec<&(f64, DVector<f64>)> =
            self.inside.iter().map(|[_, middle, _]| middle).collect();
        let (nodes, middles) = (self.nodes.len(), all.len());
        let to_nodes = DMatrix::from_fn(middles, nodes, |m, i| alike(all[m].0, self.nodes[i]));
        let weights = DMatrix::from_fn(middles, nodes, |m, i| all[m].1[i]);
        let own = DMatrix::from_fn(middles, middles, |m, n| alike(all[m].0, all[n].0));
        let crossed = &weights * to_nodes.transpose();
        own - &crossed - crossed.transpose() + &weights * between * weights.transpose()
    }
}

/// Orthonormal rows that are zero for polynomials up to this degree.
fn contrasts(nodes: &[f64], degree: usize) -> DMatrix<f64> {
    let count = nodes.len();
    let middle = f64::midpoint(nodes[0], nodes[count - 1]);
    let half = (nodes[count - 1] - nodes[0]) / 2.0;
    let powers = DMatrix::from_fn(count, degree + 1, |at, power| {
        units::portable::powi((nodes[at] - middle) / half, power as i32)
    });
    kernel(&powers.transpose()).transpose()
}

fn logarithmic(low: f64, high: f64, count: usize) -> Vec<f64> {
    let (from, to) = (ln(low), ln(high));
    let at = |n: usize| exp(from + (to - from) * n as f64 / (count - 1) as f64);
    (0..count).map(at).collect()
}
