//! Parameters: their numbers, banks and values.

use core::fmt;

/// Where a parameter's value lives (p. 10).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Bank {
    /// Lost at a reset.
    Ram,
    /// Kept; copied to RAM at a reset.
    Flash,
}

/// A parameter's number.
///
/// # Example
///
/// ```
/// use wire::copley::{Bank, Command, Parameter, Request};
///
/// assert_eq!(Parameter::EVENT_STATUS.to_string(), "0xa0");
/// let command = Request::parse(b"g f0x17").map(|it| it.command);
/// let (bank, parameter) = (Bank::Flash, Parameter::POSITION);
/// assert_eq!(command, Ok(Command::Get { bank, parameter }));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Parameter(pub u16);

impl Parameter {
    /// Load position, counts (p. 50); the motor's, where one encoder serves both.
    pub const POSITION: Self = Self(0x17);
    /// What the amplifier does; see [`DesiredState`] (p. 19).
    pub const DESIRED_STATE: Self = Self(0x24);
    /// Motor position, counts (p. 50).
    pub const MOTOR_POSITION: Self = Self(0x32);
    /// Following error, counts (p. 50).
    pub const FOLLOWING_ERROR: Self = Self(0x35);
    /// Commanded position, counts (p. 50).
    pub const COMMANDED_POSITION: Self = Self(0x3D);
    /// Model, a text in flash (Parameter Dictionary).
    pub const MODEL: Self = Self(0x80);
    /// Serial number, in flash (Parameter Dictionary).
    pub const SERIAL_NUMBER: Self = Self(0x81);
    /// Bits per second of the serial port; RAM only (p. 42).
    pub const BAUD: Self = Self(0x90);
    /// Firmware version, major and minor in a byte each (Parameter Dictionary).
    pub const FIRMWARE: Self = Self(0x94);
    /// [`EventStatus`](super::EventStatus) (p. 46).
    pub const EVENT_STATUS: Self = Self(0xA0);
    /// [`Faults`](super::Faults) that have latched; a 1 written clears its fault (p. 48).
    pub const FAULTS: Self = Self(0xA4);
    /// Milliseconds since power-on or reset (Parameter Dictionary).
    pub const UPTIME: Self = Self(0xB7);
    /// Positive software limit, counts (p. 39); in force once homed.
    pub const SOFT_LIMIT_POSITIVE: Self = Self(0xB8);
    /// Negative software limit, counts (p. 39).
    pub const SOFT_LIMIT_NEGATIVE: Self = Self(0xB9);
    /// Following error that is a fault, counts (Parameter Dictionary).
    pub const FOLLOWING_ERROR_LIMIT: Self = Self(0xBA);
    /// Tracking window, counts: so near is settled (Parameter Dictionary).
    pub const TRACKING_WINDOW: Self = Self(0xBC);
    /// ... for so many milliseconds (Parameter Dictionary).
    pub const TRACKING_WINDOW_TIME: Self = Self(0xBD);
    /// Homing method, see [`HomingMethod`] (p. 40).
    pub const HOMING_METHOD: Self = Self(0xC2);
    /// Homing speed towards the switch, 0.1 counts/s (p. 39).
    pub const HOMING_SPEED_FAST: Self = Self(0xC3);
    /// Homing speed off the switch, 0.1 counts/s (p. 39).
    pub const HOMING_SPEED_SLOW: Self = Self(0xC4);
    /// Homing acceleration, 10 counts/s² (p. 39).
    pub const HOMING_ACCELERATION: Self = Self(0xC5);
    /// Home offset, counts (p. 39).
    pub const HOME_OFFSET: Self = Self(0xC6);
    /// Profile type: 0 is absolute and trapezoidal (p. 28).
    pub const PROFILE_TYPE: Self = Self(0xC8);
    /// [`TrajectoryStatus`](super::TrajectoryStatus) (p. 48).
    pub const TRAJECTORY_STATUS: Self = Self(0xC9);
    /// Position command of the next move, counts (p. 28).
    pub const POSITION_COMMAND: Self = Self(0xCA);
    /// Speed, 0.1 counts/s (p. 29).
    pub const SPEED: Self = Self(0xCB);
    /// Acceleration, 10 counts/s² (p. 29).
    pub const ACCELERATION: Self = Self(0xCC);
    /// Deceleration, 10 counts/s² (p. 29).
    pub const DECELERATION: Self = Self(0xCD);
    /// Deceleration of an abort, 10 counts/s² (p. 29).
    pub const ABORT_DECELERATION: Self = Self(0xCF);
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#04x}", self.0)
    }
}

impl fmt::Debug for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Values of [`Parameter::DESIRED_STATE`] (p. 19).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DesiredState {
    /// No power at the motor.
    Disabled,
    /// The trajectory generator drives the position loop of a servo motor.
    ProgrammedPosition,
    /// Another of the guide's, or one that it does not have.
    Unknown(i64),
}

impl DesiredState {
    /// From the parameter's value.
    pub const fn from_raw(raw: i64) -> Self {
        match raw {
            0 => Self::Disabled,
            21 => Self::ProgrammedPosition,
            other => Self::Unknown(other),
        }
    }

    /// The parameter's value.
    pub const fn raw(self) -> i64 {
        match self {
            Self::Disabled => 0,
            Self::ProgrammedPosition => 21,
            Self::Unknown(raw) => raw,
        }
    }
}

/// Values of [`Parameter::HOMING_METHOD`] (p. 40).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HomingMethod {
    /// The position becomes the home.
    Here,
    /// The edge of the positive limit switch.
    PositiveLimit,
    /// The edge of the negative limit switch.
    NegativeLimit,
    /// The first index pulse off the positive limit switch.
    PositiveLimitToIndex,
    /// The first index pulse off the negative limit switch.
    NegativeLimitToIndex,
    /// Another.
    Unknown(i64),
}

impl HomingMethod {
    /// From the parameter's value.
    pub const fn from_raw(raw: i64) -> Self {
        match raw {
            512 => Self::Here,
            513 => Self::PositiveLimit,
            529 => Self::NegativeLimit,
            545 => Self::PositiveLimitToIndex,
            561 => Self::NegativeLimitToIndex,
            other => Self::Unknown(other),
        }
    }

    /// The parameter's value.
    pub const fn raw(self) -> i64 {
        match self {
            Self::Here => 512,
            Self::PositiveLimit => 513,
            Self::NegativeLimit => 529,
            Self::PositiveLimitToIndex => 545,
            Self::NegativeLimitToIndex => 561,
            Self::Unknown(raw) => raw,
        }
    }
}
