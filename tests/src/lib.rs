//! The rig: one emulated machine on the bus that `RIG` names, for tests that run the same on
//! every bus.
//!
//! `RIG` unset: in this process (virtual time) and on pseudo-terminals. `RIG=vcan`: on the
//! SocketCAN interface `vcan0`, serial lines still on pseudo-terminals.

mod rig;
mod slcan_hub;

pub use rig::{Bench, MACHINE, EMULATED, Rig, machine_config, rigs};
pub use slcan_hub::SlcanHub;
