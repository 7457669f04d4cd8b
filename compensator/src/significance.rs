//! Is a term of a model real, or noise? Tail probabilities of the F distribution.
//!
//! Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.6.2 (F by the
//! incomplete beta function), 26.5.8 (its continued fraction), 6.1.41 (Stirling's series).
//!
//! | symbol | name here |
//! |---|---|
//! | Q(F, ν₁, ν₂) | [`f_tail`] |
//! | t with P(\|t\| > t) given | [`student_limit`] |
//!
//! Absent: quantiles of F; a test compares the tail probability with its level.
use units::portable::{exp, ln, ln_1p};

/// Terms of the continued fraction at most; it needs about √max(a, b).
const TERMS_MAX: usize = 10_000;

/// The probability that noise alone makes an F as large as `f` with `numerator` and
/// `denominator` degrees of freedom: 1 for `f` of zero or less, 0 for infinity, NaN for NaN.
///
/// # Example
///
/// ```
/// use compensator::significance::f_tail;
///
/// // The tables' 5 % point of 1 and 10 degrees of freedom.
/// assert!((f_tail(4.965, 1, 10) - 0.05).abs() < 1e-4);
/// assert_eq!(f_tail(f64::INFINITY, 3, 9), 0.0);
/// ```
pub fn f_tail(f: f64, numerator: usize, denominator: usize) -> f64 {
    if f.is_nan() {
        return f;
    }
    let (d1, d2) = (numerator as f64, denominator as f64);
    if f <= 0.0 || numerator == 0 || denominator == 0 {
        return 1.0;
    }
    if numerator == 2 {
        // The closed form of this case has no cancellation however small the result.
        return exp(-0.5 * d2 * ln_1p(2.0 * f / d2));
    }
    incomplete_beta(d2 / (d2 + d1 * f), d2 / 2.0, d1 / 2.0)
}

/// The t that noise exceeds, to either side, with probability `chance` (over 0) and so many degrees of
/// `freedom` (one or more).
pub fn student_limit(chance: f64, freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while f_tail(high * high, 1, freedom) > chance && high < 1e12 {
        (low, high) = (high, high * 2.0);
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if f_tail(middle * middle, 1, freedom) > chance {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// I_x(a, b).
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let ln_front = a * ln(x) + b * ln_1p(-x) + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b);
    let front = exp(ln_front);
    // The fraction converges fast on this side of the mean, the mirrored one on the other.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(x, a, b) / a
    } else {
        1.0 - front * fraction(1.0 - x, b, a) / b
    }
}

/// The continued fraction 1/(1 + d₁/(1 + d₂/(1 + …))) evaluated from the front, as the quotient
/// of numerators and denominators that are rescaled as they grow.
fn fraction(x: f64, a: f64, b: f64) -> f64 {
    let term = |n: usize| {
        let m = (n / 2) as f64;
        if n.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        }
    };
    let (mut upper, mut upper_before) = (1.0, 0.0);
    let (mut lower, mut lower_before) = (1.0, 1.0);
    let mut value = 1.0;
    for n in 1..TERMS_MAX {
        let d = term(n);
        (upper, upper_before) = (upper + d * upper_before, upper);
        (lower, lower_before) = (lower + d * lower_before, lower);
        let scale = 1.0 / lower;
        (upper, upper_before) = (upper * scale, upper_before * scale);
        (lower, lower_before) = (1.0, lower_before * scale);
        if (upper - value).abs() <= 1e-15 * upper.abs() {
            return upper;
        }
        value = upper;
    }
    value
}

/// ln Γ(z) for z > 0.
fn ln_gamma(z: f64) -> f64 {
    let mut shift = 0.0;
    let mut z = z;
    // Γ(z) = Γ(z + 1)/z brings z to where Stirling's series has all digits.
    while z < 12.0 {
        shift += ln(z);
        z += 1.0;
    }
    let (inverse, square) = (1.0 / z, 1.0 / (z * z));
    let series =
        inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    (z - 0.5) * ln(z) - z + 0.5 * ln(core::f64::consts::TAU) + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(f: f64, numerator: usize, denominator: usize, expected: f64, relative: f64) {
        let seen = f_tail(f, numerator, denominator);
        assert!(
            (seen / expected - 1.0).abs() < relative,
            "Q({f}; {numerator}, {denominator}) = {seen}, not {expected}"
        );
    }

    /// Percentage points as printed in any table of the F distribution.
    #[test]
    fn the_tables_are_met() {
        check(4.965, 1, 10, 0.05, 1e-3);
        check(3.708, 3, 10, 0.05, 1e-3);
        check(5.849, 2, 20, 0.01, 1e-3);
        check(2.978, 10, 10, 0.05, 1e-3);
        check(1.3519, 100, 120, 0.0578, 0.02);
        check(161.45, 1, 1, 0.05, 1e-3);
    }

    /// One degree of freedom over one is the Cauchy distribution: Q = 1 − (2/π) atan √f.
    #[test]
    fn closed_forms_are_met_to_rounding() {
        for f in [1e-3, 0.5, 1.0, 7.0, 1e4] {
            let cauchy = 2.0 / core::f64::consts::PI * (1.0 / f64::sqrt(f)).atan();
            check(f, 1, 1, cauchy, 1e-12);
            // Four over four: with x = 1/(1 + f), Q = x²(3 − 2x).
            let x = 1.0 / (1.0 + f);
            check(f, 4, 4, x * x * (3.0 - 2.0 * x), 1e-12);
            // The general way agrees with the short one for two.
            let general = incomplete_beta(7.0 / (7.0 + 2.0 * f), 3.5, 1.0);
            check(f, 2, 7, general, 1e-12);
        }
    }

    #[test]
    fn students_limits_are_those_of_the_tables() {
        for (chance, freedom, expected) in
            [(0.05, 4, 2.7764), (0.05, 1, 12.706), (0.01, 10, 3.1693)]
        {
            let seen = student_limit(chance, freedom);
            assert!((seen / expected - 1.0).abs() < 1e-4, "{seen} {expected}");
        }
    }

    #[test]
    fn the_ends_are_certain() {
        assert_eq!(f_tail(0.0, 3, 9), 1.0);
        assert_eq!(f_tail(f64::INFINITY, 3, 9), 0.0);
        assert_eq!(f_tail(f64::INFINITY, 2, 9), 0.0);
        assert!(f_tail(f64::NAN, 2, 9).is_nan());
        assert!(f_tail(300.0, 2, 1000) > 0.0);
    }
}
