//! Whether a move is corrected.

/// Whether a move is corrected by the active calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Correction {
    /// The drive is sent the target as it is.
    Off,
    /// The drive is sent the set-point that makes the stage arrive at the target.
    On,
}
