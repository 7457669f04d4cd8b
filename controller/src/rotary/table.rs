//! The handle of one rotary axis.

use crate::handle::Core;
use crate::rotary::{RotaryConfig, TableInUse};

/// What is known about a rotary axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct RotaryMemory {
    /// The calibration in use.
    pub(crate) calibration: Option<TableInUse>,
    /// Where the plate was read last, in lines; `None` when somebody may have turned it since.
    pub(crate) plate_at: Option<f64>,
}

/// One rotary axis of a machine: its zero, its moves, its calibration and what they need to
/// remember. [`Machine::rotary`](crate::Machine::rotary) gives it.
pub struct RotaryTable<'m> {
    pub(crate) core: Core<'m>,
    pub(crate) axis: &'m str,
    pub(crate) config: &'m RotaryConfig,
    pub(crate) memory: &'m mut RotaryMemory,
}

impl<'m> RotaryTable<'m> {
    /// Its section of the configuration.
    pub const fn config(&self) -> &'m RotaryConfig {
        self.config
    }
}
