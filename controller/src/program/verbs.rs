//! What each kind of machine does for the verbs of the cycle.

use super::output::{Ended, Output};
use super::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs};

/// The verbs of one kind.
pub(crate) struct Verbs {
    pub(crate) zero: fn(&AxisArgs, Output) -> Ended,
    pub(crate) calibrate: fn(&CalibrateArgs, Output) -> Ended,
    pub(crate) verify: fn(&VerifyArgs, Output) -> Ended,
    pub(crate) move_to: fn(&MoveArgs, Output) -> Ended,
}
