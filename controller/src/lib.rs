//! truestage: makes precision motion stages go where they are told.
//!
//! One cycle for any stage: **calibrate → zero → compensate → verify**. This package joins
//! the drivers, the mathematics and the records; it is both a library and the command
//! `truestage`.
//!
//! # A stage in a program of yours
//!
//! ```no_run
//! use truestage::{Failure, Machine, Store, config, ports};
//! use units::Metres;
//!
//! fn main() -> Result<(), Failure> {
//!     let loaded = config::load("machine.toml".as_ref())?;
//!     let transport = ports::open(&loaded.config, &ports::Overrides::default(), ports::Use::Motion, 1.0)?;
//!     let mut machine = Machine::new(&loaded, Box::new(transport));
//!     let store = Store::of(&loaded.config.machine);
//!     machine.guarded(|machine| {
//!         machine.start()?;
//!         machine.zero("x", &store)?;
//!         machine.load_active("x", &store)?;
//!         machine.move_to("x", Metres::from_mm(12.5))?;
//!         machine.shut_down()
//!     })
//! }
//! ```
//!
//! This is not a safety controller: wire STO.

pub mod assemble;
pub mod bus_plan;
mod bus_watch;
pub mod camera;
pub mod config;
pub mod cycle;
mod devices;
mod edit;
pub mod emulated;
pub mod engine;
pub mod failure;
mod host_watch;
pub mod json;
mod looking;
pub mod machine;
pub mod observer;
mod outbox;
pub mod patience;
pub mod ports;
pub mod report;
mod stop_request;
mod stopping;
pub mod store;
pub mod text;
mod tick;
mod unit;
mod waiting;

pub use edit::Edit;
pub use failure::Failure;
pub use machine::{Machine, StopRequest};
pub use store::Store;
