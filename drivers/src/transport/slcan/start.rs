//! Bringing an adapter to work: its settings and the steps.

use core::time::Duration;

use super::super::serial::SerialSettings;
use wire::slcan::{BitrateCode, Command};

/// How an SLCAN adapter is set up.
///
/// # Example
///
/// ```
/// use drivers::transport::live::{SerialSettings, SlcanSettings};
///
/// let settings = SlcanSettings {
///     serial: SerialSettings::new(1_000_000),
///     ..SlcanSettings::new(500_000)
/// };
/// assert_eq!((settings.bitrate, settings.serial.baud), (500_000, 1_000_000), "CAN, and the cable");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlcanSettings {
    /// The CAN bus's bit/s.
    pub bitrate: u32,
    /// The serial line.
    pub serial: SerialSettings,
    /// Ask for the adapter's millisecond time stamps; done without when it refuses.
    pub timestamps: bool,
    /// How often the status flags are read; `None` for never.
    pub status_interval: Option<Duration>,
    /// How long an answer may take (wall time).
    pub answer_timeout: Duration,
    /// `false` for adapters that answer nothing (some firmware does not): nothing can be
    /// checked then.
    pub answers: bool,
}

impl SlcanSettings {
    /// Usual settings for a bus of `bitrate` bit/s.
    pub const fn new(bitrate: u32) -> Self {
        Self {
            bitrate,
            serial: SerialSettings::new(115_200),
            timestamps: true,
            status_interval: Some(Duration::from_millis(500)),
            answer_timeout: Duration::from_secs(2),
            answers: true,
        }
    }
}

/// The steps of the start, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Clears the adapter's line, closes the channel; `V` marks the end of old answers.
    Close,
    Bitrate,
    Timestamps,
    Open,
}

impl Step {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Close => "C",
            Self::Bitrate => "S",
            Self::Timestamps => "Z",
            Self::Open => "O",
        }
    }

    pub(super) const fn next(self) -> Option<Self> {
        match self {
            Self::Close => Some(Self::Bitrate),
            Self::Bitrate => Some(Self::Timestamps),
            Self::Timestamps => Some(Self::Open),
            Self::Open => None,
        }
    }

    pub(super) fn lines(self, settings: &SlcanSettings, bitrate: BitrateCode) -> Vec<u8> {
        match self {
            Self::Close => [
                b"\r\r".as_slice(),
                &Command::Close.emit(),
                &Command::ReadVersion.emit(),
            ]
            .concat(),
            Self::Bitrate => Command::Bitrate(bitrate).emit(),
            Self::Timestamps => Command::Timestamps(settings.timestamps).emit(),
            Self::Open => Command::Open.emit(),
        }
    }
}
