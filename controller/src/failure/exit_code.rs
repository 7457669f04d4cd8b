//! What a shell script learns of a failure.

use super::{EmulatedError, Failure};
use crate::store::StoreError;

/// What shells add to the number of the signal that ended a program.
const STOPPED_BY: u8 = 128;
/// Ctrl-C.
const SIGINT: u8 = 2;

impl Failure {
    /// The exit code: 2 usage or configuration, 3 refused for safety, 4 device or bus,
    /// 5 the result is out of tolerance, 128 and the signal's number (130 for Ctrl-C, 143 for
    /// SIGTERM) when it was stopped on request.
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Platform(failure) => failure.exit_code(),
            Self::Table(failure) => failure.exit_code(),
            Self::Engine(failure) => failure.exit_code(),
            Self::Resumable { source, .. } => source.exit_code(),
            Self::HeldUp { failure, .. } => failure.exit_code(),
            Self::Interrupted => STOPPED_BY + SIGINT,
            Self::Terminated { signal } => STOPPED_BY.saturating_add(*signal),
            Self::Volumetric(failure) => failure.exit_code(),
            Self::Config(_)
            | Self::NotConfigured { .. }
            | Self::NoSuchAxis { .. }
            | Self::NoSuchCamera { .. }
            | Self::Figures(_)
            | Self::Data(_)
            | Self::Series(_)
            | Self::Screw { .. }
            | Self::Rotary { .. }
            | Self::Misplaced { .. }
            | Self::Plan(_)
            | Self::SearchSettings { .. }
            | Self::File { .. }
            | Self::Usage { .. }
            | Self::Store(
                StoreError::Io { .. }
                | StoreError::Unknown { .. }
                | StoreError::Ambiguous { .. }
                | StoreError::NoEarlier { .. }
                | StoreError::AlreadyComplete { .. },
            )
            | Self::Emulator(EmulatedError::Config(_) | EmulatedError::NoPort { .. }) => 2,
            Self::SoftLimit { .. }
            | Self::Path { .. }
            | Self::NotZeroed { .. }
            | Self::NotStarted { .. }
            | Self::Store(_)
            | Self::Compensation { .. }
            | Self::ScrewCompensation { .. }
            | Self::RotaryCompensation { .. }
            | Self::OutOfCalibration { .. }
            | Self::StandsOff { .. }
            | Self::ScaleMismatch { .. } => 3,
            Self::Open(_)
            | Self::Send { .. }
            | Self::Link { .. }
            | Self::BusOff { .. }
            | Self::SecondMaster { .. }
            | Self::Babbling { .. }
            | Self::FringeJump { .. }
            | Self::Alarm { .. }
            | Self::Device { .. }
            | Self::Overdue { .. }
            | Self::Search { .. }
            | Self::NoLines { .. }
            | Self::Correction { .. }
            | Self::ScanMismatch { .. }
            | Self::Emulator(_) => 4,
            Self::ZeroUncertain { .. }
            | Self::Refine { .. }
            | Self::Closure { .. }
            | Self::Fit { .. }
            | Self::MadeWorse { .. }
            | Self::OutOfTolerance { .. } => 5,
        }
    }
}

#[cfg(test)]
mod tests {
    use units::Metres;

    use super::*;

    #[track_caller]
    fn check(failure: Failure, exit_code: u8) {
        assert_eq!(failure.exit_code(), exit_code, "{failure}");
    }

    #[test]
    fn the_exit_code_says_whose_turn_it_is() {
        let id = || "abc".to_owned();
        check(StoreError::Unknown { id: id() }.into(), 2);
        check(StoreError::Leased { owner: id() }.into(), 3);
        check(Failure::NotZeroed { axis: id() }, 3);
        check(Failure::ScanMismatch { wrong: 1 }, 4);
        check(Failure::Interrupted, 130);
        check(Failure::Terminated { signal: 15 }, 143);
        let (source, journal) = (Box::new(Failure::Interrupted), "run.jsonl".into());
        check(Failure::Resumable { source, journal }, 130);
        let (seen, limit) = (Metres(2e-6), Metres(1e-6));
        let axis = id();
        check(Failure::OutOfTolerance { axis, seen, limit }, 5);
    }
}
