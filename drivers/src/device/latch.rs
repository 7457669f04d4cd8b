//! Positions that a drive latches in hardware at the edges of an input: a touch probe, a line
//! detector.

use units::{Approach, Coordinate, Counts, Metres, Radians, Time};

use super::{Axis, DeviceError, ServoDrive};

/// Between two edges there must be time for so many SYNCs: one that reads the position, and one
/// that may be lost or late.
pub const SYNCS_PER_EDGE: f64 = 2.0;

/// A drive that latches its axis's position at the edges of an input.
///
/// The latched position is read at each SYNC, so at most one edge may fall between two SYNCs;
/// a drive that counts edges tells when there were more.
pub trait PositionLatch<Q: Coordinate = Metres>: ServoDrive {
    /// Begins a command; it is refused while another one runs.
    /// [`Device::poll_outcome`](super::Device::poll_outcome) says when it is done, and how.
    fn latch(&mut self, now: Time, command: LatchCommand<Q>);

    /// Whether edges are being latched.
    fn is_latching(&self) -> bool;

    /// The fastest that the axis may move over edges so far apart for every one to be read,
    /// one lost or late frame in between included.
    fn latch_speed_max(&self, spacing: Q) -> Q::Speed;

    /// Whether a move at `speed` would let every edge be read, edges being `spacing` apart.
    ///
    /// # Errors
    /// When it would not, with the speed that would.
    fn check_latch_speed(&self, spacing: Q, speed: Q::Speed) -> Result<(), DeviceError>;

    /// The next latched position, in the order of the edges.
    fn poll_latched(&mut self) -> Option<Latched<Q>>;
}

/// What a latch can be told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LatchCommand<Q: Coordinate = Metres> {
    /// Latch from now on, and forget what was latched before; needs an axis that stands. Done
    /// when the drive says it is armed. Until it is disarmed, moves too fast for `spacing` are refused.
    Arm {
        /// How many edges.
        repeat: Repeat,
        /// The smallest distance between two edges.
        spacing: Q,
    },
    /// Latch no more. What was latched before can still be polled.
    Disarm,
}

/// How many edges are latched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeat {
    /// The first one; arm again for the next.
    Once,
    /// Every one.
    Continuous,
}

/// A position at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latched<Q: Coordinate = Metres> {
    /// When it was read: at most a SYNC period after the edge, unless frames were lost.
    pub at: Time,
    /// The encoder at the edge, as the drive counts.
    pub counts: Counts,
    /// The same in metres or radians, drive coordinates.
    pub position: Q,
    /// How many edges came between the latched position before and this one and were
    /// overwritten before they were read; always 0 on a drive that does not count edges.
    pub missed: u32,
}

/// A rotary axis that turns on and on, with a latch: what a table needs to be calibrated.
pub trait RotaryAxis: Axis<Radians> + PositionLatch<Radians> {
    /// The last position in this direction that the drive can be sent to from where it is; the angle counts on over the
    /// turns. `None` before its first sample.
    fn last_position(&self, way: Approach) -> Option<Radians>;
}
