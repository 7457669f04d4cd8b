//! The power state machine of CiA 402 (IEC 61800-7-201, 8.4): which controlword leads on.
//!
//! Every statusword is judged by the state it shows now, never by the state it should show
//! next: a drive that passes through two states between two samples is followed just the same.
//! Bit 5 of the statusword counts only where the standard gives it. A fault is reset by one
//! edge of bit 7 and not again: a cause that remains is for a person.

use core::time::Duration;
use units::Time;
use wire::cia402::{Controlword, PowerState, Statusword};

/// Where the drive shall go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Goal {
    /// Up to operation enabled.
    OperationEnabled,
    /// Down to switch on disabled, step by step.
    SwitchOnDisabled,
    /// Quick stop, then switch on disabled.
    QuickStop,
    /// Out of fault, once.
    FaultReset,
}

/// Why a goal is out of reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerFailure {
    /// The drive is faulted, or became so.
    Faulted {
        /// Its state.
        state: PowerState,
    },
    /// The drive did not leave `from`.
    TimedOut {
        /// The state it stayed in.
        from: PowerState,
        /// The state it should have gone to.
        to: PowerState,
        /// What was awaited, for a person.
        awaited: &'static str,
        /// How long.
        waited: Duration,
    },
    /// The drive changes its state but gets nowhere.
    Wanders {
        /// Where it is now.
        state: PowerState,
    },
}

/// What to do after a statusword.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerStep {
    /// Send this (again) and wait.
    Command(Controlword),
    /// The goal is reached; this controlword keeps it.
    Done(Controlword),
    /// It cannot be reached.
    Failed(PowerFailure),
}

/// More changes of state than this lead nowhere.
const CHANGES_MAX: u8 = 16;

/// One way to one goal.
///
/// # Example
///
/// ```
/// use drivers::protocol::power_state::{Goal, PowerSequence, PowerStep};
/// use std::time::Duration;
/// use units::Time;
/// use wire::cia402::{Controlword, Statusword};
///
/// let patience = Duration::from_millis(500);
/// let mut sequence = PowerSequence::new(Time::ZERO, Goal::OperationEnabled, patience);
/// let mut next = |raw| sequence.next(Time::ZERO, Statusword::from_bits_retain(raw), true);
/// assert_eq!(next(0x0250), PowerStep::Command(Controlword::SHUTDOWN));
/// assert_eq!(next(0x0231), PowerStep::Command(Controlword::SWITCH_ON_COMMAND));
/// assert_eq!(next(0x0233), PowerStep::Command(Controlword::ENABLE_COMMAND));
/// assert_eq!(next(0x0237), PowerStep::Done(Controlword::ENABLE_COMMAND));
/// ```
#[derive(Debug)]
pub struct PowerSequence {
    goal: Goal,
    transition: Duration,
    from: Option<PowerState>,
    since: Time,
    changes: u8,
    /// Bit 7 was low and seen so; the edge may come.
    reset_armed: bool,
    reset_sent: bool,
}

impl PowerSequence {
    /// Begins; each transition may take `transition`.
    pub const fn new(now: Time, goal: Goal, transition: Duration) -> Self {
        Self {
            goal,
            transition,
            from: None,
            since: now,
            changes: 0,
            reset_armed: false,
            reset_sent: false,
        }
    }

    /// The goal.
    pub const fn goal(&self) -> Goal {
        self.goal
    }

    /// When the present transition is too late.
    pub fn poll_timeout(&self) -> Time {
        self.since + self.transition
    }

    /// The first controlword, before any statusword: what is safe whatever the state is.
    /// A quick stop waits for nothing.
    pub const fn first(&self) -> Option<Controlword> {
        match self.goal {
            Goal::QuickStop => Some(Controlword::QUICK_STOP_COMMAND),
            Goal::OperationEnabled | Goal::SwitchOnDisabled | Goal::FaultReset => None,
        }
    }

    /// What the drive's state and the time mean. `standing`: the axis does not move, so that
    /// after a quick stop the power may go.
    pub fn next(&mut self, now: Time, status: Statusword, standing: bool) -> PowerStep {
        let state = status.state();
        if self.from != Some(state) {
            if self.from.is_some() {
                self.changes += 1;
            }
            self.from = Some(state);
            self.since = now;
            if self.changes > CHANGES_MAX {
                return PowerStep::Failed(PowerFailure::Wanders { state });
            }
        }
        let (step, to) = match self.goal {
            Goal::OperationEnabled => up(state),
            Goal::SwitchOnDisabled => down(state),
            Goal::QuickStop => stop(state, standing),
            Goal::FaultReset => self.reset(state),
        };
        match step {
            PowerStep::Command(_) if now >= self.poll_timeout() => {
                PowerStep::Failed(PowerFailure::TimedOut {
                    from: state,
                    to,
                    awaited: awaited(to),
                    waited: now.since(self.since),
                })
            }
            step => step,
        }
    }

    fn reset(&mut self, state: PowerState) -> (PowerStep, PowerState) {
        const NO_EDGE: Controlword = Controlword::empty();
        let step = match state {
            PowerState::Fault if !self.reset_armed => {
                self.reset_armed = true;
                PowerStep::Command(NO_EDGE)
            }
            PowerState::Fault => {
                self.reset_sent = true;
                PowerStep::Command(Controlword::FAULT_RESET)
            }
            PowerState::FaultReactionActive
            | PowerState::NotReadyToSwitchOn
            | PowerState::Unknown(_) => {
                let high = self.reset_sent;
                PowerStep::Command(if high {
                    Controlword::FAULT_RESET
                } else {
                    NO_EDGE
                })
            }
            PowerState::SwitchOnDisabled
            | PowerState::ReadyToSwitchOn
            | PowerState::SwitchedOn
            | PowerState::OperationEnabled
            | PowerState::QuickStopActive => PowerStep::Done(keep(state)),
        };
        (step, PowerState::SwitchOnDisabled)
    }
}

/// The controlword that changes nothing in a state.
pub const fn keep(state: PowerState) -> Controlword {
    match state {
        PowerState::ReadyToSwitchOn => Controlword::SHUTDOWN,
        PowerState::SwitchedOn => Controlword::SWITCH_ON_COMMAND,
        PowerState::OperationEnabled => Controlword::ENABLE_COMMAND,
        PowerState::QuickStopActive => Controlword::QUICK_STOP_COMMAND,
        PowerState::NotReadyToSwitchOn
        | PowerState::SwitchOnDisabled
        | PowerState::FaultReactionActive
        | PowerState::Fault
        | PowerState::Unknown(_) => Controlword::empty(),
    }
}

const fn up(state: PowerState) -> (PowerStep, PowerState) {
    let command = PowerStep::Command;
    match state {
        PowerState::NotReadyToSwitchOn | PowerState::Unknown(_) => {
            (command(Controlword::empty()), PowerState::SwitchOnDisabled)
        }
        PowerState::SwitchOnDisabled => {
            (command(Controlword::SHUTDOWN), PowerState::ReadyToSwitchOn)
        }
        PowerState::ReadyToSwitchOn => (
            command(Controlword::SWITCH_ON_COMMAND),
            PowerState::SwitchedOn,
        ),
        PowerState::SwitchedOn => (
            command(Controlword::ENABLE_COMMAND),
            PowerState::OperationEnabled,
        ),
        PowerState::OperationEnabled => (PowerStep::Done(Controlword::ENABLE_COMMAND), state),
        // Transition 16 exists only with 0x605A 5 to 8: the way round always does.
        PowerState::QuickStopActive => {
            (command(Controlword::empty()), PowerState::SwitchOnDisabled)
        }
        PowerState::FaultReactionActive | PowerState::Fault => (
            PowerStep::Failed(PowerFailure::Faulted { state }),
            PowerState::OperationEnabled,
        ),
    }
}

const fn down(state: PowerState) -> (PowerStep, PowerState) {
    let command = PowerStep::Command;
    match state {
        PowerState::OperationEnabled => (
            command(Controlword::SWITCH_ON_COMMAND),
            PowerState::SwitchedOn,
        ),
        PowerState::SwitchedOn => (command(Controlword::SHUTDOWN), PowerState::ReadyToSwitchOn),
        PowerState::ReadyToSwitchOn
        | PowerState::QuickStopActive
        | PowerState::NotReadyToSwitchOn
        | PowerState::FaultReactionActive
        | PowerState::Unknown(_) => (command(Controlword::empty()), PowerState::SwitchOnDisabled),
        // A faulted drive gives no torque: nothing is left to switch off.
        PowerState::SwitchOnDisabled | PowerState::Fault => {
            (PowerStep::Done(Controlword::empty()), state)
        }
    }
}

const fn stop(state: PowerState, standing: bool) -> (PowerStep, PowerState) {
    let command = PowerStep::Command;
    match state {
        PowerState::OperationEnabled => (
            command(Controlword::QUICK_STOP_COMMAND),
            PowerState::QuickStopActive,
        ),
        // With 0x605A 5 to 8 the drive stays here until it is told otherwise.
        PowerState::QuickStopActive if standing => {
            (command(Controlword::empty()), PowerState::SwitchOnDisabled)
        }
        PowerState::QuickStopActive
        | PowerState::SwitchedOn
        | PowerState::ReadyToSwitchOn
        | PowerState::NotReadyToSwitchOn
        | PowerState::FaultReactionActive
        | PowerState::Unknown(_) => (
            command(Controlword::QUICK_STOP_COMMAND),
            PowerState::SwitchOnDisabled,
        ),
        PowerState::SwitchOnDisabled | PowerState::Fault => {
            (PowerStep::Done(Controlword::empty()), state)
        }
    }
}

const fn awaited(to: PowerState) -> &'static str {
    match to {
        PowerState::NotReadyToSwitchOn => "the state not ready to switch on",
        PowerState::SwitchOnDisabled => "the state switch on disabled",
        PowerState::ReadyToSwitchOn => "the state ready to switch on",
        PowerState::SwitchedOn => "the state switched on",
        PowerState::OperationEnabled => "the state operation enabled",
        PowerState::QuickStopActive => "the state quick stop active",
        PowerState::FaultReactionActive => "the end of the fault reaction",
        PowerState::Fault => "the state fault",
        PowerState::Unknown(_) => "a known state",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(500);

    fn word(raw: u16) -> Statusword {
        Statusword::from_bits_retain(raw)
    }

    /// Statuswords in, controlwords out; the last answer is returned.
    #[track_caller]
    fn check(goal: Goal, dialog: &[(u16, u16)]) -> PowerStep {
        let mut sequence = PowerSequence::new(Time::ZERO, goal, PATIENCE);
        let mut last = None;
        for (index, (status, control)) in dialog.iter().enumerate() {
            let now = Time::ZERO + Duration::from_millis(index as u64);
            let step = sequence.next(now, word(*status), true);
            let (PowerStep::Command(seen) | PowerStep::Done(seen)) = step else {
                panic!("step {index}: {step:?}")
            };
            assert_eq!(seen.bits(), *control, "step {index}");
            last = Some(step);
        }
        last.unwrap()
    }

    /// Kollmorgen AKD CANopen manual, p. 145: 0x06, 0x07, 0x0F.
    #[test]
    fn enabling_walks_the_standards_transitions() {
        let dialog = [
            (0x0250, 0x06),
            (0x0231, 0x07),
            (0x0233, 0x0F),
            (0x0237, 0x0F),
        ];
        let last = check(Goal::OperationEnabled, &dialog);
        assert_eq!(last, PowerStep::Done(Controlword::ENABLE_COMMAND));
    }

    #[test]
    fn skipped_states_and_either_bit_5_are_followed() {
        let dialog = [(0x0270, 0x06), (0x0233, 0x0F), (0x0637, 0x0F)];
        assert!(matches!(
            check(Goal::OperationEnabled, &dialog),
            PowerStep::Done(_)
        ));
    }

    #[test]
    fn enabling_out_of_a_quick_stop_goes_by_switch_on_disabled() {
        check(
            Goal::OperationEnabled,
            &[(0x0217, 0x00), (0x0250, 0x06), (0x0231, 0x07)],
        );
    }

    #[test]
    fn a_faulted_drive_is_not_enabled_and_not_reset_unasked() {
        let mut sequence = PowerSequence::new(Time::ZERO, Goal::OperationEnabled, PATIENCE);
        let step = sequence.next(Time::ZERO, word(0x0218), true);
        let state = PowerState::Fault;
        assert_eq!(step, PowerStep::Failed(PowerFailure::Faulted { state }));
    }

    #[test]
    fn a_fault_is_reset_by_one_edge_only() {
        let dialog = [
            (0x0238, 0x00),
            (0x0238, 0x80),
            (0x0238, 0x80),
            (0x0238, 0x80),
            (0x0250, 0x00),
        ];
        assert!(matches!(
            check(Goal::FaultReset, &dialog),
            PowerStep::Done(_)
        ));
    }

    #[test]
    fn a_fault_whose_cause_remains_times_out_naming_both_states() {
        let mut sequence = PowerSequence::new(Time::ZERO, Goal::FaultReset, PATIENCE);
        let step = |sequence: &mut PowerSequence, ms| {
            sequence.next(Time::ZERO + Duration::from_millis(ms), word(0x0218), true)
        };
        step(&mut sequence, 0);
        step(&mut sequence, 100);
        let last = step(&mut sequence, 500);
        assert_eq!(
            last,
            PowerStep::Failed(PowerFailure::TimedOut {
                from: PowerState::Fault,
                to: PowerState::SwitchOnDisabled,
                awaited: "the state switch on disabled",
                waited: PATIENCE,
            })
        );
    }

    #[test]
    fn a_quick_stop_that_stays_active_is_ended_when_the_axis_stands() {
        let mut sequence = PowerSequence::new(Time::ZERO, Goal::QuickStop, PATIENCE);
        assert_eq!(sequence.first(), Some(Controlword::QUICK_STOP_COMMAND));
        let mut next = |raw, standing| sequence.next(Time::ZERO, word(raw), standing);
        let stop = PowerStep::Command(Controlword::QUICK_STOP_COMMAND);
        assert_eq!(next(0x0237, false), stop);
        assert_eq!(next(0x0217, false), stop);
        assert_eq!(next(0x0217, true), PowerStep::Command(Controlword::empty()));
        assert_eq!(next(0x0250, true), PowerStep::Done(Controlword::empty()));
    }

    #[test]
    fn disabling_goes_down_step_by_step() {
        let dialog = [
            (0x0237, 0x07),
            (0x0233, 0x06),
            (0x0231, 0x00),
            (0x0250, 0x00),
        ];
        assert!(matches!(
            check(Goal::SwitchOnDisabled, &dialog),
            PowerStep::Done(_)
        ));
    }

    #[test]
    fn a_drive_that_only_wanders_is_given_up() {
        let mut sequence = PowerSequence::new(Time::ZERO, Goal::OperationEnabled, PATIENCE);
        let failed = (0..100).any(|turn| {
            let raw = if turn % 2 == 0 { 0x0250 } else { 0x0231 };
            let step = sequence.next(Time::ZERO, word(raw), true);
            matches!(step, PowerStep::Failed(PowerFailure::Wanders { .. }))
        });
        assert!(failed);
    }
}
