//! What a program remembers of one linear axis.

use crate::linear::{Course, Datum, RunPlan};
use crate::memories::Memory;

/// What is known about a linear axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// What corrects its moves.
    pub(crate) course: Course,
    /// What was measured last, and how lengths were corrected since its datum.
    pub(crate) datum: Option<(RunPlan, Datum)>,
}

impl Memory for AxisMemory {}
