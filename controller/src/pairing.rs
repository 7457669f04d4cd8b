//! Which position and which voltages belong together.

use core::time::Duration;

use units::Time;

/// Of the time between two samples, so much may lie between a position and the voltages that belong to it.
const WINDOW: f64 = 0.6;

/// Pairs the newest position with the newest voltages, each of them once.
///
/// On CAN both are sampled at one SYNC and arrive together; members of different SYNC periods lie further apart
/// than the window and are never paired.
pub(crate) struct Pairing {
    window: Duration,
    used_position: Time,
    used_voltages: Time,
}

impl Pairing {
    /// Of samples that come so often.
    pub(crate) fn of(sampling: Duration) -> Self {
        Self {
            window: Self::window_of(sampling),
            used_position: Time::ZERO,
            used_voltages: Time::ZERO,
        }
    }

    /// How far a position and voltages of such samples may lie apart.
    pub(crate) fn window_of(sampling: Duration) -> Duration {
        sampling.mul_f64(WINDOW)
    }

    /// Whether a position and voltages that came then belong together and are new; they are used then.
    pub(crate) fn is_pair(&mut self, position: Time, voltages: Time) -> bool {
        let is_new = position > self.used_position && voltages > self.used_voltages;
        let apart = position.since(voltages).max(voltages.since(position));
        let is_pair = is_new && apart <= self.window;
        if is_pair {
            self.used_position = position;
            self.used_voltages = voltages;
        }
        is_pair
    }
}
