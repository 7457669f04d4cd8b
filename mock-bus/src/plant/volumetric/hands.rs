//! What hands and faults do to the three axes of a plant; a machine without them has nothing of it.

use super::{BeamTrouble, LineSetUp, Volumetric};
use crate::plant::Plant;

impl Plant {
    /// Somebody mounts a target on the tool of three axes and sets a laser up along a line that
    /// begins where the machine stands, a little off as ever.
    pub fn set_up_line(&mut self, set_up: &LineSetUp) {
        let now = self.now;
        if let Some(volumetric) = self.machine.of_mut::<Volumetric>() {
            volumetric.set_up_line(set_up, now);
        }
    }

    /// Somebody takes laser and target away again.
    pub fn take_line_away(&mut self) {
        if let Some(volumetric) = self.machine.of_mut::<Volumetric>() {
            volumetric.take_line_away();
        }
    }

    /// What goes wrong with the reference beam along `axis`, or is mended.
    pub(crate) fn trouble_beam(&mut self, axis: usize, change: impl FnOnce(&mut BeamTrouble)) {
        let volumetric = self.machine.of_mut::<Volumetric>();
        if let Some(trouble) = volumetric.and_then(|it| it.trouble_mut(axis)) {
            change(trouble);
        }
    }
}
