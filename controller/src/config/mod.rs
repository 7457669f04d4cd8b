//! Machine configuration: what is connected where, and how each step of the cycle is done.
//!
//! Micrometres and millimetres live here and on the screen only; every key carries its unit
//! in its name. [`load`] reads and judges a file without touching any bus.

mod analog;
mod axis;
mod camera;
mod dependence;
mod diagnostic;
mod drive;
#[cfg(test)]
mod impossible_tests;
mod instrument;
pub(crate) mod judge;
mod load;
mod model;
mod place;
pub mod reference;
pub mod schema;
mod structure;
pub(crate) mod validate;

pub use analog::{AnalogConfig, Cia404Config, DconConfig, ModuleConfig, NodeConfig};
pub use axis::{
    AmplifierConfig, AxisConfig, Cia402AxisConfig, CopleyAxisConfig, CyclicConfig, DriveConfig,
};
pub use camera::{CameraConfig, CameraDevice};
pub use dependence::hash_of;
pub use diagnostic::{ConfigError, Diagnostic};
pub use drive::{HomeOffsetName, IdentityConfig, OptionCodesConfig};
pub use instrument::{InstrumentConfig, InstrumentDevice, OpticsConfig};
pub use load::{Loaded, load, parse};
pub use machine::records::ConfigHash;
pub use model::{CanBus, CanTransport, MachineConfig, MachineSection, SerialLine};
