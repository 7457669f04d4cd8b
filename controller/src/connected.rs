//! A machine that is connected, with what each kind remembers of it.

use core::ops::{Deref, DerefMut};
use std::collections::BTreeMap;

use drivers::transport::Transport;
use machine::engine::TableCorrection;

use crate::assemble;
use crate::config::{ConfigHash, Loaded, MachineConfig};
use crate::failure::Failure;
use crate::handle::Core;
use crate::linear::{self, AxisMemory, LinearStage};
use crate::platform::{AlignmentPlatform, PlatformFailure, PlatformState};
use crate::rotary::{RotaryMemory, RotaryTable};
use crate::run;
use crate::store::RecordHead;
use crate::volumetric::{VolumetricFailure, WorkVolume};

/// A machine that is connected. What every machine can do, [`machine::Machine`] does; what a kind
/// can do, its handle does, which lives no longer than one procedure: [`Machine::linear`],
/// [`Machine::rotary`], [`Machine::platform`], [`Machine::volumetric`].
pub struct Machine {
    core: machine::Machine,
    config: MachineConfig,
    config_hash: ConfigHash,
    linear: BTreeMap<String, AxisMemory>,
    rotary: BTreeMap<String, RotaryMemory>,
    platform: Option<PlatformState>,
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
            linear: BTreeMap::new(),
            rotary: BTreeMap::new(),
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

    /// The linear axis `axis`, calibrated by itself.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn linear(&mut self, axis: &str) -> Result<LinearStage<'_>, Failure> {
        let Some((axis, config)) = self.config.axis.get_key_value(axis) else {
            return Err(no_such_axis(axis, &self.core.devices().axis_names()));
        };
        let memory = self.linear.entry(axis.clone()).or_default();
        Ok(LinearStage {
            core: Core::new(&mut self.core, &self.config, &self.config_hash),
            axis,
            config,
            memory,
        })
    }

    /// The rotary axis `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary(&mut self, axis: &str) -> Result<RotaryTable<'_>, Failure> {
        let Some((axis, config)) = self.config.rotary.get_key_value(axis) else {
            return Err(no_such_axis(axis, &self.core.devices().rotary_names()));
        };
        let memory = self.rotary.entry(axis.clone()).or_default();
        Ok(RotaryTable {
            core: Core::new(&mut self.core, &self.config, &self.config_hash),
            axis,
            config,
            memory,
        })
    }

    /// The alignment platform that the axes move.
    ///
    /// # Errors
    /// When they move none.
    pub fn platform(&mut self) -> Result<AlignmentPlatform<'_>, Failure> {
        let (config, state) = (self.config.platform.as_ref())
            .zip(self.platform.as_mut())
            .ok_or(PlatformFailure::None)?;
        Ok(AlignmentPlatform {
            core: Core::new(&mut self.core, &self.config, &self.config_hash),
            config,
            state,
        })
    }

    /// The work volume of the three axes.
    ///
    /// # Errors
    /// When its errors are not corrected.
    pub fn volumetric(&mut self) -> Result<WorkVolume<'_>, Failure> {
        let config = self
            .config
            .volumetric
            .as_ref()
            .ok_or(VolumetricFailure::None)?;
        Ok(WorkVolume {
            core: Core::new(&mut self.core, &self.config, &self.config_hash),
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
        linear::table_correction(&self.core, &self.linear, axes)
    }

    /// The head of a record without measurements, which says who this machine is.
    pub fn this_machine(&self, axis: &str) -> RecordHead {
        run::this_machine(&self.core, (&self.config, &self.config_hash), axis)
    }
}

fn no_such_axis(axis: &str, known: &[String]) -> Failure {
    Failure::Machine(machine::Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: known.join(", "),
    })
}
