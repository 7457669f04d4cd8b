//! End of the watch that devices keep on this controller's heartbeat.
//!
//! Many a drive faults when a heartbeat that was watched ends, also while that drive is off. So the
//! watch ends before this program does, on each bus whose drives have been seen off.

use core::time::Duration;

use wire::Port;
use wire::cia402::PowerState;

use crate::machine::Machine;

/// Longer than any answer of a node that is there.
const RELEASE_LIMIT: Duration = Duration::from_millis(500);

/// Ends the watch of every device of `machine` on a bus whose drives are all off.
pub(crate) fn release_watches(machine: &mut Machine) {
    for at in 0..machine.devices.instrument_device(0) {
        let now = machine.transport.now();
        let port = machine.devices.unit_mut(at).port;
        if !is_off(machine, port) || !machine.devices.unit_mut(at).device.release_watch(now) {
            continue;
        }
        if let Err(failure) = machine.await_outcome(at, "end of the watch", RELEASE_LIMIT) {
            let device = machine.devices.name(at);
            machine.notices.warn(format!(
                "{device} still watches the heartbeat of this controller and reports its loss \
                 when this program ends: acknowledge that by `truestage reset` ({failure})"
            ));
        }
    }
}

/// Whether every drive on the bus `port` was seen off.
fn is_off(machine: &mut Machine, port: Port) -> bool {
    (0..machine.devices.drive_count()).all(|at| {
        let is_elsewhere = machine.devices.unit_mut(at).port != port;
        let off = match machine.devices.drive(at).power_state() {
            Some(
                PowerState::SwitchOnDisabled
                | PowerState::ReadyToSwitchOn
                | PowerState::SwitchedOn
                | PowerState::Fault,
            ) => true,
            Some(
                PowerState::NotReadyToSwitchOn
                | PowerState::OperationEnabled
                | PowerState::QuickStopActive
                | PowerState::FaultReactionActive
                | PowerState::Unknown(_),
            )
            | None => false,
        };
        is_elsewhere || off
    })
}
