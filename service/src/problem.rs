//! Why an order was not carried out: a problem in the form of RFC 9457, with the same text as the command line.

use drivers::device::DeviceError;
use serde::{Deserialize, Serialize};
use truestage::Failure;
use utoipa::ToSchema;

/// What kind of problem it is, for programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Code {
    /// The request cannot be understood.
    BadRequest,
    /// A quantity has no unit, or one of another kind.
    BadQuantity,
    /// There is no such axis.
    NoSuchAxis,
    /// There is no such motion.
    NoSuchMotion,
    /// There is no such run.
    NoSuchRun,
    /// There is no such calibration, or none before.
    NoSuchCalibration,
    /// There is no such resource.
    NotFound,
    /// The resource knows no such method.
    MethodNotAllowed,
    /// The axis has a motion or a run.
    AxisBusy,
    /// The axis is switched off.
    AxisDisabled,
    /// The axis has no zero.
    NotZeroed,
    /// A target outside the soft limits.
    SoftLimit,
    /// A target that the calibration does not cover, or a calibration that cannot be used.
    Calibration,
    /// Not done for safety, as the cause says: a pose out of reach, a path that cannot be driven.
    Refused,
    /// The machine was stopped by a failure and waits for a reset.
    ErrorStop,
    /// Somebody else has the lease.
    Leased,
    /// The token of a lease that has lapsed, was given back or taken, or is of an earlier service.
    LeaseLapsed,
    /// The same Idempotency-Key with another request.
    KeyReused,
    /// This service does not offer that for this axis.
    NotOffered,
    /// The run is in another state than the request needs.
    RunState,
    /// The run does not ask that: it asks nothing now, or something else, or is not answered so.
    NotAsked,
    /// Too many orders are waiting.
    Busy,
    /// Whoever asks has no token that is known.
    Unauthorized,
    /// Whoever asks must not.
    Forbidden,
    /// Whoever asks does so too often.
    TooMany,
    /// The request is larger than is taken.
    TooLarge,
    /// The service ends.
    Ending,
    /// A file cannot be written or read.
    Storage,
    /// No other Idempotency-Key can be remembered.
    KeysFull,
    /// The configuration does not allow it.
    Configuration,
    /// A device or a bus.
    Device,
    /// A device did not answer, or a command did not end, in time.
    Overdue,
    /// A device raised an alarm.
    Alarm,
    /// The drive's following error.
    FollowingError,
    /// The drive left operation enabled: a fault, STO, a limit.
    DriveState,
    /// A heartbeat or process data stayed away.
    Silent,
    /// A device restarted.
    Restarted,
    /// The measurement beam or the laser.
    Beam,
    /// A result out of tolerance, or too uncertain.
    OutOfTolerance,
    /// A stop was asked for.
    Stopped,
    /// The service was restarted meanwhile.
    ServiceRestarted,
}

impl Code {
    /// The status of an HTTP answer.
    pub const fn status(self) -> u16 {
        match self {
            Self::BadRequest | Self::BadQuantity => 400,
            Self::Unauthorized => 401,
            Self::Forbidden => 403,
            Self::TooMany => 429,
            Self::NoSuchAxis
            | Self::NoSuchMotion
            | Self::NoSuchRun
            | Self::NoSuchCalibration
            | Self::NotFound => 404,
            Self::MethodNotAllowed => 405,
            Self::TooLarge => 413,
            Self::SoftLimit
            | Self::Calibration
            | Self::Refused
            | Self::KeyReused
            | Self::NotOffered
            | Self::Configuration
            | Self::OutOfTolerance => 422,
            Self::Leased | Self::LeaseLapsed => 423,
            Self::AxisBusy
            | Self::AxisDisabled
            | Self::NotZeroed
            | Self::ErrorStop
            | Self::RunState
            | Self::NotAsked
            | Self::Stopped
            | Self::ServiceRestarted => 409,
            Self::Device
            | Self::Overdue
            | Self::Alarm
            | Self::FollowingError
            | Self::DriveState
            | Self::Silent
            | Self::Restarted
            | Self::Beam => 502,
            Self::Busy | Self::Ending | Self::Storage => 503,
            Self::KeysFull => 507,
        }
    }

    /// The exit code of a command that fails so: 2 usage or configuration, 3 refused for safety, 4 device or
    /// bus, 5 out of tolerance, 130 stopped.
    pub const fn exit_code(self) -> u8 {
        match self {
            Self::AxisBusy
            | Self::AxisDisabled
            | Self::NotZeroed
            | Self::SoftLimit
            | Self::Calibration
            | Self::Refused
            | Self::ErrorStop
            | Self::Leased
            | Self::LeaseLapsed
            | Self::Unauthorized
            | Self::Forbidden
            | Self::NotAsked
            | Self::RunState => 3,
            Self::OutOfTolerance => 5,
            Self::Stopped => 130,
            Self::Busy
            | Self::TooMany
            | Self::Ending
            | Self::Device
            | Self::Overdue
            | Self::Alarm
            | Self::FollowingError
            | Self::DriveState
            | Self::Silent
            | Self::Restarted
            | Self::ServiceRestarted
            | Self::Beam => 4,
            Self::BadRequest
            | Self::BadQuantity
            | Self::NoSuchAxis
            | Self::NoSuchMotion
            | Self::NoSuchRun
            | Self::NoSuchCalibration
            | Self::NotFound
            | Self::MethodNotAllowed
            | Self::KeyReused
            | Self::NotOffered
            | Self::TooLarge
            | Self::Storage
            | Self::KeysFull
            | Self::Configuration => 2,
        }
    }

    /// As it is written in JSON.
    pub fn word(self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        value.as_str().unwrap_or_default().to_owned()
    }
}

/// Why an order was not carried out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(into = "ProblemBody", from = "ProblemBody")]
#[error("{}", self.detail())]
pub struct Problem {
    /// For programs.
    pub code: Code,
    /// What happened.
    pub cause: String,
    /// What to do; empty where nobody knows.
    pub help: String,
    /// What the command line would end with.
    pub exit_code: u8,
}

/// A problem as it is written (RFC 9457).
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
pub struct ProblemBody {
    /// `urn:truestage:problem:` and the code.
    #[serde(rename = "type")]
    pub kind: String,
    /// The code in words.
    pub title: String,
    /// The status of the answer.
    pub status: u16,
    /// Cause and help, as the command line prints them.
    pub detail: String,
    /// For programs.
    pub code: Code,
    /// What happened.
    pub cause: String,
    /// What to do; empty where nobody knows.
    pub help: String,
    /// What the command line would end with.
    pub exit_code: u8,
}

impl Problem {
    /// A problem of this kind.
    pub fn new(code: Code, cause: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            code,
            cause: cause.into(),
            help: help.into(),
            exit_code: code.exit_code(),
        }
    }

    /// Cause and help, as the command line prints them.
    pub fn detail(&self) -> String {
        match self.help.is_empty() {
            true => self.cause.clone(),
            false => format!("{}; {}", self.cause, self.help),
        }
    }
}

impl From<Problem> for ProblemBody {
    fn from(problem: Problem) -> Self {
        let word = problem.code.word();
        Self {
            kind: format!("urn:truestage:problem:{word}"),
            title: word.split('_').collect::<Vec<_>>().join(" "),
            status: problem.code.status(),
            detail: problem.detail(),
            code: problem.code,
            cause: problem.cause,
            help: problem.help,
            exit_code: problem.exit_code,
        }
    }
}

impl From<ProblemBody> for Problem {
    fn from(body: ProblemBody) -> Self {
        Self {
            code: body.code,
            cause: body.cause,
            help: body.help,
            exit_code: body.exit_code,
        }
    }
}

impl From<&Failure> for Problem {
    fn from(failure: &Failure) -> Self {
        let (cause, help) = match failure {
            Failure::Usage { what, help } => (what.clone(), help.clone()),
            other => (other.to_string(), String::new()),
        };
        Self {
            code: code_of(failure),
            cause,
            help,
            exit_code: failure.exit_code(),
        }
    }
}

impl From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        Self::from(&failure)
    }
}

/// The code of `failure` as programs read it: `drive_state`.
pub fn failure_code(failure: &Failure) -> String {
    let code = serde_json::to_value(code_of(failure));
    let text = code.ok().and_then(|code| code.as_str().map(str::to_owned));
    text.expect("a code is a word")
}

/// What kind of problem a failure is.
pub(crate) fn code_of(failure: &Failure) -> Code {
    match failure {
        Failure::Machine(failure) => code_of_machine(failure),
        Failure::Resumable { source, .. } => code_of(source),
        Failure::OutOfCalibration { .. }
        | Failure::NotCalibrated { .. }
        | Failure::BeyondCalibrated { .. }
        | Failure::Compensation { .. }
        | Failure::StandsOff { .. } => Code::Calibration,
        Failure::Store(failure) => code_of_store(failure),
        Failure::File { .. } => Code::Storage,
        other => match other.exit_code() {
            2 => Code::Configuration,
            3 => Code::Refused,
            5 => Code::OutOfTolerance,
            _ => Code::Device,
        },
    }
}

/// Whether the disk is to blame, or what was asked for.
const fn code_of_store(failure: &machine::records::StoreError) -> Code {
    use machine::records::StoreError as Of;
    match failure {
        Of::Unknown { .. } | Of::NoEarlier { .. } => Code::NoSuchCalibration,
        Of::Ambiguous { .. }
        | Of::Foreign { .. }
        | Of::OtherKind { .. }
        | Of::Model { .. }
        | Of::Part { .. } => Code::Calibration,
        Of::AlreadyComplete { .. } | Of::NotResumable { .. } => Code::Refused,
        Of::Io { .. }
        | Of::Disk(_)
        | Of::Unsynced { .. }
        | Of::UseUnsynced { .. }
        | Of::Damaged { .. }
        | Of::Format { .. }
        | Of::Unsound { .. }
        | Of::Newer { .. }
        | Of::Leased { .. } => Code::Storage,
    }
}

fn code_of_machine(failure: &machine::Failure) -> Code {
    use machine::Failure as Of;
    match failure {
        Of::SoftLimit { .. } => Code::SoftLimit,
        Of::NotZeroed { .. } => Code::NotZeroed,
        Of::ZeroNoted { .. } | Of::Disk(_) => Code::Storage,
        Of::NotStarted { .. } => Code::ErrorStop,
        Of::NoSuchAxis { .. } => Code::NoSuchAxis,
        Of::NoSuchDevice { .. } => Code::Configuration,
        Of::Overdue { .. }
        | Of::Device {
            source: DeviceError::Timeout { .. },
            ..
        } => Code::Overdue,
        Of::Interrupted | Of::Terminated { .. } => Code::Stopped,
        Of::Explained {
            finding: machine::Finding::Restarted { .. },
            ..
        } => Code::Restarted,
        Of::HeldUp { failure, .. }
        | Of::Explained { failure, .. }
        | Of::Babbling {
            missing: failure, ..
        } => code_of_machine(failure),
        Of::Alarm { alarm, .. }
        | Of::Device {
            source: DeviceError::Alarmed { alarm, .. },
            ..
        } => code_of_alarm(alarm),
        Of::Engine(_)
        | Of::Send { .. }
        | Of::Link { .. }
        | Of::BusOff { .. }
        | Of::SecondMaster { .. }
        | Of::Device { .. } => Code::Device,
    }
}

fn code_of_alarm(alarm: &drivers::device::Alarm) -> Code {
    use drivers::device::Alarm as Of;
    match alarm {
        Of::HeartbeatLost { .. }
        | Of::PdoLost { .. }
        | Of::StreamSilent { .. }
        | Of::StaleSample { .. }
        | Of::AmplifierSilent { .. } => Code::Silent,
        Of::UnexpectedBootUp { .. }
        | Of::DuplicateNode { .. }
        | Of::CountRestarted
        | Of::AmplifierRestarted { .. } => Code::Restarted,
        Of::DriveState { .. } => Code::DriveState,
        Of::FollowingError { .. } => Code::FollowingError,
        Of::BeamLost | Of::BeamWeak { .. } | Of::LaserLost => Code::Beam,
        _ => Code::Alarm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_says_what_the_command_line_says() {
        let failure = Failure::Machine(machine::Failure::NotZeroed { axis: "x".into() });
        let problem = Problem::from(&failure);
        assert_eq!(problem.to_string(), failure.to_string());
        let body = ProblemBody::from(problem);
        assert_eq!((body.status, body.exit_code), (409, 3));
        assert_eq!(body.kind, "urn:truestage:problem:not_zeroed");
        let usage = Failure::Usage {
            what: "no axis is named".into(),
            help: "name one".into(),
        };
        let problem = Problem::from(&usage);
        assert_eq!(problem.to_string(), usage.to_string());
        assert_eq!(problem.help, "name one");
    }
}
