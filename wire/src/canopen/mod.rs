//! CANopen (CiA 301) messages.

pub mod emcy;
pub mod nmt;
pub mod pdo;
pub mod sdo;
mod sdo_abort;
pub mod sync;

use core::fmt;

/// Why bytes are not the message they were read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The payload has the wrong length.
    #[error("{message}: expected {expected} bytes, saw {seen}")]
    Length {
        /// The message that was expected.
        message: &'static str,
        /// Its length in bytes.
        expected: usize,
        /// The length of what came.
        seen: usize,
    },
    /// The identifier belongs to another message.
    #[error("{message}: not carried by COB-ID {seen:#X}")]
    Identifier {
        /// The message that was expected.
        message: &'static str,
        /// The identifier that was seen.
        seen: u32,
    },
    /// A command byte that the message does not have.
    #[error("{message}: unknown command byte {seen:#04X}")]
    Command {
        /// The message that was expected.
        message: &'static str,
        /// The byte that was seen.
        seen: u8,
    },
}

/// A CANopen node identifier, 1 to 127 (CiA 301, 7.3.5).
///
/// # Example
///
/// ```
/// use wire::canopen::{Function, NodeId};
///
/// let node = NodeId::new(5).expect("1 to 127");
/// assert_eq!(node.cob_id(Function::SdoRequest), 0x605);
/// assert_eq!(NodeId::new(0), None, "all nodes are no node");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// `None` outside 1 to 127.
    pub const fn new(raw: u8) -> Option<Self> {
        if raw >= 1 && raw <= 127 {
            Some(Self(raw))
        } else {
            None
        }
    }

    /// The bare number.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// The identifier of one of this node's predefined messages.
    pub const fn cob_id(self, function: Function) -> u16 {
        function as u16 + self.0 as u16
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {}", self.0)
    }
}

/// The base identifiers of the predefined connection set (CiA 301, 7.3.5).
///
/// # Example
///
/// ```
/// use wire::canopen::{Function, NodeId};
///
/// assert_eq!(Function::of(0x585), NodeId::new(5).map(|node| (Function::SdoResponse, node)));
/// assert_eq!(Function::of(0x080), None, "a SYNC, of no node");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u16)]
#[expect(missing_docs, reason = "the names are the standard's")]
pub enum Function {
    Emergency = 0x080,
    Tpdo1 = 0x180,
    Rpdo1 = 0x200,
    Tpdo2 = 0x280,
    Rpdo2 = 0x300,
    Tpdo3 = 0x380,
    Rpdo3 = 0x400,
    Tpdo4 = 0x480,
    Rpdo4 = 0x500,
    SdoResponse = 0x580,
    SdoRequest = 0x600,
    ErrorControl = 0x700,
}

impl Function {
    const ALL: [Self; 12] = [
        Self::Emergency,
        Self::Tpdo1,
        Self::Rpdo1,
        Self::Tpdo2,
        Self::Rpdo2,
        Self::Tpdo3,
        Self::Rpdo3,
        Self::Tpdo4,
        Self::Rpdo4,
        Self::SdoResponse,
        Self::SdoRequest,
        Self::ErrorControl,
    ];

    /// Which node's which message has this identifier, `None` for NMT, SYNC, TIME and others.
    #[inline]
    pub fn of(cob_id: u16) -> Option<(Self, NodeId)> {
        let node = NodeId::new((cob_id & 0x7F) as u8)?;
        let function = Self::ALL
            .into_iter()
            .find(|f| *f as u16 == cob_id & 0x780)?;
        Some((function, node))
    }
}

/// The address of one value in an object dictionary.
///
/// # Example
///
/// ```
/// use wire::canopen::Object;
/// use wire::canopen::sdo::{Expedited, SdoRequest, SdoResponse};
///
/// let mode = Object::new(0x6060, 0);
/// assert_eq!(mode.to_string(), "0x6060:00");
/// let data = Expedited::new(&[1]).expect("1 to 4 bytes");
/// let write = SdoRequest::DownloadExpedited { object: mode, data };
/// assert_eq!(write.emit(), [0x2F, 0x60, 0x60, 0, 1, 0, 0, 0]);
/// let answer = SdoResponse::parse(&[0x60, 0x60, 0x60, 0, 0, 0, 0, 0])?;
/// assert_eq!(answer, SdoResponse::DownloadInitiate { object: mode });
/// # Ok::<(), wire::canopen::WireError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Object {
    /// 16-bit index.
    pub index: u16,
    /// 8-bit sub-index.
    pub sub: u8,
}

impl Object {
    /// The value at `index` and `sub`.
    pub const fn new(index: u16, sub: u8) -> Self {
        Self { index, sub }
    }
}

/// As drive manuals write it: `0x6040:00`.
impl fmt::Display for Object {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:04X}:{:02X}", self.index, self.sub)
    }
}

impl fmt::Debug for Object {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_predefined_connection_set_is_read_both_ways() {
        let node = NodeId::new(5).unwrap();
        assert_eq!(node.cob_id(Function::SdoRequest), 0x605);
        assert_eq!(Function::of(0x585), Some((Function::SdoResponse, node)));
        assert_eq!(Function::of(0x080), None);
        assert_eq!(Function::of(0x7E5), None);
    }

    #[test]
    fn node_identifiers_are_1_to_127() {
        assert_eq!(NodeId::new(0), None);
        assert_eq!(NodeId::new(128), None);
        assert!(NodeId::new(127).is_some());
    }
}
