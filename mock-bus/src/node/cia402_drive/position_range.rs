//! Positions that wrap at the ends of a range (0x607B), and which way a target is taken then
//! (0x60F2, bits 6 and 7).

use super::Drive;
use super::mechanism::Mechanism;

/// Bits 6 and 7 of 0x60F2: as on a linear axis, backwards only, forwards only, the shorter way.
const BACKWARDS: i64 = 1;
const FORWARDS: i64 = 2;
const SHORTEST: i64 = 3;

impl Drive {
    /// The lower end of the range and how many positions it has; `None` where positions count on.
    fn range(&self) -> Option<(i64, i64)> {
        let rotary = self.config.rotary.as_ref()?;
        let (low, high) = (self.server.get(0x607B, 1), self.server.get(0x607B, 2));
        let positions = high - low + i64::from(rotary.upper_limit_is_a_position);
        (high > low).then_some((low, positions))
    }

    /// A position as the drive shows it.
    pub(super) fn shown(&self, position: i64) -> i64 {
        match self.range() {
            Some((low, positions)) => low + (position - low).rem_euclid(positions),
            None => position,
        }
    }

    /// A position from the bus: on the turn that the axis is on, or in the 2³² counts it is in.
    pub(super) fn unwrapped(&self, raw: i64, m: &impl Mechanism) -> f64 {
        let actual = self.actual(m);
        let Some((_, positions)) = self.range() else {
            let turn = actual - i64::from(actual as i32);
            return (turn + raw) as f64;
        };
        let linear = actual - self.shown(actual) + self.shown(raw);
        let ahead = (linear - actual).rem_euclid(positions);
        let target = match self.get(0x60F2) >> 6 & 3 {
            BACKWARDS if ahead > 0 => actual + ahead - positions,
            FORWARDS => actual + ahead,
            SHORTEST if ahead > positions / 2 => actual + ahead - positions,
            SHORTEST => actual + ahead,
            _ => linear,
        };
        target as f64
    }
}
