//! Readings whose errors belong together, made independent of each other.
//!
//! What a function does between its nodes is one and the same wherever it is read there: in the middle of a
//! volume, say, where all diagonals meet. Readings that share it contradict the others together, which would be
//! taken for a wrong reading elsewhere if they counted as independent.
//!
//! Source: A. C. Aitken, On least squares and linear combination of observations (1935): with the covariance
//! C = LLᵀ of the errors, L⁻¹y has independent errors of size 1.
//!
//! | symbol | name here |
//! |---|---|
//! | L, in units of the readings' own uncertainties | [`Whitening::factor`] |

use nalgebra::{DMatrix, DVector};

/// By reading, how uncertain it is, and what it shares with others.
#[derive(Clone, Debug, Default)]
pub(super) struct Whitening {
    /// The readings' own standard uncertainties, in their SI units.
    own: Vec<f64>,
    /// `None` while nothing is shared.
    factor: Option<DMatrix<f64>>,
}

impl Whitening {
    /// Another reading of this standard uncertainty, which shares nothing.
    pub(super) fn push(&mut self, u: f64) {
        self.own.push(u);
    }

    /// The readings' own standard uncertainties, in their SI units.
    pub(super) fn own(&self) -> &[f64] {
        &self.own
    }

    /// Adds errors that readings share; `shared` is their covariance in units of the readings' own
    /// uncertainties.
    pub(super) fn share(&mut self, shared: DMatrix<f64>) {
        if shared.iter().all(|it| *it == 0.0) {
            return;
        }
        let count = self.own.len();
        // Where hypotheses are far from what is so, functions are millions of uncertainties from their curves, and
        // what rounding does to such sums is more than the readings' own.
        let own = 1.0 + shared.amax() * f64::EPSILON * count as f64;
        let whole = DMatrix::identity(count, count) * own + shared;
        let factor = whole
            .cholesky()
            .expect("what rounding takes from it was added");
        self.factor = Some(factor.unpack());
    }

    /// Σ ln of the eigenvalues of the readings' covariance.
    pub(super) fn logarithms(&self) -> f64 {
        let own: f64 = self.own.iter().map(|u| 2.0 * units::portable::ln(*u)).sum();
        let shared = self
            .factor
            .iter()
            .flat_map(|it| it.diagonal().iter().copied().collect::<Vec<f64>>());
        own + shared.map(|it| 2.0 * units::portable::ln(it)).sum::<f64>()
    }

    /// L⁻¹ of the rows of `columns` columns, which are in units of the readings' own uncertainties.
    pub(super) fn whiten(&self, rows: &mut [f64], columns: usize) {
        let Some(factor) = &self.factor else {
            return;
        };
        let mut turned = DMatrix::from_row_slice(self.own.len(), columns, rows);
        factor.solve_lower_triangular_mut(&mut turned);
        for (at, row) in turned.row_iter().enumerate() {
            for (to, from) in rows[at * columns..].iter_mut().zip(row.iter()) {
                *to = *from;
            }
        }
    }

    /// L⁻¹ of a column by reading in its SI unit.
    pub(super) fn of_column(&self, column: &[f64]) -> Vec<f64> {
        let mut weighted: Vec<f64> = column.iter().zip(&self.own).map(|(it, u)| it / u).collect();
        self.whiten(&mut weighted, 1);
        weighted
    }

    /// L⁻ᵀ of what whitened readings do: what each reading does, in units of its own uncertainty.
    pub(super) fn of_influence(&self, whitened: &[f64]) -> Vec<f64> {
        let Some(factor) = &self.factor else {
            return whitened.to_vec();
        };
        let mut turned = DVector::from_column_slice(whitened);
        // The diagonal of a Cholesky factor has no zero.
        factor.tr_solve_lower_triangular_mut(&mut turned);
        turned.as_slice().to_vec()
    }

    /// By reading, L⁻¹ of what is one SI unit off in this reading alone.
    pub(super) fn of_each(&self) -> Vec<Vec<f64>> {
        let count = self.own.len();
        let unit = |at: usize| {
            let mut column = vec![0.0; count];
            column[at] = 1.0 / self.own[at];
            column
        };
        let Some(factor) = &self.factor else {
            return (0..count).map(unit).collect();
        };
        let mut all = DMatrix::from_fn(
            count,
            count,
            |i, j| if i == j { 1.0 / self.own[i] } else { 0.0 },
        );
        factor.solve_lower_triangular_mut(&mut all);
        all.column_iter()
            .map(|it| it.iter().copied().collect())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_readings_share_is_left_out_of_their_difference() {
        // Both are 3 of their uncertainties off by the same, which is known.
        let mut whitening = Whitening::default();
        [2.0, 2.0, 4.0].iter().for_each(|u| whitening.push(*u));
        let mut shared = DMatrix::zeros(3, 3);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            shared[(i, j)] = 9.0;
        }
        whitening.share(shared);
        let square = |column: [f64; 3]| {
            whitening
                .of_column(&column)
                .iter()
                .map(|it| it * it)
                .sum::<f64>()
        };
        // Together off by 6: 3² of variance 9 + 1/2 for the mean of the two.
        assert!((square([6.0, 6.0, 0.0]) - 9.0 / 9.5).abs() < 1e-12);
        assert!(
            (square([2.0, -2.0, 0.0]) - 2.0).abs() < 1e-12,
            "nothing is shared by it"
        );
        assert!((square([0.0, 0.0, 8.0]) - 4.0).abs() < 1e-12);
        let logarithms = (4.0_f64 * 4.0 * 16.0 * 19.0).ln();
        assert!((whitening.logarithms() - logarithms).abs() < 1e-12);
        for (at, column) in whitening.of_each().iter().enumerate() {
            let mut unit = [0.0; 3];
            unit[at] = 1.0;
            assert_eq!(*column, whitening.of_column(&unit));
        }
    }
}
