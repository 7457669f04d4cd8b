//! A screw of the platform: its drive homes on an index pulse.

use core::time::Duration;

use drivers::device::cia402::Cia402Drive;
use drivers::device::{AxisCommand, Device, DriveCommand};
use mock_bus::plant::HallDrift;
use tests::{Desk, Emulator, Setup, rigs, cia402_settings};
use units::{Metres, MetresPerSecond};

/// The first mark off the negative switch, at -5 mm, of a screw with a lead of 2 mm.
const MARK: Metres = Metres(-4e-3);

/// What the drive calls 0, by the truth.
fn zero(drive: &Desk<Cia402Drive>) -> Metres {
    let screw = drive.emulator.simulation(|it| {
        let truth = it.truth();
        truth
            .platform()
            .expect("it is a platform")
            .screw_position(0)
    });
    screw - drive.reading().position
}

#[test]
fn after_every_power_cycle_the_index_pulse_gives_the_same_origin() {
    for rig in rigs() {
        let emulator = Emulator::new(rig, &Setup::uvw(41));
        let loaded = &emulator.loaded;
        let settings = cia402_settings(loaded, "u");
        let mut drive = Desk::new(emulator, "can0", Cia402Drive::new(settings));
        for cycle in 0..3 {
            let homed = drive
                .start()
                .and_then(|()| drive.command::<Metres>(DriveCommand::Enable))
                .and_then(|()| {
                    drive.command(AxisCommand::HomeIndex {
                        position: MARK,
                        speed: MetresPerSecond(5e-3),
                    })
                });
            homed.unwrap_or_else(|error| panic!("{rig:?}: {error}; {:?}", drive.alarms));
            drive.live(Duration::from_millis(200));
            let zero = zero(&drive);
            // The mark repeats to 20 nm, the encoder counts in steps of 10.
            assert!(zero.abs().nm() < 120.0, "{rig:?} {cycle}: {} nm", zero.nm());
            drive
                .emulator
                .simulation(|it| it.power_cycle(HallDrift::default()));
            drive.live(Duration::from_secs(1));
            while drive.device.poll_alarm().is_some() {}
        }
    }
}
