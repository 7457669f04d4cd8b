//! What a measuring run is made of.

use core::time::Duration;

use units::{Metres, MetresPerSecond};

/// What is measured, and how.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunPlan {
    /// The instrument's name.
    pub instrument: String,
    /// Where, increasing.
    pub targets: Vec<Metres>,
    /// How often each from each side.
    pub runs: u32,
    /// How far beyond the ends a run turns round, so that every target has its approach.
    pub overrun: Metres,
    /// How long the stage stands before it is read.
    pub settle: Duration,
    /// How many readings are averaged.
    pub average_samples: u32,
    /// Largest relative difference of instrument and encoder believed, where it is judged.
    pub scale_limit_ppm: f64,
    /// How far the datum may have drifted at the end of each run; `None` for any distance.
    pub closure_limit: Option<Metres>,
}

impl RunPlan {
    /// What it comes to when the axis moves with `speed`.
    pub(crate) fn planned(&self, speed: MetresPerSecond) -> PlannedRun {
        let (first, last) = match self.targets.as_slice() {
            [first, .., last] => (*first, *last),
            _ => (Metres::ZERO, Metres::ZERO),
        };
        let runs = f64::from(self.runs);
        let travel = (last - first + self.overrun * 2.0) * (2.0 * runs);
        let points = 2 * u64::from(self.runs) * self.targets.len() as u64;
        let ways = travel.value() / speed.value();
        let standing = self.settle.as_secs_f64() * points as f64;
        PlannedRun {
            points,
            travel,
            at_least: Duration::try_from_secs_f64(ways + standing).unwrap_or_default(),
        }
    }
}

/// What a measuring run will do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedRun {
    /// How many points it measures.
    pub points: u64,
    /// How far the axis goes from the first of them to the last.
    pub travel: Metres,
    /// How long that takes at least: the ways at the usual speed, and standing.
    pub at_least: Duration,
}
