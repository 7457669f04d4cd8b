//! Why a live port could not be opened.

use wire::Port;

use super::lockstep::LockstepError;
use super::serial::SerialError;
use super::slcan::SlcanFailure;

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// No network interface of that name.
    #[error(
        "CAN interface {interface}: does not exist; `ip link` lists what there is, \
         `ip link add dev {interface} type vcan && ip link set {interface} up` makes a \
         virtual one"
    )]
    NoInterface {
        /// Its name.
        interface: String,
    },
    /// The kernel was built without CAN.
    #[error(
        "CAN interface {interface}: this kernel has no CAN sockets; try `modprobe can_raw`, \
         or use an SLCAN adapter"
    )]
    NoCan {
        /// Its name.
        interface: String,
    },
    /// Opening or setting up the CAN socket failed otherwise.
    #[error("CAN interface {interface}: {source}")]
    Can {
        /// Its name.
        interface: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The serial port could not be opened.
    #[error("{path}: {source}; {help}")]
    Serial {
        /// The device's path.
        path: String,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do about it.
        help: &'static str,
    },
    /// The CAN adapter has no code for the bit rate.
    #[error(
        "{path}: SLCAN has no code for {bitrate} bit/s; it supports 10, 20, 50, 100, 125, 250, \
         500, 800 and 1000 kbit/s"
    )]
    Bitrate {
        /// The device's path.
        path: String,
        /// The bit rate asked for.
        bitrate: u32,
    },
    /// The SLCAN adapter did not do what it was told.
    #[error("{path}: SLCAN adapter {failure}")]
    Slcan {
        /// The device's path.
        path: String,
        /// What went wrong.
        failure: SlcanFailure,
    },
    /// More ports than one thread waits for.
    #[error("more than {limit} CAN buses and serial lines: move some to another process")]
    TooManyPorts {
        /// How many there may be.
        limit: usize,
    },
    /// The clock that both ends share does not know the port.
    #[error(transparent)]
    Lockstep(#[from] LockstepError),
    /// Two ports have the same number.
    #[error("port {}: given twice", port.0)]
    DuplicatePort {
        /// The number.
        port: Port,
    },
}

impl OpenError {
    pub(super) fn serial(path: &str, error: SerialError) -> Self {
        Self::Serial {
            path: path.to_owned(),
            source: error.source,
            help: error.help,
        }
    }
}
