//! Drivers of precision stages: protocols, devices, transports. Bytes are encoded and decoded by
//! the package `wire`.
//!
//! - [`protocol`]: sans-io machines (SDO client, NMT, heartbeat, CiA 402 power machine).
//! - [`device`]: what one device's objects or lines mean, behind domain traits.
//! - [`transport`]: the only sockets, ports and threads.
//!
//! # Example
//!
//! A driver has no clock and no port: time and bytes come in, bytes and readings go out. `examples/device.rs` is a
//! whole one.
//!
//! ```
//! use drivers::device::Device;
//! use drivers::device::nd287::{Nd287, Nd287Settings};
//! use units::Time;
//! use wire::{Input, Payload};
//!
//! let mut display = Nd287::new(Nd287Settings::default());
//! display.start(Time::ZERO);
//! let asked = display.poll_transmit();
//! assert_eq!(asked, Some(Payload::Bytes(b"\x1bA0000\r".to_vec())));
//! let answer = b"\x02ND-287    \r\n646118-01 \r\nV1-01     \r\n".to_vec();
//! let at = Time::from_seconds(0.05);
//! display.handle(at, &Input::Payload(Payload::Bytes(answer)));
//! assert_eq!(display.identity().map(|it| it.name), Some("ND-287".into()));
//! ```

pub mod device;
pub mod protocol;
pub mod transport;
