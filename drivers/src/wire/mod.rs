//! Bytes to typed messages and back; no state, no time, no I/O.
//!
//! Everything here is `parse(bytes) -> Result` and `emit() -> bytes`. Codes that a standard
//! does not name are kept as `Unknown(raw)`, never folded into a known one. Drivers and
//! emulators share only this module, so every codec is pinned by golden bytes.

pub mod can;
pub mod candump;
pub mod canopen;
pub mod cia402;
pub mod cia404;
pub mod copley;
pub mod dcon;
pub mod in_sight;
pub mod lockstep;
pub mod slcan;
pub mod umd2;

/// What one port carries at once: a CAN frame, or a run of bytes on a serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Payload {
    /// On a CAN bus.
    Frame(can::CanFrame),
    /// On a serial line; where it is cut into runs means nothing.
    Bytes(Vec<u8>),
    /// Not sent over a serial line, but done to it, in order with what is sent.
    Control(LineControl),
}

/// What a host does at its end of a serial line besides sending. Devices never do any of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineControl {
    /// Sends and receives with so many bits per second from now on. What was sent before must
    /// have had the time to leave.
    Baud(u32),
    /// `true`: holds the line low from now on, which is a BREAK once it is longer than a byte;
    /// `false`: lets go of it. Pseudo-terminals do not carry it.
    Break(bool),
}

/// One of a machine's buses or serial lines, by its place in the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Port(pub u8);
