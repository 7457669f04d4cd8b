//! What a drive latches: index pulses of its encoder and edges at its fast input.

use units::Time;

/// A pulse that the encoder gave at its index mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexPulse {
    /// The count at the mark, in the encoder's present counting.
    pub count: i64,
    /// How many pulses there have been since the encoder was powered: a new one has a new number.
    pub number: u64,
}

/// An edge at a fast input, with what a drive latches at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProbeEdge {
    /// When.
    pub at: Time,
    /// From low to high.
    pub rising: bool,
    /// The encoder's count at that moment.
    pub count: i64,
}
