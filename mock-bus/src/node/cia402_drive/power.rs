//! The power state machine (CiA 402-2 / IEC 61800-7-201, figure "state machine"): pure.

use wire::cia402::{Controlword, PowerState};

/// The drive's states; on the wire they are [`PowerState`]s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Power {
    NotReady,
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    QuickStopActive,
    FaultReactionActive,
    Fault,
}

impl Power {
    pub(super) const fn wire(self) -> PowerState {
        match self {
            Self::NotReady => PowerState::NotReadyToSwitchOn,
            Self::SwitchOnDisabled => PowerState::SwitchOnDisabled,
            Self::ReadyToSwitchOn => PowerState::ReadyToSwitchOn,
            Self::SwitchedOn => PowerState::SwitchedOn,
            Self::OperationEnabled => PowerState::OperationEnabled,
            Self::QuickStopActive => PowerState::QuickStopActive,
            Self::FaultReactionActive => PowerState::FaultReactionActive,
            Self::Fault => PowerState::Fault,
        }
    }
}

/// What bits 0 to 3 of the controlword ask for (mask 0x8F, table "command coding").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    DisableVoltage,
    QuickStop,
    Shutdown,
    /// Also "disable operation".
    SwitchOn,
    EnableOperation,
}

impl Command {
    pub(super) fn of(controlword: Controlword) -> Self {
        if !controlword.contains(Controlword::ENABLE_VOLTAGE) {
            Self::DisableVoltage
        } else if !controlword.contains(Controlword::NO_QUICK_STOP) {
            Self::QuickStop
        } else if !controlword.contains(Controlword::SWITCH_ON) {
            Self::Shutdown
        } else if controlword.contains(Controlword::ENABLE_OPERATION) {
            Self::EnableOperation
        } else {
            Self::SwitchOn
        }
    }
}

/// The standard's numbered transitions that a controlword causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Transition {
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
    T8,
    T9,
    T10,
    T11,
    T12,
    T16,
}

/// Which transition `command` causes; one at a time, so that a drive told to enable from
/// ready to switch on is seen in switched on.
///
/// `resumable`: the quick stop option code is 5 to 8, where transition 16 exists.
pub(super) fn transition(power: Power, command: Command, resumable: bool) -> Option<Transition> {
    use Command::{DisableVoltage, EnableOperation, QuickStop, Shutdown, SwitchOn};
    use Transition::{T2, T3, T4, T5, T6, T7, T8, T9, T10, T11, T12, T16};
    match (power, command) {
        (Power::SwitchOnDisabled, Shutdown) => Some(T2),
        (Power::ReadyToSwitchOn, SwitchOn | EnableOperation) => Some(T3),
        (Power::ReadyToSwitchOn, DisableVoltage | QuickStop) => Some(T7),
        (Power::SwitchedOn, EnableOperation) => Some(T4),
        (Power::SwitchedOn, Shutdown) => Some(T6),
        (Power::SwitchedOn, DisableVoltage | QuickStop) => Some(T10),
        (Power::OperationEnabled, SwitchOn) => Some(T5),
        (Power::OperationEnabled, Shutdown) => Some(T8),
        (Power::OperationEnabled, DisableVoltage) => Some(T9),
        (Power::OperationEnabled, QuickStop) => Some(T11),
        (Power::QuickStopActive, DisableVoltage) => Some(T12),
        (Power::QuickStopActive, EnableOperation) if resumable => Some(T16),
        (Power::SwitchOnDisabled, DisableVoltage | QuickStop | SwitchOn | EnableOperation)
        | (Power::ReadyToSwitchOn, Shutdown)
        | (Power::SwitchedOn, SwitchOn)
        | (Power::OperationEnabled, EnableOperation)
        | (Power::QuickStopActive, QuickStop | Shutdown | SwitchOn | EnableOperation)
        | (
            Power::NotReady | Power::FaultReactionActive | Power::Fault,
            DisableVoltage | QuickStop | Shutdown | SwitchOn | EnableOperation,
        ) => None,
    }
}
