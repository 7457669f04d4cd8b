//! Ends of motions and runs.

use super::{MotionView, RunView};

/// Something that comes to an end, which is then kept.
pub(crate) trait Ending {
    /// Whether it has ended.
    fn has_ended(&self) -> bool;

    /// Whether its end waits for the disk.
    fn waits_for_disk(&self) -> bool;
}

impl Ending for MotionView {
    fn has_ended(&self) -> bool {
        self.state.is_end()
    }

    fn waits_for_disk(&self) -> bool {
        self.kept == Some(false)
    }
}

impl Ending for RunView {
    fn has_ended(&self) -> bool {
        self.state.is_end()
    }

    fn waits_for_disk(&self) -> bool {
        self.kept == Some(false)
    }
}
