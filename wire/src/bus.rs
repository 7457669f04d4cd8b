//! What a bus or serial line carries, and what becomes of it.

use units::Time;

use crate::can::{BusError, CanFrame};

/// What one port carries at once: a CAN frame, or a run of bytes on a serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Payload {
    /// On a CAN bus.
    Frame(CanFrame),
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

/// What came in on a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// A frame or bytes.
    Payload(Payload),
    /// The CAN controller reported an error frame.
    BusError(BusError),
    /// The receive queue overflowed; this many frames were lost since the last report.
    Lost(u32),
    /// The port changed its state.
    Link(LinkState),
}

/// Whether a port can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LinkState {
    /// Usable (again).
    Up,
    /// The interface was set down (ENETDOWN); the same socket works when it comes up.
    Down,
    /// The interface or device vanished (ENODEV, EIO); it must be opened anew.
    Gone,
}

/// One thing that came in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// Where.
    pub port: Port,
    /// When, by the transport's clock (kernel receive time where the port has it).
    pub at: Time,
    /// What.
    pub input: Input,
}
