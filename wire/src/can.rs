//! Classic CAN 2.0 frames, and the error frames that SocketCAN reports.
//!
//! Source: ISO 11898-1 (frames), Linux `include/uapi/linux/can/error.h` (error frames).

use bitflags::bitflags;
use core::fmt;

/// A CAN identifier.
///
/// # Example
///
/// ```
/// use wire::can::CanId;
///
/// assert_eq!(CanId::standard(0x181), Some(CanId::Standard(0x181)));
/// assert_eq!(CanId::standard(0x800), None, "12 bits");
/// assert_eq!(CanId::extended(0x800).map(CanId::raw), Some(0x800));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CanId {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl CanId {
    /// The largest 11-bit identifier.
    pub const STANDARD_MAX: u16 = 0x7FF;
    /// The largest 29-bit identifier.
    pub const EXTENDED_MAX: u32 = 0x1FFF_FFFF;

    /// An 11-bit identifier, `None` when it needs more bits.
    pub const fn standard(raw: u16) -> Option<Self> {
        if raw <= Self::STANDARD_MAX {
            Some(Self::Standard(raw))
        } else {
            None
        }
    }

    /// A 29-bit identifier, `None` when it needs more bits.
    pub const fn extended(raw: u32) -> Option<Self> {
        if raw <= Self::EXTENDED_MAX {
            Some(Self::Extended(raw))
        } else {
            None
        }
    }

    /// The bare number.
    pub const fn raw(self) -> u32 {
        match self {
            Self::Standard(raw) => raw as u32,
            Self::Extended(raw) => raw,
        }
    }
}

/// A data or remote frame of 0 to 8 bytes.
///
/// # Example
///
/// ```
/// use wire::can::{CanFrame, CanId};
///
/// let frame = CanFrame::standard(0x181, &[0x27, 0x02]);
/// assert_eq!(frame.to_string(), "181#2702");
/// assert_eq!((frame.standard_id(), frame.data()), (Some(0x181), &[0x27, 0x02][..]));
/// assert_eq!(CanFrame::new(CanId::Standard(1), &[0; 9]), None, "nine bytes");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct CanFrame {
    id: CanId,
    remote: bool,
    len: u8,
    data: [u8; 8],
}

impl CanFrame {
    /// A data frame; `None` when `payload` has more than 8 bytes.
    pub fn new(id: CanId, payload: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..payload.len())?.copy_from_slice(payload);
        Some(Self {
            id,
            remote: false,
            len: payload.len() as u8,
            data,
        })
    }

    /// A data frame with an 11-bit identifier.
    ///
    /// # Panics
    /// When `id` exceeds 11 bits or `payload` 8 bytes: both are constants of the caller.
    pub fn standard(id: u16, payload: &[u8]) -> Self {
        let id = CanId::standard(id).expect("callers pass 11-bit identifiers");
        Self::new(id, payload).expect("callers pass at most 8 bytes")
    }

    /// A remote frame asking for `len` bytes; `None` when `len` exceeds 8.
    pub const fn remote(id: CanId, len: u8) -> Option<Self> {
        if len > 8 {
            None
        } else {
            Some(Self {
                id,
                remote: true,
                len,
                data: [0; 8],
            })
        }
    }

    /// The identifier.
    pub const fn id(&self) -> CanId {
        self.id
    }

    /// The 11-bit identifier, `None` for a 29-bit one.
    pub const fn standard_id(&self) -> Option<u16> {
        match self.id {
            CanId::Standard(id) => Some(id),
            CanId::Extended(_) => None,
        }
    }

    /// The payload; empty for a remote frame.
    #[inline]
    pub fn data(&self) -> &[u8] {
        if self.remote {
            &[]
        } else {
            &self.data[..usize::from(self.len)]
        }
    }

    /// The data length code, also of a remote frame.
    pub const fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether the length code is 0.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether this is a remote (RTR) frame.
    pub const fn is_remote(&self) -> bool {
        self.remote
    }

    /// Bits on the wire in the worst case of bit stuffing, interframe space included.
    ///
    /// An 11-bit data frame has 34 stuffable control bits, a 29-bit one 54 (ISO 11898-1;
    /// Davis, Burns, Bril, Lukkien 2007): 8 bytes take 135 and 160 bits.
    pub const fn worst_case_bits(&self) -> u32 {
        let payload = if self.remote { 0 } else { self.len as u32 * 8 };
        worst_case_bits(payload, matches!(self.id, CanId::Extended(_)))
    }
}

/// Worst-case wire bits of a frame with `payload_bits` of data, interframe space included.
///
/// # Example
///
/// ```
/// use wire::can::{CanFrame, worst_case_bits};
///
/// assert_eq!(worst_case_bits(64, true), 160);
/// assert_eq!(CanFrame::standard(0x080, &[]).worst_case_bits(), 55, "a SYNC");
/// ```
pub const fn worst_case_bits(payload_bits: u32, extended: bool) -> u32 {
    let stuffable = if extended { 54 } else { 34 };
    payload_bits + stuffable + 13 + (stuffable + payload_bits - 1) / 4
}

impl fmt::Debug for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// As candump writes it: `181#2702` or `123#R4`.
impl fmt::Display for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id {
            CanId::Standard(id) => write!(f, "{id:03X}#")?,
            CanId::Extended(id) => write!(f, "{id:08X}#")?,
        }
        if self.remote {
            return write!(f, "R{}", self.len);
        }
        self.data()
            .iter()
            .try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

bitflags! {
    /// The classes of a SocketCAN error frame (bits of its identifier).
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct BusErrorClass: u32 {
        /// Transmission timed out.
        const TX_TIMEOUT = 0x001;
        /// Arbitration was lost.
        const LOST_ARBITRATION = 0x002;
        /// The controller reports a problem (state or overflow).
        const CONTROLLER = 0x004;
        /// A protocol violation was seen.
        const PROTOCOL = 0x008;
        /// The transceiver reports a problem.
        const TRANSCEIVER = 0x010;
        /// Nobody acknowledged the frame.
        const NO_ACK = 0x020;
        /// The controller went off the bus.
        const BUS_OFF = 0x040;
        /// A bus error occurred.
        const BUS_ERROR = 0x080;
        /// The controller was restarted.
        const RESTARTED = 0x100;
    }
}

bitflags! {
    /// What a controller problem is (byte 1 of an error frame).
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub struct ControllerProblem: u8 {
        /// Receive buffer overflow.
        const RX_OVERFLOW = 0x01;
        /// Transmit buffer overflow.
        const TX_OVERFLOW = 0x02;
        /// Receive errors reached the warning level (96).
        const RX_WARNING = 0x04;
        /// Transmit errors reached the warning level (96).
        const TX_WARNING = 0x08;
        /// Receive errors reached error passive (128).
        const RX_PASSIVE = 0x10;
        /// Transmit errors reached error passive (128).
        const TX_PASSIVE = 0x20;
        /// Back to error active.
        const ACTIVE = 0x40;
    }
}

/// An error frame as SocketCAN reports it.
///
/// # Example
///
/// ```
/// use wire::can::{BusError, BusErrorClass, ControllerProblem};
///
/// let error = BusError::parse(0x204, &[0, 0x30, 0, 0, 0, 0, 0, 0]);
/// assert!(error.class.contains(BusErrorClass::CONTROLLER));
/// let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
/// assert_eq!(error.controller, passive);
/// assert_eq!(error.emit().0, 0x204);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BusError {
    /// What went wrong.
    pub class: BusErrorClass,
    /// The controller's state or overflow, where `class` says so.
    pub controller: ControllerProblem,
}

impl BusError {
    /// From an error frame's identifier (flag bit stripped) and payload.
    pub fn parse(class_bits: u32, data: &[u8]) -> Self {
        let class = BusErrorClass::from_bits_retain(class_bits & CanId::EXTENDED_MAX);
        let controller = ControllerProblem::from_bits_retain(data.get(1).copied().unwrap_or(0));
        Self { class, controller }
    }

    /// The identifier's class bits and the payload that carry this error.
    pub const fn emit(&self) -> (u32, [u8; 8]) {
        (
            self.class.bits(),
            [0, self.controller.bits(), 0, 0, 0, 0, 0, 0],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bytes_take_135_bits_standard_and_160_extended() {
        assert_eq!(CanFrame::standard(0x181, &[0; 8]).worst_case_bits(), 135);
        assert_eq!(worst_case_bits(64, true), 160);
        assert_eq!(CanFrame::standard(0x80, &[]).worst_case_bits(), 55);
    }

    #[test]
    fn nine_bytes_and_twelve_bits_are_refused() {
        assert_eq!(CanFrame::new(CanId::Standard(1), &[0; 9]), None);
        assert_eq!(CanId::standard(0x800), None);
        assert_eq!(CanId::extended(0x2000_0000), None);
    }

    #[test]
    fn an_error_passive_frame_decodes() {
        let error = BusError::parse(0x204, &[0, 0x30, 0, 0, 0, 0, 0, 0]);
        assert!(error.class.contains(BusErrorClass::CONTROLLER));
        let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
        assert_eq!(error.controller, passive);
    }
}
