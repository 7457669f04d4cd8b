//! The emulated machine of a rig, and transports to it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use drivers::transport::Transport;
use mock_bus::simulation::Simulation;
use truestage::config::Loaded;
use truestage::emulated::{Emulated, EmulatedError, EmulatedOnPtys};
use truestage::ports;

use crate::four_screws::{four_cyclic_axes, with_fourth_drive};
use crate::rig::{Rig, shipped_config};
use crate::shipped::{LINEAR, MACHINE, ROTARY, Shipped, UVW, UVW_COPLEY, VOLUMETRIC};
use crate::stream::Watch;
use truestage::for_tests::Edit;

/// The interface that `RIG=vcan` runs on; made by whoever starts the tests.
pub const INTERFACE: &str = "vcan0";

/// Machines that live in real time share the processor, and on SocketCAN the interface: one
/// after the other.
static REAL_TIME: Mutex<()> = Mutex::new(());

/// What a machine is made from: seed, configuration, description of the emulation.
#[derive(Clone, Debug)]
pub struct Setup {
    shipped: Shipped,
    seed: u64,
    interface: &'static str,
    /// How much faster than the wall's clock it lives on live buses, where it lives by that.
    speed: Option<f64>,
    machine: Vec<Change>,
    emulated: Vec<Change>,
}

/// Something that turns a text into another.
#[derive(Clone, Debug)]
enum Change {
    Replace(String, String),
    By(fn(String) -> String),
}

impl Setup {
    /// The shipped linear machine with the noise and errors of `seed`.
    pub const fn new(seed: u64) -> Self {
        Self::of(LINEAR, seed)
    }

    /// The shipped alignment platform with the noise and errors of `seed`.
    pub const fn uvw(seed: u64) -> Self {
        Self::of(UVW, seed)
    }

    /// The alignment platform whose axes are amplifiers on a serial line.
    pub const fn uvw_copley(seed: u64) -> Self {
        Self::of(UVW_COPLEY, seed)
    }

    /// A machine that ships, with the noise and errors of `seed`.
    pub const fn of(shipped: Shipped, seed: u64) -> Self {
        Self {
            shipped,
            seed,
            interface: INTERFACE,
            speed: None,
            machine: Vec::new(),
            emulated: Vec::new(),
        }
    }

    /// The platform with four screws that follow a set-point every two milliseconds.
    pub fn four_cyclic_axes(seed: u64) -> Self {
        let mut setup = Self::of(UVW, seed);
        setup.machine.push(Change::By(four_cyclic_axes));
        setup.emulated.push(Change::By(with_fourth_drive));
        setup
    }

    /// The shipped three-axis machine with the noise and errors of `seed`.
    pub const fn volumetric(seed: u64) -> Self {
        Self::of(VOLUMETRIC, seed)
    }

    /// In real time on live buses, whatever they bear: the machine has no more patience with
    /// the computer than one of metal has.
    #[must_use]
    pub const fn in_real_time(self) -> Self {
        self.by_the_wall(1.0)
    }

    /// By the wall's clock on live buses, so many times as fast; the machine is as patient as one
    /// that lives faster must be.
    #[must_use]
    pub const fn by_the_wall(mut self, speed: f64) -> Self {
        self.speed = Some(speed);
        self
    }

    /// Whether it lives by the wall's clock on live buses, where no two runs are alike.
    pub const fn is_by_the_wall(&self) -> bool {
        self.speed.is_some()
    }

    /// The shipped rotary table with the noise and errors of `seed`.
    pub const fn rotary(seed: u64) -> Self {
        Self::of(ROTARY, seed)
    }

    /// With both texts changed as a whole.
    #[must_use]
    pub fn shaped(mut self, machine: fn(String) -> String, emulated: fn(String) -> String) -> Self {
        self.machine.push(Change::By(machine));
        self.emulated.push(Change::By(emulated));
        self
    }

    /// On another SocketCAN interface than the usual one.
    #[must_use]
    pub const fn interface(mut self, name: &'static str) -> Self {
        self.interface = name;
        self
    }

    /// With `from` replaced by `to` in the machine's configuration.
    #[must_use]
    pub fn machine(mut self, from: &str, to: &str) -> Self {
        self.machine
            .push(Change::Replace(from.to_owned(), to.to_owned()));
        self
    }

    /// With the Hall sensors read by the module on the serial line instead of that on CAN.
    ///
    /// # Panics
    /// When the shipped configuration has become another one.
    #[must_use]
    pub fn over_dcon(self) -> Self {
        let begin = MACHINE.find("[analog.hall]").expect("the machine has it");
        let end = MACHINE.find("[instrument.laser]").expect("it comes next");
        let module = "[analog.hall]\ndevice = \"dcon\"\nline = \"adc\"\naddress = 1\n\
                      checksum = true\nchannels = [0, 1]\nfull_scale_v = [5.0, 5.0]\n\
                      poll_period_ms = 100.0\n\n";
        let line = "[serial.adc]\npath = \"/dev/ttyUSB0\"\nbaud_bit_per_s = 9600\n\n[axis.x]\n";
        self.machine(&MACHINE[begin..end], module)
            .machine("[axis.x]\n", line)
    }

    /// With `from` replaced by `to` in the description of the emulation.
    #[must_use]
    pub fn emulated(mut self, from: &str, to: &str) -> Self {
        self.emulated
            .push(Change::Replace(from.to_owned(), to.to_owned()));
        self
    }
}

/// # Panics
/// When there is nothing to replace: the text has changed and the test has not.
fn replace(text: String, changes: &[Change]) -> String {
    changes.iter().fold(text, |text, change| match change {
        Change::Replace(from, to) => text.edit(from, to),
        Change::By(change) => change(text),
    })
}

#[expect(clippy::large_enum_variant, reason = "there is one a test")]
enum Emulation {
    InProcess(Emulated),
    Running(EmulatedOnPtys),
}

/// On live buses: by the wall's clock where a setup asks for that, else on a shared one.
fn on_ptys(
    text: &str,
    setup: &Setup,
    interface: Option<&str>,
) -> Result<EmulatedOnPtys, EmulatedError> {
    let seed = setup.seed;
    match (setup.speed, interface) {
        (None, None) => EmulatedOnPtys::in_lockstep(text, seed),
        (None, Some(name)) => EmulatedOnPtys::in_lockstep_on_socketcan(text, seed, name),
        (Some(speed), None) => EmulatedOnPtys::start(text, seed, speed),
        (Some(speed), Some(name)) => EmulatedOnPtys::start_on_socketcan(text, seed, speed, name),
    }
}

/// An emulated machine on one rig.
pub struct Emulator {
    /// Where it is.
    pub rig: Rig,
    /// What its controller is told.
    pub loaded: Loaded,
    emulation: Emulation,
    /// For the controller's records; gone when dropped.
    pub folder: tempfile::TempDir,
    _turn: Option<MutexGuard<'static, ()>>,
}

impl Emulator {
    /// The machine of `setup` on `rig`.
    ///
    /// # Panics
    /// When it cannot be brought up.
    pub fn new(rig: Rig, setup: &Setup) -> Self {
        let by_the_wall = setup.speed.filter(|_| rig != Rig::InProcess);
        let turn = (by_the_wall.is_some() || rig == Rig::Vcan)
            .then(|| REAL_TIME.lock().unwrap_or_else(PoisonError::into_inner));
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let change = |text| replace(text, &setup.machine);
        let mut loaded = shipped_config(&setup.shipped, folder.path(), change);
        loaded.patience = ports::Pace::Wall(by_the_wall.unwrap_or(1.0)).patience();
        let text = replace(setup.shipped.emulated.to_owned(), &setup.emulated);
        let emulation = match rig {
            Rig::InProcess => {
                Emulated::new(&text, setup.seed, &loaded.config).map(Emulation::InProcess)
            }
            Rig::Pty => on_ptys(&text, setup, None).map(Emulation::Running),
            Rig::Vcan => on_ptys(&text, setup, Some(setup.interface)).map(Emulation::Running),
        };
        Self {
            rig,
            loaded,
            emulation: emulation.unwrap_or_else(|error| panic!("{rig:?}: {error}")),
            folder,
            _turn: turn,
        }
    }

    /// A transport to it; make one only.
    ///
    /// # Panics
    /// When a port cannot be opened.
    pub fn transport(&self) -> Box<dyn Transport> {
        let emulated = match &self.emulation {
            Emulation::InProcess(emulated) => return Box::new(emulated.transport()),
            Emulation::Running(emulated) => emulated,
        };
        let config = &self.loaded.config;
        let overrides = emulated.overrides(config).expect("its ports were matched");
        let pace = emulated.pace("a test").expect("the emulator runs");
        match ports::open(config, &overrides, ports::Use::Measurement, pace) {
            Ok(live) => Box::new(live),
            Err(failure) => panic!("{:?}: {failure}", self.rig),
        }
    }

    /// The machine as who looks at it while its controller works needs it.
    pub fn watch(&self) -> Watch<'_> {
        match &self.emulation {
            Emulation::InProcess(emulated) => Watch::InProcess(emulated.clone()),
            Emulation::Running(emulated) => Watch::Running(emulated.running()),
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
}
