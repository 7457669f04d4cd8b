//! The handle of one linear axis.

use compensator::budget::AxisBudget;
use compensator::error_table::Compensation;
use machine::engine::TableCorrection;
use units::Metres;

use crate::config::{AxisConfig, MachineConfig};
use crate::connected::Machine;
use crate::failure::Failure;
use crate::handle::{Core, no_such_axis};
use crate::linear::earlier_zero::kept_since;
use crate::linear::memory::AxisMemory;
use crate::linear::{Course, GantryConfig, table_correction};

/// One linear axis of a machine: its zero, its moves, its calibration and what they need to
/// remember. [`Machine::linear`](crate::Machine::linear) gives it.
pub struct LinearStage<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) axis: &'m str,
    pub(crate) config: &'m AxisConfig,
    pub(crate) memory: &'m mut AxisMemory,
    /// What is remembered of the other side, where it is one of a gantry's.
    pub(super) other_side: Option<&'m mut AxisMemory>,
}

impl Machine {
    /// The linear axis `axis`, calibrated by itself.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn linear(&mut self, axis: &str) -> Result<LinearStage<'_>, Failure> {
        let (mut core, memories) = Core::of(self);
        let Some((axis, config)) = core.config.axis.get_key_value(axis) else {
            return Err(no_such_axis(axis, &core.devices().axis_names()));
        };
        let other = gantry_of(core.config, axis).map(|(_, gantry)| gantry.other_than(axis));
        let kept = kept_since(&mut core, memories, axis, config)?;
        let (memory, other_side) = match other {
            None => (memories.of(axis, AxisMemory::default), None),
            Some(other) => {
                let [own, other] = memories.both([axis.as_str(), other]);
                (own, Some(other))
            }
        };
        memory.course.zero = memory.course.zero.or(kept);
        Ok(LinearStage {
            memory,
            other_side,
            core,
            axis,
            config,
        })
    }

    /// What the calibrations that linear `axes` use ([`LinearStage::load_active`]) say, for an engine
    /// of these axes in this order.
    ///
    /// # Errors
    /// When there is no such axis, it is not configured for the engine, or its correction at full
    /// speed would change faster than `correction_rate_um_per_s`, or be larger than
    /// `correction_limit_um`: it would be cut off on the way.
    pub fn table_correction(&self, axes: &[&str]) -> Result<TableCorrection, Failure> {
        table_correction(&self.core, &self.memories, axes)
    }
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
            overrun: self.overrun(),
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

/// The gantry that `axis` is a side of, with its name.
pub(super) fn gantry_of<'a>(
    config: &'a MachineConfig,
    axis: &str,
) -> Option<(&'a str, &'a GantryConfig)> {
    let mut all = config.gantry.iter();
    let (name, gantry) = all.find(|(_, it)| it.axes.iter().any(|side| side == axis))?;
    Some((name.as_str(), gantry))
}

/// A calibration that was found to belong to the stage and to keep its limits.
pub(crate) struct Usable {
    pub(crate) compensation: Compensation,
    pub(crate) budget: Option<AxisBudget>,
    /// Over which distance its positions were approached, where that was always the same.
    pub(crate) approach: Option<Metres>,
}
