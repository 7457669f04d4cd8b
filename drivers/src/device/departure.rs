//! Departures of an axis from its motion envelope.

use core::fmt;

/// What an axis was asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// To hold its place.
    Hold,
    /// To move to a set-point.
    Motion,
    /// To search its home.
    Homing,
    /// To stop.
    Stop,
    /// To follow set-points.
    Follow,
}

impl fmt::Display for Asked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Hold => "to hold its place",
            Self::Motion => "to move to a set-point",
            Self::Homing => "to search its home",
            Self::Stop => "to stop",
            Self::Follow => "to follow set-points",
        })
    }
}

/// How an axis left its envelope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Departure {
    /// It is beyond `limit`.
    Place {
        asked: Asked,
        position: i64,
        limit: i64,
    },
    /// It moved at `seen` counts per second.
    Speed { asked: Asked, limit: f64, seen: f64 },
}
