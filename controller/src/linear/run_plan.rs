//! What a measuring run is made of.

use core::time::Duration;

use units::Metres;

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
