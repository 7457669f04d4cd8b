//! A machine on a bench: configuration, emulated devices, transport.

use std::path::Path;

use drivers::transport::Transport;
use machine::records::Store;
use mock_bus::config::MachineConfig as EmulatedConfig;
use truestage::Machine;
use truestage::config::{self, Loaded};
use truestage::emulated::{Emulated, HallDrift};
use truestage::for_tests::Edit;
use units::Metres;

use crate::shipped::{LINEAR, ROTARY, Shipped};

/// Which bus a test runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rig {
    /// Virtual time, in this process.
    InProcess,
    /// SLCAN and serial lines on pseudo-terminals.
    Pty,
    /// SocketCAN on `vcan0`, serial lines on pseudo-terminals.
    Vcan,
}

/// Whether `vcan` is this kernel's own: not that of a guest with one core.
pub fn vcan_is_native() -> bool {
    std::env::var("VCAN_HOST").is_ok_and(|host| host == "native")
}

/// The buses that this run of the tests is for.
///
/// # Panics
/// When `RIG` names none.
pub fn rigs() -> Vec<Rig> {
    match std::env::var("RIG").as_deref() {
        Err(_) | Ok("") => vec![Rig::InProcess, Rig::Pty],
        Ok("in-process") => vec![Rig::InProcess],
        Ok("pty") => vec![Rig::Pty],
        Ok("vcan") => vec![Rig::Vcan],
        Ok(other) => panic!("RIG={other}: known are in-process, pty, vcan"),
    }
}

/// The shipped configuration with its data below `folder`, after `change`.
///
/// # Panics
/// When the changed text is no configuration.
pub fn machine_config(folder: &Path, change: impl Fn(String) -> String) -> Loaded {
    shipped_config(&LINEAR, folder, change)
}

/// The same of any machine that ships.
///
/// # Panics
/// When the changed text is no configuration.
pub fn shipped_config(
    shipped: &Shipped,
    folder: &Path,
    change: impl Fn(String) -> String,
) -> Loaded {
    let text = change(shipped.machine.edit(
        "\"machine-data\"",
        &format!("{:?}", folder.display().to_string()),
    ));
    config::parse(&text, "machine.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// A machine in virtual time with everything a test looks at.
pub struct Bench {
    /// The controller's side.
    pub machine: Machine,
    /// The emulator's side.
    pub emulated: Emulated,
    /// Where calibrations and runs go.
    pub store: Store,
    /// What the controller was told.
    pub loaded: Loaded,
    /// Gone when dropped.
    pub folder: tempfile::TempDir,
}

impl Bench {
    /// The shipped machine with `seed`.
    pub fn new(seed: u64) -> Self {
        Self::with(seed, |text| text, |text| text)
    }

    /// The shipped machine with changes to its configuration and to its emulation.
    ///
    /// # Panics
    /// When a changed text is none any more.
    pub fn with(
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
    ) -> Self {
        Self::wrapped(seed, machine, emulated, |transport| Box::new(transport))
    }

    /// The shipped rotary table with changes to its configuration and to its emulation.
    ///
    /// # Panics
    /// When a changed text is none any more.
    pub fn rotary(
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
    ) -> Self {
        Self::shaped(&ROTARY, seed, machine, emulated)
    }

    /// The same, with the transport wrapped (recorded, say).
    ///
    /// # Panics
    /// When a changed text is none any more.
    pub fn wrapped(
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
        wrap: impl FnOnce(drivers::transport::in_process::InProcess<Emulated>) -> Box<dyn Transport>,
    ) -> Self {
        Self::build(&LINEAR, seed, machine, emulated, wrap)
    }

    /// Any machine that ships, with changes to its configuration.
    ///
    /// # Panics
    /// When the changed text is none any more.
    pub fn of(shipped: &Shipped, seed: u64, machine: impl Fn(String) -> String) -> Self {
        Self::build(shipped, seed, machine, |text| text, |it| Box::new(it))
    }

    /// The same with changes to its emulation too.
    ///
    /// # Panics
    /// When a changed text is none any more.
    pub fn shaped(
        shipped: &Shipped,
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
    ) -> Self {
        Self::build(shipped, seed, machine, emulated, |it| Box::new(it))
    }

    fn build(
        shipped: &Shipped,
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: impl Fn(String) -> String,
        wrap: impl FnOnce(drivers::transport::in_process::InProcess<Emulated>) -> Box<dyn Transport>,
    ) -> Self {
        let text = emulated(shipped.emulated.to_owned());
        let emulated = EmulatedConfig::parse(&text).unwrap_or_else(|error| panic!("{error}"));
        Self::of_emulated(shipped, seed, machine, &emulated, wrap)
    }

    /// Any machine that ships, with changes to its configuration, on these devices.
    ///
    /// # Panics
    /// When the changed text is none any more, or the devices are others.
    pub fn of_emulated(
        shipped: &Shipped,
        seed: u64,
        machine: impl Fn(String) -> String,
        emulated: &EmulatedConfig,
        wrap: impl FnOnce(drivers::transport::in_process::InProcess<Emulated>) -> Box<dyn Transport>,
    ) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let loaded = shipped_config(shipped, folder.path(), machine);
        let emulated = Emulated::with_config(emulated, seed, &loaded.config)
            .unwrap_or_else(|error| panic!("{error}"));
        let machine = Machine::new(&loaded, wrap(emulated.transport()));
        let store = truestage::for_tests::store_in(folder.path(), &loaded.config.machine.name);
        Self {
            machine,
            emulated,
            store,
            loaded,
            folder,
        }
    }

    /// Where the point of the stage truly is, and where the true origin is zero.
    pub fn true_position(&self) -> Metres {
        self.emulated.simulation().truth().position()
    }

    /// The mains goes off and on; the Hall sensors drift meanwhile.
    pub fn power_cycle(&self, drift: HallDrift) {
        self.emulated.simulation_mut().power_cycle(drift);
    }
}
