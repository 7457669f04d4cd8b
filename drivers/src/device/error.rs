//! Why a device could not carry out a command: where, what was awaited, what was seen.

use core::fmt;
use core::time::Duration;

use units::{LengthOrAngle, Short};
use wire::canopen::nmt::NmtState;
use wire::canopen::sdo::AbortCode;
use wire::canopen::{NodeId, Object};
use wire::cia402::{NamedStatus, PowerState, UnitCode};
use wire::copley::{ErrorCode, EventStatus, Faults, Parameter};

use super::{Alarm, DeviceName};

/// Why a command of a device failed.
///
/// # Example
///
/// ```
/// use drivers::device::{DeviceError, DeviceName, Seen};
/// use std::time::Duration;
///
/// let error = DeviceError::Timeout {
///     device: DeviceName::Serial("caliper"),
///     awaited: "the answer to P",
///     waited: Duration::from_millis(200),
///     seen: Seen::Nothing,
/// };
/// let text = "caliper: waited 200ms for the answer to P, last saw nothing";
/// assert_eq!(error.to_string(), text);
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the Display text says what each field is")]
pub enum DeviceError {
    /// The node aborted a transfer.
    #[error("{node}, {object}: aborted the transfer with {code} while {step}")]
    SdoAbort {
        node: NodeId,
        object: Object,
        code: AbortCode,
        step: &'static str,
    },
    /// A transfer was not answered.
    #[error("{node}, {object}: no answer within {} ({}) while {step}",
        units::ShortSpan(*waited), units::Several(*attempts, "attempt"))]
    SdoTimeout {
        node: NodeId,
        object: Object,
        waited: Duration,
        attempts: u32,
        step: &'static str,
    },
    /// A transfer went wrong in another way and was aborted by us.
    #[error("{node}, {object}: transfer aborted by this controller with {code} while {step}")]
    SdoProtocol {
        node: NodeId,
        object: Object,
        code: AbortCode,
        step: &'static str,
    },
    /// The device is not the one the configuration names.
    #[error(
        "{node}: {what} is {seen:#010X}, the configuration says {expected:#010X}; fit the right \
         device or correct the configuration"
    )]
    WrongIdentity {
        node: NodeId,
        what: &'static str,
        expected: u32,
        seen: u32,
    },
    /// A value read back differs from what was written.
    #[error("{node}, {object}: read back {seen:#X}, wrote {expected:#X} ({step})")]
    ReadBack {
        node: NodeId,
        object: Object,
        expected: u64,
        seen: u64,
        step: &'static str,
    },
    /// The drive's units are not those of the configuration.
    #[error(
        "{node}, {object}: one encoder increment is {seen} position units, the configured scale \
         says {expected}; correct the scale or the drive's factors", seen = Short(*seen), expected = Short(*expected)
    )]
    WrongScale {
        node: NodeId,
        object: Object,
        expected: f64,
        seen: f64,
    },
    /// The drive counts speed or acceleration in another unit than the position's.
    #[error(
        "{node}, {object}: the drive counts {what} in another unit ({seen}) than its position units \
         per second; set {object} to those, or use a drive that has them: nothing was moved"
    )]
    WrongUnit {
        node: NodeId,
        object: Object,
        what: &'static str,
        seen: UnitCode,
    },
    /// The drive turns speeds or accelerations into units of its own.
    #[error(
        "{node}, {object}: the drive multiplies {what} by {above}/{below}; set both parts to 1, so \
         that {what} counts in position units: nothing was moved"
    )]
    WrongFactor {
        node: NodeId,
        object: Object,
        what: &'static str,
        above: u32,
        below: u32,
    },
    /// The first motion of a drive that states no units was not what was asked for.
    #[error(
        "{node}: the first motion had {factor:.2} times the {what} that was asked for, which fits {fits}; set \
         the drive to position units per second (0x60A9, 0x60AA, or its maker's program)"
    )]
    UnitSeen {
        node: NodeId,
        what: &'static str,
        factor: f64,
        fits: &'static str,
    },
    /// Something that was awaited did not come.
    #[error("{device}: waited {} for {awaited}, last saw {seen}", units::ShortSpan(*waited))]
    Timeout {
        device: DeviceName,
        awaited: &'static str,
        waited: Duration,
        seen: Seen,
    },
    /// The drive refused or failed a command.
    #[error("{node}: {step} failed, drive is in {state}{}", what_to_do(*state))]
    DriveRefused {
        node: NodeId,
        step: &'static str,
        state: PowerState,
    },
    /// The drive is not in the mode that it was given: it is not enabled, or was switched off.
    #[error(
        "{node}: not enabled, the drive shows mode {seen} (0x6061) and was given mode {expected} \
         (0x6060); does another program set it, or does it take a mode only when enabled?"
    )]
    WrongMode {
        node: NodeId,
        expected: i8,
        seen: i8,
    },
    /// A quick stop had no effect; the drive was switched off while its axis moved.
    #[error(
        "{device}: the quick stop had no effect, and the drive was switched off in motion: the axis \
         coasts; set what a quick stop does (0x605A) and its deceleration (0x6085)"
    )]
    NoQuickStop { device: DeviceName },
    /// A homing was called done, and the place shown has not become the home coordinate.
    #[error(
        "{node}: not homed, the drive calls homing attained, but shows {shown:.3} in place of \
         {home:.3}; does 0x607C mean the position at home to this drive, or are its bits those \
         of a homing before?"
    )]
    NotAtHome {
        node: NodeId,
        shown: LengthOrAngle,
        home: LengthOrAngle,
    },
    /// A condition that the command needs is not met.
    #[error("{device}: {step} needs {needs}")]
    NotPossible {
        device: DeviceName,
        step: &'static str,
        needs: &'static str,
    },
    /// A value cannot be represented in the drive's units.
    #[error(
        "{node}: {what} {} {unit} does not fit {object} (limit {} {unit})",
        Short(*value), Short(*limit)
    )]
    OutOfRange {
        node: NodeId,
        object: Object,
        what: &'static str,
        value: f64,
        limit: f64,
        unit: &'static str,
    },
    /// A device refused a command.
    #[error("{device}: {step} refused with {status}")]
    Refused {
        device: DeviceName,
        step: &'static str,
        status: wire::in_sight::Status,
    },
    /// Too few good pictures.
    #[error(
        "{device}: {good} of {wanted} pictures were good; of the {} bad ones {without_target} \
         showed no target and {judged_bad} were judged bad (best score {:.0} %); is the target in \
         the field, clean, lit and at rest?",
        without_target + judged_bad, best_score * 100.0
    )]
    NoGoodPicture {
        device: DeviceName,
        good: u32,
        wanted: u32,
        without_target: u32,
        judged_bad: u32,
        best_score: f64,
    },
    /// An alarm ended the command.
    #[error("{device}: {step} ended by an alarm: {alarm}")]
    Alarmed {
        device: DeviceName,
        step: &'static str,
        alarm: Alarm,
    },
    /// An amplifier on a serial line did not answer.
    #[error(
        "{device}: no answer ({}) while {step}; check its power, its address, the cable and the line's \
         baud rate",
        units::Several(*attempts, "attempt")
    )]
    Unanswered {
        device: DeviceName,
        step: &'static str,
        attempts: u32,
    },
    /// An amplifier on a serial line refused a command.
    #[error("{device}{}: {code} while {step}", of_parameter(*parameter))]
    RefusedByAmplifier {
        device: DeviceName,
        parameter: Option<Parameter>,
        code: ErrorCode,
        step: &'static str,
    },
    /// A parameter read back differs from what was written, or is not a number.
    #[error("{device}, parameter {parameter}: read back {seen}, wrote {expected} ({step})")]
    ParameterReadBack {
        device: DeviceName,
        parameter: Parameter,
        expected: i64,
        seen: String,
        step: &'static str,
    },
    /// The amplifier is not the one the configuration names.
    #[error(
        "{device}: {what} is {seen}, the configuration says {expected}; fit the right device or \
         correct the configuration"
    )]
    WrongAmplifier {
        device: DeviceName,
        what: &'static str,
        expected: String,
        seen: String,
    },
    /// A value cannot be represented in the amplifier's units.
    #[error(
        "{device}: {what} {} {unit} does not fit parameter {parameter} (limit {} {unit})",
        Short(*value), Short(*limit)
    )]
    ParameterOutOfRange {
        device: DeviceName,
        parameter: Parameter,
        what: &'static str,
        value: f64,
        limit: f64,
        unit: &'static str,
    },
    /// Latched faults prevent the command.
    #[error("{device}: {step} is not possible with latched faults: {faults}")]
    Faulted {
        device: DeviceName,
        step: &'static str,
        faults: Faults,
    },
    /// The amplifier aborted a move.
    #[error("{device}: {step} was aborted by the amplifier, last saw {seen}")]
    Aborted {
        device: DeviceName,
        step: &'static str,
        seen: Seen,
    },
}

/// What helps against a state in which a drive does nothing that is asked of it.
const fn what_to_do(state: PowerState) -> &'static str {
    match state {
        PowerState::Fault | PowerState::FaultReactionActive => {
            ": remove the fault's cause, acknowledge it by `truestage reset`, and zero the axis again"
        }
        _ => "",
    }
}

fn of_parameter(parameter: Option<Parameter>) -> String {
    parameter.map_or_else(String::new, |parameter| format!(", parameter {parameter}"))
}

/// What was last seen when something awaited did not come.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is one kind of observation")]
pub enum Seen {
    Nothing,
    Nmt(NmtState),
    Power(PowerState),
    Statusword(NamedStatus),
    Mode(i8),
    Position(LengthOrAngle),
    Samples(u32),
    Events(EventStatus),
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing"),
            Self::Nmt(state) => state.fmt(f),
            Self::Power(state) => state.fmt(f),
            Self::Statusword(status) => status.fmt(f),
            Self::Mode(raw) => write!(f, "mode {raw}"),
            Self::Position(at) => write!(f, "position {at:.6}"),
            Self::Samples(count) => write!(f, "{count} samples"),
            Self::Events(events) => write!(f, "event status {:#010X}", events.bits()),
        }
    }
}
