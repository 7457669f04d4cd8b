//! The emulated machine, in this process, on a bus that another program can open.

use std::sync::{Mutex, MutexGuard, PoisonError};

use mock_bus::config::MachineConfig;
use mock_bus::runner::{self, Running};
use tests::{EMULATED, INTERFACE, Rig};

use crate::peer::Peer;

/// Two machines on one interface would have the same node identifiers.
static ON_INTERFACE: Mutex<()> = Mutex::new(());

pub(crate) struct Emulated {
    pub(crate) machine: Running,
    /// python-can's name of the interface.
    interface: &'static str,
    channel: String,
    _turn: Option<MutexGuard<'static, ()>>,
}

impl Emulated {
    /// The shipped machine in real time.
    pub(crate) fn spawn(rig: Rig) -> Self {
        let config = MachineConfig::parse(EMULATED).expect("the shipped emulation is well-formed");
        let turn =
            (rig == Rig::Vcan).then(|| ON_INTERFACE.lock().unwrap_or_else(PoisonError::into_inner));
        let (machine, interface) = match rig {
            Rig::Vcan => (
                runner::spawn_on_vcan(&config, 1, 1.0, INTERFACE),
                "socketcan",
            ),
            Rig::Pty | Rig::InProcess => (runner::spawn_on_ptys(&config, 1, 1.0), "slcan"),
        };
        let machine = machine.unwrap_or_else(|error| panic!("{error}"));
        let channel = machine.ports()[0].display().to_string();
        Self {
            machine,
            interface,
            channel,
            _turn: turn,
        }
    }

    /// Starts a master of the machine's CAN bus.
    pub(crate) fn master(&self, program: &'static str) -> Peer {
        Peer::start(program, &[self.interface, &self.channel])
    }

    pub(crate) fn stop(self) {
        self.machine.stop().expect("the machine ran to its end");
    }
}
