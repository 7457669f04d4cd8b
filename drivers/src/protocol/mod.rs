//! Sans-io protocol machines: frames and time come in, frames and events go out.
//!
//! - [`sdo_client`]: one transfer at a time with one server (CiA 301, 7.2.4).
//! - [`script`]: a list of transfers, each with a text for a person; [`pdo_setup`] writes such
//!   lists for PDO parameters.
//! - [`heartbeat`]: who is alive, and saying that we are (CiA 301, 7.2.8.3.2).
//! - [`power_state`]: which controlword leads a drive to a state (CiA 402, 8.4).
//! - [`bus_load`]: whether a configuration fits its bus, before the bus is opened.

pub mod bus_load;
pub mod heartbeat;
pub mod pdo_setup;
pub mod power_state;
pub mod script;
pub mod sdo_client;
