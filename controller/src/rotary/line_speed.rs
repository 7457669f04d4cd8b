//! How fast a table may turn over the lines of a plate.

use drivers::device::SYNCS_PER_EDGE;

/// Of the nominal spacing of lines, what is left between the nearest two of them.
pub(super) const SPACING_SHARE: f64 = 0.75;

/// The fastest turn at which every line of a plate is read: the drive's latch keeps one position,
/// which comes with the next SYNC, and that one may be lost or late.
pub(crate) fn speed_max(lines: u32, sync_period_ms: f64) -> f64 {
    360.0 / f64::from(lines) * SPACING_SHARE / (SYNCS_PER_EDGE * sync_period_ms * 1e-3)
}
