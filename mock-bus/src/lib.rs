//! Emulated devices of a simulated precision stage.
//!
//! - [`plant`]: the physical truth in SI units; knows no bus.
//! - [`node`]: each emulated device's own protocol behaviour over that truth.
//! - [`simulation`]: nodes, plant, bus latency and faults in one virtual time.
//! - `runner` (feature `live`): the same in real time, on pseudo-terminals and SocketCAN interfaces.
//!
//! Only the byte codecs (`wire`) are shared with the drivers, and no formula is
//! shared with the compensator: an emulator that used either would mark its own homework.

pub mod bus;
pub mod config;
pub mod fault;
pub mod node;
pub mod plant;
pub mod random;
#[cfg(feature = "live")]
pub mod runner;
pub mod simulation;
