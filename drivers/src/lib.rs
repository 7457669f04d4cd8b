//! Drivers of precision stages: protocols, devices, transports. Bytes are the package `wire`'s.
//!
//! - [`protocol`]: sans-io machines (SDO client, NMT, heartbeat, CiA 402 power machine).
//! - [`device`]: what one device's objects or lines mean, behind domain traits.
//! - [`transport`]: the only sockets, ports and threads.

pub mod device;
pub mod protocol;
pub mod transport;
