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

/// Some of a machine's ports. Those from number 64 on are in no set.
///
/// # Example
///
/// ```
/// use wire::{Port, Ports};
///
/// let mut ports = Ports::NONE;
/// ports.insert(Port(2));
/// assert!(ports.contains(Port(2)) && !ports.contains(Port(0)));
/// assert_eq!(ports.iter().collect::<Vec<_>>(), [Port(2)]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ports(u64);

impl Ports {
    /// None of them.
    pub const NONE: Self = Self(0);

    const fn bit(port: Port) -> u64 {
        if port.0 < 64 { 1 << port.0 } else { 0 }
    }

    /// With `port`, too.
    pub const fn insert(&mut self, port: Port) {
        self.0 |= Self::bit(port);
    }

    /// Those that are not among `others`.
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Whether `port` is one of them.
    pub const fn contains(self, port: Port) -> bool {
        self.0 & Self::bit(port) != 0
    }

    /// Each of them.
    pub fn iter(self) -> impl Iterator<Item = Port> {
        (0..64).map(Port).filter(move |port| self.contains(*port))
    }
}

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

impl Arrival {
    /// Whether it can be handed on later, with its time, when what comes on `unhurried` can: bytes can,
    /// the state of a port cannot.
    pub fn can_wait(&self, unhurried: Ports) -> bool {
        matches!(self.input, Input::Payload(Payload::Bytes(_))) && unhurried.contains(self.port)
    }
}
