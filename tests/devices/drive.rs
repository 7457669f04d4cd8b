//! The CiA 402 drive.

use core::time::Duration;

use drivers::device::cia402::Cia402Drive;
use drivers::device::{Alarm, Axis, AxisCommand, Device, DeviceError, DriveCommand, ServoDrive};
use mock_bus::fault::{Fault, FaultConfig};
use tests::{Desk, Emulator, Rig, Setup, rigs, cia402_settings};
use units::{Metres, MetresPerSecond, MetresPerSecondSquared};
use wire::cia402::PowerState;

type Drive = Desk<Cia402Drive>;

/// How long the drive bears a master that is silent.
const SILENCE: Duration = Duration::from_millis(1500);

fn drive(rig: Rig) -> Drive {
    let emulator = Emulator::new(rig, &Setup::new(21));
    let loaded = &emulator.loaded;
    let mut settings = cia402_settings(loaded, "x");
    settings.common.master_consumer_time = SILENCE;
    Desk::new(emulator, "can0", Cia402Drive::new(settings))
}

/// Runs `procedure` with the started drive on every rig.
#[track_caller]
fn check(procedure: impl Fn(&mut Drive) -> Result<(), DeviceError>) {
    for rig in rigs() {
        let mut drive = drive(rig);
        if let Err(error) = drive.start().and_then(|()| procedure(&mut drive)) {
            panic!("{rig:?}: {error}; {:?}", drive.alarms);
        }
    }
}

fn to(mm: f64, mm_per_s: f64) -> AxisCommand {
    AxisCommand::MoveTo {
        target: Metres::from_mm(mm),
        speed: MetresPerSecond(mm_per_s * 1e-3),
        acceleration: MetresPerSecondSquared(5.0),
    }
}

const HERE_IS_ZERO: AxisCommand = AxisCommand::HomeHere {
    position: Metres::ZERO,
};

/// Where the stage stands on its scale.
fn scale(drive: &Drive) -> Metres {
    let emulator = &drive.emulator;
    emulator.simulation(|simulation| simulation.truth().scale_position())
}

/// The stage has come to rest, whatever the drive says.
fn rests(drive: &mut Drive) -> bool {
    let before = scale(drive);
    drive.live(Duration::from_millis(50));
    (scale(drive) - before).abs() < Metres::from_um(0.1)
}

const fn is_off(state: PowerState) -> bool {
    use PowerState::{ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
    matches!(state, SwitchOnDisabled | ReadyToSwitchOn | SwitchedOn)
}

/// On the way to 40 mm for at least 30 s of the machine's life.
fn on_a_slow_way(drive: &mut Drive) -> Result<(), DeviceError> {
    on_the_way_at(drive, 1.0)
}

fn on_the_way(drive: &mut Drive) -> Result<(), DeviceError> {
    on_the_way_at(drive, 20.0)
}

fn on_the_way_at(drive: &mut Drive, mm_per_s: f64) -> Result<(), DeviceError> {
    drive.command(DriveCommand::Enable)?;
    drive.command(HERE_IS_ZERO)?;
    drive.begin(to(40.0, mm_per_s));
    drive.live_until(|drive| {
        let reading = drive.reading();
        reading.is_some_and(|it| it.position > Metres::from_mm(1.0))
    });
    Ok(())
}

#[test]
fn a_started_drive_says_who_it_is_and_is_off() {
    check(|drive| {
        let identity = drive.device.identity().expect("the start has asked");
        assert_eq!(identity.device_type, 0x0002_0192);
        assert_eq!((identity.vendor, identity.serial), (0x7FF, 1001));
        drive.live(Duration::from_millis(50));
        let state = drive.device.power_state();
        assert!(state.is_some_and(is_off), "{state:?}");
        assert!(!drive.device.is_homed());
        Ok(())
    });
}

#[test]
fn an_enabled_drive_moves_to_its_target_and_is_disabled_again() {
    check(|drive| {
        drive.command(DriveCommand::Enable)?;
        assert_eq!(
            drive.device.power_state(),
            Some(PowerState::OperationEnabled)
        );
        drive.command(HERE_IS_ZERO)?;
        let begin = scale(drive);
        for (mm, speed) in [(12.5, 200.0), (-1.0, 50.0), (0.25, 10.0)] {
            drive.command(to(mm, speed))?;
            let target = Metres::from_mm(mm);
            let reading = drive.reading();
            assert!((reading.position - target).abs() < Metres::from_um(1.0));
            assert!((scale(drive) - begin - target).abs() < Metres::from_um(1.0));
        }
        drive.command(DriveCommand::Disable)?;
        let state = drive.device.power_state();
        assert!(state.is_some_and(is_off), "{state:?}");
        assert_eq!(drive.alarms, []);
        Ok(())
    });
}

#[test]
fn a_halt_stops_short_of_the_target_and_the_drive_stays_enabled() {
    check(|drive| {
        on_the_way(drive)?;
        drive.command(DriveCommand::Halt)?;
        let stopped = drive.reading();
        assert!(stopped.position < Metres::from_mm(40.0));
        assert_eq!(
            drive.device.power_state(),
            Some(PowerState::OperationEnabled)
        );
        assert!(rests(drive));
        // The target that was given up does not come back.
        drive.command(to(2.0, 100.0))?;
        assert!((drive.reading().position - Metres::from_mm(2.0)).abs() < Metres::from_um(1.0));
        Ok(())
    });
}

#[test]
fn a_quick_stop_ends_disabled_and_short_of_the_target() {
    check(|drive| {
        on_the_way(drive)?;
        drive.command(DriveCommand::QuickStop)?;
        assert!(rests(drive));
        assert!(drive.reading().position < Metres::from_mm(40.0));
        let state = drive.device.power_state();
        assert!(state.is_some_and(is_off), "{state:?}");
        Ok(())
    });
}

#[test]
fn homing_here_moves_the_coordinates_and_not_the_stage() {
    check(|drive| {
        drive.command(DriveCommand::Enable)?;
        let before = scale(drive);
        let position = Metres::from_mm(3.25);
        drive.command(AxisCommand::HomeHere { position })?;
        assert!(drive.device.is_homed());
        assert!((drive.reading().position - position).abs() < Metres::from_um(1.0));
        assert!((scale(drive) - before).abs() < Metres::from_um(1.0));
        Ok(())
    });
}

#[test]
fn a_blocked_axis_faults_and_one_reset_clears_it_when_the_cause_is_gone() {
    check(|drive| {
        on_the_way(drive)?;
        let blocked = drive.emulator.simulation(|simulation| {
            simulation.inject(FaultConfig::permanent(Fault::BlockedAxis { axis: 0 }))
        });
        let blocked = blocked.expect("every stage can be blocked");
        assert!(drive.outcome().is_err());
        drive.live_until(|drive| drive.power_state() == Some(PowerState::Fault));
        assert_ne!(drive.alarms, []);
        drive
            .emulator
            .simulation(move |simulation| simulation.end_fault(blocked));
        drive.command(DriveCommand::ResetFault)?;
        drive.command(DriveCommand::Enable)?;
        drive.command(to(6.0, 50.0))?;
        assert!((drive.reading().position - Metres::from_mm(6.0)).abs() < Metres::from_um(1.0));
        Ok(())
    });
}

#[test]
fn a_drive_whose_master_falls_silent_stops_by_itself() {
    check(|drive| {
        on_a_slow_way(drive)?;
        drive.stop_heartbeat();
        let ended = drive.outcome();
        assert!(ended.is_err());
        assert!(!drive.alarms.is_empty(), "a drive that stops must be told");
        // It is told on the wall's clock, so it may have gone on for a while.
        while !rests(drive) {
            assert!(
                scale(drive) < Metres::from_mm(36.0),
                "{ended:?}, {:?}",
                drive.alarms
            );
        }
        Ok(())
    });
}

#[test]
fn a_drive_that_is_another_one_is_refused_before_anything_is_set() {
    for rig in rigs() {
        let change =
            Setup::new(21).emulated("product_code = 0x42_0001", "product_code = 0x42_0002");
        let emulator = Emulator::new(rig, &change);
        let loaded = &emulator.loaded;
        let settings = cia402_settings(loaded, "x");
        let mut drive = Desk::new(emulator, "can0", Cia402Drive::new(settings));
        let refused = drive.start();
        let seen = 0x42_0002;
        assert!(
            matches!(refused, Err(DeviceError::WrongIdentity { seen: it, .. }) if it == seen),
            "{rig:?}: {refused:?}"
        );
    }
}

#[test]
fn a_drive_that_loses_its_power_raises_an_alarm_and_its_reference_is_gone() {
    check(|drive| {
        drive.command(DriveCommand::Enable)?;
        drive.command(HERE_IS_ZERO)?;
        drive
            .emulator
            .simulation(|simulation| {
                let node = "drive".to_owned();
                let span = Duration::from_millis(300);
                let fault = FaultConfig::lasting(Fault::PowerLoss { node }, span);
                simulation.inject(fault).map(drop)
            })
            .expect("the machine has a drive");
        drive.live_until(|drive| !drive.is_homed());
        drive.live(Duration::from_secs(1));
        let boot_up = |alarm: &Alarm| matches!(alarm, Alarm::UnexpectedBootUp { .. });
        let lost =
            |alarm: &Alarm| matches!(alarm, Alarm::HeartbeatLost { .. } | Alarm::PdoLost { .. });
        assert!(
            drive.alarms.iter().any(|it| boot_up(it) || lost(it)),
            "{:?}",
            drive.alarms
        );
        Ok(())
    });
}
