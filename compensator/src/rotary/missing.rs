//! Readings that are missing, as further unknowns of the closed form.
//!
//! A missing reading may be given any value when the value is an unknown of the least squares: it
//! then says nothing (the "missing plot" of F. Yates, Empire J. Exp. Agric. 1 (1933)). With R the
//! map from readings to residuals of the complete form and E the choice of the missing ones, the
//! values x solve (EᵀRE)x = −EᵀRv, and the covariance of the table error grows by
//! LE(EᵀRE)⁻¹EᵀLᵀ, L being the map from readings to table errors. All of R and L follow from the
//! covariance g of the complete form, so that only a matrix of the size of the gaps is factored.
//!
//! Of a line that is missing in every placement one reading stays fixed: its plate error takes
//! that value whatever it is, and nothing else follows from it.

use super::closed_form::ClosedForm;
use super::design::Design;
use super::lanes::dot;

/// More gaps than this make a matrix that takes minutes to factor.
pub(super) const UNKNOWNS_MAX: usize = 3000;

/// A pivot (1 for a reading that others determine fully) taken for zero.
const PIVOT_MIN: f64 = 1e-9;

/// Residuals that share less than this part of their variance are hardly mistaken for each other.
const AKIN_MIN: f64 = 0.1;

/// Why gaps cannot be bridged.
pub(super) enum Unbridged {
    /// Too many.
    Many {
        /// How many.
        seen: usize,
    },
    /// Without this reading part of the table has no connection to the rest.
    Needed {
        /// Its index: placement · lines + line.
        reading: usize,
    },
}

/// How readings act on residuals and on the table error, from the covariance of the latter.
struct Response<'a> {
    lines: usize,
    offsets: &'a [usize],
    /// ℓ_j[d]: what 1 in line n of placement j adds to the table error at position n + d.
    table: Vec<Vec<f64>>,
    /// The mean of ℓ_j[d + s_a] over all placements a.
    mean: Vec<Vec<f64>>,
}

impl<'a> Response<'a> {
    fn new(design: &'a Design, covariance: &[f64]) -> Self {
        let (lines, offsets) = (design.lines(), design.offsets());
        let count = offsets.len() as f64;
        let mut common = vec![0.0; lines];
        for &offset in offsets {
            for (d, sum) in common.iter_mut().enumerate() {
                *sum += covariance[(d + lines - offset) % lines] / count;
            }
        }
        let table: Vec<Vec<f64>> = offsets
            .iter()
            .map(|offset| {
                let own = |d: usize| covariance[(d + lines - offset) % lines];
                (0..lines).map(|d| own(d) - common[d]).collect()
            })
            .collect();
        let mean = table
            .iter()
            .map(|kernel| {
                let at = |d: usize, offset: &usize| kernel[(d + offset) % lines] / count;
                let mean = |d| offsets.iter().map(|offset| at(d, offset)).sum();
                (0..lines).map(mean).collect()
            })
            .collect();
        Self {
            lines,
            offsets,
            table,
            mean,
        }
    }

    /// What 1 in reading `from` adds to the table error at `position`.
    fn on_table(&self, position: usize, from: usize) -> f64 {
        let (placement, line) = (from / self.lines, from % self.lines);
        self.table[placement][(position + self.lines - line) % self.lines]
    }

    /// What 1 in reading `from` adds to the residual of reading `to`.
    fn on_residual(&self, to: usize, from: usize) -> f64 {
        let (n, count) = (self.lines as f64, self.offsets.len() as f64);
        let (to_placement, to_line) = (to / self.lines, to % self.lines);
        let (from_placement, from_line) = (from / self.lines, from % self.lines);
        let apart = (to_line + self.lines - from_line) % self.lines;
        let position = (apart + self.offsets[to_placement]) % self.lines;
        let table = self.table[from_placement][position] - self.mean[from_placement][apart];
        let plate = (f64::from(to_line == from_line) - 1.0 / n) / count;
        let constant = f64::from(to_placement == from_placement) / n;
        f64::from(to == from) - table - plate - constant
    }
}

/// The gaps of one series, ready to be filled.
pub(super) struct Gaps<'a> {
    response: Response<'a>,
    unknown: Vec<usize>,
    factor: Lower,
}

impl<'a> Gaps<'a> {
    /// `missing` is increasing; readings are numbered placement · lines + line.
    pub(super) fn new(
        design: &'a Design,
        covariance: &[f64],
        missing: &[usize],
    ) -> Result<Self, Unbridged> {
        let unknown = unknowns(missing, design.lines(), design.offsets().len());
        if unknown.len() > UNKNOWNS_MAX {
            return Err(Unbridged::Many {
                seen: missing.len(),
            });
        }
        let response = Response::new(design, covariance);
        let factor = Lower::cholesky(unknown.len(), |row, column| {
            response.on_residual(unknown[row], unknown[column])
        });
        let factor = factor.map_err(|row| Unbridged::Needed {
            reading: unknown[row],
        })?;
        Ok(Self {
            response,
            unknown,
            factor,
        })
    }

    /// How many readings are unknown, those of wholly missing lines counted once less.
    pub(super) fn unknowns(&self) -> usize {
        self.unknown.len()
    }

    /// Puts values into the missing readings that the others predict: their residuals vanish.
    pub(super) fn fill(&self, form: &ClosedForm, readings: &mut [f64]) {
        // The second pass takes away what rounding left of the first.
        for _ in 0..2 {
            let residuals = form.residuals(readings, &form.estimate(readings));
            let mut step: Vec<f64> = self.unknown.iter().map(|&at| residuals[at]).collect();
            self.factor.solve(&mut step);
            for (&at, step) in self.unknown.iter().zip(&step) {
                readings[at] -= step;
            }
        }
    }

    /// By how much the gaps enlarge the variance of the table error at each position, in units of
    /// a reading's variance.
    pub(super) fn variances(&self) -> Vec<f64> {
        let mut column = vec![0.0; self.unknown.len()];
        (0..self.response.lines)
            .map(|position| {
                for (value, &from) in column.iter_mut().zip(&self.unknown) {
                    *value = self.response.on_table(position, from);
                }
                self.factor.solve_forward(&mut column);
                column.iter().map(|it| it * it).sum()
            })
            .collect()
    }

    /// The variance of reading − prediction for the missing reading `at`, in units of a reading's
    /// variance; `None` when it is not predicted (of a line that nothing was read of).
    pub(super) fn prediction_variance(&self, at: usize) -> Option<f64> {
        let place = self.unknown.iter().position(|it| *it == at)?;
        let mut column = vec![0.0; self.unknown.len()];
        column[place] = 1.0;
        self.factor.solve_forward(&mut column);
        Some(column.iter().map(|it| it * it).sum())
    }
}

impl Gaps<'_> {
    /// Readings on whose residuals a bad reading `at` throws much of its shadow: those of its line,
    /// of its position, and others that the offsets put beside it.
    pub(super) fn akin(&self, at: usize) -> Vec<usize> {
        let (response, lines) = (&self.response, self.response.lines);
        let own = response.on_residual(at, at);
        let total = lines * response.offsets.len();
        let shadow = |to: &usize| {
            let shadow = response.on_residual(*to, at);
            shadow * shadow > AKIN_MIN * own * response.on_residual(*to, *to)
        };
        (0..total).filter(|to| *to != at).filter(shadow).collect()
    }

    /// What of its own variance is left in the residual of the reading `at`, which is not missing,
    /// and for each unknown reading how much of `at` the prediction for it contains.
    pub(super) fn shadow(&self, at: usize) -> (f64, Vec<(usize, f64)>) {
        let response = &self.response;
        let on = self.unknown.iter().map(|it| response.on_residual(*it, at));
        let on: Vec<f64> = on.collect();
        let mut contained = on.clone();
        self.factor.solve(&mut contained);
        let left = response.on_residual(at, at) - dot(&on, &contained);
        let unknown = self.unknown.iter().copied();
        (left.max(0.0), unknown.zip(contained).collect())
    }
}

/// `missing` without the first reading of each line that was never read.
fn unknowns(missing: &[usize], lines: usize, placements: usize) -> Vec<usize> {
    let mut counts = vec![0_usize; lines];
    missing.iter().for_each(|at| counts[at % lines] += 1);
    let fixed = |at: &&usize| **at < lines && counts[**at] == placements;
    missing.iter().filter(|at| !fixed(at)).copied().collect()
}

/// A lower triangular matrix, row by row.
struct Lower {
    rows: Vec<Vec<f64>>,
}

impl Lower {
    /// The factor of a symmetric matrix; the row of the first pivot that vanishes otherwise.
    fn cholesky(size: usize, entry: impl Fn(usize, usize) -> f64) -> Result<Self, usize> {
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(size);
        for at in 0..size {
            let mut row = Vec::with_capacity(at + 1);
            for (column, other) in rows.iter().enumerate() {
                let value = entry(at, column) - dot(&row, &other[..column]);
                row.push(value / other[column]);
            }
            let pivot = entry(at, at) - dot(&row, &row);
            // Written so that NaN is refused too.
            let sound = pivot > PIVOT_MIN;
            if !sound {
                return Err(at);
            }
            row.push(pivot.sqrt());
            rows.push(row);
        }
        Ok(Self { rows })
    }

    /// L x = b, in place.
    fn solve_forward(&self, b: &mut [f64]) {
        for (at, row) in self.rows.iter().enumerate() {
            let (before, rest) = b.split_at_mut(at);
            rest[0] = (rest[0] - dot(&row[..at], before)) / row[at];
        }
    }

    /// L Lᵀ x = b, in place.
    fn solve(&self, b: &mut [f64]) {
        self.solve_forward(b);
        for (at, row) in self.rows.iter().enumerate().rev() {
            let (before, rest) = b.split_at_mut(at);
            rest[0] /= row[at];
            for (value, factor) in before.iter_mut().zip(row) {
                *value -= factor * rest[0];
            }
        }
    }
}
