//! True motions, for judges only.

use super::Simulation;
use crate::plant::Travel;

impl Simulation {
    /// A judge begins to watch the motion of `axis`.
    pub fn mark_travel(&mut self, axis: usize) {
        self.plant.mark_travel(axis);
    }

    /// The encoder of `axis`, in counts.
    pub fn encoder_counts(&self, axis: usize) -> i64 {
        self.plant.encoder_counts(axis)
    }

    /// Metres or radians of one count of `axis`.
    pub fn encoder_resolution(&self, axis: usize) -> f64 {
        self.plant.encoder_resolution(axis)
    }

    /// Returns the true motion of `axis` since it was marked.
    pub fn travel(&self, axis: usize) -> Option<Travel> {
        self.truth().travel(axis)
    }
}
