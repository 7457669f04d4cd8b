//! Cyclic synchronous position against the fake drive of the other tests.

use core::time::Duration;
use units::Metres;
use wire::canopen::sdo::AbortCode;

use super::cyclic::{interpolation_period, period_from};
use super::tests::{Rig, SYNC_MS, move_to, settings};
use super::*;
use crate::device::{Axis, DriveCommand};

const ENTER: DriveCommand = DriveCommand::EnterCyclic {
    period: Duration::from_millis(SYNC_MS),
};

fn started() -> Rig {
    let mut rig = Rig::with(Cia402Settings {
        synchronous_start: true,
        ..settings()
    });
    rig.fake.node.set_u32(0x6502, 0, 0xA1);
    rig.fake.node.set(0x60C2, 1, &[1]);
    rig.fake.node.set(0x60C2, 2, &[0]);
    rig.start().unwrap();
    rig
}

fn following() -> Rig {
    let mut rig = started();
    rig.does(ENTER).unwrap();
    rig.does(DriveCommand::Enable).unwrap();
    rig
}

/// The targets of RPDO 1, as the frames have them, without repetitions.
fn targets(rig: &Rig) -> Vec<i32> {
    let lines = rig.sent.iter().filter(|line| line.starts_with("205#"));
    let mut targets: Vec<i32> = lines
        .map(|line| u32::from_str_radix(&line[8..16], 16).unwrap())
        .map(|raw| raw.swap_bytes().cast_signed())
        .collect();
    targets.dedup();
    targets
}

#[test]
fn periods_are_whole_milliseconds_where_they_can_be() {
    let check = |us, expected| {
        let period = Duration::from_micros(us);
        assert_eq!(interpolation_period(period), expected, "{us} us");
    };
    check(2_000, Some((2, -3)));
    check(255_000, Some((255, -3)));
    check(1_500, Some((15, -4)));
    check(250, Some((25, -5)));
    check(125, Some((125, -6)));
    check(256_000, None);
    check(1_001, None);
    check(0, None);
    assert_eq!(interpolation_period(Duration::from_nanos(1_500)), None);
    let next = |us| period_from(Duration::from_micros(us)).map(|it| it.as_micros());
    assert_eq!(next(1_863), Some(1_870));
    assert_eq!(next(2_000), Some(2_000));
    assert_eq!(next(2_551), Some(2_600));
    assert_eq!(next(255_001), None);
    for us in (0..3_000).step_by(7) {
        let period = period_from(Duration::from_micros(us)).unwrap();
        assert!(interpolation_period(period).is_some(), "{us} us");
    }
}

#[test]
fn entering_sets_the_period_then_the_mode_and_waits_for_its_display() {
    let mut rig = started();
    rig.fake.node.written.clear();
    rig.does(ENTER).unwrap();
    assert_eq!(
        rig.fake.node.written,
        [(0x60C2, 1, 2), (0x60C2, 2, 0xFD), (0x6060, 0, 8)]
    );
    assert_eq!(
        rig.drive.mode(),
        Some(OperationMode::CyclicSynchronousPosition)
    );
    // RPDO 1 takes effect at the SYNC.
    assert_eq!(rig.fake.node.get(0x1400, 2), 1);
}

#[test]
fn the_target_is_where_the_axis_stands_until_it_is_enabled_and_then_stays() {
    let mut rig = started();
    rig.fake.set_position(123_456);
    rig.passes_ms(10);
    rig.does(ENTER).unwrap();
    rig.fake.set_position(123_500);
    rig.passes_ms(10);
    rig.does(DriveCommand::Enable).unwrap();
    assert_eq!(targets(&rig).last(), Some(&123_500));
    assert_eq!(rig.drive.held(), Some(Metres(1.235e-3)));
    rig.fake.set_position(123_503);
    rig.passes_ms(10);
    rig.does(DriveCommand::Enable).unwrap();
    assert_eq!(targets(&rig).last(), Some(&123_500), "enabled already");
}

#[test]
fn an_enabled_drive_keeps_the_target_it_holds() {
    let mut rig = started();
    rig.does(DriveCommand::Enable).unwrap();
    rig.does(move_to(250.0)).unwrap();
    rig.fake.set_position(25_007);
    rig.passes_ms(20);
    rig.does(ENTER).unwrap();
    assert_eq!(targets(&rig).last(), Some(&25_000));
    assert_eq!(rig.drive.held(), Some(Metres(25_000.0 * 10e-9)));
}

#[test]
fn set_points_go_out_with_the_controlword_and_are_never_repeated_late() {
    let mut rig = following();
    rig.sent.clear();
    for step in 1..=3 {
        let target = Metres::from_um(f64::from(step));
        rig.drive.follow(rig.now, target).unwrap();
        rig.passes_ms(SYNC_MS);
    }
    rig.passes_ms(500);
    let rpdos: Vec<_> = rig
        .sent
        .iter()
        .filter(|it| it.starts_with("205#"))
        .collect();
    assert_eq!(
        rpdos,
        ["205#0F0064000000", "205#0F00C8000000", "205#0F002C010000"]
    );
}

#[test]
fn set_points_are_refused_outside_the_limits_and_the_mode() {
    let mut rig = following();
    let beyond = rig.drive.follow(rig.now, Metres(30.0)).unwrap_err();
    assert!(beyond.to_string().contains("set-point 30 m"), "{beyond}");
    assert!(rig.drive.follow(rig.now, Metres(f64::NAN)).is_err());
    rig.does(DriveCommand::LeaveCyclic).unwrap();
    assert_eq!(rig.drive.mode(), Some(OperationMode::ProfilePosition));
    assert_eq!(rig.drive.held(), None);
    let error = rig.drive.follow(rig.now, Metres(0.0)).unwrap_err();
    assert!(error.to_string().contains("cyclic"), "{error}");
}

#[test]
fn a_profile_move_after_the_cyclic_mode_goes_back_by_itself() {
    let mut rig = following();
    rig.does(move_to(100.0)).unwrap();
    assert_eq!(rig.fake.position(), 10_000);
    assert_eq!(rig.drive.mode(), Some(OperationMode::ProfilePosition));
}

#[test]
fn a_drive_that_cannot_is_refused_before_anything_is_written() {
    let check = |prepare: fn(&mut Rig), command: DriveCommand, what: &str| {
        let mut rig = started();
        prepare(&mut rig);
        rig.fake.node.written.clear();
        let error = rig.does(command).unwrap_err();
        assert!(error.to_string().contains(what), "{error}");
        assert!(rig.fake.node.written.is_empty(), "{error}");
    };
    check(
        |rig| {
            rig.fake.node.set_u32(0x6502, 0, 0x21);
            rig.start().unwrap();
        },
        ENTER,
        "mode 8",
    );
    let period = Duration::from_micros(1_001);
    check(|_| {}, DriveCommand::EnterCyclic { period }, "0x60C2");
    check(
        |rig| {
            rig.does(DriveCommand::Enable).unwrap();
            rig.drive.command(rig.now, move_to(5_000.0));
            rig.passes_ms(20);
        },
        ENTER,
        "stands still",
    );
    let mut rig = Rig::with(settings());
    rig.fake.node.set_u32(0x6502, 0, 0xA1);
    rig.start().unwrap();
    let error = rig.does(ENTER).unwrap_err();
    assert!(error.to_string().contains("synchronous_start"), "{error}");
}

#[test]
fn a_period_the_drive_does_not_take_is_named() {
    let mut rig = started();
    rig.fake.node.manners.lies.push((0x60C2, 2));
    let error = rig.does(ENTER).unwrap_err();
    assert!(matches!(error, DeviceError::ReadBack { .. }), "{error}");
    assert!(error.to_string().contains("0x60C2:02"), "{error}");

    let mut rig = started();
    rig.fake.node.manners.refuses.push((0x60C2, 1, 0x0609_0030));
    let error = rig.does(ENTER).unwrap_err();
    let DeviceError::SdoAbort { code, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(code, AbortCode::InvalidValue);
}

#[test]
fn a_mode_whose_display_never_follows_is_a_time_out() {
    let mut rig = started();
    rig.passes_ms(20);
    rig.fake.mode_lag = u32::MAX;
    let error = rig.does(ENTER).unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5: waited 1s for the mode display (0x6061) to follow, last saw mode 1"
    );
}

#[test]
fn a_following_error_in_the_cyclic_mode_is_an_alarm() {
    let mut rig = following();
    rig.fake.following_error = true;
    rig.passes_ms(4);
    assert!(
        matches!(rig.alarms[..], [Alarm::FollowingError { .. }]),
        "{:?}",
        rig.alarms
    );
}

#[test]
fn a_drive_that_limits_or_leaves_its_set_points_is_named() {
    let (limited, follows) = (1 << 11, 1 << 12);
    let mut rig = following();
    rig.passes_ms(20);
    assert_eq!(rig.alarms, [], "a drive that never says that it follows");
    rig.fake.also_says = follows;
    rig.passes_ms(20);
    rig.fake.also_says = 0;
    rig.passes_ms(SYNC_MS);
    rig.fake.also_says = follows | limited;
    rig.passes_ms(SYNC_MS);
    rig.fake.also_says = follows;
    rig.passes_ms(20);
    assert_eq!(rig.alarms, [], "for a moment");
    rig.fake.also_says = follows | limited;
    rig.passes_ms(20);
    assert!(
        matches!(rig.alarms[..], [Alarm::InternalLimit { .. }]),
        "{:?}",
        rig.alarms
    );
    rig.alarms.clear();
    rig.fake.also_says = 0;
    rig.passes_ms(20);
    assert!(
        matches!(rig.alarms[..], [Alarm::NotFollowing { .. }]),
        "{:?}",
        rig.alarms
    );
}

#[test]
fn a_quick_stop_needs_one_frame_and_no_sdo() {
    let mut rig = following();
    rig.drive.follow(rig.now, Metres::from_um(1.0)).unwrap();
    rig.tick();
    rig.sent.clear();
    rig.does(DriveCommand::QuickStop).unwrap();
    assert_eq!(rig.sent[0], "205#020064000000");
    assert!(!rig.sent.iter().any(|line| line.starts_with("605#")));
}
