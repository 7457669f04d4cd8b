//! The handle of one linear axis.

use compensator::budget::AxisBudget;
use compensator::error_table::Compensation;
use units::Metres;

use crate::config::AxisConfig;
use crate::handle::Core;
use crate::linear::{Course, Datum, RunPlan};

/// What is known about a linear axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// What corrects its moves.
    pub(crate) course: Course,
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
        self.memory.course.compensation.as_ref()
    }

    /// What corrects its moves now, for whoever begins moves without waiting for them.
    pub fn course(&self) -> Course {
        Course {
            arrives_over: self.approach_length(),
            ..self.memory.course.clone()
        }
    }

    /// Uses `compensation` (or none) for every move from now on; how uncertain it is, is then not known.
    pub fn set_compensation(&mut self, compensation: Option<Compensation>) {
        self.memory.course.compensation = compensation;
        self.memory.course.budget = None;
        self.memory.course.approach = None;
    }

    /// Uses a calibration for every move from now on.
    pub(crate) fn use_calibration(&mut self, calibration: Usable) {
        self.memory.course.compensation = Some(calibration.compensation);
        self.memory.course.budget = calibration.budget;
        self.memory.course.approach = calibration.approach;
    }
}

/// A calibration that was found to belong to the stage and to keep its limits.
pub(crate) struct Usable {
    pub(crate) compensation: Compensation,
    pub(crate) budget: Option<AxisBudget>,
    /// Over which distance its positions were approached, where that was always the same.
    pub(crate) approach: Option<Metres>,
}
