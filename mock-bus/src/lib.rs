//! Emulated devices of a simulated precision stage.
//!
//! - [`plant`]: the physical truth in SI units; knows no bus.
//! - [`node`]: each emulated device's own protocol behaviour over that truth.
//! - [`simulation`]: nodes, plant, bus latency and faults in one virtual time.
//! - `runner` (feature `live`): the same in real time, on pseudo-terminals and SocketCAN interfaces.
//!
//! Only the byte codecs (`wire`) are shared with the drivers, and no formula is
//! shared with the compensator: an emulator that used either would mark its own homework.
//!
//! # Example
//!
//! A machine that an emulation describes, in virtual time: the same seed is the same machine, on every computer.
//!
//! ```
//! use mock_bus::config::MachineConfig;
//! use mock_bus::simulation::Simulation;
//! use units::Time;
//!
//! let config = MachineConfig::parse(
//!     r#"
//!     name = "bench"
//!     ports = [{ kind = "can", name = "can0", bitrate_kbit_per_s = 1000 }]
//!     nodes = [{ name = "drive", port = "can0", device = { kind = "cia402_drive" } }]
//!     "#,
//! )?;
//! let mut simulation = Simulation::new(&config, 7)?;
//! let booted = simulation.advance_to_delivery(Time::from_seconds(1.0));
//! assert!(booted.is_some(), "a boot-up message");
//! # Ok::<(), mock_bus::config::ConfigError>(())
//! ```

pub mod bus;
pub mod config;
pub mod fault;
pub mod node;
pub mod plant;
pub mod random;
#[cfg(feature = "live")]
pub mod runner;
pub mod simulation;
mod span;
