//! Elementary functions that give the same bits on every computer.
//!
//! Those of the standard library are the operating system's, which picks variants by processor and
//! changes them with its versions: their last bits differ, and with them what a seed stands for. These
//! are the `libm` crate's, in plain Rust and without instructions that only some processors have.
//!
//! Whatever can reach a set-point, a record, an emulated machine or its log takes them from here. Square
//! roots, remainders, absolute values and roundings are exact by IEEE 754 and stay the standard
//! library's. Arguments and results are those of the standard library's methods of the same names.

/// The sine of an angle in radians.
///
/// # Example
///
/// ```
/// use units::portable::sin;
///
/// assert_eq!(sin(1.0).to_bits(), 0x3FEA_ED54_8F09_0CEE, "on every computer");
/// ```
pub fn sin(angle: f64) -> f64 {
    libm::sin(angle)
}

/// The cosine of an angle in radians.
pub fn cos(angle: f64) -> f64 {
    libm::cos(angle)
}

/// Sine and cosine of an angle in radians.
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// The tangent of an angle in radians.
pub fn tan(angle: f64) -> f64 {
    libm::tan(angle)
}

/// The angle of a sine, in radians; NaN beyond ±1.
pub fn asin(sine: f64) -> f64 {
    libm::asin(sine)
}

/// The angle of a cosine, in radians; NaN beyond ±1.
pub fn acos(cosine: f64) -> f64 {
    libm::acos(cosine)
}

/// The angle of a tangent, in radians.
pub fn atan(tangent: f64) -> f64 {
    libm::atan(tangent)
}

/// The direction of (`x`, `y`) in radians, from −π to π.
///
/// # Example
///
/// ```
/// use units::portable::atan2;
///
/// assert_eq!(atan2(1.0, 0.0).to_degrees(), 90.0);
/// assert!(atan2(-1.0, -3.0) < 0.0, "below the axis of x");
/// ```
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// e to the power of `exponent`.
pub fn exp(exponent: f64) -> f64 {
    libm::exp(exponent)
}

/// The natural logarithm.
pub fn ln(value: f64) -> f64 {
    libm::log(value)
}

/// The natural logarithm of 1 + `value`, also where that is next to nothing.
pub fn ln_1p(value: f64) -> f64 {
    libm::log1p(value)
}

/// The logarithm to the base of 10.
pub fn log10(value: f64) -> f64 {
    libm::log10(value)
}

/// The length of (`x`, `y`).
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// `base` to a whole power, by multiplication alone: what the compiler makes of the standard library's
/// depends on how hard it tries.
///
/// # Example
///
/// ```
/// use units::portable::powi;
///
/// assert_eq!(powi(10.0, -6), 1e-6);
/// assert_eq!(powi(-2.0, 3), -8.0);
/// ```
pub fn powi(base: f64, exponent: i32) -> f64 {
    let (mut result, mut square, mut left) = (1.0, base, exponent.unsigned_abs());
    while left > 0 {
        if left & 1 == 1 {
            result *= square;
        }
        square *= square;
        left >>= 1;
    }
    if exponent < 0 { 1.0 / result } else { result }
}

/// The largest power of two that is no larger than a positive, normal `value`.
///
/// # Example
///
/// ```
/// use units::portable::power_of_two_below;
///
/// assert_eq!(power_of_two_below(0.3), 0.25);
/// assert_eq!(power_of_two_below(1024.0), 1024.0);
/// ```
pub fn power_of_two_below(value: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    f64::from_bits(value.to_bits() & !MANTISSA)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits of one computer, which every other must have too.
    #[track_caller]
    fn check(value: f64, bits: u64) {
        assert_eq!(
            value.to_bits(),
            bits,
            "{value:e} is {:016X}",
            value.to_bits()
        );
    }

    #[test]
    fn the_last_bit_is_the_same_everywhere() {
        check(sin(1.0), 0x3FEA_ED54_8F09_0CEE);
        check(sin(1e5), 0x3FA2_4DAA_9C52_7E96);
        check(cos(2.5), 0xBFE9_A2F7_EF85_8B7D);
        check(tan(0.7), 0x3FEA_F406_C2FC_78AE);
        check(asin(0.3), 0x3FD3_8015_9E14_F6FF);
        check(acos(0.3), 0x3FF4_41F5_ECBE_EF59);
        check(atan(12.5), 0x3FF7_DAFF_85A6_3058);
        check(atan2(-1.0, -3.0), 0xC006_8F09_5FDF_593C);
        check(exp(-3.7), 0x3F99_511F_C687_1044);
        check(ln(0.1), 0xC002_6BB1_BBB5_5515);
        check(ln_1p(1e-3), 0x3F50_6035_4F8C_3EBF);
        check(log10(3.0), 0x3FDE_8927_964F_D5FD);
        check(hypot(0.1, 0.7), 0x3FE6_A09E_667F_3BCC);
    }

    /// Against the operating system's, which are within a unit of the last place.
    #[test]
    fn they_are_the_functions_that_they_are_named_after() {
        type Pair = (fn(f64) -> f64, fn(f64) -> f64);
        let pairs: [Pair; 10] = [
            (sin, f64::sin),
            (cos, f64::cos),
            (tan, f64::tan),
            (asin, f64::asin),
            (acos, f64::acos),
            (atan, f64::atan),
            (exp, f64::exp),
            (ln, f64::ln),
            (ln_1p, f64::ln_1p),
            (log10, f64::log10),
        ];
        for (at, (ours, theirs)) in pairs.iter().enumerate() {
            for step in 1..1000 {
                let x = f64::from(step) * 1e-3;
                let (a, b) = (ours(x), theirs(x));
                assert!((a - b).abs() <= 1e-15 * b.abs().max(1.0), "{at}: {x}");
            }
        }
        for step in 1..1000 {
            let (x, y) = (f64::from(step) * 1e-3 - 0.5, 0.37);
            assert!((atan2(y, x) - y.atan2(x)).abs() <= 1e-15);
            assert!((hypot(x, y) - x.hypot(y)).abs() <= 1e-15);
            assert_eq!(sin_cos(x), (sin(x), cos(x)));
        }
    }

    #[test]
    fn whole_powers_are_products() {
        assert_eq!(powi(3.0, 4), 81.0);
        assert_eq!(powi(10.0, -6), 1e-6);
        assert_eq!(powi(-2.0, 3), -8.0);
        assert_eq!(powi(7.5, 0), 1.0);
        assert_eq!(powi(1.1, i32::MIN), 0.0);
        for (value, power) in [
            (1.0, 1.0),
            (1.99, 1.0),
            (0.3, 0.25),
            (1e-3, 2.0_f64.powi(-10)),
        ] {
            assert_eq!(power_of_two_below(value), power);
        }
    }
}
