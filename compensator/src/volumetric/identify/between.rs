//! How far an error function may be from the curve through its nodes, between them.
//!
//! Source: the mean-square error of a linear predictor of a random function (C. E. Rasmussen, C. K. I.
//! Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5). What nobody read is judged
//! by how the values at the nodes differ from polynomials that the curve reproduces. These contrasts are
//! compared with random functions of covariance a²·exp(−d²/2ℓ²): for each length ℓ on a grid, from the
//! distance of the nodes to more than the travel, and each size a. All functions of one axis share their
//! length, each has a size of its own; both are weighted by their likelihood, the noise of the nodes
//! included, and averaged in logarithms: that is how far a function likely is from its curve ([`Extent::Likely`]).
//! A few nodes hardly tell the size, as a few readings hardly tell a scatter (of Student's t with two degrees
//! of freedom, one in 10 000 is beyond 100). Whoever refuses something because a function cannot be that far
//! from its curve needs what it is at most ([`Extent::AtMost`]).
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
use super::block::{Block, axis_of, kernel};
use crate::least_squares::Fit;
use crate::volumetric::function::{INSIDE, Shape, between_at};

/// Lengths that are tried, the longest in units of the travel.
const LENGTHS: usize = 9;
const LONGEST: f64 = 1.5;
/// Sizes that are tried, in units of the contrasts' rms.
const SIZES: usize = 36;
const SMALLEST: f64 = 1e-2;
const LARGEST: f64 = 1e5;
/// What rounding leaves of a mean-square error.
const ROUNDING: f64 = 1e-16;

/// Which of all lengths and sizes count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Their mean.
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
        for axis in Axis::ALL {
            let own: Vec<usize> = (0..blocks.len())
                .filter(|at| axis_of(blocks[*at].name) == axis)
                .collect();
            let judged: Vec<(usize, Judged)> = own
                .into_iter()
                .filter_map(|at| Some((at, Judged::new(&blocks[at], fit, shape)?)))
                .collect();
            for (at, found, own) in of_axis(&judged, extent) {
                inside[at] = found;
                alike[at] = own;
            }
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

/// All lengths, weighted by what all functions of the axis say of them.
fn of_axis(
    judged: &[(usize, Judged)],
    extent: Extent,
) -> Vec<(usize, Vec<[f64; 3]>, DMatrix<f64>)> {
    let step = judged
        .iter()
        .map(|it| it.1.step)
        .fold(f64::INFINITY, f64::min);
    let span = judged.iter().map(|it| it.1.span).fold(0.0, f64::max);
    let longest = (LONGEST * span).max(2.0 * step);
    let lengths = logarithmic(step, longest, LENGTHS);
    let each: Vec<Vec<ByLength>> = lengths
        .iter()
        .map(|length| judged.iter().map(|it| it.1.by_length(*length)).collect())
        .collect();
    let likelihoods: Vec<f64> = each
        .iter()
        .map(|all| all.iter().map(|it| it.likelihood).sum())
        .collect();
    let weights = normalised(&likelihoods);
    let inside = |number: usize| {
        let intervals = each[0][number].squares.len();
        let own = |at: usize, place: usize| {
            let of_length = |(all, weight): (&Vec<ByLength>, &f64)| {
                let it = &all[number];
                let square = it.squares[at][place];
                let sizes = it.sizes.clone().into_iter();
                let weight = *weight;
                sizes.map(move |(size, own)| (size + square, weight * own))
            };
            each.iter().zip(&weights).flat_map(of_length).collect()
        };
        (0..intervals)
            .map(|at| core::array::from_fn(|place| exp(0.5 * extent.of(own(at, place)))))
            .collect()
    };
    let alike = |number: usize| {
        let terms = lengths.iter().zip(&weights);
        let first = &judged[number].1;
        let nothing = DMatrix::zeros(first.inside.len(), first.inside.len());
        terms.fold(nothing, |sum, (length, weight)| {
            sum + first.alike(*length) * *weight
        })
    };
    let numbered = judged.iter().enumerate();
    numbered
        .map(|(number, (at, _))| (*at, inside(number), alike(number)))
        .collect()
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

/// What a function says of one length.
struct ByLength {
    /// The logarithm of the length's likelihood.
    likelihood: f64,
    /// Of each size the logarithm of its square, and its weight.
    sizes: Vec<(f64, f64)>,
    /// For each interval the logarithm of the mean-square error at its [`INSIDE`] in units of the size's square.
    squares: Vec<[f64; 3]>,
}

/// One function, made ready to be compared with random ones.
struct Judged {
    nodes: Vec<f64>,
    /// Contrasts × nodes.
    contrasts: DMatrix<f64>,
    /// What they are of the function.
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
        let of_contrasts = &contrasts * &block.basis;
        let values = &of_contrasts * own;
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
            inside: inside.collect(),
            step: nodes
                .windows(2)
                .map(|it| it[1] - it[0])
                .fold(f64::INFINITY, f64::min),
            span: nodes[count - 1] - nodes[0],
            nodes,
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
        let (likelihood, sizes) = self.sizes(&eigen.eigenvalues, &seen);
        let of_place = |(at, weights): &(f64, DVector<f64>)| {
            let near = DVector::from_fn(count, |i, _| alike(*at, self.nodes[i]));
            let square = 1.0 - 2.0 * weights.dot(&near) + weights.dot(&(&between * weights));
            ln(square.max(ROUNDING))
        };
        ByLength {
            likelihood,
            sizes,
            squares: self
                .inside
                .iter()
                .map(|it| it.each_ref().map(of_place))
                .collect(),
        }
    }

    /// The middles of the intervals, with each node's weight there.
    fn middles(&self) -> Vec<&(f64, DVector<f64>)> {
        self.inside.iter().map(|[_, middle, _]| middle).collect()
    }

    /// The correlations of how far the function is from its curve in the middles of two intervals, for this
    /// length.
    fn alike(&self, length: f64) -> DMatrix<f64> {
        let near = |a: f64, b: f64| {
            let d = (a - b) / length;
            exp(-0.5 * d * d)
        };
        let all = self.middles();
        let (nodes, middles) = (self.nodes.len(), all.len());
        let between = DMatrix::from_fn(nodes, nodes, |i, j| near(self.nodes[i], self.nodes[j]));
        let to_nodes = DMatrix::from_fn(middles, nodes, |m, i| near(all[m].0, self.nodes[i]));
        let weights = DMatrix::from_fn(middles, nodes, |m, i| all[m].1[i]);
        let own = DMatrix::from_fn(middles, middles, |m, n| near(all[m].0, all[n].0));
        let crossed = &weights * to_nodes.transpose();
        let error = own - &crossed - crossed.transpose() + &weights * between * weights.transpose();
        let size: Vec<f64> = error
            .diagonal()
            .iter()
            .map(|it| it.max(ROUNDING).sqrt())
            .collect();
        DMatrix::from_fn(middles, middles, |m, n| {
            let own = error[(m, n)] / (size[m] * size[n]);
            if m == n { 1.0 } else { own.clamp(-1.0, 1.0) }
        })
    }

    /// The logarithm of the likelihood over all sizes, and of each size that of its square, with its weight.
    fn sizes(&self, powers: &DVector<f64>, seen: &DVector<f64>) -> (f64, Vec<(f64, f64)>) {
        let rms = (self.values.norm_squared() / self.values.len() as f64).sqrt();
        let sizes = logarithmic(SMALLEST, LARGEST, SIZES);
        let sizes: Vec<f64> = sizes
            .iter()
            .map(|it| it * rms.max(f64::MIN_POSITIVE))
            .collect();
        let likelihood = |size: &f64| {
            let each = powers.iter().zip(seen.iter());
            let terms = each.map(|(power, seen)| {
                let variance = 1.0 + size * size * power.max(0.0);
                ln(variance) + seen * seen / variance
            });
            -0.5 * terms.sum::<f64>()
        };
        let likelihoods: Vec<f64> = sizes.iter().map(likelihood).collect();
        let most = likelihoods
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        let mean = likelihoods.iter().map(|it| exp(it - most)).sum::<f64>() / SIZES as f64;
        let weights = normalised(&likelihoods);
        let squares = sizes.iter().map(|size| 2.0 * ln(*size)).zip(weights);
        (most + ln(mean), squares.collect())
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

/// Shares of a whole, by their logarithms.
fn normalised(logs: &[f64]) -> Vec<f64> {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let each: Vec<f64> = logs.iter().map(|it| exp(it - most)).collect();
    let sum: f64 = each.iter().sum();
    each.into_iter().map(|it| it / sum).collect()
}
