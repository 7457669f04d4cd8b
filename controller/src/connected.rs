//! A machine that is connected, with what each kind remembers of it.

use core::ops::{Deref, DerefMut};
use std::collections::BTreeMap;

use compensator::error_table::Compensation;
use drivers::transport::Transport;

use crate::assemble;
use crate::config::{AxisConfig, ConfigHash, Loaded, MachineConfig};
use crate::failure::Failure;
use crate::linear::{Datum, RunPlan};
use crate::platform::PlatformState;
use crate::rotary::TableInUse;

/// What is known about a linear axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct AxisMemory {
    /// The calibration in use.
    pub(crate) compensation: Option<Compensation>,
    /// What was measured last, and how lengths were corrected since its datum.
    pub(crate) datum: Option<(RunPlan, Datum)>,
}

/// What is known about a rotary axis beyond what its drive says.
#[derive(Default)]
pub(crate) struct RotaryMemory {
    /// The calibration in use.
    pub(crate) calibration: Option<TableInUse>,
    /// Where the plate was read last, in lines; `None` when somebody may have turned it since.
    pub(crate) plate_at: Option<f64>,
}

/// A machine that is connected. What every machine can do, [`machine::Machine`] does; the
/// procedures of each kind are methods of this one.
pub struct Machine {
    pub(crate) core: machine::Machine,
    pub(crate) config: MachineConfig,
    pub(crate) config_hash: ConfigHash,
    pub(crate) memory: BTreeMap<String, AxisMemory>,
    pub(crate) rotary_memory: BTreeMap<String, RotaryMemory>,
    pub(crate) platform: Option<PlatformState>,
}

impl Deref for Machine {
    type Target = machine::Machine;

    fn deref(&self) -> &machine::Machine {
        &self.core
    }
}

impl DerefMut for Machine {
    fn deref_mut(&mut self) -> &mut machine::Machine {
        &mut self.core
    }
}

impl Machine {
    /// A machine over `transport`, whose ports are numbered as [`assemble::ports`] says.
    /// Nothing is sent yet.
    pub fn new(loaded: &Loaded, transport: Box<dyn Transport>) -> Self {
        let config = loaded.config.clone();
        Self {
            core: machine::Machine::new(assemble::parts(loaded), transport),
            memory: BTreeMap::new(),
            rotary_memory: BTreeMap::new(),
            platform: PlatformState::of(&config),
            config_hash: loaded.hash.clone(),
            config,
        }
    }

    /// [`machine::Machine::start`]; what was known of where things are is forgotten.
    ///
    /// # Errors
    /// When a device does not answer, is another one than configured, or refuses its set-up.
    pub fn start(&mut self) -> Result<(), Failure> {
        if let Some(platform) = &mut self.platform {
            platform.forget();
        }
        Ok(self.core.start()?)
    }

    /// [`machine::Machine::shut_down`].
    ///
    /// # Errors
    /// When an axis cannot be disabled; the others are tried all the same.
    pub fn shut_down(&mut self) -> Result<(), Failure> {
        Ok(self.core.shut_down()?)
    }

    /// Runs `procedure`; when it fails, stops and disables every axis before the failure is
    /// returned.
    ///
    /// # Errors
    /// What `procedure` returns.
    pub fn guarded<R>(
        &mut self,
        procedure: impl FnOnce(&mut Self) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let result = procedure(self);
        result.map_err(|failure| {
            // Why it failed must be asked before stopping it takes its time.
            let failure = self.core.explain(failure);
            self.make_safe();
            failure
        })
    }

    /// Quick stop and disable on every axis that can still be reached. Never fails: it does
    /// what can be done, and the drives' own watch on our heartbeat does the rest.
    pub fn make_safe(&mut self) {
        self.core.make_safe();
        if let Some(platform) = &mut self.platform {
            platform.interrupted_before_it_ends();
        }
    }

    /// The configuration.
    pub const fn config(&self) -> &MachineConfig {
        &self.config
    }

    /// Of what a calibration depends on.
    pub const fn config_hash(&self) -> &ConfigHash {
        &self.config_hash
    }

    /// The configuration of `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn axis_config(&self, axis: &str) -> Result<&AxisConfig, Failure> {
        let config = self.config.axis.get(axis);
        config.ok_or_else(|| {
            Failure::Machine(machine::Failure::NoSuchAxis {
                axis: axis.to_owned(),
                known: self.axis_names().join(", "),
            })
        })
    }

    /// The calibration `axis` uses now.
    pub fn compensation(&self, axis: &str) -> Option<&Compensation> {
        self.memory.get(axis)?.compensation.as_ref()
    }

    /// Uses `compensation` (or none) for every move of `axis` from now on.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn set_compensation(
        &mut self,
        axis: &str,
        compensation: Option<Compensation>,
    ) -> Result<(), Failure> {
        self.axis_config(axis)?;
        self.remember(axis).compensation = compensation;
        Ok(())
    }

    pub(crate) fn remember(&mut self, axis: &str) -> &mut AxisMemory {
        self.memory.entry(axis.to_owned()).or_default()
    }
}
