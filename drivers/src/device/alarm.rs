//! What a device says unasked when something is wrong.

use core::fmt;
use core::time::Duration;
use units::Metres;

use crate::wire::canopen::NodeId;
use crate::wire::canopen::emcy::Emergency;
use crate::wire::canopen::nmt::NmtState;
use crate::wire::cia402::PowerState;

/// Something that must stop the machine, or at least be told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    missing_docs,
    reason = "fields are named by what they are: node, waited, state, limit"
)]
pub enum Alarm {
    /// No heartbeat for the consumer time.
    HeartbeatLost { node: NodeId, waited: Duration },
    /// The node booted by itself: it was reset or lost power, its reference is gone.
    UnexpectedBootUp { node: NodeId },
    /// The node left operational.
    UnexpectedNmtState { node: NodeId, state: NmtState },
    /// An emergency message that reports an error.
    Emergency { node: NodeId, emergency: Emergency },
    /// The node's synchronous PDO did not come for `missed` SYNCs.
    PdoLost { node: NodeId, missed: u32 },
    /// A PDO was shorter than its mapping.
    PdoTooShort {
        node: NodeId,
        expected: usize,
        seen: usize,
    },
    /// The drive left the state it was told to keep.
    DriveState {
        node: NodeId,
        expected: PowerState,
        seen: PowerState,
    },
    /// The drive says its following error left the window.
    FollowingError { node: NodeId },
    /// An implausible jump of a position.
    PositionJump {
        node: NodeId,
        jump: Metres,
        limit: Metres,
    },
    /// The axis goes the other way than its drive wants it to.
    WrongDirection {
        node: NodeId,
        wanted: Metres,
        moved: Metres,
    },
    /// A second device with this node identifier is on the bus.
    DuplicateNode { node: NodeId },
    /// The interferometer's measurement beam is blocked.
    BeamLost,
    /// So many samples had no valid phase: there is light, but too little of it.
    BeamWeak { samples: u64 },
    /// The interferometer's laser head gives no reference.
    LaserLost,
    /// The stage moved faster than the interferometer can count.
    SlewError,
    /// Samples are missing from the interferometer's stream.
    SamplesLost { lost: u64 },
    /// The interferometer began to count anew: it was reset or lost power.
    CountRestarted,
    /// The stream ended.
    StreamSilent { waited: Duration },
    /// Lines that are not understood came in a row: wrong baud rate?
    Garbage { lines: u64 },
    /// An analog channel's sample is too old.
    StaleSample { waited: Duration },
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HeartbeatLost { node, waited } => {
                write!(
                    f,
                    "{node}: no heartbeat for {waited:?}; power, cable or drive lost"
                )
            }
            Self::UnexpectedBootUp { node } => {
                write!(
                    f,
                    "{node}: booted by itself; it lost power or was reset, zero again"
                )
            }
            Self::UnexpectedNmtState { node, state } => {
                write!(f, "{node}: left operational, is {state}")
            }
            Self::Emergency { node, emergency } => write!(
                f,
                "{node}: emergency {}, error register {:#04X}",
                emergency.code, emergency.register
            ),
            Self::PdoLost { node, missed } => {
                write!(f, "{node}: process data missing for {missed} SYNC periods")
            }
            Self::PdoTooShort {
                node,
                expected,
                seen,
            } => {
                write!(f, "{node}: process data of {seen} bytes, mapped {expected}")
            }
            Self::DriveState {
                node,
                expected,
                seen,
            } => {
                write!(f, "{node}: drive is in {seen}, should be in {expected}")
            }
            Self::FollowingError { node } => {
                write!(
                    f,
                    "{node}: following error outside its window; blocked or overloaded?"
                )
            }
            Self::PositionJump { node, jump, limit } => write!(
                f,
                "{node}: position jumped by {:.3} mm, possible are {:.3} mm",
                jump.mm(),
                limit.mm()
            ),
            Self::WrongDirection {
                node,
                wanted,
                moved,
            } => write!(
                f,
                "{node}: the axis runs in the wrong direction: wanted {:+.3} mm, went {:+.3} mm; \
                 motor phases, encoder or polarity exchanged?",
                wanted.mm(),
                moved.mm()
            ),
            Self::DuplicateNode { node } => write!(
                f,
                "{node}: a second device with this node number is on the bus; give one of them \
                 another (LSS or its switches)"
            ),
            Self::BeamLost => {
                f.write_str("interferometer: beam lost; clear and align it, set a new datum")
            }
            Self::BeamWeak { samples } => write!(
                f,
                "interferometer: beam too weak, {samples} samples without a valid phase; align \
                 it, clean the optics"
            ),
            Self::LaserLost => f.write_str("interferometer: no reference from the laser head"),
            Self::SlewError => f.write_str("interferometer: too fast to count; slow down"),
            Self::SamplesLost { lost } => write!(f, "interferometer: {lost} samples missing"),
            Self::CountRestarted => f.write_str("interferometer: was reset; set a new datum"),
            Self::StreamSilent { waited } => {
                write!(
                    f,
                    "interferometer: no sample for {waited:?}; cable or power?"
                )
            }
            Self::Garbage { lines } => {
                write!(f, "{lines} lines in a row not understood; wrong baud rate?")
            }
            Self::StaleSample { waited } => {
                write!(f, "analog input: no sample for {waited:?}")
            }
        }
    }
}
