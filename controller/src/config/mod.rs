//! Machine configuration: what is connected where, and how each step of the cycle is done.
//!
//! Micrometres and millimetres live here and on the screen only; every key carries its unit
//! in its name. [`load`] reads and judges a file without touching any bus.

mod camera;
mod dependence;
mod diagnostic;
mod drive;
pub(crate) mod judge;
mod load;
mod model;
pub(crate) mod validate;

pub use camera::{CameraConfig, CameraDevice};
pub use dependence::hash_of;
pub use diagnostic::{ConfigError, Diagnostic};
pub use drive::{HomeOffsetName, IdentityConfig, OptionCodesConfig};
pub use load::{Loaded, load, parse};
pub use machine::records::ConfigHash;
pub use model::{
    AmplifierConfig, AnalogConfig, AnalogDevice, AxisConfig, AxisDevice, CalibrateConfig, CanAxis,
    CanBus, CanTransport, CompensationConfig, CyclicConfig, EndPolicyName, InstrumentConfig,
    InstrumentDevice, InterpolationName, MachineConfig, MachineSection, OpticsConfig, SerialAxis,
    SerialLine, VerifyConfig, ZeroConfig,
};
