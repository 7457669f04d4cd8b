//! The handle of one linear axis.

use compensator::error_table::Compensation;

use crate::config::AxisConfig;
use crate::handle::Core;
use crate::linear::{Datum, RunPlan};

/// What is known about a linear axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// The calibration in use.
    pub(crate) compensation: Option<Compensation>,
    /// What was measured last, and how lengths were corrected since its datum.
    pub(crate) datum: Option<(RunPlan, Datum)>,
}

/// One linear axis of a machine: its zero, its moves, its calibration and what they need to
/// remember. [`Machine::linear`](crate::Machine::linear) gives it.
pub struct LinearStage<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) axis: &'m str,
    pub(crate) config: &'m AxisConfig,
    pub(crate) memory: &'m mut AxisMemory,
}

impl<'m> LinearStage<'m> {
    /// Its section of the configuration.
    pub const fn config(&self) -> &'m AxisConfig {
        self.config
    }
}

impl LinearStage<'_> {
    /// The calibration in use.
    pub fn compensation(&self) -> Option<&Compensation> {
        self.memory.compensation.as_ref()
    }

    /// Uses `compensation` (or none) for every move from now on.
    pub fn set_compensation(&mut self, compensation: Option<Compensation>) {
        self.memory.compensation = compensation;
    }
}
