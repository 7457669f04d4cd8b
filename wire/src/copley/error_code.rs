//! The numbers behind `e`.

use core::fmt;

/// What is wrong with a command (p. 66).
///
/// # Example
///
/// ```
/// use wire::copley::ErrorCode;
///
/// assert_eq!(ErrorCode::from_raw(18).to_string(), "error 18 (the axis is already moving)");
/// assert_eq!(ErrorCode::from_raw(77), ErrorCode::Unknown(77));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorCode {
    /// 1.
    DataTooLong,
    /// 3.
    UnknownCommand,
    /// 4.
    TooLittleData,
    /// 5.
    SurplusData,
    /// 9.
    UnknownParameter,
    /// 10.
    OutOfRange,
    /// 11.
    ReadOnly,
    /// 14.
    UnknownAxisState,
    /// 15.
    NotInThisBank,
    /// 16.
    IllegalForwarding,
    /// 18.
    MovingAlready,
    /// 19.
    SpeedLimit,
    /// 20.
    AccelerationLimit,
    /// 21.
    DecelerationLimit,
    /// 22.
    JerkLimit,
    /// 25.
    TrajectoryMode,
    /// 27.
    ProgramRuns,
    /// 31.
    ForwardingNode,
    /// 32.
    CanFailed,
    /// 33.
    Syntax,
    /// 36.
    AxisLetter,
    /// 46.
    EncoderCommand,
    /// 48.
    Filter,
    /// One that the guide does not have.
    Unknown(u16),
}

impl ErrorCode {
    /// Those of the guide, in its order.
    pub const KNOWN: [Self; 23] = [
        Self::DataTooLong,
        Self::UnknownCommand,
        Self::TooLittleData,
        Self::SurplusData,
        Self::UnknownParameter,
        Self::OutOfRange,
        Self::ReadOnly,
        Self::UnknownAxisState,
        Self::NotInThisBank,
        Self::IllegalForwarding,
        Self::MovingAlready,
        Self::SpeedLimit,
        Self::AccelerationLimit,
        Self::DecelerationLimit,
        Self::JerkLimit,
        Self::TrajectoryMode,
        Self::ProgramRuns,
        Self::ForwardingNode,
        Self::CanFailed,
        Self::Syntax,
        Self::AxisLetter,
        Self::EncoderCommand,
        Self::Filter,
    ];

    /// From its number.
    pub fn from_raw(raw: u16) -> Self {
        let known = Self::KNOWN.into_iter().find(|code| code.raw() == raw);
        known.unwrap_or(Self::Unknown(raw))
    }

    /// Its number.
    pub const fn raw(self) -> u16 {
        match self {
            Self::DataTooLong => 1,
            Self::UnknownCommand => 3,
            Self::TooLittleData => 4,
            Self::SurplusData => 5,
            Self::UnknownParameter => 9,
            Self::OutOfRange => 10,
            Self::ReadOnly => 11,
            Self::UnknownAxisState => 14,
            Self::NotInThisBank => 15,
            Self::IllegalForwarding => 16,
            Self::MovingAlready => 18,
            Self::SpeedLimit => 19,
            Self::AccelerationLimit => 20,
            Self::DecelerationLimit => 21,
            Self::JerkLimit => 22,
            Self::TrajectoryMode => 25,
            Self::ProgramRuns => 27,
            Self::ForwardingNode => 31,
            Self::CanFailed => 32,
            Self::Syntax => 33,
            Self::AxisLetter => 36,
            Self::EncoderCommand => 46,
            Self::Filter => 48,
            Self::Unknown(raw) => raw,
        }
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::DataTooLong => "too much data in the command",
            Self::UnknownCommand => "unknown command",
            Self::TooLittleData => "a value is missing",
            Self::SurplusData => "too many values",
            Self::UnknownParameter => "no such parameter",
            Self::OutOfRange => "value out of range",
            Self::ReadOnly => "parameter is read-only",
            Self::UnknownAxisState => "no such axis state",
            Self::NotInThisBank => "parameter is not in this memory bank",
            Self::IllegalForwarding => "only the amplifier with address 0 forwards commands",
            Self::MovingAlready => "the axis is already moving",
            Self::SpeedLimit => "speed not possible for a move",
            Self::AccelerationLimit => "acceleration not possible for a move",
            Self::DecelerationLimit => "deceleration not possible for a move",
            Self::JerkLimit => "jerk not possible for a move",
            Self::TrajectoryMode => "not possible in this trajectory mode",
            Self::ProgramRuns => "a program is running in the amplifier",
            Self::ForwardingNode => "not a node number that commands can be forwarded to",
            Self::CanFailed => {
                "the amplifier with address 0 cannot reach the node; check its power, its node \
                 number and the CAN cable"
            }
            Self::Syntax => "not understood",
            Self::AxisLetter => "no such axis letter",
            Self::EncoderCommand => "the encoder did not accept the command",
            Self::Filter => "filter cannot be computed",
            Self::Unknown(raw) => return write!(f, "error {raw}"),
        };
        write!(f, "error {} ({text})", self.raw())
    }
}
