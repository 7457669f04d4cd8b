//! Seeded noise: one independent stream for each source, the same bits on every run.
//!
//! A stream is ChaCha8 keyed by the run's seed; its name picks the ChaCha stream number, so a
//! source that draws more often never shifts another source's values.

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use units::portable::ln;

/// One source of random numbers.
///
/// # Example
///
/// ```
/// use mock_bus::random::Stream;
///
/// let mut noise = Stream::new(7, "adc");
/// assert_eq!(Stream::new(7, "adc").bits(), noise.bits(), "the same run again");
/// assert_ne!(Stream::new(7, "laser").bits(), Stream::new(7, "adc").bits());
/// let share = noise.uniform();
/// assert!((0.0..1.0).contains(&share));
/// assert!(noise.chance(1.0) && !noise.chance(0.0));
/// ```
#[derive(Debug)]
pub struct Stream {
    generator: ChaCha8Rng,
    spare_gaussian: Option<f64>,
}

/// The generator has no `Clone`, lest secrets be copied unawares; here a copy goes on with the same numbers.
impl Clone for Stream {
    fn clone(&self) -> Self {
        Self {
            generator: ChaCha8Rng::deserialize_state(&self.generator.serialize_state()),
            spare_gaussian: self.spare_gaussian,
        }
    }
}

impl Stream {
    /// The stream called `name` of the run with `seed`.
    pub fn new(seed: u64, name: &str) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(fnv1a(name));
        Self {
            generator,
            spare_gaussian: None,
        }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.generator.next_u64()
    }

    /// Uniform in 0 (included) to 1 (excluded).
    pub fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.bits() >> 11) as f64 * STEP
    }

    /// Uniform in `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and standard deviation 1, by Marsaglia's polar method.
    pub fn gaussian(&mut self) -> f64 {
        if let Some(spare) = self.spare_gaussian.take() {
            return spare;
        }
        loop {
            let (a, b) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let square = a * a + b * b;
            if square > 0.0 && square < 1.0 {
                let factor = (-2.0 * ln(square) / square).sqrt();
                self.spare_gaussian = Some(b * factor);
                return a * factor;
            }
        }
    }

    /// True with this probability; a certain or impossible event draws nothing.
    pub fn chance(&mut self, probability: f64) -> bool {
        probability >= 1.0 || (probability > 0.0 && self.uniform() < probability)
    }

    /// Uniform in 0 to `count` (excluded).
    pub fn below(&mut self, count: usize) -> usize {
        (self.uniform() * count as f64) as usize
    }
}

/// FNV-1a (Fowler, Noll, Vo), 64 bits: turns a name or a log into a number.
pub(crate) fn fnv1a(text: &str) -> u64 {
    fnv1a_bytes(FNV_START, text.as_bytes())
}

pub(crate) const FNV_START: u64 = 0xCBF2_9CE4_8422_2325;

/// Goes on with the hash over further bytes.
pub(crate) fn fnv1a_bytes(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_repeats_and_differs_from_its_neighbours() {
        let draw = |seed, name| {
            let mut stream = Stream::new(seed, name);
            [stream.bits(), stream.bits(), stream.bits()]
        };
        assert_eq!(draw(7, "adc"), draw(7, "adc"));
        assert_ne!(draw(7, "adc"), draw(7, "laser"));
        assert_ne!(draw(7, "adc"), draw(8, "adc"));
    }

    /// Wherever in the generator's blocks it is taken.
    #[test]
    fn a_copy_goes_on_with_the_same_numbers() {
        let mut stream = Stream::new(7, "adc");
        for drawn in 0..200 {
            let mut copy = stream.clone();
            let mut original = stream.clone();
            for _ in 0..40 {
                assert_eq!(original.gaussian(), copy.gaussian(), "{drawn}");
            }
            stream.bits();
        }
    }

    #[test]
    fn gaussians_have_mean_0_and_deviation_1() {
        let mut stream = Stream::new(1, "test");
        let values: Vec<f64> = (0..20_000).map(|_| stream.gaussian()).collect();
        let mean = values.iter().sum::<f64>() / 20_000.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03, "{mean}");
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
    }

    #[test]
    fn certainty_draws_nothing() {
        let mut stream = Stream::new(1, "test");
        let mut untouched = stream.clone();
        assert!(stream.chance(1.0) && !stream.chance(0.0));
        assert_eq!(stream.bits(), untouched.bits());
    }
}
