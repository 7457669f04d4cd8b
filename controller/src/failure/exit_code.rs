//! The exit code that tells a shell script of a failure.

use super::Failure;
use crate::store::StoreError;

impl Failure {
    /// Whether it says that a calibration makes the machine worse.
    pub fn tells_worse(&self) -> bool {
        match self {
            Self::Kind(failure) => failure.tells_worse(),
            other => matches!(other, Self::MadeWorse { .. } | Self::NewIsWorse(_)),
        }
    }

    /// Whether it is what ends a procedure that was asked to end.
    pub fn is_stop(&self) -> bool {
        match self {
            Self::Machine(failure) => failure.is_stop(),
            Self::Resumable { source, .. } | Self::BeforeZero { source, .. } => source.is_stop(),
            _ => false,
        }
    }

    /// Whether the disk of the records refused, or did not answer.
    #[cfg(feature = "program")]
    pub(crate) const fn is_of_disk(&self) -> bool {
        matches!(
            self,
            Self::Store(
                StoreError::Io { .. }
                    | StoreError::Disk(_)
                    | StoreError::Unsynced { .. }
                    | StoreError::UseUnsynced { .. }
            ) | Self::Machine(machine::Failure::Disk(_))
        )
    }

    /// Whether an axis may still move after it, or nobody supervises it: a device, a bus, or what is not known.
    pub fn stops_the_machine(&self) -> bool {
        match self.exit_code() {
            // A refusal, a configuration, a result: the axis stands, and is supervised.
            2 | 3 | 5 => false,
            _ => !self.is_stop(),
        }
    }

    /// The exit code: 2 usage or configuration, 3 refused for safety, 4 device or bus,
    /// 5 the result is out of tolerance, 128 and the signal's number (130 for Ctrl-C, 143 for
    /// SIGTERM) when it was stopped on request.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Machine(failure) => failure.exit_code(),
            Self::Kind(failure) => failure.exit_code(),
            Self::Resumable { source, .. } | Self::BeforeZero { source, .. } => source.exit_code(),
            Self::Kept { exit_code, .. } => *exit_code,
            #[cfg(feature = "emulator")]
            Self::Emulator(failure) => failure.exit_code(),
            Self::Config(_)
            | Self::NotConfigured { .. }
            | Self::PatternElsewhere { .. }
            | Self::NoLimitSwitch { .. }
            | Self::Figures(_)
            | Self::Data(_)
            | Self::Series(_)
            | Self::SearchSettings { .. }
            | Self::File { .. }
            | Self::NotCertified { .. }
            | Self::Usage { .. }
            | Self::Store(
                StoreError::Io { .. }
                | StoreError::Disk(_)
                | StoreError::Unsynced { .. }
                | StoreError::UseUnsynced { .. }
                | StoreError::Unknown { .. }
                | StoreError::Ambiguous { .. }
                | StoreError::NoEarlier { .. }
                | StoreError::AlreadyComplete { .. },
            ) => 2,
            Self::Store(_)
            | Self::Compensation { .. }
            | Self::OutOfCalibration { .. }
            | Self::NotCalibrated { .. }
            | Self::BeyondCalibrated { .. }
            | Self::StandsOff { .. }
            | Self::ScaleMismatch { .. } => 3,
            Self::Open(_)
            | Self::FringeJump { .. }
            | Self::DatumSlip { .. }
            | Self::InputNotSeen { .. }
            | Self::SamplesLost(_)
            | Self::Search { .. }
            | Self::Correction { .. }
            | Self::ScanMismatch { .. }
            | Self::Unfit { .. } => 4,
            Self::ZeroUncertain { .. }
            | Self::Refine { .. }
            | Self::Closure { .. }
            | Self::Fit { .. }
            | Self::Budget { .. }
            | Self::MadeWorse { .. }
            | Self::NewIsWorse(_)
            | Self::OutOfTolerance { .. }
            | Self::Turned { .. }
            | Self::ZeroPlan { .. } => 5,
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

    fn resumable(stopped: machine::Failure) -> Failure {
        Failure::Resumable {
            source: Box::new(stopped.into()),
            journal: "run.jsonl".into(),
        }
    }

    #[test]
    fn whatever_signal_stopped_it_is_a_stop_and_its_exit_code_says_which() {
        for (signal, exit_code) in [(1, 129), (2, 130), (15, 143)] {
            let stopped = || match signal {
                2 => machine::Failure::Interrupted,
                signal => machine::Failure::Terminated { signal },
            };
            for failure in [Failure::Machine(stopped()), resumable(stopped())] {
                assert!(failure.is_stop(), "signal {signal}: {failure}");
                assert!(!failure.stops_the_machine(), "signal {signal}: {failure}");
                check(failure, exit_code);
            }
        }
        let other = machine::Failure::NotZeroed { axis: "x".into() };
        assert!(!Failure::from(other).is_stop());
    }

    #[test]
    fn the_exit_code_says_whose_turn_it_is() {
        let id = || "abc".to_owned();
        check(StoreError::Unknown { id: id() }.into(), 2);
        check(
            StoreError::Leased {
                owner: id(),
                places: Vec::new(),
            }
            .into(),
            3,
        );
        check(
            Failure::Machine(machine::Failure::NotZeroed { axis: id() }),
            3,
        );
        check(Failure::ScanMismatch { wrong: 1 }, 4);
        check(Failure::Machine(machine::Failure::Interrupted), 130);
        check(
            Failure::Machine(machine::Failure::Terminated { signal: 15 }),
            143,
        );
        check(resumable(machine::Failure::Interrupted), 130);
        let (seen, limit) = (Metres(2e-6), Metres(1e-6));
        let axis = id();
        check(Failure::OutOfTolerance { axis, seen, limit }, 5);
    }
}
