//! Bytes to typed messages and back, and what a bus or serial line carries; no state, no I/O, no
//! operating system.
//!
//! Every codec is `parse(bytes) -> Result` and `emit() -> bytes`. Codes that a standard does not
//! name are kept as `Unknown(raw)`, never folded into a known one. Drivers and emulators share only
//! this package, so every codec is pinned by golden bytes.
//!
//! # Example
//!
//! A codec has no state: bytes become a value or an error, and a value becomes bytes.
//!
//! ```
//! use wire::dcon::{Command, frame, parse_volts, unframe};
//!
//! let asked = frame(&Command::ReadAll { address: 1 }.emit(), true);
//! assert_eq!(asked, b"#0184\r");
//! let volts = parse_volts(">+1.2345-0.0010")?;
//! assert_eq!(volts, [1.2345, -0.001]);
//! assert!(unframe(b">+1.2345AA", true).is_err(), "a wrong checksum");
//! # Ok::<(), wire::dcon::DconError>(())
//! ```

// What every frame of a cyclic loop passes is `#[inline]`: callers are in other packages.
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

pub use bus::{Arrival, Input, LineControl, LinkState, Payload, Port, Ports};
