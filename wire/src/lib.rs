//! Bytes to typed messages and back, and what a bus or serial line carries; no state, no I/O, no
//! operating system.
//!
//! Every codec is `parse(bytes) -> Result` and `emit() -> bytes`. Codes that a standard does not
//! name are kept as `Unknown(raw)`, never folded into a known one. Drivers and emulators share only
//! this package, so every codec is pinned by golden bytes.

mod bus;
pub mod can;
pub mod candump;
pub mod canopen;
pub mod cia402;
pub mod cia404;
pub mod copley;
pub mod dcon;
pub mod in_sight;
pub mod lockstep;
pub mod nd287;
pub mod slcan;
pub mod umd2;

pub use bus::{Arrival, Input, LineControl, LinkState, Payload, Port};
