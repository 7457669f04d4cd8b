//! What an adapter says about itself and the bus, in the terms of SocketCAN's error frames.

use wire::Input;
use wire::can::{BusError, BusErrorClass, ControllerProblem};
use wire::slcan::{BusState, StatusFlags};

/// The adapter refused a frame: it did not go out.
pub(super) const fn transmit_overflow() -> Input {
    controller(ControllerProblem::TX_OVERFLOW)
}

/// Events of the status flags each time, lasting states when they begin, change or end.
pub(super) fn of_flags(before: StatusFlags, flags: StatusFlags) -> Vec<Input> {
    let mut inputs = Vec::new();
    if flags.intersects(StatusFlags::RX_FULL | StatusFlags::OVERRUN) {
        // How many, the protocol does not say: at least one.
        inputs.push(Input::Lost(1));
    }
    if flags.contains(StatusFlags::TX_FULL) {
        inputs.push(transmit_overflow());
    }
    if flags.contains(StatusFlags::BUS_ERROR) {
        inputs.push(class(BusErrorClass::BUS_ERROR));
    }
    let lasting = StatusFlags::PASSIVE | StatusFlags::WARNING;
    if (flags ^ before).intersects(lasting) {
        inputs.push(if flags.contains(StatusFlags::PASSIVE) {
            of_state(BusState::Passive)
        } else if flags.contains(StatusFlags::WARNING) {
            of_state(BusState::Warning)
        } else {
            of_state(BusState::Active)
        });
    }
    inputs
}

/// A report of the controller's state.
pub(super) fn of_state(state: BusState) -> Input {
    match state {
        BusState::Active => controller(ControllerProblem::ACTIVE),
        BusState::Warning => {
            controller(ControllerProblem::RX_WARNING.union(ControllerProblem::TX_WARNING))
        }
        BusState::Passive => {
            controller(ControllerProblem::RX_PASSIVE.union(ControllerProblem::TX_PASSIVE))
        }
        BusState::Off | BusState::Stopped => class(BusErrorClass::BUS_OFF),
    }
}

const fn controller(controller: ControllerProblem) -> Input {
    let class = BusErrorClass::CONTROLLER;
    Input::BusError(BusError { class, controller })
}

const fn class(class: BusErrorClass) -> Input {
    let controller = ControllerProblem::empty();
    Input::BusError(BusError { class, controller })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lasting_state_is_told_when_it_begins_changes_and_ends() {
        let (none, warning) = (StatusFlags::empty(), StatusFlags::WARNING);
        let passive = warning | StatusFlags::PASSIVE;
        assert_eq!(of_flags(none, warning), [of_state(BusState::Warning)]);
        assert_eq!(of_flags(warning, warning), []);
        assert_eq!(of_flags(warning, passive), [of_state(BusState::Passive)]);
        assert_eq!(of_flags(passive, none), [of_state(BusState::Active)]);
    }

    #[test]
    fn an_event_is_told_each_time() {
        let full = StatusFlags::TX_FULL;
        assert_eq!(of_flags(full, full), [transmit_overflow()]);
    }
}
