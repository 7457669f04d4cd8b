//! truestage: makes precision motion stages go where they are told.
//!
//! One cycle for any stage: **calibrate → zero → compensate → verify**. This package joins
//! the drivers, the mathematics and the records; it is both a library and the command
//! `truestage`.
//!
//! # A stage in a program of yours
//!
//! ```no_run
//! use truestage::{Failure, Machine, config, ports, store_of};
//! use units::Metres;
//!
//! fn main() -> Result<(), Failure> {
//!     let loaded = config::load("machine.toml".as_ref())?;
//!     let transport = ports::open(&loaded.config, &ports::Overrides::default(), ports::Use::Motion, 1.0)?;
//!     let mut machine = Machine::new(&loaded, Box::new(transport));
//!     let store = store_of(&loaded.config.machine);
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
//! This is not a safety controller: wire STO.

pub mod assemble;
pub mod bus_plan;
pub mod config;
mod connected;
mod correction;
mod edit;
#[cfg(feature = "emulator")]
pub mod emulated;
pub mod failure;
mod handle;
mod hardware;
pub mod json;
pub mod linear;
pub mod page;
pub mod platform;
pub mod ports;
pub mod rotary;
pub mod run;
pub mod store;
mod stores;
pub mod text;
pub mod volumetric;

pub use connected::Machine;
pub use edit::Edit;
pub use failure::Failure;
pub use machine::{
    Desk, Engine, EngineFailure, Found, Observer, Patience, Silent, Stage, StopRequest, engine,
};
pub use store::Store;
pub use stores::{CONTENTS, store_in, store_of, store_of_journal};
