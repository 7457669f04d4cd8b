//! What a run will take.

use core::time::Duration;
use std::collections::BTreeMap;

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
    /// By name, the share of each CAN bus that frames take meanwhile, 0 to 1.
    pub bus_load: BTreeMap<String, f64>,
}

/// How long a machine stands that stands so long at each of so many points.
pub(crate) fn standing(at_each: Duration, points: u64) -> Duration {
    at_each.saturating_mul(u32::try_from(points).unwrap_or(u32::MAX))
}
