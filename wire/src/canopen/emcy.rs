//! Emergency messages (CiA 301, 7.2.7; drive codes: CiA 402-2).

use super::{Function, NodeId, WireError};
use crate::can::CanFrame;
use core::fmt;

/// A 16-bit emergency error code.
///
/// # Example
///
/// ```
/// use wire::canopen::emcy::EmergencyCode;
///
/// assert_eq!(EmergencyCode(0x8611).to_string(), "0x8611 (following error)");
/// assert_eq!(EmergencyCode(0x2311).name(), "current", "the class of a code without a name");
/// assert!(EmergencyCode(0x0000).is_cleared());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EmergencyCode(pub u16);

/// Ranges from most to least specific: first match names the code.
const NAMES: &[(u16, u16, &str)] = &[
    (0xFFFF, 0x0000, "error reset or no error"),
    (0xFFFF, 0x2310, "continuous over-current"),
    (0xFFFF, 0x2320, "short circuit or earth leakage"),
    (0xFFFF, 0x2340, "short circuit in the motor circuit"),
    (0xFFFF, 0x3210, "DC link over-voltage"),
    (0xFFFF, 0x3220, "DC link under-voltage"),
    (0xFFFF, 0x4210, "device over-temperature"),
    (0xFFFF, 0x4310, "drive over-temperature"),
    (0xFFFF, 0x5113, "logic supply low"),
    (0xFFFF, 0x5530, "non-volatile memory failed"),
    (0xFFFF, 0x6320, "parameter error"),
    (0xFFFF, 0x7121, "motor blocked"),
    (0xFFFF, 0x7305, "incremental encoder 1"),
    (0xFFFF, 0x7306, "incremental encoder 2"),
    (0xFFFF, 0x8110, "CAN overrun, objects lost"),
    (0xFFFF, 0x8120, "CAN error passive"),
    (0xFFFF, 0x8130, "life guard or heartbeat lost"),
    (0xFFFF, 0x8140, "recovered from bus-off"),
    (0xFFFF, 0x8150, "CAN-ID collision"),
    (0xFFFF, 0x8210, "PDO not processed, too short"),
    (0xFFFF, 0x8220, "PDO too long"),
    (0xFFFF, 0x8250, "RPDO time-out"),
    (0xFFFF, 0x8611, "following error"),
    (0xFFFF, 0x8612, "reference limit"),
    (0xFF00, 0x1000, "generic"),
    (0xF000, 0x2000, "current"),
    (0xF000, 0x3000, "voltage"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xF000, 0x6000, "device software"),
    (0xFF00, 0x7100, "power module"),
    (0xFF00, 0x7300, "sensor"),
    (0xF000, 0x7000, "additional modules"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol"),
    (0xFF00, 0x8400, "velocity controller"),
    (0xFF00, 0x8600, "positioning controller"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0x9000, "external"),
    (
        0xFFFF,
        0xFF01,
        "manufacturer specific; often: safe torque off (STO) is open",
    ),
    (0xFF00, 0xFF00, "manufacturer specific"),
];

impl EmergencyCode {
    /// "Error reset or no error".
    pub const CLEARED: Self = Self(0x0000);
    /// A heartbeat or life guard was lost.
    pub const HEARTBEAT_LOST: Self = Self(0x8130);
    /// The following error left its window.
    pub const FOLLOWING_ERROR: Self = Self(0x8611);
    /// Manufacturer specific; the emulated drive uses it for an opened STO.
    pub const SAFE_TORQUE_OFF: Self = Self(0xFF01);

    /// Whether this message says that errors went away.
    pub const fn is_cleared(self) -> bool {
        self.0 >> 8 == 0
    }

    /// Every code that has a name here, or the first one of a class that has.
    pub fn named() -> impl Iterator<Item = Self> {
        NAMES.iter().map(|(_, value, _)| Self(*value))
    }

    /// Whether the standards have a class for it.
    pub fn has_class(self) -> bool {
        !self.is_cleared() && NAMES.iter().any(|(mask, value, _)| self.0 & mask == *value)
    }

    /// What the standards call it.
    pub fn name(self) -> &'static str {
        NAMES
            .iter()
            .find(|(mask, value, _)| self.0 & mask == *value)
            .map_or("unnamed code", |(_, _, name)| name)
    }
}

impl fmt::Display for EmergencyCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:04X} ({})", self.0, self.name())
    }
}

/// One emergency message.
///
/// # Example
///
/// ```
/// use wire::can::CanFrame;
/// use wire::canopen::emcy::{Emergency, EmergencyCode};
///
/// let frame = CanFrame::standard(0x083, &[0x11, 0x86, 0x20, 0x02, 0, 0, 0, 0]);
/// let (node, emergency) = Emergency::parse(&frame)?;
/// assert_eq!((node.raw(), emergency.code), (3, EmergencyCode::FOLLOWING_ERROR));
/// assert_eq!(emergency.emit(node), frame);
/// # Ok::<(), wire::canopen::WireError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Emergency {
    /// What happened.
    pub code: EmergencyCode,
    /// The error register, object 0x1001.
    pub register: u8,
    /// Manufacturer's bytes.
    pub detail: [u8; 5],
}

impl Emergency {
    /// The frame that `node` sends.
    pub fn emit(&self, node: NodeId) -> CanFrame {
        let [low, high] = self.code.0.to_le_bytes();
        let [a, b, c, d, e] = self.detail;
        let payload = [low, high, self.register, a, b, c, d, e];
        CanFrame::standard(node.cob_id(Function::Emergency), &payload)
    }

    /// Who reports what.
    ///
    /// # Errors
    /// When the identifier is no node's emergency or the length is not 8.
    #[inline]
    pub fn parse(frame: &CanFrame) -> Result<(NodeId, Self), WireError> {
        const MESSAGE: &str = "emergency";
        let wrong_id = WireError::Identifier {
            message: MESSAGE,
            seen: frame.id().raw(),
        };
        let id = frame.standard_id().ok_or(wrong_id)?;
        let Some((Function::Emergency, node)) = Function::of(id) else {
            return Err(wrong_id);
        };
        let &[low, high, register, ref detail @ ..] = frame.data() else {
            return Err(WireError::Length {
                message: MESSAGE,
                expected: 8,
                seen: frame.len(),
            });
        };
        let detail = <[u8; 5]>::try_from(detail).map_err(|_| WireError::Length {
            message: MESSAGE,
            expected: 8,
            seen: frame.len(),
        })?;
        let code = EmergencyCode(u16::from_le_bytes([low, high]));
        Ok((
            node,
            Self {
                code,
                register,
                detail,
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faulhaber MC 5010 communications manual, p. 25: following error.
    #[test]
    fn a_real_drives_following_error_decodes() {
        let frame = CanFrame::standard(0x083, &[0x11, 0x86, 0x20, 0x02, 0, 0, 0, 0]);
        let (node, emergency) = Emergency::parse(&frame).unwrap();
        assert_eq!(node.raw(), 3);
        assert_eq!(emergency.code, EmergencyCode::FOLLOWING_ERROR);
        assert_eq!(emergency.register, 0x20);
        assert_eq!(emergency.emit(node), frame);
        assert_eq!(emergency.code.to_string(), "0x8611 (following error)");
    }

    #[test]
    fn codes_fall_back_to_their_class() {
        assert_eq!(EmergencyCode(0x2311).name(), "current");
        assert_eq!(EmergencyCode(0xFF42).name(), "manufacturer specific");
        assert_eq!(EmergencyCode(0x0042).name(), "unnamed code");
        assert!(EmergencyCode(0x0000).is_cleared());
    }

    #[test]
    fn a_sync_is_no_emergency() {
        assert!(Emergency::parse(&CanFrame::standard(0x080, &[0; 8])).is_err());
    }
}
