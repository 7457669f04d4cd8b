//! Means, scatter and robust scatter of plain `f64` slices, and how uncertainties combine.
//!
//! Source: GUM (JCGM 100:2008) 4.2 and 5.1 for the Type A evaluation and the root sum of
//! squares; the median absolute deviation after Hampel (1974).
//!
//! | symbol | name here |
//! |---|---|
//! | x̄ | [`mean`] |
//! | s (n − 1) | [`standard_deviation`] |
//! | u_c | [`combine`] |
//! | c·Σ·cᵀ | [`propagate`] |
//!
//! Absent: Student factors; expanded uncertainties are stated with their k by who prints them.
use units::portable::powi;

/// Turns a median absolute deviation into the standard deviation of a normal distribution.
const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// The arithmetic mean; `None` for an empty slice.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The sample standard deviation with n − 1; `None` for fewer than two values.
///
/// # Example
///
/// ```
/// use compensator::uncertainty::{mean, standard_deviation};
///
/// let sample = [1.0, 2.0, 4.0];
/// assert_eq!(mean(&sample), Some(7.0 / 3.0));
/// let s = standard_deviation(&sample).expect("two values and more");
/// assert!((s - (7.0_f64 / 3.0).sqrt()).abs() < 1e-15);
/// assert_eq!(standard_deviation(&[1.0]), None);
/// ```
pub fn standard_deviation(values: &[f64]) -> Option<f64> {
    if values.len() < 2 {
        return None;
    }
    let centre = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - centre) * (v - centre)).sum();
    Some((squares / (values.len() - 1) as f64).sqrt())
}

/// The median; `None` for an empty slice. NaN sorts last.
pub fn median(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    let (below, upper, above) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    if below.len() > above.len() {
        let lower = below.iter().copied().max_by(f64::total_cmp)?;
        return Some((lower + upper) / 2.0);
    }
    Some(upper)
}

/// The standard deviation estimated from the median absolute value of residuals that are
/// already centred; up to half of them may be wild. `None` for an empty slice.
///
/// # Example
///
/// ```
/// use compensator::uncertainty::robust_sigma;
///
/// let tame = robust_sigma(&[-1.0, 0.5, 1.0, -0.5, 0.8]);
/// let wild = robust_sigma(&[-1.0, 0.5, 1000.0, -0.5, 0.8]);
/// assert_eq!(tame, wild);
/// ```
pub fn robust_sigma(residuals: &[f64]) -> Option<f64> {
    let magnitudes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    median(&magnitudes).map(|m| m * MAD_TO_SIGMA)
}

/// Root mean square; zero for an empty slice.
pub fn rms(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// The combined standard uncertainty of independent contributions: their root sum of squares.
///
/// # Example
///
/// ```
/// use compensator::uncertainty::combine;
///
/// assert_eq!(combine(&[3.0, 4.0]), 5.0);
/// ```
pub fn combine(contributions: &[f64]) -> f64 {
    contributions.iter().map(|u| u * u).sum::<f64>().sqrt()
}

/// The standard uncertainty of a value that is only known to the nearest multiple of `step` (GUM F.2.2.1).
///
/// # Example
///
/// ```
/// use compensator::uncertainty::of_rounding;
///
/// assert!((of_rounding(10.0) - 2.887).abs() < 1e-3, "a count of 10 nm");
/// ```
pub fn of_rounding(step: f64) -> f64 {
    step / 12_f64.sqrt()
}

/// The variance of a linear combination: gradient · covariance · gradientᵀ.
///
/// `covariance` is square, row by row, of the gradient's length.
///
/// # Panics
/// Of another length.
///
/// # Example
///
/// ```
/// use compensator::uncertainty::propagate;
///
/// let fully_correlated = [4.0, 4.0, 4.0, 4.0];
/// assert_eq!(propagate(&[1.0, -1.0], &fully_correlated), 0.0, "of a difference");
/// assert_eq!(propagate(&[1.0, 1.0], &fully_correlated), 16.0, "of a sum");
/// ```
pub fn propagate(gradient: &[f64], covariance: &[f64]) -> f64 {
    let n = gradient.len();
    assert_eq!(covariance.len(), n * n);
    let mut variance = 0.0;
    for (row, gi) in gradient.iter().enumerate() {
        for (column, gj) in gradient.iter().enumerate() {
            variance += gi * gj * covariance[row * n + column];
        }
    }
    variance
}

/// The upper limit of chi²/ν that a right model exceeds with the one-sided probability of
/// `sigmas` standard deviations (Wilson and Hilferty 1931: 3 is about 0.13 %).
///
/// # Example
///
/// ```
/// use compensator::uncertainty::reduced_chi_square_limit;
///
/// // The tables' upper 0.135 % point of 10 degrees of freedom is 28.79.
/// assert!((10.0 * reduced_chi_square_limit(10, 3.0) - 28.79).abs() < 0.3);
/// ```
pub fn reduced_chi_square_limit(degrees_of_freedom: usize, sigmas: f64) -> f64 {
    let spread = 2.0 / (9.0 * degrees_of_freedom.max(1) as f64);
    powi(1.0 - spread + sigmas * spread.sqrt(), 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scatter_of_a_hand_worked_sample_uses_n_minus_one() {
        // 1, 2, 4: mean 7/3, squares 16/9 + 1/9 + 25/9 = 42/9, divided by 2 = 7/3.
        let sd = standard_deviation(&[1.0, 2.0, 4.0]).unwrap();
        assert!((sd - (7.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(standard_deviation(&[1.0]), None);
    }

    #[test]
    fn the_median_of_an_even_number_is_the_middle_of_the_two() {
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn one_wild_value_does_not_move_the_robust_sigma() {
        let tame = robust_sigma(&[-1.0, 0.5, 1.0, -0.5, 0.8]).unwrap();
        let wild = robust_sigma(&[-1.0, 0.5, 1000.0, -0.5, 0.8]).unwrap();
        assert!((tame - wild).abs() < 1e-12);
    }

    #[test]
    fn correlated_contributions_cancel_in_a_difference() {
        let fully_correlated = [4.0, 4.0, 4.0, 4.0];
        assert_eq!(propagate(&[1.0, -1.0], &fully_correlated), 0.0);
        assert_eq!(propagate(&[1.0, 1.0], &fully_correlated), 16.0);
    }

    #[test]
    fn the_chi_square_limit_matches_the_tables() {
        // chi² upper 0.135 % point of 10 degrees of freedom is 28.79, of 100 it is 147.4.
        assert!((reduced_chi_square_limit(10, 3.0) * 10.0 - 28.79).abs() < 0.3);
        assert!((reduced_chi_square_limit(100, 3.0) * 100.0 - 147.4).abs() < 0.5);
    }
}
