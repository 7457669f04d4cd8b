//! The drive of a rotary table, and the lines of a plate at its touch probe.

use core::f64::consts::TAU;
use core::time::Duration;

use drivers::device::cia402::Cia402Drive;
use drivers::device::{
    Alarm, Axis, AxisCommand, DeviceError, DriveCommand, LatchCommand, Latched, PositionLatch,
    Repeat, ServoDrive,
};
use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::plant::HallDrift;
use tests::{Desk, Emulator, Rig, Setup, rigs};
use units::{Approach, Radians, RadiansPerSecond, RadiansPerSecondSquared};

type Table = Desk<Cia402Drive<Radians>>;

const SEED: u64 = 31;
const LINES: usize = 360;
/// What the detector's latency of 2 µs makes of 30 °/s.
const LATENCY_ARCSEC: f64 = 0.216;

fn table(rig: Rig, setup: &Setup) -> Table {
    let emulator = Emulator::new(rig, setup);
    let loaded = &emulator.loaded;
    let (rotary, can) = (&loaded.config.rotary["c"], &loaded.config.can);
    let settings = truestage::for_tests::rotary_settings(rotary, can, loaded.patience);
    Desk::new(emulator, "can0", Cia402Drive::new(settings))
}

/// Runs `procedure` with the started table of `setup` on every rig.
#[track_caller]
fn check_with(setup: &Setup, procedure: impl Fn(Rig, &mut Table) -> Result<(), DeviceError>) {
    for rig in rigs() {
        let mut table = table(rig, setup);
        if let Err(error) = table.start().and_then(|()| procedure(rig, &mut table)) {
            panic!("{rig:?}: {error}; {:?}", table.alarms);
        }
    }
}

#[track_caller]
fn check(procedure: impl Fn(Rig, &mut Table) -> Result<(), DeviceError>) {
    check_with(&Setup::rotary(SEED), procedure);
}

fn per_s(degrees: f64) -> RadiansPerSecond {
    RadiansPerSecond(degrees.to_radians())
}

fn to(degrees: f64, degrees_per_s: f64) -> AxisCommand<Radians> {
    AxisCommand::MoveTo {
        target: Radians::from_degrees(degrees),
        speed: per_s(degrees_per_s),
        acceleration: RadiansPerSecondSquared(180_f64.to_radians()),
    }
}

const fn index(approach: Approach) -> AxisCommand<Radians> {
    AxisCommand::HomeNextIndex {
        position: Radians::ZERO,
        speed: RadiansPerSecond(0.7),
        approach,
    }
}

/// Enabled, and zero at the index mark.
fn zeroed(table: &mut Table) -> Result<(), DeviceError> {
    table.command(DriveCommand::Enable)?;
    table.command(index(Approach::Forward))
}

fn reads(table: &Table) -> Radians {
    table.reading().position
}

/// Lets the table come to rest, so that samples and truth are of the same place.
fn settle(table: &mut Table) {
    table.live(Duration::from_millis(300));
}

/// What the encoder reads from its own zero, and the true angle.
fn truth(table: &Table) -> (Radians, Radians) {
    table.emulator.simulation(|simulation| {
        let truth = simulation.truth();
        let table = truth.table().expect("the machine is a table");
        (table.reading(), table.angle())
    })
}

#[track_caller]
fn check_near(seen: Radians, expected: Radians, within_arcsec: f64) {
    let away = (seen - expected).arcsec();
    assert!(
        away.abs() <= within_arcsec,
        "{} is {away} arcsec from {}",
        seen.degrees(),
        expected.degrees()
    );
}

/// By less than half a turn.
fn within_a_turn(angle: Radians) -> Radians {
    Radians(angle.value() - TAU * (angle.value() / TAU).round())
}

#[test]
fn the_index_mark_makes_the_drives_zero_that_of_the_encoder_from_both_sides() {
    check(|_, table| {
        table.command(DriveCommand::Enable)?;
        for approach in [Approach::Forward, Approach::Reverse] {
            table.command(index(approach))?;
            assert!(table.device.is_homed());
            settle(table);
            let (reading, _) = truth(table);
            check_near(within_a_turn(reads(table) - reading), Radians::ZERO, 0.1);
        }
        Ok(())
    });
}

#[test]
fn a_table_turns_across_the_seam_as_often_as_it_is_told() {
    for range in ["to_last_count", "counts_on"] {
        let setup = Setup::rotary(SEED).machine("to_last_count\"   #", &format!("{range}\"   #"));
        check_with(&setup, |_, table| {
            zeroed(table)?;
            settle(table);
            let turns = truth(table).0 - reads(table);
            for degrees in [350.0, 370.0, 1090.0, -10.0, -370.0, 0.0] {
                table.command(to(degrees, 180.0))?;
                let target = Radians::from_degrees(degrees);
                check_near(reads(table), target, 0.5);
                check_near(truth(table).0 - turns, target, 0.6);
            }
            assert_eq!(table.alarms, []);
            Ok(())
        });
    }
}

#[test]
fn a_drive_whose_upper_limit_is_the_first_count_again_turns_as_well() {
    let setup = Setup::rotary(SEED)
        .machine("to_last_count\"   #", "to_first_count\"   #")
        .emulated(
            "upper_limit_is_a_position = true",
            "upper_limit_is_a_position = false",
        );
    check_with(&setup, |_, table| {
        zeroed(table)?;
        settle(table);
        let turns = truth(table).0 - reads(table);
        for degrees in [359.0, 1081.0, -359.0] {
            table.command(to(degrees, 180.0))?;
            check_near(truth(table).0 - turns, Radians::from_degrees(degrees), 0.6);
        }
        Ok(())
    });
}

/// One turn and half a line more, from half a line before 0 or beyond a turn.
fn sweep(table: &mut Table, approach: Approach) -> Result<Vec<Latched<Radians>>, DeviceError> {
    let (from, end) = match approach {
        Approach::Forward => (-0.5, 359.5),
        Approach::Reverse => (359.5, -0.5),
    };
    table.command(to(from, 180.0))?;
    table.live(Duration::from_millis(100));
    table.latch(LatchCommand::Arm {
        repeat: Repeat::Continuous,
        spacing: Radians::from_degrees(0.9),
    })?;
    table.command(to(end, 30.0))?;
    table.live(Duration::from_millis(50));
    table.latch(LatchCommand::Disarm)?;
    Ok(core::iter::from_fn(|| table.device.poll_latched()).collect())
}

/// Where each line should be read: its true angle and the encoder's error there, within a turn.
fn expected(table: &Table) -> Vec<Radians> {
    table.emulator.simulation(|simulation| {
        let truth = simulation.truth();
        let table = truth.table().expect("the machine is a table");
        (0..table.lines())
            .map(|line| {
                let angle = table.line_angle(line);
                angle + table.encoder_error(angle)
            })
            .collect()
    })
}

/// The line that is read nearest to a latched position, and how far from it.
fn nearest(expected: &[Radians], latched: &Latched<Radians>) -> (usize, Radians) {
    let away = |line: &Radians| within_a_turn(latched.position - *line);
    expected
        .iter()
        .map(away)
        .enumerate()
        .min_by(|a, b| a.1.abs().value().total_cmp(&b.1.abs().value()))
        .expect("a plate has lines")
}

/// What was overwritten unread; nothing is in virtual time, where no host is late.
fn lost(rig: Rig, latched: &[Latched<Radians>]) -> usize {
    let lost: u32 = latched.iter().map(|it| it.missed).sum();
    assert!(
        rig != Rig::InProcess || lost == 0,
        "{lost} lines were overwritten"
    );
    lost as usize
}

#[test]
fn every_line_of_a_turn_is_latched_where_it_is_in_both_directions() {
    check(|rig, table| {
        zeroed(table)?;
        let expected = expected(table);
        for approach in [Approach::Forward, Approach::Reverse] {
            let begun = table.now();
            let latched = sweep(table, approach)?;
            let took = table.now().since(begun);
            assert_eq!(latched.len() + lost(rig, &latched), LINES);
            let mut seen = vec![false; LINES];
            let mut worst = Radians::ZERO;
            for edge in &latched {
                let (line, away) = nearest(&expected, edge);
                assert!(!seen[line], "line {line} came twice");
                seen[line] = true;
                let latency = Radians::from_arcsec(LATENCY_ARCSEC * approach.sign());
                worst = worst.max((away - latency).abs());
            }
            println!(
                "{rig:?} {approach:?}: {} lines in {took:?}, worst {:.3} arcsec",
                latched.len(),
                worst.arcsec()
            );
            // Five standard deviations of the detector, the bearing, the mark, and a count.
            assert!(worst.arcsec() < 0.30, "{}", worst.arcsec());
        }
        assert_eq!(table.alarms, []);
        Ok(())
    });
}

#[test]
fn a_smudged_line_is_the_only_one_that_is_missing() {
    check(|rig, table| {
        let smudged = Fault::LineSmudged { line: 123 };
        let injected = table
            .emulator
            .simulation(|simulation| simulation.inject(FaultConfig::permanent(smudged)));
        let injected = injected.expect("every plate can get dirty");
        zeroed(table)?;
        let expected = expected(table);
        let latched = sweep(table, Approach::Forward)?;
        assert_eq!(latched.len() + lost(rig, &latched), LINES - 1);
        let lines: Vec<_> = latched.iter().map(|it| nearest(&expected, it).0).collect();
        assert!(!lines.contains(&123));
        let delivered = table
            .emulator
            .simulation(move |simulation| simulation.fault_deliveries(injected));
        assert_eq!(delivered, 1);
        Ok(())
    });
}

#[test]
fn a_scratch_so_near_to_a_line_that_it_overwrites_it_is_counted() {
    check(|rig, table| {
        let scratched = Fault::LineScratched { line: 45 };
        let injected = table
            .emulator
            .simulation(|simulation| simulation.inject(FaultConfig::permanent(scratched)));
        injected.expect("every plate can be scratched");
        zeroed(table)?;
        let expected = expected(table);
        let latched = sweep(table, Approach::Forward)?;
        let missed: u32 = latched.iter().map(|it| it.missed).sum();
        assert_eq!(latched.len() + missed as usize, LINES + 1);
        let doubtful = latched.iter().filter(|it| it.missed > 0);
        let lines: Vec<_> = doubtful.map(|it| nearest(&expected, it).0).collect();
        // In real time a busy host may let more of them be overwritten.
        if rig == Rig::InProcess {
            assert_eq!(lines, [45]);
        }
        assert!(lines.contains(&45), "{rig:?}: {lines:?}");
        Ok(())
    });
}

#[test]
fn a_sweep_too_fast_for_its_lines_is_refused_before_anything_moves() {
    check(|_, table| {
        zeroed(table)?;
        table.command(to(0.0, 60.0))?;
        table.live(Duration::from_millis(100));
        let spacing = Radians::from_degrees(0.9);
        let repeat = Repeat::Continuous;
        table.latch(LatchCommand::Arm { repeat, spacing })?;
        let refused = table.command(to(90.0, 120.0));
        let Err(DeviceError::OutOfRange { value, limit, .. }) = refused else {
            panic!("{refused:?}");
        };
        assert!((value - 120.0).abs() < 1e-9);
        // 0.9° in two periods of 5 ms.
        assert!((limit - 90.0).abs() < 1e-9, "{limit}");
        check_near(reads(table), Radians::ZERO, 0.5);
        Ok(())
    });
}

#[test]
fn after_a_power_cycle_the_index_mark_brings_the_same_angles_back() {
    check(|_, table| {
        zeroed(table)?;
        table.command(to(-90.0, 180.0))?;
        settle(table);
        let before = truth(table).0 - reads(table);
        table
            .emulator
            .simulation(|simulation| simulation.power_cycle(HallDrift::default()));
        table.live_until(|drive| !drive.is_homed());
        table.live(Duration::from_secs(2));
        let told = table.alarms.iter().any(|alarm| {
            matches!(
                alarm,
                Alarm::UnexpectedBootUp { .. }
                    | Alarm::HeartbeatLost { .. }
                    | Alarm::PdoLost { .. }
            )
        });
        assert!(told, "{:?}", table.alarms);
        table.start()?;
        zeroed(table)?;
        settle(table);
        let after = truth(table).0 - reads(table);
        check_near(within_a_turn(after - before), Radians::ZERO, 0.15);
        Ok(())
    });
}

#[test]
fn a_quick_stop_ends_a_turn_and_the_probe_goes_on_latching_until_disarmed() {
    check(|_, table| {
        zeroed(table)?;
        table.command(to(0.5, 60.0))?;
        table.live(Duration::from_millis(100));
        table.latch(LatchCommand::Arm {
            repeat: Repeat::Continuous,
            spacing: Radians::from_degrees(0.9),
        })?;
        table.begin(to(3600.0, 30.0));
        table.live_until(|drive| {
            let reading = drive.reading();
            reading.is_some_and(|it| it.position > Radians::from_degrees(10.0))
        });
        table.command(DriveCommand::QuickStop)?;
        assert!(reads(table) < Radians::from_degrees(60.0));
        assert!(table.device.is_latching());
        let latched = core::iter::from_fn(|| table.device.poll_latched()).count();
        assert!((5..60).contains(&latched), "{latched}");
        Ok(())
    });
}
