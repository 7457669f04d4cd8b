//! A machine on any bus: what the tests that run the same on every bus are written against.

use core::time::Duration;
use std::sync::{Mutex, MutexGuard, PoisonError};

use mock_bus::simulation::Simulation;
use truestage::config::Loaded;
use truestage::emulated::{Emulated, EmulatedOnPtys, HallDrift};
use truestage::{Failure, Machine, Store, ports};
use units::Metres;

use crate::rig::{EMULATED, Rig, machine_config, rigs};

/// The interface that `RIG=vcan` runs on; made by whoever starts the tests.
pub const INTERFACE: &str = "vcan0";
/// The mains is off, and the drives boot, for less than this.
const POWER_OFF: Duration = Duration::from_secs(1);

/// Machines that live in real time share the processor, and on SocketCAN the interface: one
/// after the other.
static REAL_TIME: Mutex<()> = Mutex::new(());

/// What a machine is made from: seed, configuration, description of the emulation.
#[derive(Clone, Debug)]
pub struct Setup {
    seed: u64,
    machine: Vec<(String, String)>,
    emulated: Vec<(String, String)>,
}

impl Setup {
    /// The shipped machine with the noise and errors of `seed`.
    pub const fn new(seed: u64) -> Self {
        Self {
            seed,
            machine: Vec::new(),
            emulated: Vec::new(),
        }
    }

    /// With `from` replaced by `to` in the machine's configuration.
    #[must_use]
    pub fn machine(mut self, from: &str, to: &str) -> Self {
        self.machine.push((from.to_owned(), to.to_owned()));
        self
    }

    /// With `from` replaced by `to` in the description of the emulation.
    #[must_use]
    pub fn emulated(mut self, from: &str, to: &str) -> Self {
        self.emulated.push((from.to_owned(), to.to_owned()));
        self
    }
}

/// # Panics
/// When there is nothing to replace: the text has changed and the test has not.
fn replace(text: String, changes: &[(String, String)]) -> String {
    changes.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the text");
        text.replace(from, to)
    })
}

#[expect(clippy::large_enum_variant, reason = "one a test")]
enum Emulation {
    InProcess(Emulated),
    Running(EmulatedOnPtys),
}

/// A machine on one rig with everything a test looks at.
pub struct Stand {
    /// Where it is.
    pub rig: Rig,
    /// The controller's side.
    pub machine: Machine,
    /// Where calibrations and runs go.
    pub store: Store,
    /// What the controller was told.
    pub loaded: Loaded,
    emulation: Emulation,
    /// Gone when dropped.
    pub folder: tempfile::TempDir,
    _turn: Option<MutexGuard<'static, ()>>,
}

impl Stand {
    /// The machine of `setup` on `rig`, not started yet.
    ///
    /// # Panics
    /// When it cannot be brought up.
    pub fn new(rig: Rig, setup: &Setup) -> Self {
        Self::on(rig, setup, INTERFACE)
    }

    /// The same with another interface for SocketCAN.
    ///
    /// # Panics
    /// When it cannot be brought up.
    pub fn on(rig: Rig, setup: &Setup, interface: &str) -> Self {
        let turn = (rig != Rig::InProcess)
            .then(|| REAL_TIME.lock().unwrap_or_else(PoisonError::into_inner));
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let mut loaded = machine_config(folder.path(), |text| replace(text, &setup.machine));
        let text = replace(EMULATED.to_owned(), &setup.emulated);
        let (speed, seed) = (rig.speed(), setup.seed);
        let emulation = match rig {
            Rig::InProcess => Emulated::new(&text, seed, &loaded.config).map(Emulation::InProcess),
            Rig::Pty => EmulatedOnPtys::start(&text, seed, speed).map(Emulation::Running),
            Rig::Vcan => EmulatedOnPtys::start_on_socketcan(&text, seed, speed, interface)
                .map(Emulation::Running),
        };
        let emulation = emulation.unwrap_or_else(|error| panic!("{rig:?}: {error}"));
        loaded.patience = ports::patience(speed);
        let machine = connect(&loaded, &emulation, speed)
            .unwrap_or_else(|failure| panic!("{rig:?}: {failure}"));
        let store = Store::new(folder.path(), &loaded.config.machine.name);
        Self {
            rig,
            machine,
            store,
            loaded,
            emulation,
            folder,
            _turn: turn,
        }
    }

    /// Looks at the simulated machine, or meddles with it.
    ///
    /// # Panics
    /// When the emulator has ended.
    pub fn simulation<R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Simulation) -> R + Send + 'static,
    ) -> R {
        match &self.emulation {
            Emulation::InProcess(emulated) => work(&mut emulated.simulation_mut()),
            Emulation::Running(emulated) => {
                let result = emulated.running().with(work);
                result.unwrap_or_else(|error| panic!("{error}"))
            }
        }
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
        self.machine.run_until(until)
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

fn connect(loaded: &Loaded, emulation: &Emulation, speed: f64) -> Result<Machine, Failure> {
    match emulation {
        Emulation::InProcess(emulated) => Ok(Machine::new(loaded, Box::new(emulated.transport()))),
        Emulation::Running(emulated) => {
            let overrides = emulated.overrides(&loaded.config)?;
            let live = ports::open(&loaded.config, &overrides, ports::Use::Measurement, speed)?;
            Ok(Machine::new(loaded, Box::new(live)))
        }
    }
}

/// Runs `procedure` with the started machine of `setup` on every rig of this run, and shuts
/// the machine down.
///
/// # Panics
/// When anything returns a failure; the rig is named.
pub fn on_every_rig(setup: &Setup, procedure: impl Fn(&mut Stand) -> Result<(), Failure>) {
    for rig in rigs() {
        let mut stand = Stand::new(rig, setup);
        let result = stand
            .machine
            .start()
            .and_then(|()| procedure(&mut stand))
            .and_then(|()| stand.machine.shut_down());
        if let Err(failure) = result {
            stand.machine.make_safe();
            let counters = stand.machine.counters();
            panic!("{rig:?}: {failure}\n{counters:?}");
        }
    }
}
