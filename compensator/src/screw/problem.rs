//! Least squares over strokes: how noisy they are about a model, and which harmonics they show.

use nalgebra::{Matrix2, Vector2};
use units::portable::hypot;
use units::{Approach, Metres};

use super::cells::{Cells, Place};
use super::error::FitError;
use super::strata::{Strata, Variances};
use super::{BASE, design_row};
use crate::least_squares::{self, LeastSquaresError};
use crate::screw::Stroke;
use crate::significance::f_tail;

/// The smallest scatter that tests believe in: data without noise have no harmonics by rounding.
pub(super) const SCATTER_FLOOR_M: f64 = 1e-10;

/// Its square.
pub(super) const FLOOR: f64 = SCATTER_FLOOR_M * SCATTER_FLOOR_M;

/// What was found about one harmonic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HarmonicTest {
    /// Which one.
    pub number: u32,
    /// How likely noise alone makes one as strong, in its last test.
    pub p_value: f64,
    /// The level it had to stay within.
    pub level: f64,
    /// Whether it is in the model.
    pub kept: bool,
}

pub(super) struct Problem {
    cells: Cells,
    lead: f64,
    ends: (Metres, Metres),
}

impl Problem {
    pub(super) fn new(strokes: &[Stroke], lead: Option<Metres>) -> Self {
        let infinity = Metres(f64::INFINITY);
        let all = || strokes.iter().map(|it| it.stroke);
        Self {
            cells: Cells::of(strokes),
            lead: lead.map_or(1.0, Metres::value),
            ends: (
                all().fold(infinity, Metres::min),
                all().fold(-infinity, Metres::max),
            ),
        }
    }

    pub(super) fn check_rows(&self) -> Result<(), FitError> {
        let rows = self.cells.rows;
        if rows > BASE {
            return Ok(());
        }
        let parameters = BASE;
        Err(FitError::TooFewRows { rows, parameters })
    }

    /// Strokes, repetitions counted.
    pub(super) const fn rows(&self) -> usize {
        self.cells.rows
    }

    /// Different strokes.
    pub(super) fn places(&self) -> usize {
        self.cells.places.len()
    }

    /// The lowest and the highest stroke.
    pub(super) const fn ends(&self) -> (Metres, Metres) {
        self.ends
    }

    pub(super) fn strata(&self, harmonics: &[u32]) -> Result<Strata, LeastSquaresError> {
        Strata::of(&self.cells, self.lead, harmonics)
    }

    /// The model of these harmonics, every cell weighted by what its scatter is made of.
    pub(super) fn solve(
        &self,
        harmonics: &[u32],
        variances: &Variances,
    ) -> Result<least_squares::Fit, LeastSquaresError> {
        let (mut design, mut observed) = (Vec::new(), Vec::new());
        for place in &self.cells.places {
            let white = Whitening::of(place, variances);
            let (rows, means): (Vec<_>, Vec<_>) = place
                .design(self.lead, harmonics)
                .map(|(cell, row)| (row, cell.mean))
                .unzip();
            design.extend(white.rows(rows).into_iter().flatten());
            observed.extend(white.values(&means));
        }
        least_squares::solve(&design, BASE + 2 * harmonics.len(), &observed)
    }

    /// The covariance of a solution that was weighted by `assumed` when the variances are `real`:
    /// C·(Σ XᵀV⁻¹·R·V⁻¹X)·C over the strokes, with C the solution's cofactor.
    pub(super) fn covariance(
        &self,
        harmonics: &[u32],
        (assumed, real): (&Variances, &Variances),
        cofactor: &[f64],
    ) -> Vec<f64> {
        self.sandwich(harmonics, assumed, cofactor, |place| block(place, real))
    }

    /// The same in two parts: what the means of strokes scatter, and what the sides and repetitions of a stroke
    /// differ by.
    pub(super) fn covariance_in_parts(
        &self,
        harmonics: &[u32],
        (assumed, real): (&Variances, &Variances),
        cofactor: &[f64],
    ) -> [Vec<f64>; 2] {
        let means = |place: &Place| block_of_mean(place, real);
        let within = |place: &Place| block(place, real) - block_of_mean(place, real);
        [
            self.sandwich(harmonics, assumed, cofactor, means),
            self.sandwich(harmonics, assumed, cofactor, within),
        ]
    }

    fn sandwich(
        &self,
        harmonics: &[u32],
        assumed: &Variances,
        cofactor: &[f64],
        real: impl Fn(&Place) -> Matrix2<f64>,
    ) -> Vec<f64> {
        let size = BASE + 2 * harmonics.len();
        let mut middle = vec![0.0; size * size];
        for place in &self.cells.places {
            let rows: Vec<_> = place.design(self.lead, harmonics).map(|it| it.1).collect();
            let inverse = inverse_block(place, assumed);
            let kernel = inverse * real(place) * inverse;
            for i in 0..size {
                for j in 0..size {
                    let left = Vector2::from_fn(|at, _| rows.get(at).map_or(0.0, |it| it[i]));
                    let right = Vector2::from_fn(|at, _| rows.get(at).map_or(0.0, |it| it[j]));
                    middle[i * size + j] += left.dot(&(kernel * right));
                }
            }
        }
        let whole = product(&product(cofactor, &middle, size), cofactor, size);
        // Rounding apart it is symmetric.
        let mirrored = |at: usize| f64::midpoint(whole[at], whole[at % size * size + at / size]);
        (0..size * size).map(mirrored).collect()
    }

    /// By how much the slope is off for an amplitude of 1 when harmonic `number` is there, in the
    /// worst phase, and not in the model; 1/m.
    pub(super) fn leak(
        &self,
        number: u32,
        harmonics: &[u32],
        variances: &Variances,
    ) -> Result<f64, LeastSquaresError> {
        let others: Vec<u32> = harmonics
            .iter()
            .copied()
            .filter(|it| *it != number)
            .collect();
        let slope = |which: usize| {
            let wave =
                |place: &Place| design_row(place.stroke, Approach::Forward, self.lead, &[number]);
            let mut pure = self.cells.clone();
            for place in &mut pure.places {
                let value = wave(place)[BASE + which];
                place.cells.iter_mut().for_each(|it| it.mean = value);
            }
            let of_wave = Self {
                cells: pure,
                ..*self
            };
            Ok(of_wave.solve(&others, variances)?.coefficients[1])
        };
        Ok(hypot(slope(0)?, slope(1)?))
    }

    /// The harmonics that pass their tests, increasing, and all the tests.
    pub(super) fn significant(
        &self,
        candidates: &[u32],
        significance: f64,
    ) -> Result<(Vec<u32>, Vec<HarmonicTest>), LeastSquaresError> {
        let strata = self.strata(candidates)?;
        let variances = strata.variances();
        let squares = |harmonics: &[u32]| Ok(self.solve(harmonics, &variances)?.squares());
        let (mut kept, mut tests) = (Vec::new(), Vec::new());
        let mut open = candidates.to_vec();
        let mut before = squares(&kept)?;
        while !open.is_empty() {
            let level = significance / open.len() as f64;
            let mut round = Vec::with_capacity(open.len());
            for &number in &open {
                let left = squares(&[kept.as_slice(), &[number]].concat())?;
                let test = HarmonicTest {
                    number,
                    p_value: f_tail((before - left) / 2.0, 2, strata.strokes.freedom),
                    level,
                    kept: false,
                };
                round.push((left, test));
            }
            round.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (left, mut strongest) = round[0];
            if strongest.p_value > level {
                tests.extend(round.iter().map(|(_, test)| *test));
                break;
            }
            strongest.kept = true;
            tests.push(strongest);
            before = left;
            kept.push(strongest.number);
            open.retain(|number| *number != strongest.number);
        }
        kept.sort_unstable();
        tests.sort_by_key(|test| test.number);
        Ok((kept, tests))
    }
}

/// The covariance of the means of a stroke's cells; of one side alone, the other a unit apart.
fn block(place: &Place, variances: &Variances) -> Matrix2<f64> {
    let floored = |count: f64| variances.of_cell(count).max(FLOOR);
    match place.cells.as_slice() {
        [a, b] => {
            let shared = variances.stroke;
            let [first, second] = [a, b].map(|it| shared + floored(it.count));
            Matrix2::new(first, shared, shared, second)
        }
        cells => {
            let count = cells.first().map_or(1.0, |it| it.count);
            Matrix2::new(variances.stroke + floored(count), 0.0, 0.0, 1.0)
        }
    }
}

/// What both sides of a stroke have in common: the variance of its best mean. Of one side alone all of it.
fn block_of_mean(place: &Place, variances: &Variances) -> Matrix2<f64> {
    let block = block(place, variances);
    if place.cells.len() < 2 {
        return block;
    }
    let shared = block[(1, 0)];
    let weights = [0, 1].map(|i| 1.0 / (block[(i, i)] - shared));
    Matrix2::repeat(shared + 1.0 / (weights[0] + weights[1]))
}

/// The inverse of [`block`], its determinant not as a difference of large numbers.
fn inverse_block(place: &Place, variances: &Variances) -> Matrix2<f64> {
    let block = block(place, variances);
    let shared = block[(1, 0)];
    let own = [0, 1].map(|i| block[(i, i)] - shared);
    let determinant = shared * (own[0] + own[1]) + own[0] * own[1];
    Matrix2::new(block[(1, 1)], -shared, -shared, block[(0, 0)]) / determinant
}

/// What makes the means of a stroke's cells independent, with a variance of 1: the inverse of the lower Cholesky
/// factor of their covariance.
struct Whitening {
    first: f64,
    carried: f64,
    second: f64,
}

impl Whitening {
    fn of(place: &Place, variances: &Variances) -> Self {
        let block = block(place, variances);
        let first = block[(0, 0)].sqrt();
        let carried = block[(1, 0)] / first;
        // Not as a difference of large numbers: what is left of b + v₂ is v₂ + b·v₁/(b + v₁).
        let shared = block[(1, 0)];
        let rest = block[(1, 1)] - shared + shared * (1.0 - shared / block[(0, 0)]);
        Self {
            first,
            carried,
            second: rest.sqrt(),
        }
    }

    fn values(&self, seen: &[f64]) -> Vec<f64> {
        let first = seen[0] / self.first;
        let second = seen
            .get(1)
            .map(|it| (it - self.carried * first) / self.second);
        core::iter::once(first).chain(second).collect()
    }

    fn rows(&self, rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let columns = rows[0].len();
        let mut white = vec![vec![0.0; columns]; rows.len()];
        for column in 0..columns {
            let seen: Vec<f64> = rows.iter().map(|it| it[column]).collect();
            for (row, value) in white.iter_mut().zip(self.values(&seen)) {
                row[column] = value;
            }
        }
        white
    }
}

/// Of two square matrices, row by row.
fn product(a: &[f64], b: &[f64], size: usize) -> Vec<f64> {
    let entry = |i: usize, j: usize| (0..size).map(|k| a[i * size + k] * b[k * size + j]).sum();
    (0..size * size)
        .map(|at| entry(at / size, at % size))
        .collect()
}
