//! Drivers of precision stages: bytes, protocols, devices, transports.
//!
//! - [`wire`]: bytes to typed messages and back, one file per protocol part.
//! - [`protocol`]: sans-io machines (SDO client, NMT, heartbeat, CiA 402 power machine).
//! - [`device`]: what one device's objects or lines mean, behind domain traits.
//! - [`transport`]: the only sockets, ports and threads.

pub mod device;
pub mod protocol;
pub mod transport;
pub mod wire;
