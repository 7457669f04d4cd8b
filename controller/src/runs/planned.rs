//! What a run will take.

use core::time::Duration;

use units::{Metres, Radians};

/// How far something goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Travel {
    /// Along a way.
    Length(Metres),
    /// Round and round.
    Angle(Radians),
}

/// What a run will do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planned {
    /// How many points are measured.
    pub points: u64,
    /// How far the axis goes for them, where that is known.
    pub travel: Option<Travel>,
    /// How long that takes at least, without becoming warm.
    pub at_least: Duration,
    /// What a person will be asked, in this order.
    pub asks: Vec<String>,
}
