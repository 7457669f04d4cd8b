//! The handle of one linear axis.

use compensator::budget::AxisBudget;
use compensator::error_table::Compensation;
use units::Metres;

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
    /// How uncertain the calibration in use is, where it says so.
    pub(crate) budget: Option<AxisBudget>,
    /// Standard uncertainty of the zero that was found last.
    pub(crate) zero: Option<Metres>,
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

    /// Uses `compensation` (or none) for every move from now on; how uncertain it is, is then not known.
    pub fn set_compensation(&mut self, compensation: Option<Compensation>) {
        self.memory.compensation = compensation;
        self.memory.budget = None;
    }

    /// Uses a calibration for every move from now on.
    pub(crate) fn use_calibration(
        &mut self,
        compensation: Compensation,
        budget: Option<AxisBudget>,
    ) {
        self.memory.compensation = Some(compensation);
        self.memory.budget = budget;
    }
}
