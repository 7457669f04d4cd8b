//! The same faults while an axis follows a path, a set-point at every SYNC (classes 1 to 6, 8 to
//! 10, 12 to 15, 22 to 24, 32, 50; those of the host are in `cyclic_host.rs`).

use drivers::device::Alarm;
use machine::Finding;
use machine::engine::EngineFailure;
use mock_bus::fault::{Fault, FaultConfig};
use truestage::Failure;
use wire::LinkState;
use wire::can::CanId;
use wire::canopen::emcy::EmergencyCode;

use crate::scene::{HEARTBEAT, PERIOD, Phase, STOPPING, Scene, Wanted, check, check_harmless};

const DRIVE: &str = "drive";
const CAN: &str = "can0";
/// When the drive stops by its own watch on SYNC (two and a half periods) or on our heartbeat.
const BY_ITSELF: core::time::Duration = core::time::Duration::from_millis(600);

/// In the middle of the path, at nearly 200 mm/s.
fn following() -> Scene {
    Scene::during(Phase::Follow).after_ms(1_700)
}

fn wanted(
    cause: fn(&Failure) -> bool,
    words: &'static [&'static str],
    periods: u32,
) -> Wanted<'static> {
    Wanted {
        cause,
        words,
        within: PERIOD * periods,
        rest: PERIOD * periods + STOPPING,
    }
}

fn now_and_then(fault: Fault, probability: f64) -> FaultConfig {
    let mut fault = FaultConfig::permanent(fault);
    fault.probability = probability;
    fault
}

fn on_tpdo(make: fn(String, Option<u16>) -> Fault) -> Fault {
    make(CAN.into(), Some(0x181))
}

#[test]
fn a_path_is_followed_to_its_end() {
    let played = Scene::during(Phase::Follow).play();
    played.result.as_ref().unwrap();
    let seen = played.seen();
    let reached = |mm: f64| seen.path.iter().any(|(_, at)| (at * 1e3 - mm).abs() < 0.5);
    assert!(reached(15.0) && reached(45.0));
    // One RPDO for each SYNC, in the cyclic mode without an edge: never a set-point bit.
    assert!(
        seen.controlwords()
            .filter(|(_, word)| *word == 0x0F)
            .count()
            > 800
    );
}

#[test]
fn single_lost_and_doubled_samples_are_ridden_out() {
    let lost = on_tpdo(|port, cob_id| Fault::Drop { port, cob_id });
    check_harmless(Scene::during(Phase::Follow).inject(now_and_then(lost, 0.02)));
    let doubled = on_tpdo(|port, cob_id| Fault::Duplicate { port, cob_id });
    check_harmless(Scene::during(Phase::Follow).inject(now_and_then(doubled, 0.5)));
    // An adapter that exchanges a sample and what comes after it.
    let reordered = on_tpdo(|port, cob_id| Fault::Reorder { port, cob_id });
    check_harmless(Scene::during(Phase::Follow).inject(now_and_then(reordered, 0.1)));
}

#[test]
fn a_bus_that_gets_worse_is_told_and_goes_on() {
    let fault = Fault::ErrorPassive { port: CAN.into() };
    let played = check_harmless(following().inject(FaultConfig::times(fault, 1)));
    let warnings = played.warnings();
    let told = |it: &String| it.contains("can0") && it.contains("error-passive");
    assert!(warnings.iter().any(told), "{warnings:?}");
}

#[test]
fn a_second_node_with_the_drives_number_stops_it() {
    let fault = Fault::DuplicateBootUp {
        port: CAN.into(),
        node_id: 1,
    };
    let cause = |it: &Failure| {
        matches!(
            it,
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::DuplicateNode { .. } | Alarm::UnexpectedBootUp { .. },
                ..
            })
        )
    };
    let scene = following().inject(FaultConfig::times(fault, 1));
    let played = check(scene, &wanted(cause, &["x:"], 2));
    assert!(!played.bench.machine.is_zeroed("x"));
}

#[test]
fn process_data_that_freeze_stop_the_drive() {
    let fault = Fault::StaleData { node: DRIVE.into() };
    let cause = |failure: &Failure| {
        matches!(
            failure,
            Failure::Machine(machine::Failure::Explained {
                finding: Finding::Frozen { .. },
                ..
            })
        )
    };
    // 1 mm and the last four set-points at 80 mm/s and more.
    check(following().fault(fault), &wanted(cause, &["x:"], 8));
}

#[test]
fn a_limit_switch_that_is_pressed_on_the_way_stops_the_drive() {
    let cause = |failure: &Failure| {
        matches!(
            failure,
            Failure::Machine(
                machine::Failure::Engine(EngineFailure::Deviates { .. })
                    | machine::Failure::Explained {
                        finding: Finding::OnLimitSwitch { .. },
                        ..
                    }
            )
        )
    };
    let pressed = |positive| Fault::LimitSwitch {
        axis: 0,
        positive,
        pressed: true,
    };
    let both = following().fault(pressed(true)).fault(pressed(false));
    check(both, &wanted(cause, &["x:"], 10));
}

#[test]
fn samples_that_stay_away_stop_the_drive_within_four_periods() {
    let missing = |failure: &Failure| {
        matches!(
            failure,
            Failure::Machine(machine::Failure::Explained {
                finding: Finding::NoProcessData { .. }
                    | Finding::Silent { .. }
                    | Finding::NoSample { .. },
                ..
            })
        )
    };
    for fault in [
        Fault::StopPdos { node: DRIVE.into() },
        Fault::Mute { node: DRIVE.into() },
        on_tpdo(|port, cob_id| Fault::Drop { port, cob_id }),
    ] {
        check(following().fault(fault), &wanted(missing, &["x:"], 4));
    }
}

#[test]
fn a_heartbeat_that_stops_while_samples_go_on_stops_the_drive() {
    let fault = Fault::StopHeartbeat { node: DRIVE.into() };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Explained {
                    finding: Finding::NoHeartbeat { .. },
                    ..
                })
            )
        },
        words: &["x:", "no heartbeat"],
        within: HEARTBEAT + PERIOD,
        rest: HEARTBEAT + PERIOD + STOPPING,
    };
    check(following().fault(fault), &wanted);
}

#[test]
fn positions_that_jump_again_and_again_stop_the_drive() {
    let fault = on_tpdo(|port, cob_id| Fault::Corrupt { port, cob_id });
    let cause = |failure: &Failure| {
        matches!(
            failure,
            Failure::Machine(
                machine::Failure::Alarm {
                    alarm: Alarm::PositionJump { .. }
                        | Alarm::DriveState { .. }
                        | Alarm::FollowingError { .. },
                    ..
                } | machine::Failure::Engine(
                    EngineFailure::Deviates { .. } | EngineFailure::NotCyclic { .. }
                ) | machine::Failure::Device { .. }
            )
        )
    };
    for seed in 1..=6 {
        check(
            following().seed(seed).fault(fault.clone()),
            &wanted(cause, &["x:"], 8),
        );
    }
}

#[test]
fn bus_off_and_a_bus_that_goes_away_are_named_within_a_period() {
    let by_itself = |cause, words| Wanted {
        cause,
        words,
        within: PERIOD,
        rest: BY_ITSELF,
    };
    let off = by_itself(
        |it| matches!(it, Failure::Machine(machine::Failure::BusOff { .. })),
        &["can0", "bus-off"],
    );
    check(following().fault(Fault::BusOff { port: CAN.into() }), &off);
    let down = by_itself(
        |it| {
            matches!(
                it,
                Failure::Machine(machine::Failure::Link {
                    state: LinkState::Down,
                    ..
                })
            )
        },
        &["can0"],
    );
    check(
        following().fault(Fault::LinkDown { port: CAN.into() }),
        &down,
    );
    let gone = by_itself(
        |it| {
            matches!(
                it,
                Failure::Machine(machine::Failure::Link {
                    state: LinkState::Gone,
                    ..
                })
            )
        },
        &["can0"],
    );
    check(
        following().fault(Fault::LinkGone { port: CAN.into() }),
        &gone,
    );
}

#[test]
fn a_second_masters_sync_stops_the_drive() {
    let fault = Fault::ForeignSync {
        port: CAN.into(),
        period_ms: 7.0,
    };
    let cause =
        |it: &Failure| matches!(it, Failure::Machine(machine::Failure::SecondMaster { .. }));
    check(
        following().fault(fault),
        &wanted(cause, &["can0", "another master"], 3),
    );
}

#[test]
fn a_talker_that_fills_the_bus_is_named() {
    let fault = Fault::Babble {
        port: CAN.into(),
        cob_id: 0x010,
    };
    let wanted = Wanted {
        cause: |it| {
            matches!(
                it,
                Failure::Machine(machine::Failure::Babbling {
                    id: CanId::Standard(0x010),
                    ..
                })
            )
        },
        words: &["can0", "0x010"],
        within: PERIOD * 4,
        rest: BY_ITSELF,
    };
    check(following().fault(fault), &wanted);
}

#[test]
fn an_emergency_stops_the_drive_within_two_periods() {
    let fault = FaultConfig::times(
        Fault::Emergency {
            port: CAN.into(),
            node_id: 1,
            code: 0x4310,
            register: 0x08,
        },
        1,
    );
    let cause = |it: &Failure| {
        matches!(
            it,
            Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::Emergency { emergency, .. },
                ..
            }) if emergency.code == EmergencyCode(0x4310)
        )
    };
    check(following().inject(fault), &wanted(cause, &["x:"], 2));
}

#[test]
fn a_blocked_axis_and_a_drive_without_torque_are_never_driven_on() {
    let cause = |it: &Failure| {
        matches!(
            it,
            Failure::Machine(
                machine::Failure::Engine(EngineFailure::Deviates { .. })
                    | machine::Failure::Alarm {
                        alarm: Alarm::FollowingError { .. }
                            | Alarm::DriveState { .. }
                            | Alarm::Emergency { .. },
                        ..
                    }
            )
        )
    };
    check(
        following().fault(Fault::BlockedAxis { axis: 0 }),
        &wanted(cause, &["x:"], 10),
    );
    let torque_off = Wanted {
        // It coasts.
        rest: BY_ITSELF,
        ..wanted(cause, &["x:"], 3)
    };
    check(following().fault(Fault::SafeTorqueOff), &torque_off);
}

#[test]
fn a_drive_that_loses_its_power_is_not_homed_any_more() {
    let scene = following().inject({
        let mut fault = FaultConfig::permanent(Fault::PowerLoss { node: DRIVE.into() });
        fault.duration_s = Some(0.3);
        fault
    });
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Explained {
                    finding: Finding::Restarted { .. },
                    ..
                })
            )
        },
        words: &["x: node 1 restarted at"],
        within: PERIOD * 4,
        rest: BY_ITSELF,
    };
    let mut played = check(scene, &wanted);
    let machine = &mut played.bench.machine;
    assert!(!machine.is_zeroed("x"));
    machine.start().unwrap();
    let refused = machine.linear("x").unwrap().move_to(units::Metres::ZERO);
    assert!(
        matches!(
            refused,
            Err(Failure::Machine(machine::Failure::NotZeroed { .. }))
        ),
        "{refused:?}"
    );
}

#[test]
fn a_stop_that_is_asked_for_is_a_controlled_one() {
    let played = following().stop_request().play();
    assert!(
        matches!(
            played.result,
            Err(Failure::Machine(machine::Failure::Interrupted))
        ),
        "{:?}",
        played.result
    );
    // 200 mm/s at 5 m/s² and 100 m/s³, and no quick stop before the axis is at rest.
    let at_rest = played.seen().moved_last(played.due).unwrap();
    assert!(
        at_rest <= played.due + 4 * STOPPING,
        "{:?}",
        at_rest - played.due
    );
    let seen = played.seen();
    let quick = seen
        .controlwords()
        .find(|(at, word)| *at > played.due && *word & 0x06 == 0x02);
    assert!(
        quick.is_none_or(|(at, _)| at + PERIOD * 4 >= at_rest),
        "{quick:?} {at_rest}"
    );
}
