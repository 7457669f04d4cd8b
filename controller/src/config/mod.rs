//! Machine configuration: what is connected where, and how each step of the cycle is done.
//!
//! Micrometres and millimetres live here and on the screen only; every key carries its unit
//! in its name. [`load`] reads and judges a file without touching any bus.

mod axis;
mod certificates;
mod consequences;
pub(crate) mod dependence;
#[cfg(any(feature = "program", test))]
mod described;
mod device_warnings;
mod diagnostic;
#[cfg(feature = "program")]
pub(crate) mod explained;
mod file;
mod foreign;
#[cfg(test)]
mod impossible_tests;
pub(crate) mod judge;
pub(crate) mod least_time;
pub(crate) mod lines;
mod load;
mod meant;
mod model;
mod motion_warnings;
#[cfg(test)]
mod mutated_tests;
mod other_units;
mod place;
#[cfg(test)]
mod reference;
mod relocated;
mod repair;
pub(crate) mod schema;
mod slips;
mod structure;
mod syntax;
mod text_warnings;
mod twins;
mod unit;
pub(crate) mod validate;
mod wanted;
pub(crate) mod warnings;
mod watch_warnings;
mod whole;

// What users write; `tests/tidy/public_names.txt` lists it.
pub use diagnostic::ConfigError;
pub(crate) use diagnostic::Diagnostic;
pub(crate) use load::filled_in;
pub use load::{Loaded, load, parse};
pub use model::MachineConfig;

// What the rest of this package uses.
pub(crate) use crate::hardware::analog::*;
pub(crate) use crate::hardware::bus::{CanBus, CanTransport};
pub(crate) use crate::hardware::drive::cia402::{
    AccelerationUnitName, HomeOffsetName, OptionCodesConfig, SpeedUnitName,
};
pub(crate) use crate::hardware::drive::*;
pub(crate) use crate::hardware::instrument::*;
pub(crate) use crate::hardware::node::IdentityConfig;
pub(crate) use axis::AxisConfig;
pub(crate) use load::read;
pub(crate) use machine::records::ConfigHash;
pub(crate) use model::MachineSection;
