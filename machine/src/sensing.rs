//! The analog modules and the cameras that are detectors alone, while somebody has his hands in the machine: no drive is addressed.

use crate::failure::Failure;
use crate::lookout::Lookout;
use crate::machine::{Machine, Supervision};

/// Starts SYNC, the analog modules of `machine` and its cameras that are detectors, and checks who they are. Nothing is sent to a drive, and what
/// drives say is no alarm: they may be without power. Afterwards no axis counts as started or zeroed.
///
/// # Errors
/// When a module does not answer, is another one than configured, or refuses its set-up.
pub fn start_sensors(machine: &mut Machine) -> Result<(), Failure> {
    machine.catch_up();
    machine.zeroed.fill(false);
    machine.ports.set_sync(&mut *machine.transport, true)?;
    machine.devices.lookouts.fill(Lookout::default());
    let modules = machine.devices.drive_count()..machine.devices.instrument_device(0);
    let sensors: Vec<usize> = modules.chain(machine.devices.detector_cameras()).collect();
    let now = machine.now();
    for at in &sensors {
        machine.devices.unit_mut(*at).device.start(now);
    }
    for at in sensors {
        machine.await_start(at)?;
    }
    machine.devices.open_lookouts();
    Ok(())
}

/// Stops SYNC again.
///
/// # Errors
/// When a bus does not take that.
pub fn stop_sensors(machine: &mut Machine) -> Result<(), Failure> {
    machine.supervision = Supervision::Off;
    machine.ports.set_sync(&mut *machine.transport, false)
}
