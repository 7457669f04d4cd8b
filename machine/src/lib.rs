//! One machine, of whatever kind: its devices, the one loop in which everything waits, how it
//! stops, and the cyclic engine that moves axes together.
//!
//! A [`Machine`] is assembled of [`Parts`] over a [`Transport`](drivers::transport::Transport) and
//! driven by plain sequential procedures that call [`Machine::tick`]; every wait of every procedure
//! is that one function, so supervision, heartbeats and the stop request hold at every moment, on
//! real buses and in virtual time alike (docs/decisions/0001). What only one kind of machine knows,
//! such as a calibration or the place of a plate, does not belong in this crate: each kind is a
//! handle of its own over the machine (docs/decisions/0020).

mod bus_account;
mod bus_text;
mod bus_watch;
mod cause_search;
mod coasting;
mod devices;
mod diagnosis;
mod disk;
mod driving;
pub mod engine;
mod failure;
mod figures;
mod host_watch;
mod instruments;
pub mod kept_zero;
mod looking;
mod lookout;
mod machine;
mod moving;
mod notices;
mod observer;
mod outbox;
mod parts;
mod patience;
mod ports;
pub mod records;
mod release;
mod scan;
mod sensing;
mod spots;
mod starting;
mod stop_request;
mod stopping;
mod sync_account;
mod tick;
mod travel;
mod turning;
mod unit;
mod waiting;
mod zero_notes;

pub use bus_account::BusCounts;
pub use bus_text::{identifier_text, link_text};
pub use cause_search::diagnose;
pub use devices::Devices;
pub use diagnosis::Finding;
pub use disk::{ask_disk, read_ahead, settle};
pub use driving::Driving;
pub use engine::{Desk, Engine, EngineFailure};
pub use failure::{Failure, Layered};
pub use figures::{BusFigures, HostDelays, Thermometer, bus_figures, host_delays, temperatures};
pub use machine::{Attendant, Machine, attend};
pub use moving::Moving;
pub use observer::{Observer, Silent, Stage};
pub use parts::{AxisSettings, Bus, Camera, CyclicSettings, ExpectedNode, LinearAxis, Parts};
pub use patience::Patience;
pub use scan::Found;
pub use sensing::{start_sensors, stop_sensors};
pub use stop_request::StopRequest;
pub use stopping::{LONGEST_STOP, STOP_LIMIT, watch_stopped};
pub use turning::Turning;
pub use unit::Unit;
