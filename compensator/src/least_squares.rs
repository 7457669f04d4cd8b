//! Small dense linear least squares with the covariance of the coefficients.
//!
//! Householder QR of the design after its columns are scaled to unit length (nalgebra), so that
//! a poor choice of units does not cost digits. Rank deficiency is an error, never a silent
//! minimum-norm answer. Golden values: NIST StRD Norris, Longley and Wampler1.
//!
//! | symbol | name here |
//! |---|---|
//! | X (n × p), row by row | `design` |
//! | β | [`Fit::coefficients`] |
//! | (XᵀX)⁻¹ | [`Fit::cofactor`] |
//! | s, ν = n − p | [`Fit::residual_sd`], [`Fit::degrees_of_freedom`] |
//!
//! Absent: weights (scale the rows instead), iteration, bounds.

use nalgebra::{DMatrix, DVector, Dyn, QR};

/// Columns whose independent part is smaller than this share of their length count as
/// dependent. Wampler1 (powers 0…5 of 0…20, one of the hardest legitimate designs) has 1e-4.
const RANK_TOLERANCE: f64 = 1e-11;
/// Below this share of the largest singular value (columns scaled to unit length) nothing is told.
const TOLD_SHARE: f64 = 1e-7;

/// Why a least-squares problem has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LeastSquaresError {
    /// Fewer observations than coefficients.
    #[error("least squares: {observations} observations for {coefficients} coefficients")]
    TooFew {
        /// Rows given.
        observations: usize,
        /// Columns given.
        coefficients: usize,
    },
    /// The design's length is not rows × columns.
    #[error("least squares: the design has {seen} entries, {expected} expected")]
    Shape {
        /// Entries given.
        seen: usize,
        /// Entries expected.
        expected: usize,
    },
    /// A NaN or an infinity.
    #[error("least squares: observation {observation} is not finite")]
    NotFinite {
        /// Index of the row.
        observation: usize,
    },
    /// A column is a combination of the others.
    #[error("least squares: coefficient {column} cannot be distinguished from the others")]
    Dependent {
        /// Index of the column.
        column: usize,
    },
}

/// A solved least-squares problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// One per column of the design, in the observations' unit over the column's.
    pub coefficients: Vec<f64>,
    /// (XᵀX)⁻¹, p × p row by row; times the noise variance it is the covariance.
    pub cofactor: Vec<f64>,
    /// Observation minus model, one per row.
    pub residuals: Vec<f64>,
    /// Rows minus columns.
    pub degrees_of_freedom: usize,
}

impl Fit {
    /// The sum of the squared residuals, in the observations' unit squared.
    pub fn squares(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }

    /// The noise's standard deviation estimated from the residuals; `None` without spare rows.
    pub fn residual_sd(&self) -> Option<f64> {
        let freedom = self.degrees_of_freedom;
        (freedom > 0).then(|| (self.squares() / freedom as f64).sqrt())
    }

    /// The variance of `gradient · coefficients` for a noise of standard deviation `sigma`.
    pub fn variance(&self, gradient: &[f64], sigma: f64) -> f64 {
        crate::uncertainty::propagate(gradient, &self.cofactor) * sigma * sigma
    }

    /// The standard uncertainty of each coefficient for a noise of standard deviation `sigma`.
    pub fn standard_uncertainties(&self, sigma: f64) -> Vec<f64> {
        let p = self.coefficients.len();
        (0..p)
            .map(|i| self.cofactor[i * p + i].sqrt() * sigma)
            .collect()
    }
}

/// Solves `design · β ≈ observed` for the smallest sum of squared residuals.
///
/// `design` holds `observed.len()` rows of `columns` entries each.
///
/// # Errors
/// When the shape is wrong, a value is not finite, rows are missing or columns dependent.
///
/// # Example
///
/// ```
/// use compensator::least_squares::{LeastSquaresError, solve};
///
/// // Observations 1, 2 and 6 of one constant: 3, with residuals −2, −1 and 3.
/// let fit = solve(&[1.0, 1.0, 1.0], 1, &[1.0, 2.0, 6.0])?;
/// assert!((fit.coefficients[0] - 3.0).abs() < 1e-14);
/// let s = fit.residual_sd().expect("two rows to spare");
/// assert!((s - 7.0_f64.sqrt()).abs() < 1e-14);
/// // The second column is the first one doubled.
/// let refused = solve(&[1.0, 2.0, 1.0, 2.0, 1.0, 2.0], 2, &[1.0, 2.0, 3.0]);
/// assert_eq!(refused, Err(LeastSquaresError::Dependent { column: 1 }));
/// # Ok::<(), LeastSquaresError>(())
/// ```
pub fn solve(design: &[f64], columns: usize, observed: &[f64]) -> Result<Fit, LeastSquaresError> {
    Decomposed::new(design, columns, observed)?.fit()
}

/// A problem that was brought to a triangle: what takes most of the time, whatever is asked of it then.
pub(crate) struct Decomposed<'a> {
    design: &'a [f64],
    observed: &'a [f64],
    /// Of the columns, by which they were divided where they are not zero.
    lengths: Vec<f64>,
    r: DMatrix<f64>,
    /// Qᵀ times the observations, as many of it as there are columns.
    rotated: DVector<f64>,
}

impl<'a> Decomposed<'a> {
    /// # Errors
    /// As [`solve`], but for coefficients that cannot be distinguished.
    pub(crate) fn new(
        design: &'a [f64],
        columns: usize,
        observed: &'a [f64],
    ) -> Result<Self, LeastSquaresError> {
        check(design, columns, observed)?;
        let mut matrix = DMatrix::from_row_slice(observed.len(), columns, design);
        let lengths: Vec<f64> = matrix.column_iter().map(|c| c.norm()).collect();
        for (column, length) in lengths.iter().enumerate() {
            matrix
                .column_mut(column)
                .unscale_mut(length.max(f64::MIN_POSITIVE));
        }
        let qr = matrix.qr();
        Ok(Self {
            design,
            observed,
            lengths,
            rotated: rotated(&qr, columns, observed),
            r: qr.r(),
        })
    }

    /// All coefficients.
    ///
    /// # Errors
    /// When one cannot be distinguished from the others.
    pub(crate) fn fit(&self) -> Result<Fit, LeastSquaresError> {
        let columns = self.lengths.len();
        let is_dependent = |i: &usize| self.r[(*i, *i)].abs() < RANK_TOLERANCE;
        let nothing = self.lengths.iter().position(|it| *it == 0.0);
        if let Some(column) = nothing.or_else(|| (0..columns).find(is_dependent)) {
            return Err(LeastSquaresError::Dependent { column });
        }
        let r_inverse = upper_inverse(&self.r);
        let scaled = &r_inverse * &self.rotated;
        let scaled_cofactor = &r_inverse * r_inverse.transpose();
        let lengths = &self.lengths;
        let coefficients: Vec<f64> = (0..columns).map(|i| scaled[i] / lengths[i]).collect();
        let cofactor = (0..columns * columns)
            .map(|k| (k / columns, k % columns))
            .map(|(i, j)| scaled_cofactor[(i, j)] / (lengths[i] * lengths[j]))
            .collect();
        Ok(Fit {
            residuals: residuals(self.design, columns, self.observed, &coefficients),
            coefficients,
            cofactor,
            degrees_of_freedom: self.observed.len() - columns,
        })
    }

    /// The same where some combinations of coefficients make nothing of the observations: these are left at
    /// nothing, and count neither as coefficients nor as uncertain (singular values; Moore and Penrose).
    pub(crate) fn fit_of_what_is_told(&self) -> Fit {
        let columns = self.lengths.len();
        let svd = self.r.clone().svd(true, true);
        let (u, v_t) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
        let largest = svd.singular_values.max();
        let told: Vec<usize> = (0..columns)
            .filter(|at| svd.singular_values[*at] > TOLD_SHARE * largest)
            .collect();
        let mut scaled = DVector::zeros(columns);
        let mut scaled_cofactor = DMatrix::zeros(columns, columns);
        for at in &told {
            let own = v_t.row(*at).transpose();
            let value = svd.singular_values[*at];
            scaled += &own * (u.column(*at).dot(&self.rotated) / value);
            scaled_cofactor += &own * own.transpose() / (value * value);
        }
        let is_there = |at: usize| self.lengths[at] > 0.0;
        let unscaled = |at: usize| 1.0 / self.lengths[at].max(f64::MIN_POSITIVE);
        let coefficient = |at: usize| match is_there(at) {
            true => scaled[at] * unscaled(at),
            false => 0.0,
        };
        let coefficients: Vec<f64> = (0..columns).map(coefficient).collect();
        let cofactor = (0..columns * columns).map(|k| {
            let (i, j) = (k / columns, k % columns);
            match is_there(i) && is_there(j) {
                true => scaled_cofactor[(i, j)] * unscaled(i) * unscaled(j),
                false => 0.0,
            }
        });
        Fit {
            cofactor: cofactor.collect(),
            residuals: residuals(self.design, columns, self.observed, &coefficients),
            coefficients,
            degrees_of_freedom: self.observed.len() - told.len(),
        }
    }
}

/// Of a triangle without a zero on its diagonal; of each column only what is not zero is solved for.
fn upper_inverse(r: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = r.ncols();
    let mut inverse = DMatrix::identity(columns, columns);
    for at in 0..columns {
        let mut own = inverse.view_mut((0, at), (at + 1, 1));
        r.view((0, 0), (at + 1, at + 1))
            .solve_upper_triangular_mut(&mut own);
    }
    inverse
}

/// Qᵀ times the observations, as many of it as there are columns. Q itself is never formed: it would take as long
/// as the decomposition.
fn rotated(qr: &QR<f64, Dyn, Dyn>, columns: usize, observed: &[f64]) -> DVector<f64> {
    let mut rotated = DVector::from_column_slice(observed);
    qr.q_tr_mul(&mut rotated);
    rotated.rows(0, columns).into_owned()
}

fn residuals(design: &[f64], columns: usize, observed: &[f64], coefficients: &[f64]) -> Vec<f64> {
    let rows = observed.iter().zip(design.chunks_exact(columns));
    rows.map(|(y, row)| {
        y - row
            .iter()
            .zip(coefficients)
            .map(|(x, b)| x * b)
            .sum::<f64>()
    })
    .collect()
}

/// By row, orthonormal columns that span those of `design` (rows of `columns` entries each, which are
/// independent): what the coefficients can explain of observations.
pub(crate) fn orthonormal_columns(design: &[f64], columns: usize) -> Vec<Vec<f64>> {
    let rows = design.len() / columns.max(1);
    let mut matrix = DMatrix::from_row_slice(rows, columns, design);
    for mut column in matrix.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column.unscale_mut(length);
        }
    }
    let q = matrix.qr().q();
    q.row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}

fn check(design: &[f64], columns: usize, observed: &[f64]) -> Result<(), LeastSquaresError> {
    let rows = observed.len();
    if columns == 0 || rows < columns {
        return Err(LeastSquaresError::TooFew {
            observations: rows,
            coefficients: columns,
        });
    }
    if design.len() != rows * columns {
        return Err(LeastSquaresError::Shape {
            seen: design.len(),
            expected: rows * columns,
        });
    }
    let bad = design
        .chunks_exact(columns)
        .zip(observed)
        .position(|(row, y)| !y.is_finite() || row.iter().any(|x| !x.is_finite()));
    match bad {
        Some(observation) => Err(LeastSquaresError::NotFinite { observation }),
        None => Ok(()),
    }
}

/// The powers 0…`degree` of `z`, one row of a polynomial design.
pub fn powers(z: f64, degree: usize) -> impl Iterator<Item = f64> {
    (0..=degree).scan(1.0, move |power, _| {
        let this = *power;
        *power *= z;
        Some(this)
    })
}

/// Fits a polynomial of `degree` in `x` (coefficients from the constant upwards).
///
/// Centre and scale `x` to about ±1 beforehand, or digits are lost.
///
/// # Errors
/// As [`solve`]; too few distinct abscissae show as dependent columns.
///
/// # Example
///
/// ```
/// use compensator::least_squares::polynomial;
///
/// let x = [-1.0, -0.5, 0.0, 0.5, 1.0];
/// let y = x.map(|z| 2.0 - 3.0 * z + 4.0 * z * z);
/// let fit = polynomial(&x, &y, 2)?;
/// let close = |(seen, it): (&f64, f64)| (seen - it).abs() < 1e-14;
/// assert!(fit.coefficients.iter().zip([2.0, -3.0, 4.0]).all(close));
/// assert_eq!(fit.degrees_of_freedom, 2);
/// # Ok::<(), compensator::least_squares::LeastSquaresError>(())
/// ```
pub fn polynomial(x: &[f64], y: &[f64], degree: usize) -> Result<Fit, LeastSquaresError> {
    let design: Vec<f64> = x.iter().flat_map(|&z| powers(z, degree)).collect();
    solve(&design, degree + 1, y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_close(name: &str, seen: f64, certified: f64, relative: f64) {
        let error = ((seen - certified) / certified).abs();
        assert!(
            error < relative,
            "{name}: {seen} against {certified}, off by {error:e}"
        );
    }

    /// NIST StRD, linear regression, "Norris" (lower difficulty), 36 observations.
    #[test]
    fn nist_norris_is_met_to_eleven_digits() {
        let y = [
            0.1, 338.8, 118.1, 888.0, 9.2, 228.1, 668.5, 998.5, 449.1, 778.9, 559.2, 0.3, 0.1,
            778.1, 668.8, 339.3, 448.9, 10.8, 557.7, 228.3, 998.0, 888.8, 119.6, 0.3, 0.6, 557.6,
            339.3, 888.0, 998.5, 778.9, 10.2, 117.6, 228.9, 668.4, 449.2, 0.2,
        ];
        let x = [
            0.2, 337.4, 118.2, 884.6, 10.1, 226.5, 666.3, 996.3, 448.6, 777.0, 558.2, 0.4, 0.6,
            775.5, 666.9, 338.0, 447.5, 11.6, 556.0, 228.1, 995.8, 887.6, 120.2, 0.3, 0.3, 556.8,
            339.1, 887.2, 999.0, 779.0, 11.1, 118.3, 229.2, 669.1, 448.9, 0.5,
        ];
        let fit = polynomial(&x, &y, 1).unwrap();
        let sd = fit.residual_sd().unwrap();
        let u = fit.standard_uncertainties(sd);
        check_close("B0", fit.coefficients[0], -0.262323073774029, 1e-11);
        check_close("B1", fit.coefficients[1], 1.00211681802045, 1e-11);
        check_close("u(B0)", u[0], 0.232818234301152, 1e-11);
        check_close("u(B1)", u[1], 0.429796848199937E-03, 1e-11);
        check_close("residual sd", sd, 0.884796396144373, 1e-11);
    }

    /// NIST StRD, "Wampler1" (higher difficulty): y = 1 + x + … + x⁵ for x = 0…20, exactly.
    #[test]
    fn nist_wampler1_is_met_without_scaling_the_abscissa() {
        let x: Vec<f64> = (0..=20).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|&z| powers(z, 5).sum()).collect();
        let fit = polynomial(&x, &y, 5).unwrap();
        for b in &fit.coefficients {
            check_close("B", *b, 1.0, 1e-7);
        }
    }

    /// NIST StRD, "Longley" (higher difficulty, nearly collinear), 16 observations.
    #[test]
    fn nist_longley_is_met_to_nine_digits() {
        #[rustfmt::skip]
        let data = [
            60323.0, 83.0, 234289.0, 2356.0, 1590.0, 107608.0, 1947.0,
            61122.0, 88.5, 259426.0, 2325.0, 1456.0, 108632.0, 1948.0,
            60171.0, 88.2, 258054.0, 3682.0, 1616.0, 109773.0, 1949.0,
            61187.0, 89.5, 284599.0, 3351.0, 1650.0, 110929.0, 1950.0,
            63221.0, 96.2, 328975.0, 2099.0, 3099.0, 112075.0, 1951.0,
            63639.0, 98.1, 346999.0, 1932.0, 3594.0, 113270.0, 1952.0,
            64989.0, 99.0, 365385.0, 1870.0, 3547.0, 115094.0, 1953.0,
            63761.0, 100.0, 363112.0, 3578.0, 3350.0, 116219.0, 1954.0,
            66019.0, 101.2, 397469.0, 2904.0, 3048.0, 117388.0, 1955.0,
            67857.0, 104.6, 419180.0, 2822.0, 2857.0, 118734.0, 1956.0,
            68169.0, 108.4, 442769.0, 2936.0, 2798.0, 120445.0, 1957.0,
            66513.0, 110.8, 444546.0, 4681.0, 2637.0, 121950.0, 1958.0,
            68655.0, 112.6, 482704.0, 3813.0, 2552.0, 123366.0, 1959.0,
            69564.0, 114.2, 502601.0, 3931.0, 2514.0, 125368.0, 1960.0,
            69331.0, 115.7, 518173.0, 4806.0, 2572.0, 127852.0, 1961.0,
            70551.0, 116.9, 554894.0, 4007.0, 2827.0, 130081.0, 1962.0,
        ];
        let y: Vec<f64> = data.chunks(7).map(|row| row[0]).collect();
        let design: Vec<f64> = data
            .chunks(7)
            .flat_map(|row| [1.0].into_iter().chain(row[1..].to_vec()))
            .collect();
        let fit = solve(&design, 7, &y).unwrap();
        let sd = fit.residual_sd().unwrap();
        let u = fit.standard_uncertainties(sd);
        check_close("B0", fit.coefficients[0], -3482258.63459582, 1e-9);
        check_close("B2", fit.coefficients[2], -0.358191792925910E-01, 1e-9);
        check_close("B6", fit.coefficients[6], 1829.15146461355, 1e-9);
        check_close("u(B0)", u[0], 890420.383607373, 1e-9);
        check_close("u(B6)", u[6], 455.478499142212, 1e-9);
        check_close("residual sd", sd, 304.854073561965, 1e-9);
    }

    #[test]
    fn dependent_columns_are_named_and_not_guessed() {
        let design = [1.0, 2.0, 1.0, 2.0, 1.0, 2.0];
        let error = solve(&design, 2, &[1.0, 2.0, 3.0]).unwrap_err();
        assert_eq!(error, LeastSquaresError::Dependent { column: 1 });
    }

    #[test]
    fn nan_and_missing_rows_are_refused() {
        let error = polynomial(&[0.0, 1.0, f64::NAN], &[0.0; 3], 1).unwrap_err();
        assert_eq!(error, LeastSquaresError::NotFinite { observation: 2 });
        let error = polynomial(&[0.0], &[0.0], 1).unwrap_err();
        assert_eq!(
            error,
            LeastSquaresError::TooFew {
                observations: 1,
                coefficients: 2
            }
        );
        assert!(matches!(
            solve(&[1.0], 2, &[1.0, 2.0]),
            Err(LeastSquaresError::Shape { .. })
        ));
    }
}
