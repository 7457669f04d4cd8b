//! Why a machine of any kind stopped or refused: each says where, what was expected, what was seen.

use core::time::Duration;
use std::path::PathBuf;

use drivers::device::{Alarm, DeviceError};
use drivers::transport::SendError;
use units::Metres;
use wire::LinkState;
use wire::can::CanId;

use crate::bus_text::{identifier_text, link_text};
use crate::diagnosis::Finding;
use crate::engine::EngineFailure;
use crate::records::DiskFailure;

/// What shells add to the number of the signal that ended a program.
const STOPPED_BY: u8 = 128;
/// Ctrl-C.
const SIGINT: u8 = 2;

/// Everything that ends a procedure of a machine, whatever its kind.
///
/// # Example
///
/// ```
/// use machine::Failure;
/// use units::Metres;
///
/// let refused = Failure::SoftLimit {
///     axis: "x".into(),
///     target: Metres::from_mm(70.0),
///     min: Metres::from_mm(-3.0),
///     max: Metres::from_mm(63.0),
/// };
/// let text = "axis x: 70.000000 mm is outside the soft limits -3.000 to 63.000 mm; nothing was moved";
/// assert_eq!(refused.to_string(), text);
/// assert_eq!(refused.exit_code(), 3, "refused for safety");
/// ```
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The cyclic engine refused, or stopped every drive at once.
    #[error(transparent)]
    Engine(#[from] EngineFailure),
    /// A payload could not be sent; control words are never dropped silently.
    #[error("sending to {device}: {source}")]
    Send {
        /// The device it was for.
        device: String,
        /// Why not.
        source: SendError,
    },
    /// A bus or serial line cannot be used any more.
    #[error("{port}: {}", link_text(*state))]
    Link {
        /// The port's name in the configuration.
        port: String,
        /// What became of it.
        state: LinkState,
    },
    /// Our CAN controller left the bus.
    #[error("{port}: bus-off; check cable, termination and bit rate, then start again")]
    BusOff {
        /// The port's name in the configuration.
        port: String,
    },
    /// Another master is on the bus.
    #[error(
        "{port}: received {heard} that this controller did not send: another master is on the bus; \
         disconnect it, then start again"
    )]
    SecondMaster {
        /// The port's name in the configuration.
        port: String,
        /// What only a master sends.
        heard: &'static str,
    },
    /// One sender occupies the bus, and an expected message did not come.
    #[error(
        "{port}: {} takes {percent:.0} % of the bus and leaves no room; find the device or program \
         that sends it ({missing})", identifier_text(*id)
    )]
    Babbling {
        /// The port's name in the configuration.
        port: String,
        /// What is sent.
        id: CanId,
        /// Its share of the bus.
        percent: f64,
        /// What did not come or go.
        missing: Box<Self>,
    },
    /// The traffic of the bus shows why something did not come, or came false.
    #[error("{device}: {finding} ({})", without_device(failure, device))]
    Explained {
        /// The device's name in the configuration.
        device: String,
        /// What was seen.
        finding: Finding,
        /// What went wrong.
        failure: Box<Self>,
    },
    /// Something went wrong shortly after the program was kept from its buses.
    #[error(
        "{failure}. This program was kept from its buses for {:.3} s, until {:.3} s before, and \
         that alone may be the cause: the computer is too busy for real time. Allow the program \
         SCHED_FIFO (`ulimit -r`) or give the computer less to do; an emulated machine can wait \
         for the program (--clock lockstep:PATH)",
        pause.as_secs_f64(), ago.as_secs_f64()
    )]
    HeldUp {
        /// For how long, by the machine's clock.
        pause: Duration,
        /// How long before.
        ago: Duration,
        /// What went wrong.
        failure: Box<Self>,
    },
    /// A device raised an alarm.
    #[error("{device}: {alarm}")]
    Alarm {
        /// The device's name in the configuration.
        device: String,
        /// What it said.
        alarm: Alarm,
    },
    /// A command of a device failed.
    #[error("{device}: {source}")]
    Device {
        /// The device's name in the configuration.
        device: String,
        /// Why.
        source: DeviceError,
    },
    /// A command did not end in time.
    #[error("{device}: {step} did not end within {}", units::ShortSpan(*waited))]
    Overdue {
        /// The device's name in the configuration.
        device: String,
        /// What was asked.
        step: &'static str,
        /// How long we waited.
        waited: Duration,
    },
    /// A move would leave the soft limits; nothing moved.
    #[error(
        "axis {axis}: {:.6} mm is outside the soft limits {:.3} to {:.3} mm; nothing was moved",
        target.mm(), min.mm(), max.mm()
    )]
    SoftLimit {
        /// Which axis.
        axis: String,
        /// Where it should have gone.
        target: Metres,
        /// The lower limit.
        min: Metres,
        /// The upper limit.
        max: Metres,
    },
    /// The verb needs a zeroed axis.
    #[error("axis {axis}: not zeroed since power-on; run `truestage zero` first")]
    NotZeroed {
        /// Which axis.
        axis: String,
    },
    /// What was noted of an earlier zero would be believed at the next start.
    #[error(
        "{}: cannot be removed: {source}; it tells of a zero that the axis loses now: remove it, or the next start believes it",
        path.display()
    )]
    ZeroNoted {
        /// Which file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The machine was stopped, or was never started: its alarms would not be handled.
    #[error("{device}: not moved, the machine was stopped; start it again (`Machine::start`)")]
    NotStarted {
        /// The drive.
        device: String,
    },
    /// There is no such axis.
    #[error("there is no axis `{axis}`; known: {known}")]
    NoSuchAxis {
        /// What was asked for.
        axis: String,
        /// What there is.
        known: String,
    },
    /// There is no such instrument, analog module or image controller.
    #[error("there is no {what} `{name}`; known: {known}")]
    NoSuchDevice {
        /// Which of them it should be.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// The disk of the records is too slow, or does not answer.
    #[error(transparent)]
    Disk(#[from] DiskFailure),
    /// Somebody asked to stop (Ctrl-C).
    #[error("stopped on request")]
    Interrupted,
    /// Another program asked to stop (SIGTERM), or the terminal is gone (SIGHUP).
    #[error("stopped on request (signal {signal})")]
    Terminated {
        /// Its number.
        signal: u8,
    },
}

/// The text of `failure` where its device was named before.
fn without_device(failure: &Failure, device: &str) -> String {
    let text = failure.to_string();
    let rest = text.strip_prefix(device);
    let rest = rest.and_then(|rest| rest.strip_prefix(": "));
    rest.map_or(text.clone(), str::to_owned)
}

impl Failure {
    /// The device that it is about, where it is about a single one.
    pub fn device(&self) -> Option<&str> {
        match self {
            Self::HeldUp { failure, .. } => failure.device(),
            Self::Explained { device, .. }
            | Self::Send { device, .. }
            | Self::Alarm { device, .. }
            | Self::Device { device, .. }
            | Self::Overdue { device, .. }
            | Self::NotStarted { device } => Some(device),
            Self::Engine(_)
            | Self::Link { .. }
            | Self::BusOff { .. }
            | Self::SecondMaster { .. }
            | Self::Babbling { .. }
            | Self::SoftLimit { .. }
            | Self::NotZeroed { .. }
            | Self::ZeroNoted { .. }
            | Self::NoSuchAxis { .. }
            | Self::NoSuchDevice { .. }
            | Self::Disk(_)
            | Self::Interrupted
            | Self::Terminated { .. } => None,
        }
    }

    /// Whether it is what ends a procedure that was asked to end, by whatever signal or program.
    pub const fn is_stop(&self) -> bool {
        match self {
            Self::HeldUp { failure, .. } => failure.is_stop(),
            other => matches!(other, Self::Interrupted | Self::Terminated { .. }),
        }
    }

    /// The exit code: 2 usage or configuration, 3 refused for safety, 4 device or bus, 128 and the
    /// signal's number (130 for Ctrl-C, 143 for SIGTERM) when it was stopped on request.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Engine(failure) => failure.exit_code(),
            Self::HeldUp { failure, .. } | Self::Explained { failure, .. } => failure.exit_code(),
            Self::Interrupted => STOPPED_BY + SIGINT,
            Self::Terminated { signal } => STOPPED_BY.saturating_add(*signal),
            Self::NoSuchAxis { .. } | Self::NoSuchDevice { .. } | Self::Disk(_) => 2,
            Self::SoftLimit { .. }
            | Self::NotZeroed { .. }
            | Self::ZeroNoted { .. }
            | Self::NotStarted { .. } => 3,
            Self::Send { .. }
            | Self::Link { .. }
            | Self::BusOff { .. }
            | Self::SecondMaster { .. }
            | Self::Babbling { .. }
            | Self::Alarm { .. }
            | Self::Device { .. }
            | Self::Overdue { .. } => 4,
        }
    }
}

/// A failure of a layer above, which may be one of the machine.
pub trait Layered: From<Failure> {
    /// Lets `explain` say more of it when it is the machine's own; others stay as they are.
    #[must_use]
    fn map_machine(self, explain: impl FnOnce(Failure) -> Failure) -> Self;

    /// Whether it judges what an axis did in a time: a computer that did not look meanwhile may have made it do so.
    fn depends_on_time(&self) -> bool {
        false
    }
}

impl Layered for Failure {
    fn map_machine(self, explain: impl FnOnce(Failure) -> Failure) -> Self {
        explain(self)
    }
}
