//! Machine configuration: what is connected where, and how each step of the cycle is done.
//!
//! Micrometres and millimetres live here and on the screen only; every key carries its unit
//! in its name. [`load`] reads and judges a file without touching any bus.

mod axis;
mod dependence;
mod diagnostic;
#[cfg(test)]
mod impossible_tests;
pub(crate) mod judge;
mod load;
mod model;
mod place;
pub mod reference;
pub mod schema;
mod structure;
pub(crate) mod validate;

// What a family brings is public as soon as its section names it.
pub use crate::hardware::analog::*;
pub use crate::hardware::bus::{CanBus, CanTransport, SerialLine, Wiring};
pub use crate::hardware::camera::*;
pub use crate::hardware::drive::cia402::{HomeOffsetName, OptionCodesConfig};
pub use crate::hardware::drive::*;
pub use crate::hardware::instrument::*;
pub use crate::hardware::node::{IdentityConfig, NodeConfig};
pub use axis::AxisConfig;
pub use dependence::hash_of;
pub use diagnostic::{ConfigError, Diagnostic};
pub use load::{Loaded, load, parse};
pub use machine::records::ConfigHash;
pub use model::{MachineConfig, MachineSection};
