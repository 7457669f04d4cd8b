//! A machine that is connected, with what each kind remembers of it.

use core::ops::{Deref, DerefMut};

use drivers::transport::Transport;
use machine::kept_zero;

use crate::assemble;
use crate::config::{ConfigHash, Diagnostic, Loaded, MachineConfig, filled_in};
use crate::failure::Failure;
use crate::memories::Memories;
use crate::run;
use crate::store::RecordHead;

/// A machine that is connected. What every machine can do, [`machine::Machine`] does; what a kind
/// can do, its handle does, which lives no longer than one procedure: [`Machine::linear`],
/// [`Machine::rotary`], [`Machine::platform`], [`Machine::volumetric`].
pub struct Machine {
    pub(crate) core: machine::Machine,
    pub(crate) config: MachineConfig,
    pub(crate) config_hash: ConfigHash,
    pub(crate) memories: Memories,
    /// What the configuration has of an example.
    unfilled: Vec<Diagnostic>,
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
        let mut core = machine::Machine::new(assemble::parts(loaded), transport);
        let store = loaded.config.machine.store();
        kept_zero::keep(&mut core, store, loaded.text.as_str().to_owned());
        Self {
            core,
            config: loaded.config.clone(),
            config_hash: loaded.hash.clone(),
            memories: Memories::default(),
            unfilled: loaded.unfilled.clone(),
        }
    }

    /// [`machine::Machine::start`]; what was known of where things are is forgotten.
    ///
    /// # Errors
    /// When a device does not answer, is another one than configured, or refuses its set-up; before anything is
    /// sent, when the configuration has values that are marked as an example's ([`Loaded::unfilled`]).
    pub fn start(&mut self) -> Result<(), Failure> {
        filled_in(&self.unfilled)?;
        self.memories.each().for_each(|it| it.forget());
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
            machine::diagnose(&mut self.core, failure)
        })
    }

    /// Quick stop and disable on every axis that can still be reached. Never fails: it does
    /// what can be done, and the drives' own watch on our heartbeat does the rest.
    pub fn make_safe(&mut self) {
        self.core.make_safe();
        let memories = self.memories.each();
        memories.for_each(|it| it.interrupted_before_it_ends());
    }

    /// The configuration.
    pub const fn config(&self) -> &MachineConfig {
        &self.config
    }

    /// Of what a calibration depends on.
    pub const fn config_hash(&self) -> &ConfigHash {
        &self.config_hash
    }

    /// The head of a record without measurements, which says who this machine is.
    pub fn this_machine(&self, axis: &str) -> RecordHead {
        run::this_machine(&self.core, (&self.config, &self.config_hash), axis)
    }
}
