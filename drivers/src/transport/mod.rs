//! The machine's buses and serial lines: the only sockets, ports and threads.
//!
//! A [`Transport`] is everything the controller hears and says. Three of them behave the
//! same: live ports (SocketCAN, SLCAN, serial lines), an in-process world in virtual time,
//! and the replay of a recording.

mod histogram;
pub mod in_process;
pub mod record;
pub mod replay;
mod sync_grid;
mod sync_statistics;

#[cfg(feature = "live")]
pub mod awake;
#[cfg(feature = "live")]
pub mod clock;
#[cfg(feature = "live")]
pub mod live;
#[cfg(feature = "live")]
mod live_port;
#[cfg(feature = "live")]
pub mod lockstep;
#[cfg(feature = "live")]
mod one_core;
#[cfg(feature = "live")]
mod open_error;
#[cfg(feature = "live")]
mod open_line;
#[cfg(feature = "live")]
mod os;
#[cfg(feature = "live")]
mod processors;
#[cfg(feature = "live")]
pub mod real_time;
#[cfg(feature = "live")]
mod serial;
#[cfg(feature = "live")]
mod slcan;
#[cfg(feature = "live")]
mod socketcan;
#[cfg(feature = "live")]
mod stamps;
#[cfg(feature = "live")]
pub mod sync_thread;

use core::time::Duration;
use units::Time;
use wire::{Arrival, LinkState, Payload, Port, Ports};

pub use histogram::Histogram;
pub use sync_statistics::{Scheduling, SyncStatistics};

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

    /// As [`Transport::receive`], but bytes on the `unhurried` ports need not end the wait: they may be kept
    /// until something else comes or the wait is over, and are handed over then, with the time at which they
    /// came. Where time is simulated that spares most rounds of a stream to which nobody listens; in real time
    /// they are handed over at once.
    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        let _ = unhurried;
        self.receive(until)
    }

    /// Waits until the clock has reached `until`, as exactly as it can, and listens to nothing:
    /// what arrives meanwhile waits for [`Transport::receive`]. For the moment of a SYNC; in
    /// simulation virtual time passes.
    fn sleep_until(&mut self, until: Time);

    /// Starts, changes or (with `None`) stops the SYNC producer of a CAN port.
    ///
    /// # Errors
    /// When the port is no CAN bus or its SYNC thread cannot be started.
    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError>;

    /// What the SYNC producer of a CAN port has done; `None` when it has none, or none that can be late.
    fn sync_statistics(&self, port: Port) -> Option<SyncStatistics> {
        let _ = port;
        None
    }
}
