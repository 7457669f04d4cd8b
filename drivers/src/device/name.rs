//! The name of a device in messages that come from its driver alone.

use core::fmt;

use wire::canopen::NodeId;
use wire::copley::Address;

/// Which device speaks: a node on the bus or a serial device by its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DeviceName {
    /// On CAN.
    Node(NodeId),
    /// On a serial line.
    Serial(&'static str),
    /// One of several amplifiers behind a serial line.
    Amplifier(Address),
}

impl fmt::Display for DeviceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(node) => node.fmt(f),
            Self::Serial(kind) => f.write_str(kind),
            Self::Amplifier(address) => write!(f, "amplifier {address}"),
        }
    }
}
