//! Whether a place can have changed as far as it did.

use units::{Metres, MetresPerSecond, Time};

use super::Trouble;

/// Watches a place in two directions for jumps that nothing there can make.
#[derive(Clone, Copy, Debug)]
pub(super) struct JumpWatch {
    /// How fast it can change.
    pub(super) speed_max: MetresPerSecond,
    /// How far apart two samples of the same place can be, by noise.
    pub(super) noise_max: Metres,
    last: Option<(Time, [Metres; 2])>,
}

impl JumpWatch {
    /// A watch that has seen nothing yet.
    pub(super) const fn new(speed_max: MetresPerSecond, noise_max: Metres) -> Self {
        Self {
            speed_max,
            noise_max,
            last: None,
        }
    }

    /// The longer nothing good was seen, the further away the next good place may be.
    ///
    /// # Errors
    /// When `place` is further from the last good one; that one stays the last.
    pub(super) fn check(&mut self, at: Time, place: [Metres; 2]) -> Result<(), Trouble> {
        if let Some((before, last)) = self.last {
            let seconds = at.since(before).as_secs_f64();
            let limit = self.noise_max + Metres(self.speed_max.value() * seconds);
            let change = |k: usize| (place[k] - last[k]).abs();
            let seen = change(0).max(change(1));
            if seen > limit {
                let (seen, limit) = (seen.value(), limit.value());
                return Err(Trouble::Jumped { seen, limit });
            }
        }
        self.last = Some((at, place));
        Ok(())
    }
}
