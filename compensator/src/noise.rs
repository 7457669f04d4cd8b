//! Reproducible noise for the tests of this package.

use units::portable::ln;

/// SplitMix64 (Steele, Lea, Flood 2014) with a seed.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    /// Uniform in 0 … 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal with standard deviation 1, by the polar method: the tails matter to tests of tests.
    pub(crate) fn normal(&mut self) -> f64 {
        loop {
            let (a, b) = (self.within(1.0), self.within(1.0));
            let square = a * a + b * b;
            if square > 0.0 && square < 1.0 {
                return a * (-2.0 * ln(square) / square).sqrt();
            }
        }
    }

    /// Uniform in ±`half`.
    pub(crate) fn within(&mut self, half: f64) -> f64 {
        (2.0 * self.uniform() - 1.0) * half
    }
}
