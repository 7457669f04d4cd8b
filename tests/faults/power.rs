//! A drive that does not do what its power state machine says (classes 16, 23, 24).

use std::time::Duration;

use drivers::device::{Alarm, DeviceError};
use machine::Finding;
use mock_bus::fault::Fault;
use mock_bus::node::cia402_drive::DriveQuirks;
use truestage::Failure;
use truestage::emulated::Emulated;
use units::Metres;
use wire::canopen::emcy::EmergencyCode;
use wire::cia402::PowerState;

use crate::scene::{PERIOD, Phase, STOPPING, Scene, Wanted, check, power_state, with_drive};

/// A drive with the quirk `key`, which `set` switches on: it must have made a difference.
fn quirk(scene: Scene, key: &'static str, set: fn(&mut DriveQuirks)) -> Scene {
    scene.deed(
        move |emulated| with_drive(emulated, |drive| set(drive.quirks_mut())),
        move |emulated| with_drive(emulated, |drive| drive.deliveries().contains_key(key)),
    )
}

#[test]
fn a_statusword_that_never_changes_is_named_with_the_state_it_stays_in() {
    let scene = quirk(Scene::during(Phase::Zero), "statusword_stuck", |quirks| {
        quirks.statusword_stuck = true
    });
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: DeviceError::Timeout { .. },
                    ..
                })
            )
        },
        words: &["x:", "ready to switch on", "switch on disabled"],
        within: Duration::from_secs(3),
        rest: Duration::from_secs(3),
    };
    check(scene, &wanted);
}

#[test]
fn a_statusword_that_sticks_in_a_move_ends_it_in_bounded_time() {
    let scene = quirk(
        Scene::during(Phase::Move).after_ms(100),
        "statusword_stuck",
        |quirks| {
            quirks.statusword_stuck = true;
        },
    );
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: DeviceError::Timeout { .. },
                    ..
                })
            )
        },
        words: &["x:", "target to be reached"],
        within: Duration::from_secs(5),
        rest: Duration::from_secs(5),
    };
    check(scene, &wanted);
}

#[test]
fn a_drive_that_refuses_to_enable_is_named_with_its_state() {
    let scene = quirk(Scene::during(Phase::Zero), "enable_refused", |quirks| {
        quirks.enable_refused = true
    });
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: DeviceError::Timeout { .. },
                    ..
                })
            )
        },
        words: &["x:", "operation enabled", "switched on"],
        within: Duration::from_secs(3),
        rest: Duration::ZERO,
    };
    check(scene, &wanted);
}

#[test]
fn a_target_that_is_never_reached_ends_the_move_in_bounded_time() {
    let scene = quirk(
        Scene::during(Phase::Move),
        "target_never_reached",
        |quirks| quirks.target_never_reached = true,
    );
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Device {
                    source: DeviceError::Timeout { .. },
                    ..
                })
            )
        },
        words: &["x:", "target to be reached", "last saw position", " mm"],
        within: Duration::from_secs(10),
        rest: Duration::from_secs(10),
    };
    let played = check(scene, &wanted);
    // Where the approach to 60 mm begins.
    let off = (played.bench.true_position() - Metres::from_mm(59.0)).abs();
    assert!(off.um() < 100.0, "it never got there: {} um off", off.um());
}

/// The drive stops with an error of its own that lasts, and its resets are counted.
fn fault_resets(emulated: &Emulated, internal: Option<EmergencyCode>) {
    with_drive(emulated, |drive| {
        drive.set_internal_error(internal);
        drive.quirks_mut().fault_reset_ignored = true;
    });
}

#[test]
fn a_fault_that_does_not_go_is_reset_once_and_no_more() {
    let scene = Scene::during(Phase::Move).after_ms(100).deed(
        |emulated| fault_resets(emulated, Some(EmergencyCode(0x3210))),
        |emulated| power_state(emulated) == PowerState::Fault,
    );
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: Alarm::Emergency { .. } | Alarm::DriveState { .. },
                    ..
                })
            )
        },
        words: &["x:"],
        within: PERIOD * 2,
        rest: PERIOD * 2 + Duration::from_millis(150),
    };
    let mut played = check(scene, &wanted);
    assert_eq!(resets(&played.seen()), 0, "nobody asked for a reset");
    played.bench.machine.start().unwrap();
    let failure = played.bench.machine.reset_fault("x").unwrap_err();
    assert!(failure.to_string().contains("fault"), "{failure}");
    let key = "fault_reset_ignored";
    let ignored = with_drive(&played.bench.emulated, |drive| {
        drive.deliveries().get(key).copied()
    });
    assert_eq!(ignored, Some(1), "the drive has ignored one reset");
    assert_eq!(resets(&played.seen()), 1, "{failure}");
    let failure = played.bench.machine.enable("x").unwrap_err();
    assert!(failure.to_string().contains("fault"), "{failure}");
    assert_eq!(
        resets(&played.seen()),
        1,
        "enabling resets nothing by itself"
    );
}

/// Rising edges of the controlword's bit 7.
fn resets(seen: &crate::witness::Testimony) -> usize {
    let bits: Vec<bool> = seen
        .controlwords()
        .map(|(_, word)| word & 0x80 != 0)
        .collect();
    bits.windows(2).filter(|pair| !pair[0] && pair[1]).count()
}

fn wrong_direction(scene: Scene, farthest: Duration) {
    let scene = quirk(scene, "direction_reversed", |quirks| {
        quirks.direction_reversed = true
    });
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Alarm {
                    alarm: Alarm::WrongDirection { .. },
                    ..
                })
            )
        },
        words: &["x:", "wrong direction"],
        within: farthest,
        rest: farthest + STOPPING,
    };
    check(scene, &wanted);
}

#[test]
fn an_axis_that_runs_the_wrong_way_is_stopped_before_it_gets_far() {
    wrong_direction(
        Scene::during(Phase::Restart).after_ms(60),
        Duration::from_millis(120),
    );
}

#[test]
fn an_axis_that_runs_the_wrong_way_is_stopped_at_its_first_motion_of_all() {
    wrong_direction(Scene::during(Phase::Zero), Duration::from_millis(200));
}

#[test]
fn torque_that_is_off_is_told_when_enabling_is_tried() {
    let scene = Scene::during(Phase::Zero).fault(Fault::SafeTorqueOff);
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(
                    machine::Failure::Alarm {
                        alarm: Alarm::Emergency { .. },
                        ..
                    } | machine::Failure::Device { .. }
                )
            )
        },
        words: &["x:"],
        within: Duration::from_secs(3),
        rest: Duration::ZERO,
    };
    check(scene, &wanted);
}

#[test]
fn a_limit_switch_that_is_hit_ends_the_move() {
    let fault = Fault::LimitSwitch {
        axis: 0,
        positive: true,
        pressed: true,
    };
    let wanted = Wanted {
        cause: |failure| {
            matches!(
                failure,
                Failure::Machine(machine::Failure::Explained {
                    finding: Finding::OnLimitSwitch { .. },
                    ..
                })
            )
        },
        words: &["x: the positive limit switch of node 1 is pressed"],
        within: PERIOD * 3,
        rest: PERIOD * 3 + STOPPING,
    };
    check(
        Scene::during(Phase::Move).after_ms(100).fault(fault),
        &wanted,
    );
}
