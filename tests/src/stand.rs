//! A machine on any bus: what the tests that run the same on every bus are written against.

use core::time::Duration;

use drivers::transport::Transport;
use machine::records::Store;
use mock_bus::simulation::Simulation;
use truestage::emulated::HallDrift;
use truestage::{Failure, Machine};
use units::Metres;

use crate::emulator::{Emulator, Setup};
use crate::rig::{Rig, rigs};

/// The mains is off, and the drives boot, for less than this.
const POWER_OFF: Duration = Duration::from_secs(1);

/// A machine on one rig with everything a test looks at.
pub struct Stand {
    /// The controller's side.
    pub machine: Machine,
    /// Where calibrations and runs go.
    pub store: Store,
    /// The emulator's side.
    pub emulator: Emulator,
}

impl Stand {
    /// The machine of `setup` on `rig`, not started yet.
    ///
    /// # Panics
    /// When it cannot be brought up.
    pub fn new(rig: Rig, setup: &Setup) -> Self {
        Self::wrapped(rig, setup, |transport| transport)
    }

    /// The same, with the transport wrapped (recorded, say).
    ///
    /// # Panics
    /// When it cannot be brought up.
    pub fn wrapped(
        rig: Rig,
        setup: &Setup,
        wrap: impl FnOnce(Box<dyn Transport>) -> Box<dyn Transport>,
    ) -> Self {
        let emulator = Emulator::new(rig, setup);
        let name = &emulator.loaded.config.machine.name;
        Self {
            machine: Machine::new(&emulator.loaded, wrap(emulator.transport())),
            store: truestage::for_tests::store_in(emulator.folder.path(), name),
            emulator,
        }
    }

    /// Which rig it is on.
    pub const fn rig(&self) -> Rig {
        self.emulator.rig
    }

    /// The emulator's side once the controller's has gone: what that said last has been heard.
    pub fn gone(self) -> Emulator {
        drop(self.machine);
        self.emulator
    }

    /// Looks at the simulated machine, or meddles with it.
    pub fn simulation<R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Simulation) -> R + Send + 'static,
    ) -> R {
        self.emulator.simulation(work)
    }

    /// Where the point of the stage truly is.
    pub fn true_position(&self) -> Metres {
        self.simulation(|simulation| simulation.truth().position())
    }

    /// Lets the machine live for `span`.
    ///
    /// # Errors
    /// Whatever stops it.
    pub fn live(&mut self, span: Duration) -> Result<(), Failure> {
        let until = self.machine.now() + span;
        Ok(self.machine.run_until(until)?)
    }

    /// The machine is shut down, its mains goes off and on while the Hall sensors drift, and
    /// it is started again.
    ///
    /// # Errors
    /// What shutting down and starting return.
    pub fn power_cycle(&mut self, drift: HallDrift) -> Result<(), Failure> {
        self.machine.shut_down()?;
        self.simulation(move |simulation| simulation.power_cycle(drift));
        self.live(POWER_OFF)?;
        self.machine.start()
    }
}

/// Runs `procedure` with the started machine of `setup` on every rig of this run, and shuts
/// the machine down. Whatever the rig, the same frames pass at the same times.
///
/// # Panics
/// When anything returns a failure, or the log is another one; the rig is named.
pub fn on_every_rig(setup: &Setup, procedure: impl Fn(&mut Stand) -> Result<(), Failure>) {
    let mut first = None;
    for rig in rigs() {
        let mut stand = Stand::new(rig, setup);
        let result = stand
            .machine
            .start()
            .and_then(|()| procedure(&mut stand))
            .and_then(|()| stand.machine.shut_down());
        if let Err(failure) = result {
            stand.machine.make_safe();
            let counters = stand.machine.devices().counters();
            panic!("{rig:?}: {failure}\n{counters:?}");
        }
        let emulator = stand.gone();
        let hash = emulator.simulation(|simulation| simulation.log_hash());
        if !setup.is_by_the_wall() {
            assert_eq!(*first.get_or_insert(hash), hash, "{rig:?}: another log");
        }
    }
}
