//! truestage: makes precision motion stages go where they are told.
//!
//! One cycle for any stage: **calibrate → zero → compensate → verify**. This package joins
//! the drivers, the mathematics and the records; it is both a library and the command
//! `truestage`.
//!
//! # A stage in a program of yours
//!
//! ```no_run
//! use truestage::{Failure, Machine, config, ports};
//! use units::Metres;
//!
//! fn main() -> Result<(), Failure> {
//!     let loaded = config::load("machine.toml".as_ref())?;
//!     let transport = ports::open(&loaded.config, &ports::Overrides::default(), ports::Use::Motion, 1.0)?;
//!     let mut machine = Machine::new(&loaded, Box::new(transport));
//!     let store = loaded.config.machine.store();
//!     machine.guarded(|machine| {
//!         machine.start()?;
//!         machine.linear("x")?.zero(&store)?;
//!         machine.linear("x")?.load_active(&store)?;
//!         machine.linear("x")?.move_to(Metres::from_mm(12.5))?;
//!         machine.shut_down()
//!     })
//! }
//! ```
//!
//! # Features
//!
//! `program` (on by default) is the command `truestage` with all that only it needs; `emulator`, which
//! comes with it, is the module `emulated` alone: machines without hardware, for tests.
//! With `default-features = false` the library links neither.
//!
//! # Names
//!
//! Here is what a program has to write. Quantities are those of `units`; what a machine of any kind is and
//! fails with, who is told and who stops it ([`machine::Observer`], [`machine::StopRequest`]), records of any kind and
//! who has the machine meanwhile ([`machine::records`]), and several axes as one motion ([`machine::engine`]) are in `machine`;
//! mathematics are in `compensator`. What is read only (sections of a configuration, entries of a journal, what
//! a procedure found) has fields and needs no name.
//!
//! This is not a safety controller: wire STO.

mod agreed;
mod assemble;
mod bus_plan;
mod certificate;
#[cfg(test)]
mod chance;
pub mod config;
mod connected;
mod correction;
mod edit;
#[cfg(feature = "emulator")]
pub mod emulated;
mod failure;
mod groups;
mod handle;
mod hardware;
mod homing;
mod jogging;
mod kinds;
pub mod linear;
mod made_by;
mod memories;
mod pairing;
pub mod platform;
pub mod ports;
#[cfg(feature = "program")]
mod program;
pub mod rotary;
mod run;
pub mod runs;
mod store;
mod stores;
mod time_of_day;
pub mod volumetric;
mod worse;

// A machine, what its moves may do without, and why it stopped or refused.
pub use agreed::Agreed;
pub use connected::Machine;
pub use failure::Failure;
pub use groups::groups;
pub use run::CalibrateOptions;

// The command, whose `main` is this alone; who keeps a machine for others is given to it.
#[cfg(feature = "program")]
pub use program::{Serving, main};

/// What the tests of this project need beyond that. No promise is made about it.
#[doc(hidden)]
pub mod for_tests {
    pub use crate::assemble::ports as port_numbers;
    pub use crate::edit::{
        Edit, with_line_signal, with_rare_heartbeats, with_spot_cameras, with_three_rolls,
    };
    pub use crate::hardware::analog::ModuleConfig;
    pub use crate::hardware::camera::CameraDevice;
    pub use crate::hardware::drive::DriveConfig;
    pub use crate::hardware::instrument::InstrumentDevice;
    pub use crate::linear::calibrate::Calibrated;
    pub use crate::linear::entries::PointEntry;
    pub use crate::linear::job::JobDone;
    pub use crate::linear::settings::{compensation, harmless};
    pub use crate::linear::verify::Verified;
    pub use crate::linear::zero::Zeroed;
    pub use crate::linear::zero_budget::{budget as zero_budget, record as zero_budget_record};
    pub use crate::platform::moves::PoseMoved;
    pub use crate::rotary::calibrate::RotaryCalibrated;
    pub use crate::rotary::settings::rotary_settings;
    pub use crate::rotary::sighted::{Asked, Person, Question};
    pub use crate::rotary::sweep::Sweep;
    pub use crate::rotary::verify::RotaryVerified;
    pub use crate::stores::store_in;
    pub use crate::volumetric::calibrate::{VolumetricCalibrated, VolumetricEvaluated};
    pub use crate::volumetric::entries::OpticsName;
    pub use crate::volumetric::first_part::FirstPartCorrection;
    pub use crate::volumetric::line::{Line, LineReading, LineReadout};
    pub use crate::volumetric::memory_import::import as import_memory;
    pub use crate::volumetric::record::BendRecord;
    pub use crate::volumetric::settings::{beam_detector, beam_drift, roll_optics};
}

#[cfg(test)]
use edit::Edit;
