//! The drive falls silent, resets, cannot move, loses its torque (classes 1, 12 to 16, 22 to 24).

use std::time::Duration;

use drivers::device::Alarm;
use machine::Finding;
use mock_bus::fault::{Fault, FaultConfig};
use truestage::Failure;
use wire::canopen::emcy::EmergencyCode;

use crate::scene::{HEARTBEAT, PERIOD, Phase, STOPPING, Scene, Wanted, check, check_harmless};

const DRIVE: &str = "drive";

fn drops(cob_id: u16) -> Fault {
    Fault::Drop {
        port: "can0".into(),
        cob_id: Some(cob_id),
    }
}

macro_rules! alarm {
    ($pattern:pat) => {
        |failure: &Failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: $pattern,
                    ..
                })
            )
        }
    };
}

macro_rules! finding {
    ($pattern:pat) => {
        |failure: &Failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Explained {
                    finding: $pattern,
                    ..
                })
            )
        }
    };
}

#[test]
fn a_heartbeat_that_stops_while_process_data_go_on_stops_the_machine() {
    let fault = Fault::StopHeartbeat { node: DRIVE.into() };
    let scene = Scene::during(Phase::Move).after_ms(100).fault(fault);
    let wanted = Wanted {
        cause: finding!(Finding::NoHeartbeat { .. }),
        words: &["x: node 1 sends process data, but no heartbeat since"],
        within: HEARTBEAT,
        rest: HEARTBEAT + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn process_data_that_stop_while_the_heartbeat_goes_on_stop_the_machine_within_four_periods() {
    let fault = Fault::StopPdos { node: DRIVE.into() };
    let scene = Scene::during(Phase::Move).after_ms(100).fault(fault);
    let wanted = Wanted {
        cause: finding!(Finding::NoProcessData { .. }),
        words: &["x: node 1 lives", "switched off", "process data missing"],
        within: PERIOD * 4,
        rest: PERIOD * 4 + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn a_drive_that_falls_silent_altogether_stops_the_machine_within_four_periods() {
    let fault = Fault::Mute { node: DRIVE.into() };
    let scene = Scene::during(Phase::Move).after_ms(100).fault(fault);
    let wanted = Wanted {
        cause: finding!(Finding::Silent { .. }),
        words: &[
            "x: no data from node 1 since",
            "while node 2 answers: power or cable",
        ],
        within: PERIOD * 4,
        rest: PERIOD * 4 + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn single_lost_process_data_are_tolerated() {
    let mut fault = FaultConfig::permanent(drops(0x181));
    fault.probability = 0.02;
    check_harmless(Scene::during(Phase::Calibrate).inject(fault));
}

#[test]
fn three_process_data_lost_in_a_row_stop_the_machine() {
    let fault = FaultConfig::times(drops(0x181), 3);
    let scene = Scene::during(Phase::Move).after_ms(100).inject(fault);
    let wanted = Wanted {
        cause: finding!(Finding::Interrupted { .. }),
        words: &["missing for 3 SYNC"],
        within: PERIOD * 4,
        rest: PERIOD * 4 + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn a_drive_that_resets_while_it_moves_is_not_zeroed_any_more() {
    let fault = FaultConfig::lasting(
        Fault::PowerLoss { node: DRIVE.into() },
        Duration::from_millis(5),
    );
    let scene = Scene::during(Phase::Move)
        .after_ms(100)
        .inject(fault)
        .emulated("boot_delay_ms = 100", "boot_delay_ms = 2");
    let wanted = Wanted {
        cause: alarm!(Alarm::UnexpectedBootUp { .. }),
        words: &["x:", "restarted unexpectedly"],
        within: PERIOD * 4,
        rest: PERIOD * 4 + STOPPING * 2,
    };
    let mut played = check(scene, &wanted);
    assert!(!played.bench.machine.is_zeroed("x"));
    let refused = played
        .bench
        .machine
        .linear("x")
        .unwrap()
        .move_to(units::Metres::ZERO);
    assert!(
        matches!(
            refused,
            Err(Failure::Machine(machine::Failure::NotZeroed { .. }))
        ),
        "{refused:?}"
    );
}

#[test]
fn an_emergency_during_a_measurement_is_told_in_words() {
    let fault = Fault::Emergency {
        port: "can0".into(),
        node_id: 1,
        code: 0x4210,
        register: 0x09,
    };
    let scene = Scene::during(Phase::Calibrate).after_ms(6000).fault(fault);
    let wanted = Wanted {
        cause: alarm!(Alarm::Emergency { .. }),
        words: &["x:", "0x4210", "temperature"],
        within: PERIOD,
        rest: PERIOD + STOPPING,
    };
    let played = check(scene, &wanted);
    assert!(played.journal_points("calibrate") > 5);
}

#[test]
fn a_blocked_axis_is_named_as_such() {
    let scene = Scene::during(Phase::Move)
        .after_ms(100)
        .fault(Fault::BlockedAxis { axis: 0 });
    let wanted = Wanted {
        cause: |failure| match failure {
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::FollowingError { .. },
                ..
            }) => true,
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::Emergency { emergency, .. },
                ..
            }) => emergency.code == EmergencyCode::FOLLOWING_ERROR,
            _ => false,
        },
        words: &["x:", "following error"],
        within: Duration::from_millis(80),
        rest: Duration::from_millis(80) + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn torque_that_is_switched_off_while_the_axis_moves_stops_it_for_good() {
    let scene = Scene::during(Phase::Move)
        .after_ms(100)
        .fault(Fault::SafeTorqueOff);
    let wanted = Wanted {
        cause: |failure| match failure {
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::Emergency { emergency, .. },
                ..
            }) => emergency.code == EmergencyCode::SAFE_TORQUE_OFF,
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::DriveState { .. },
                ..
            }) => true,
            _ => false,
        },
        words: &["x:", "torque"],
        within: PERIOD * 3,
        // It coasts: 200 mm/s at 2 m/s².
        rest: Duration::from_millis(250),
    };
    check(scene, &wanted);
}
