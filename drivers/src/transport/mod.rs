//! The machine's buses and serial lines: the only sockets, ports and threads.
//!
//! A [`Transport`] is everything the controller hears and says. Three of them behave the
//! same: live ports (SocketCAN, SLCAN, serial lines), an in-process world in virtual time,
//! and the replay of a recording.

pub mod clock;
pub mod in_process;
pub mod live;
pub mod lockstep;
mod one_core;
mod os;
pub mod real_time;
pub mod record;
pub mod replay;
mod serial;
mod slcan;
mod socketcan;
mod stamps;
mod sync_grid;
pub mod sync_thread;

use core::time::Duration;
use units::Time;

use crate::wire::can::BusError;
pub use crate::wire::{Payload, Port};

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

/// Why something could not be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The kernel's transmit queue is full (ENOBUFS, EAGAIN).
    #[error("port {}: transmit queue full; raise txqueuelen or lower the load", port.0)]
    QueueFull {
        /// Which port.
        port: Port,
    },
    /// The port is down or gone.
    #[error("port {}: not usable ({state:?})", port.0)]
    Unusable {
        /// Which port.
        port: Port,
        /// Its state.
        state: LinkState,
    },
    /// No such port, or a frame for a serial line, or bytes for a CAN bus.
    #[error("port {}: cannot carry this payload", port.0)]
    WrongKind {
        /// Which port.
        port: Port,
    },
    /// The operating system refused for another reason.
    #[error("port {}: sending failed (errno {errno})", port.0)]
    System {
        /// Which port.
        port: Port,
        /// The operating system's error number.
        errno: i32,
    },
}

/// All the machine's ports, and the clock that goes with them.
pub trait Transport {
    /// The monotonic clock; virtual in simulation.
    fn now(&self) -> Time;

    /// Sends without waiting.
    ///
    /// # Errors
    /// When the port cannot take it now; nothing is queued then.
    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError>;

    /// Waits until something arrives or the clock reaches `until`; in simulation, lets
    /// virtual time pass instead. Arrivals that wait already are returned at once.
    fn receive(&mut self, until: Time) -> Option<Arrival>;

    /// Waits until the clock has reached `until`, as exactly as it can, and listens to nothing:
    /// what arrives meanwhile waits for [`Transport::receive`]. For the moment of a SYNC; in
    /// simulation virtual time passes.
    fn sleep_until(&mut self, until: Time);

    /// Starts, changes or (with `None`) stops the SYNC producer of a CAN port.
    ///
    /// # Errors
    /// When the port is no CAN bus or its SYNC thread cannot be started.
    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError>;
}
