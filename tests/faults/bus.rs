//! What happens on the bus (classes 2 to 10): frames doubled, re-ordered, corrupted; the
//! controller off the bus, the interface gone, the queue full; somebody else who talks.

use std::time::Duration;

use drivers::device::Alarm;
use drivers::transport::SendError;
use mock_bus::fault::{Fault, FaultConfig};
use truestage::Failure;
use wire::LinkState;
use wire::can::CanId;

use crate::scene::{PERIOD, Phase, STOPPING, Scene, WATCH_MASTER, Wanted, check, check_harmless};

const CAN: &str = "can0";

fn moving() -> Scene {
    Scene::during(Phase::Move).after_ms(100)
}

/// When nothing of ours gets through any more, the drive stops by its own watch.
const BY_ITSELF: Duration = Duration::from_millis(600);

fn duplicated(cob_id: Option<u16>, probability: f64) -> FaultConfig {
    let mut fault = FaultConfig::permanent(Fault::Duplicate {
        port: CAN.into(),
        cob_id,
    });
    fault.probability = probability;
    fault
}

#[test]
fn process_data_and_answers_that_come_twice_do_no_harm() {
    for cob_id in [0x181, 0x281, 0x581, 0x701] {
        for phase in [Phase::Start, Phase::Zero, Phase::Calibrate] {
            if phase == Phase::Start || cob_id != 0x581 {
                check_harmless(Scene::during(phase).inject(duplicated(Some(cob_id), 1.0)));
            }
        }
    }
}

#[test]
fn frames_of_all_kinds_that_come_twice_now_and_then_do_no_harm() {
    for phase in [Phase::Start, Phase::Zero, Phase::Verify] {
        for seed in 1..=5 {
            check_harmless(
                Scene::during(phase)
                    .seed(seed)
                    .inject(duplicated(None, 0.02)),
            );
        }
    }
}

#[test]
fn frames_that_change_places_do_no_harm() {
    let mut fault = FaultConfig::permanent(Fault::Reorder {
        port: CAN.into(),
        cob_id: Some(0x181),
    });
    fault.probability = 0.2;
    check_harmless(Scene::during(Phase::Calibrate).inject(fault));
}

#[test]
fn a_single_corrupted_position_is_not_believed() {
    // The third byte of a position that is wrong: 0.65 mm or more. Other bytes have other ends.
    for seed in 1..=12 {
        let fault = Fault::Corrupt {
            port: CAN.into(),
            cob_id: Some(0x181),
        };
        let scene = moving().seed(seed).inject(FaultConfig::times(fault, 1));
        let played = scene.play();
        played.was_delivered();
        match &played.result {
            Ok(()) => {}
            Err(Failure::Machine(machine::Failure::Alarm {
                alarm: Alarm::DriveState { .. } | Alarm::FollowingError { .. },
                ..
            })) => {
                played.is_safe(PERIOD * 2 + STOPPING);
            }
            Err(failure) => panic!("seed {seed}: {failure}"),
        }
    }
}

#[test]
fn positions_that_jump_again_and_again_stop_the_machine() {
    let fault = Fault::Corrupt {
        port: CAN.into(),
        cob_id: Some(0x181),
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: Alarm::PositionJump { .. }
                        | Alarm::DriveState { .. }
                        | Alarm::FollowingError { .. },
                    ..
                })
            )
        },
        words: &["x:"],
        within: PERIOD * 8,
        rest: PERIOD * 8 + STOPPING,
    };
    for seed in 1..=6 {
        check(moving().seed(seed).fault(fault.clone()), &wanted);
    }
}

#[test]
fn error_passive_is_a_warning_and_no_stop() {
    let fault = Fault::ErrorPassive { port: CAN.into() };
    let played = check_harmless(moving().fault(fault));
    let warned = played.warnings();
    assert!(
        warned
            .iter()
            .any(|it| it.contains("can0") && it.contains("error-passive")),
        "{warned:?}"
    );
}

#[test]
fn bus_off_ends_everything_and_the_drive_stops_by_itself() {
    let fault = Fault::BusOff { port: CAN.into() };
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::BusOff { .. })),
        words: &["can0", "bus-off"],
        within: PERIOD,
        rest: BY_ITSELF,
    };
    check(moving().fault(fault), &wanted);
}

#[test]
fn an_interface_that_is_set_down_is_named_and_the_drive_stops_by_itself() {
    let fault = Fault::LinkDown { port: CAN.into() };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Link {
                    state: LinkState::Down,
                    ..
                })
            )
        },
        words: &["can0", "ENETDOWN"],
        within: PERIOD,
        rest: BY_ITSELF,
    };
    check(moving().fault(fault), &wanted);
}

#[test]
fn an_adapter_that_is_pulled_out_is_named_and_the_drive_stops_by_itself() {
    let fault = Fault::LinkGone { port: CAN.into() };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Link {
                    state: LinkState::Gone,
                    ..
                })
            )
        },
        words: &["can0", "ENODEV"],
        within: PERIOD,
        rest: BY_ITSELF,
    };
    check(moving().fault(fault), &wanted);
}

#[test]
fn an_adapter_that_comes_back_after_a_moment_is_not_simply_used_again() {
    let fault = FaultConfig::lasting(
        Fault::LinkGone { port: CAN.into() },
        Duration::from_millis(20),
    );
    let wanted = Wanted {
        cause: |failure| matches!(failure, Failure::Machine(machine::Failure::Link { .. })),
        words: &["can0"],
        within: PERIOD,
        rest: PERIOD + STOPPING + Duration::from_millis(100),
    };
    check(moving().inject(fault), &wanted);
}

#[test]
fn a_transmit_queue_that_is_full_is_named_and_drops_nothing_silently() {
    let scene = Scene::during(Phase::Start).emulated(
        "latency_us = 100.0\n",
        "latency_us = 100.0\ntransmit_queue_frames = 0\n",
    );
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Send {
                    source: SendError::QueueFull { .. },
                    ..
                })
            )
        },
        words: &["transmit queue full", "txqueuelen"],
        // Full for a moment is ordinary: 15 ms, three periods, are waited for.
        within: PERIOD * 4,
        rest: PERIOD * 4,
    };
    check(scene, &wanted);
}

#[test]
fn a_node_that_fills_the_bus_is_named_by_its_identifier() {
    let fault = Fault::Babble {
        port: CAN.into(),
        cob_id: 0x010,
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
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
    check(moving().fault(fault), &wanted);
}

#[test]
fn a_full_bus_of_low_priority_does_no_harm() {
    let fault = Fault::Babble {
        port: CAN.into(),
        cob_id: 0x7F0,
    };
    check_harmless(moving().fault(fault));
}

#[test]
fn a_second_master_is_refused_before_anything_moves() {
    let fault = Fault::ForeignSync {
        port: CAN.into(),
        period_ms: 10.0,
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::SecondMaster { .. })
            )
        },
        words: &["can0", "SYNC", "another master"],
        within: Duration::from_millis(20),
        rest: Duration::ZERO,
    };
    check(Scene::during(Phase::Start).fault(fault), &wanted);
}

#[test]
fn a_second_master_that_appears_stops_the_motion() {
    let fault = Fault::ForeignSync {
        port: CAN.into(),
        period_ms: 10.0,
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::SecondMaster { .. })
            )
        },
        words: &["can0", "SYNC", "another master"],
        within: PERIOD,
        rest: PERIOD + STOPPING,
    };
    check(moving().fault(fault), &wanted);
}

#[test]
fn two_devices_of_one_node_number_are_told_apart_from_a_reset() {
    let fault = Fault::DuplicateBootUp {
        port: CAN.into(),
        node_id: 1,
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: Alarm::DuplicateNode { .. },
                    ..
                })
            )
        },
        words: &["x:", "node 1", "second device"],
        within: PERIOD,
        rest: PERIOD + STOPPING,
    };
    check(moving().fault(fault), &wanted);
}

#[test]
fn a_second_device_with_the_drives_number_is_refused_at_the_start() {
    let twin = "[[nodes]]\nname = \"hall_adc\"";
    let with_twin = "[[nodes]]\nname = \"twin\"\nport = \"can0\"\n[nodes.device]\n\
         kind = \"cia402_drive\"\nnode_id = 1\naxis = 1\nencoder_resolution_nm = 10.0\n\
         identity = { vendor_id = 0x7FF, product_code = 0x42_0001, revision = 0x1_0000, \
         serial_number = 1002 }\n\n[[nodes]]\nname = \"hall_adc\"";
    let wanted = Wanted {
        cause: |failure| format!("{failure:?}").contains("DuplicateNode"),
        words: &["x:", "node 1", "second device"],
        within: Duration::from_secs(1),
        rest: Duration::ZERO,
    };
    check(
        Scene::during(Phase::Start).emulated(twin, with_twin),
        &wanted,
    );
}

#[test]
fn the_drives_own_watch_is_shorter_than_what_these_tests_allow() {
    assert!(WATCH_MASTER < BY_ITSELF);
}
