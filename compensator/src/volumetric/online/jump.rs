//! Whether a value can have changed as far as it did.

use units::{Quantity, Time};

use super::Trouble;

/// Watches N values of one detector for jumps that nothing there can make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpWatch<Q, const N: usize> {
    /// In SI units per second.
    rate_max: f64,
    noise_max: Q,
    last: Option<(Time, [Q; N])>,
}

impl<Q: Quantity, const N: usize> JumpWatch<Q, N> {
    /// A watch that has seen nothing yet: how fast a value can change, in SI units per second, and how far apart two
    /// samples of the same value can be, by noise.
    pub const fn new(rate_max: f64, noise_max: Q) -> Self {
        Self {
            rate_max,
            noise_max,
            last: None,
        }
    }

    /// The longer nothing good was seen, the further away the next good value may be.
    ///
    /// # Errors
    /// When one of `values` is further from the last good one; that one stays the last.
    pub fn check(&mut self, at: Time, values: [Q; N]) -> Result<(), Trouble> {
        if let Some((before, last)) = self.last {
            let seconds = at.since(before).as_secs_f64();
            let limit = self.noise_max.value() + self.rate_max * seconds;
            let changes = values.iter().zip(last).map(|(it, last)| (*it - last).abs());
            let seen = changes.fold(Q::ZERO, Q::max).value();
            if seen > limit {
                return Err(Trouble::Jumped { seen, limit });
            }
        }
        self.last = Some((at, values));
        Ok(())
    }
}
