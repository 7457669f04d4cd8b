//! What a program remembers of one linear axis.

use units::Metres;

use crate::linear::{Course, Datum, RunPlan};
use crate::memories::Memory;

/// What is known about a linear axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// What corrects its moves.
    pub(crate) course: Course,
    /// What was measured last, and how lengths were corrected since its datum.
    pub(crate) datum: Option<(RunPlan, Datum)>,
    /// The calibration that was put into use and that nothing has verified yet.
    pub(crate) untried: Option<Untried>,
}

/// A calibration that was just made.
#[derive(Clone, Debug)]
pub(crate) struct Untried {
    pub(crate) id: String,
    /// A of what it was made from, the axis as found; `None` where that were too few runs.
    pub(crate) as_found: Option<Metres>,
}

impl Memory for AxisMemory {}
