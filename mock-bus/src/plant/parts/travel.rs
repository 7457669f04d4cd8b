//! The true motion of one driven direction, for judges only.

use super::servo::GRID_NS;

/// Metres, or radians, of encoder travel since a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travelled {
    /// Where the mark was set.
    pub from: f64,
    /// The lowest position.
    pub low: f64,
    /// The highest position.
    pub high: f64,
    /// The largest speed of a quarter of a millisecond, per second.
    pub speed_max: f64,
}

/// The true motion of one driven direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Encoder travel from the scale's own zero, in metres or radians.
    pub position: f64,
    /// The same per second.
    pub speed: f64,
    /// What it has done since it was marked.
    pub since_mark: Travelled,
}

impl From<f64> for Travelled {
    fn from(position: f64) -> Self {
        Self {
            from: position,
            low: position,
            high: position,
            speed_max: 0.0,
        }
    }
}

impl Travelled {
    /// One grid step led from one position to another.
    pub(in crate::plant) fn pass(&mut self, from: f64, to: f64) {
        const GRID_S: f64 = GRID_NS as f64 * 1e-9;
        self.low = self.low.min(to);
        self.high = self.high.max(to);
        self.speed_max = self.speed_max.max((to - from).abs() / GRID_S);
    }
}
