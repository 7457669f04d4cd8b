//! Inputs that give exactly the same again and again: no signal with noise does.
//!
//! Source: none. A converter that is stuck shows what it showed last, which is plausible and
//! changes no faster than anything can: only that its noise is gone tells it.

use core::num::NonZeroU32;

use units::Time;

use super::Trouble;

/// Watches N inputs whose noise is above their converter's step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckWatch<const N: usize> {
    /// So many equal samples in a row are no coincidence; `None` where noise is too small to tell.
    limit: Option<NonZeroU32>,
    at: Time,
    last: [f64; N],
    equal: [u32; N],
}

impl<const N: usize> StuckWatch<N> {
    /// A watch that has seen nothing yet; `limit` is the number of equal samples in a row that
    /// make an input stuck.
    pub const fn new(limit: Option<NonZeroU32>) -> Self {
        Self {
            limit,
            at: Time::NEVER,
            last: [f64::NAN; N],
            equal: [0; N],
        }
    }

    /// Takes the newest sample, of the moment `at`; the same sample again says nothing.
    ///
    /// # Errors
    /// [`Trouble::Stuck`] with the first input that is.
    pub fn check(&mut self, at: Time, sample: [f64; N]) -> Result<(), Trouble> {
        let Some(limit) = self.limit else {
            return Ok(());
        };
        if at != self.at {
            self.at = at;
            for ((equal, last), seen) in self.equal.iter_mut().zip(&self.last).zip(sample) {
                let same = seen.total_cmp(last).is_eq();
                *equal = if same { equal.saturating_add(1) } else { 1 };
            }
            self.last = sample;
        }
        match self.equal.iter().position(|it| *it >= limit.get()) {
            Some(input) => Err(Trouble::Stuck {
                input,
                seen: self.last[input],
                samples: limit,
            }),
            None => Ok(()),
        }
    }
}
