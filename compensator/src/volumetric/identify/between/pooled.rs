//! How likely each length and each size of a random function is, by all functions of a machine.
//!
//! A few nodes hardly tell the size of one function, as a few readings hardly tell a scatter: of two contrasts
//! it is Student's t with two degrees of freedom, whose mean square is infinite. Guides of one machine are of
//! one make: the logarithms of the sizes of its displacements are taken as normal about a common one that
//! nothing is known of, and so are those of its rotations (a random effect; A. Gelman and others, Bayesian
//! Data Analysis, 3rd edition, chapter 5). What one function leaves open, the others tell; one that says of
//! itself that it is larger is.

use nalgebra::DVector;
use units::portable::{exp, ln};

use super::{ByLength, logarithmic};
use crate::volumetric::Axis;
use crate::volumetric::identify::block::axis_of;
use crate::volumetric::model::ErrorName;

/// Lengths that are tried for each axis.
pub(super) const LENGTHS: usize = 9;
/// Sizes that are tried, in units of the rms of all values at nodes. What noise hides would be as large as is
/// tried; of a function as smooth as the longest length, nodes show a thirtieth once its line is taken off. A function that is alone
/// of its kind and has two contrasts comes out three times too large by this end (the mean square grows with its logarithm).
const SIZES: usize = 36;
const SMALLEST: f64 = 1e-5;
const LARGEST: f64 = 1e2;
/// Functions of one kind are taken to be as large as each other within this factor: a standard deviation of their
/// logarithms. 1.5 leaves four nodes understated by 1.3 to 2 (docs/decisions/0066).
const FACTOR: f64 = 2.0;

/// A function and what it is beside random ones.
pub(super) struct Seen<'a> {
    pub(super) name: ErrorName,
    /// Its values at its nodes.
    pub(super) nodes: &'a DVector<f64>,
    /// By the lengths of its axis.
    pub(super) by_length: &'a [ByLength],
}

/// How likely each length and size of a function is.
pub(super) struct Pooled {
    /// By size its square, in the square of the function's unit.
    pub(super) squares: Vec<f64>,
    /// By length and size; all of them sum to 1.
    pub(super) weights: Vec<Vec<f64>>,
}

/// By function.
pub(super) fn pooled(functions: &[Seen<'_>]) -> Vec<Pooled> {
    let sizes = KINDS.map(|kind| sizes(functions.iter().filter(|it| kind.has(it.name))));
    let alike = alike();
    let own: Vec<Vec<OfLength>> = functions
        .iter()
        .map(|it| {
            let sizes = &sizes[Kind::of(it.name) as usize];
            let of_length = |by_length| OfLength::new(by_length, sizes, &alike);
            it.by_length.iter().map(of_length).collect()
        })
        .collect();
    let common = common(functions, &own);
    let each = functions.iter().zip(&own);
    each.map(|(it, own)| {
        let kind = Kind::of(it.name);
        let common = &common[axis_of(it.name).index()];
        Pooled {
            squares: sizes[kind as usize].iter().map(|it| it * it).collect(),
            weights: (0..LENGTHS)
                .map(|length| own[length].weights(&common[length][kind as usize], &alike))
                .collect(),
        }
    })
    .collect()
}

/// What a function's size is compared with.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Displacements,
    Rotations,
}

const KINDS: [Kind; 2] = [Kind::Displacements, Kind::Rotations];

impl Kind {
    const fn of(name: ErrorName) -> Self {
        match name {
            ErrorName::Along(..) => Self::Displacements,
            ErrorName::About(..) => Self::Rotations,
        }
    }

    fn has(self, name: ErrorName) -> bool {
        Self::of(name) == self
    }
}

/// The sizes that are tried for these functions.
fn sizes<'a>(functions: impl Iterator<Item = &'a Seen<'a>>) -> Vec<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for it in functions {
        sum += it.nodes.norm_squared();
        count += it.nodes.len();
    }
    let rms = (sum / count.max(1) as f64).sqrt();
    let sizes = logarithmic(SMALLEST, LARGEST, SIZES).into_iter();
    sizes
        .map(|it| it * rms.max(f64::MIN_POSITIVE.sqrt()))
        .collect()
}

/// By common size, how likely each size of a function is.
fn alike() -> Vec<Vec<f64>> {
    let step = ln(LARGEST / SMALLEST) / (SIZES - 1) as f64;
    let density = |common: usize, size: usize| {
        let off = step * (common as f64 - size as f64) / ln(FACTOR);
        exp(-0.5 * off * off)
    };
    (0..SIZES)
        .map(|common| {
            let each: Vec<f64> = (0..SIZES).map(|size| density(common, size)).collect();
            let sum: f64 = each.iter().sum();
            each.into_iter().map(|it| it / sum).collect()
        })
        .collect()
}

/// What a function says with one length.
struct OfLength {
    /// By size its likelihood, in units of the greatest.
    of_size: Vec<f64>,
    /// By common size, in the same units.
    of_common: Vec<f64>,
    /// The logarithm of that unit.
    unit: f64,
}

impl OfLength {
    fn new(it: &ByLength, sizes: &[f64], alike: &[Vec<f64>]) -> Self {
        let likelihood = |size: &f64| {
            let each = it.powers.iter().zip(it.seen.iter());
            let terms = each.map(|(power, seen)| {
                let variance = 1.0 + size * size * power.max(0.0);
                ln(variance) + seen * seen / variance
            });
            -0.5 * terms.sum::<f64>()
        };
        let logs: Vec<f64> = sizes.iter().map(likelihood).collect();
        let unit = greatest(&logs);
        let of_size: Vec<f64> = logs.iter().map(|it| exp(it - unit)).collect();
        let of_common = alike.iter().map(|alike| product(alike, &of_size));
        Self {
            of_common: of_common.collect(),
            of_size,
            unit,
        }
    }

    /// By common size, its logarithm.
    fn logs(&self) -> impl Iterator<Item = f64> {
        self.of_common.iter().map(|it| self.unit + ln(*it))
    }

    /// By size; `common`: how likely each common size is, and this length.
    fn weights(&self, common: &[f64], alike: &[Vec<f64>]) -> Vec<f64> {
        let all = || common.iter().zip(&self.of_common).zip(alike);
        let of_size = |size: usize| {
            let each = all().map(|((weight, of_common), alike)| weight * alike[size] / of_common);
            self.of_size[size] * each.sum::<f64>()
        };
        (0..SIZES).map(of_size).collect()
    }
}

/// By axis, its length, and kind: how likely that length and each common size are.
type Common = [Vec<[Vec<f64>; KINDS.len()]>; 3];

/// By what all functions say. Lengths belong to axes and common sizes to kinds, of which each has functions of
/// all axes: all lengths are tried with each other.
fn common(functions: &[Seen<'_>], own: &[Vec<OfLength>]) -> Common {
    let none = || core::array::from_fn(|_| vec![0.0; SIZES]);
    let mut logs: Common = core::array::from_fn(|_| vec![none(); LENGTHS]);
    for (it, own) in functions.iter().zip(own) {
        for (length, of_length) in own.iter().enumerate() {
            let sum = &mut logs[axis_of(it.name).index()][length][Kind::of(it.name) as usize];
            sum.iter_mut()
                .zip(of_length.logs())
                .for_each(|(sum, own)| *sum += own);
        }
    }
    let together = |lengths: [usize; 3], kind: Kind| -> Vec<f64> {
        let of = |axis: usize, size: usize| logs[axis][lengths[axis]][kind as usize][size];
        (0..SIZES)
            .map(|size| of(0, size) + of(1, size) + of(2, size))
            .collect()
    };
    let all: Vec<[usize; 3]> = (0..LENGTHS.pow(3))
        .map(|it| [it % LENGTHS, it / LENGTHS % LENGTHS, it / LENGTHS / LENGTHS])
        .collect();
    let each: Vec<[(f64, Vec<f64>); KINDS.len()]> = all
        .iter()
        .map(|lengths| KINDS.map(|kind| normalised(&together(*lengths, kind))))
        .collect();
    let evidence: Vec<f64> = each
        .iter()
        .map(|kinds| kinds.iter().map(|it| it.0).sum())
        .collect();
    let (_, weights) = normalised(&evidence);
    let mut common: Common = core::array::from_fn(|_| vec![none(); LENGTHS]);
    for ((lengths, kinds), weight) in all.iter().zip(&each).zip(&weights) {
        for axis in Axis::ALL.map(Axis::index) {
            for (sum, (_, of_kind)) in common[axis][lengths[axis]].iter_mut().zip(kinds) {
                let each = sum.iter_mut().zip(of_kind);
                each.for_each(|(sum, own)| *sum += weight * own);
            }
        }
    }
    common
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn greatest(all: &[f64]) -> f64 {
    all.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// The logarithm of their sum, and their shares of it, by their logarithms.
fn normalised(logs: &[f64]) -> (f64, Vec<f64>) {
    let most = greatest(logs);
    let each: Vec<f64> = logs.iter().map(|it| exp(it - most)).collect();
    let sum: f64 = each.iter().sum();
    (
        most + ln(sum),
        each.into_iter().map(|it| it / sum).collect(),
    )
}
