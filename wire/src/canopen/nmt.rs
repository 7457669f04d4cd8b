//! Network management: node control, boot-up and heartbeat (CiA 301, 7.2.8 and 7.3.5).

use super::{Function, NodeId, WireError};
use crate::can::CanFrame;
use core::fmt;

/// The identifier of NMT node control, the highest priority on the bus.
pub const NMT_COB_ID: u16 = 0x000;

/// What a master can ask of a node.
///
/// # Example
///
/// ```
/// use wire::can::CanFrame;
/// use wire::canopen::{NodeId, nmt::NmtCommand};
///
/// assert_eq!(NmtCommand::Start.emit(NodeId::new(3)).to_string(), "000#0103");
/// let heard = NmtCommand::parse(&CanFrame::standard(0, &[0x80, 0]))?;
/// assert_eq!(heard, (NmtCommand::EnterPreOperational, None), "for all nodes");
/// # Ok::<(), wire::canopen::WireError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum NmtCommand {
    /// Enter operational.
    Start = 0x01,
    /// Enter stopped.
    Stop = 0x02,
    /// Enter pre-operational.
    EnterPreOperational = 0x80,
    /// Reset the application, all objects to their power-on values.
    ResetNode = 0x81,
    /// Reset the communication objects only.
    ResetCommunication = 0x82,
}

impl NmtCommand {
    const ALL: [Self; 5] = [
        Self::Start,
        Self::Stop,
        Self::EnterPreOperational,
        Self::ResetNode,
        Self::ResetCommunication,
    ];

    /// The frame that asks it of one node, or of all when `node` is `None`.
    pub fn emit(self, node: Option<NodeId>) -> CanFrame {
        CanFrame::standard(NMT_COB_ID, &[self as u8, node.map_or(0, NodeId::raw)])
    }

    /// The command and the node it is for (`None`: all nodes).
    ///
    /// # Errors
    /// When the identifier, the length or the command byte is not NMT's.
    pub fn parse(frame: &CanFrame) -> Result<(Self, Option<NodeId>), WireError> {
        const MESSAGE: &str = "NMT command";
        if frame.standard_id() != Some(NMT_COB_ID) {
            return Err(WireError::Identifier {
                message: MESSAGE,
                seen: frame.id().raw(),
            });
        }
        let &[command, node] = frame.data() else {
            return Err(WireError::Length {
                message: MESSAGE,
                expected: 2,
                seen: frame.len(),
            });
        };
        let command = Self::ALL
            .into_iter()
            .find(|known| *known as u8 == command)
            .ok_or(WireError::Command {
                message: MESSAGE,
                seen: command,
            })?;
        Ok((command, NodeId::new(node)))
    }
}

/// A node's state as its heartbeat reports it.
///
/// # Example
///
/// ```
/// use wire::canopen::nmt::NmtState;
///
/// assert_eq!(NmtState::from_raw(0x05), NmtState::Operational);
/// assert_eq!(NmtState::from_raw(0x85), NmtState::Operational, "with a toggle bit");
/// assert_eq!(NmtState::PreOperational.raw(), 0x7F);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtState {
    /// Just booted.
    BootUp,
    /// No SDO, no PDO.
    Stopped,
    /// SDO and PDO.
    Operational,
    /// SDO only.
    PreOperational,
    /// A value that CiA 301 does not name.
    Unknown(u8),
}

impl NmtState {
    /// From the byte of a heartbeat; the toggle bit of node guarding is ignored.
    pub const fn from_raw(raw: u8) -> Self {
        match raw & 0x7F {
            0x00 => Self::BootUp,
            0x04 => Self::Stopped,
            0x05 => Self::Operational,
            0x7F => Self::PreOperational,
            other => Self::Unknown(other),
        }
    }

    /// The byte of a heartbeat.
    pub const fn raw(self) -> u8 {
        match self {
            Self::BootUp => 0x00,
            Self::Stopped => 0x04,
            Self::Operational => 0x05,
            Self::PreOperational => 0x7F,
            Self::Unknown(raw) => raw,
        }
    }
}

impl fmt::Display for NmtState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BootUp => f.write_str("boot-up"),
            Self::Stopped => f.write_str("stopped"),
            Self::Operational => f.write_str("operational"),
            Self::PreOperational => f.write_str("pre-operational"),
            Self::Unknown(raw) => write!(f, "unknown NMT state {raw:#04X}"),
        }
    }
}

/// The heartbeat (or, with [`NmtState::BootUp`], the boot-up message) of a node.
///
/// # Example
///
/// ```
/// use wire::canopen::{NodeId, nmt};
///
/// let node = NodeId::new(2).expect("1 to 127");
/// let beat = nmt::emit_heartbeat(node, nmt::NmtState::Operational);
/// assert_eq!(beat.to_string(), "702#05");
/// assert_eq!(nmt::parse_heartbeat(&beat), Ok((node, nmt::NmtState::Operational)));
/// ```
pub fn emit_heartbeat(node: NodeId, state: NmtState) -> CanFrame {
    CanFrame::standard(node.cob_id(Function::ErrorControl), &[state.raw()])
}

/// Who beats, and in which state.
///
/// # Errors
/// When the identifier or the length is not error control's.
///
/// # Example
///
/// ```
/// use wire::can::CanFrame;
/// use wire::canopen::nmt::{NmtState, parse_heartbeat};
///
/// let (node, state) = parse_heartbeat(&CanFrame::standard(0x703, &[0x00]))?;
/// assert_eq!((node.raw(), state), (3, NmtState::BootUp));
/// assert!(parse_heartbeat(&CanFrame::standard(0x080, &[0x05])).is_err(), "a SYNC");
/// # Ok::<(), wire::canopen::WireError>(())
/// ```
#[inline]
pub fn parse_heartbeat(frame: &CanFrame) -> Result<(NodeId, NmtState), WireError> {
    const MESSAGE: &str = "heartbeat";
    let wrong_id = WireError::Identifier {
        message: MESSAGE,
        seen: frame.id().raw(),
    };
    let id = frame.standard_id().ok_or(wrong_id)?;
    let Some((Function::ErrorControl, node)) = Function::of(id) else {
        return Err(wrong_id);
    };
    let &[state] = frame.data() else {
        return Err(WireError::Length {
            message: MESSAGE,
            expected: 1,
            seen: frame.len(),
        });
    };
    Ok((node, NmtState::from_raw(state)))
}

/// The value of 0x1016 sub 1..n: which producer to watch, and for how long (CiA 301, 7.5.2.19).
///
/// # Example
///
/// ```
/// use wire::canopen::{NodeId, nmt::consumer_heartbeat_entry};
///
/// let master = NodeId::new(0x7F).expect("1 to 127");
/// assert_eq!(consumer_heartbeat_entry(master, 500), 0x007F_01F4);
/// ```
pub const fn consumer_heartbeat_entry(producer: NodeId, time_ms: u16) -> u32 {
    (producer.raw() as u32) << 16 | time_ms as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).unwrap()
    }

    #[test]
    fn commands_have_the_standards_bytes() {
        assert_eq!(
            NmtCommand::Start.emit(Some(node(3))).to_string(),
            "000#0103"
        );
        assert_eq!(
            NmtCommand::ResetCommunication.emit(None).to_string(),
            "000#8200"
        );
        let frame = CanFrame::standard(0, &[0x80, 7]);
        let parsed = NmtCommand::parse(&frame);
        assert_eq!(parsed, Ok((NmtCommand::EnterPreOperational, Some(node(7)))));
    }

    #[test]
    fn a_short_or_unknown_command_is_refused() {
        assert!(NmtCommand::parse(&CanFrame::standard(0, &[1])).is_err());
        assert!(NmtCommand::parse(&CanFrame::standard(0, &[3, 1])).is_err());
    }

    #[test]
    fn heartbeats_read_both_ways() {
        let frame = emit_heartbeat(node(2), NmtState::Operational);
        assert_eq!(frame.to_string(), "702#05");
        assert_eq!(
            parse_heartbeat(&frame),
            Ok((node(2), NmtState::Operational))
        );
        assert_eq!(NmtState::from_raw(0x33), NmtState::Unknown(0x33));
    }

    #[test]
    fn the_consumer_entry_names_producer_and_time() {
        assert_eq!(consumer_heartbeat_entry(node(0x7F), 500), 0x007F_01F4);
    }
}
