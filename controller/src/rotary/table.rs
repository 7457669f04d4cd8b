//! The handle of one rotary axis.

use crate::connected::Machine;
use crate::failure::Failure;
use crate::handle::{Core, no_such_axis};
use crate::memories::Memory;
use crate::rotary::{RotaryConfig, TableInUse};

/// What is known about a rotary axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct RotaryMemory {
    /// The calibration in use.
    pub(crate) calibration: Option<TableInUse>,
    /// Where the plate was read last, in lines; `None` when somebody may have turned it since.
    pub(crate) plate_at: Option<f64>,
}

impl Memory for RotaryMemory {}

/// One rotary axis of a machine: its zero, its moves, its calibration and what they need to
/// remember. [`Machine::rotary`](crate::Machine::rotary) gives it.
pub struct RotaryTable<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) axis: &'m str,
    pub(crate) config: &'m RotaryConfig,
    pub(crate) memory: &'m mut RotaryMemory,
}

impl Machine {
    /// The rotary axis `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary(&mut self, axis: &str) -> Result<RotaryTable<'_>, Failure> {
        let (core, memories) = Core::of(self);
        let Some((axis, config)) = core.config.rotary.get_key_value(axis) else {
            return Err(no_such_axis(axis, &core.devices().rotary_names()));
        };
        Ok(RotaryTable {
            memory: memories.of(axis, RotaryMemory::default),
            core,
            axis,
            config,
        })
    }
}

impl<'m> RotaryTable<'m> {
    /// Its section of the configuration.
    pub const fn config(&self) -> &'m RotaryConfig {
        self.config
    }
}
