//! Lines 1 to 5, 7 and 8: how motions end.

use std::path::Path;

use mock_bus::fault::Fault;
use service::{
    ApproachName, AxisState, Code, IfMoving, MachineState, MotionState, MoveRequest, StopMode,
};
use tests::{Edit, LINEAR, Rig, Shipped};
use units::MetresPerSecond;

use super::together::path;
use super::{
    Bed, SEED, anna, bert, compensated, each, length, slowly, to, with_stage, with_three_axes,
    with_zeroed_stage, with_zeroed_stage_in_process, zeroed,
};
use crate::stage::Stage;

/// Line 1: the end is a level: whoever asks later, and however often, hears the same.
#[test]
fn the_end_of_a_motion_is_a_level_with_an_id() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&to("x", 10.0));
        let first = bed.ended(&id);
        assert_eq!(first.state, MotionState::Done, "{first:?}");
        assert_eq!((&first.stopped, &first.cause), (&None, &None));
        let other = bed.begin(&to("x", 20.0));
        bed.ended(&other);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        assert_eq!(bed.now(&id), first, "a stop afterwards changes no end");
        let unknown = bed.client.motion("m0-0", core::time::Duration::ZERO);
        assert_eq!(unknown.unwrap_err().code, Code::NoSuchMotion);
    });
}

/// Line 2: in position for the configured time, the final position published before the end is.
#[test]
fn done_comes_after_the_axis_has_been_in_position_and_after_its_final_position() {
    with_zeroed_stage(|bed| {
        let before = bed.client.machine().newest_event;
        let id = bed.begin(&to("x", 12.5));
        let view = bed.ended(&id);
        let leg = &view.axes["x"];
        let (encoder, set_point) = (leg.encoder.clone(), leg.set_point.clone());
        let off = encoder.unwrap().value - set_point.unwrap().value;
        assert!(off.abs() <= 0.05e-3, "within the window of 50 nm: {off} mm");
        let events = bed.client.events(before);
        let of_position = events.iter().find(|it| it.kind == "position").unwrap();
        let is_done = |it: &&service::Event| it.kind == "motion" && it.data["state"] == "done";
        let of_end = events.iter().find(is_done).unwrap();
        assert!(of_position.id < of_end.id, "{events:#?}");
        assert_eq!(of_position.data["motion"], id);
        let position = view.axes["x"].position.clone().unwrap();
        assert_eq!(of_position.data["position"]["value"], position.value);
        assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Standstill);
        // The truth: encoder and stage differ by the deviation of the stage, 10 µm at most.
        assert!((bed.stage.true_mm() - 12.5).abs() < 0.02);
    });
}

/// Line 2, when it has not been in position long enough: it is not done.
#[test]
fn a_motion_is_not_done_before_the_axis_has_been_in_position_for_its_time() {
    let long = |text: String| {
        super::patient(text).edit(
            "position_window_time_ms = 10",
            "position_window_time_ms = 2000",
        )
    };
    each(
        |rig, folder| Stage::new(rig, (LINEAR, SEED), folder, long),
        |bed| {
            bed.client.zero(&anna(), None);
            let begun = bed.client.machine().clock_s;
            let id = bed.begin(&to("x", 1.0));
            assert_eq!(bed.ended(&id).state, MotionState::Done);
            let events = bed.client.events(0);
            assert!(events.iter().any(|it| it.kind == "position"));
            // A millimetre takes milliseconds; the rest is being in position.
            let took = bed.client.machine().clock_s - begun;
            assert!(took >= 2.0, "{took} s");
        },
    );
}

/// Line 3: a stop by anybody ends every pending motion as stopped, and names who.
#[test]
fn a_stop_by_anybody_ends_every_pending_motion_and_names_who() {
    with_zeroed_stage(|bed| {
        let moving = bed.begin(&slowly("x", 30.0));
        let queued = bed.begin(&MoveRequest {
            if_moving: IfMoving::Queue,
            ..to("x", 1.0)
        });
        bed.under_way(&moving);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        for id in [&moving, &queued] {
            let view = bed.ended(id);
            assert_eq!(view.state, MotionState::Stopped, "{view:?}");
            assert_eq!(view.stopped.unwrap().by, "bert");
        }
        let axis = bed.client.axis("x").unwrap();
        assert_eq!(axis.state, AxisState::Standstill, "it stays enabled");
        assert!(axis.homed, "and keeps its zero");
        let here = bed.encoder_mm("x");
        bed.let_time_pass(1.0);
        assert!(
            (bed.encoder_mm("x") - here).abs() < 1e-3,
            "it moves on after its end"
        );
        // And the next motion is like any other.
        let next = bed.begin(&to("x", 5.0));
        assert_eq!(bed.ended(&next).state, MotionState::Done);
    });
}

/// Line 3, the quick way: the drive is off afterwards, and keeps its zero.
#[test]
fn a_quick_stop_ends_motions_as_stopped_and_switches_the_drive_off() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&slowly("x", 30.0));
        bed.under_way(&id);
        bed.client.stop(&bert(), StopMode::Quick).unwrap();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Disabled);
        let problem = bed.refused(&to("x", 1.0), Code::AxisDisabled);
        assert!(problem.detail().contains("enable"), "{problem}");
        bed.client.power(&anna(), "x", true).unwrap();
        let next = bed.begin(&to("x", 5.0));
        assert_eq!(bed.ended(&next).state, MotionState::Done);
    });
}

/// Line 4: each fault of the drive or its bus ends the motion as failed with its cause. A heartbeat that stays away, a
/// drive that says what happened and a bus that is gone on every bus, the others in-process.
#[test]
fn a_fault_fails_the_motion_with_its_cause_and_nothing_moves_before_a_reset() {
    let drive = || "drive".to_owned();
    let link = Fault::LinkDown {
        port: "can0".into(),
    };
    let everywhere = [
        (Fault::StopHeartbeat { node: drive() }, &[Code::Silent][..]),
        (Fault::SafeTorqueOff, &[Code::DriveState, Code::Alarm]),
        // An adapter on a serial line says nothing of its bus: what stays away does.
        (link, &[Code::Device, Code::Silent]),
    ];
    for (fault, codes) in everywhere {
        with_zeroed_stage(|bed| check_fails(bed, &fault, codes));
    }
    let in_process = [
        (Fault::StopPdos { node: drive() }, &[Code::Silent][..]),
        (
            Fault::PowerLoss { node: drive() },
            &[Code::Restarted, Code::Silent],
        ),
        (
            Fault::BlockedAxis { axis: 0 },
            &[Code::FollowingError, Code::DriveState, Code::Alarm],
        ),
    ];
    for (fault, codes) in in_process {
        with_zeroed_stage_in_process(|bed| check_fails(bed, &fault, codes));
    }
}

fn check_fails(bed: &Bed<'_>, fault: &Fault, codes: &[Code]) {
    let id = bed.begin(&slowly("x", 30.0));
    bed.under_way(&id);
    let injected = bed.stage.inject(fault.clone());
    let view = bed.ended(&id);
    assert_eq!(view.state, MotionState::Failed, "{fault:?}: {view:?}");
    let cause = view.cause.expect("it has a cause");
    assert!(codes.contains(&cause.code), "{fault:?}: {cause:?}");
    assert!(
        bed.stage.deliveries(injected) > 0,
        "{fault:?} was delivered"
    );
    assert_eq!(bed.client.machine().state, MachineState::ErrorStop);
    let axis = bed.client.axis("x").unwrap();
    assert_eq!(axis.state, AxisState::ErrorStop);
    assert_eq!(axis.last_cause.as_ref(), Some(&cause));
    let refused = bed.refused(&to("x", 1.0), Code::ErrorStop);
    assert!(refused.detail().contains(&cause.cause), "{refused}");
}

/// Line 4, afterwards: a reset starts the machine anew, and the axis has to be zeroed again.
#[test]
fn after_a_fault_a_reset_and_a_new_zero_make_the_axis_usable() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&slowly("x", 30.0));
        bed.under_way(&id);
        let fault = bed.stage.inject(Fault::SafeTorqueOff);
        assert_eq!(bed.ended(&id).state, MotionState::Failed);
        bed.stage.end_fault(fault);
        bed.client
            .reset(&anna())
            .unwrap_or_else(|it| panic!("{it}"));
        assert_eq!(bed.client.machine().state, MachineState::Running);
        bed.refused(&to("x", 1.0), Code::NotZeroed);
        bed.client.zero(&anna(), None);
        let next = bed.begin(&to("x", 5.0));
        assert_eq!(bed.ended(&next).state, MotionState::Done);
    });
}

/// A drive that keeps to a limit of its own, which the configuration does not know.
fn stage_as_fast_as(mm_per_s: f64, rig: Rig, folder: &Path) -> Stage {
    let limit = |mm_per_s: f64| format!("max_profile_velocity_mm_per_s = {mm_per_s:.1}");
    let emulated = LINEAR.emulated.edit(&limit(1000.0), &limit(mm_per_s));
    let shipped = Shipped {
        emulated: Box::leak(emulated.into_boxed_str()),
        ..LINEAR
    };
    Stage::new(rig, (shipped, SEED), folder, |text| text)
}

/// Line 1, the fourth end: what does not get there in time is stopped and says so.
#[test]
fn a_motion_that_takes_too_long_is_stopped_and_timed_out() {
    each(
        |rig, folder| stage_as_fast_as(3.0, rig, folder),
        |bed| {
            bed.client.zero(&anna(), None);
            let view = bed.ended(&bed.begin(&to("x", 55.0)));
            assert_eq!(view.state, MotionState::TimedOut, "{view:?}");
            assert_eq!(view.cause.unwrap().code, Code::Overdue);
            assert!(bed.encoder_mm("x") < 50.0);
            let axis = bed.client.axis("x").unwrap();
            assert_eq!(axis.state, AxisState::ErrorStop, "it was stopped");
        },
    );
}

/// Line 5: a motion to where the axis stands ends done at once.
#[test]
fn a_motion_to_where_the_axis_stands_is_done_at_once() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&to("x", 7.0));
        assert_eq!(bed.ended(&id).state, MotionState::Done);
        let before = bed.client.machine().newest_event;
        let again = bed.begin(&to("x", 7.0));
        assert_eq!(bed.ended(&again).state, MotionState::Done);
        let events = bed.client.events(before);
        let of_motion: Vec<_> = events.iter().filter(|it| it.of == again).collect();
        let [queued, done] = of_motion[..] else {
            panic!("{of_motion:?}")
        };
        let took_s = done.clock_s - queued.clock_s;
        // A drive that is asked again confirms it within a few of its 5 ms.
        assert!(took_s <= 0.05, "{took_s} s");
    });
}

/// Line 7: a client that goes away is not a stop.
#[test]
fn a_client_that_goes_away_is_not_a_stop() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&to("x", 40.0));
        // Nobody asks for this motion any more; only time passes.
        for _ in 0..50 {
            let _ = bed.client.axis("x");
            bed.stage.simulation(|_| ());
        }
        assert_eq!(bed.ended(&id).state, MotionState::Done);
    });
}

/// Line 7, unless it asked for a dead-man.
#[test]
fn a_dead_man_that_is_not_renewed_stops_its_motion() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&MoveRequest {
            dead_man_ms: Some(500),
            ..slowly("x", 30.0)
        });
        bed.client.renew(&anna(), &id).unwrap();
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Stopped, "{view:?}");
        assert_eq!(view.stopped.unwrap().by, "the dead-man of anna");
        let over = bed.client.renew(&anna(), &id).unwrap_err();
        assert_eq!(over.code, Code::NoSuchMotion);
    });
}

/// Line 8: refused unless the request says otherwise.
#[test]
fn a_motion_of_an_axis_that_moves_is_refused_by_default() {
    with_zeroed_stage(|bed| {
        let id = bed.begin(&slowly("x", 30.0));
        bed.under_way(&id);
        let problem = bed.refused(&to("x", 1.0), Code::AxisBusy);
        assert!(problem.detail().contains(&id), "{problem}");
        assert_eq!(bed.now(&id).state, MotionState::Moving, "it goes on");
    });
}

/// Line 8: queued.
#[test]
fn a_queued_motion_begins_when_its_axis_is_free() {
    with_zeroed_stage(|bed| {
        let first = bed.begin(&to("x", 30.0));
        let queued = MoveRequest {
            if_moving: IfMoving::Queue,
            ..to("x", 1.0)
        };
        let second = bed.begin(&queued);
        let before = bed.client.machine().newest_event;
        assert_eq!(bed.ended(&second).state, MotionState::Done);
        assert_eq!(bed.ended(&first).state, MotionState::Done);
        assert!(before > 0);
        assert!((bed.encoder_mm("x") - 1.0).abs() < 0.05);
    });
}

/// Line 8: superseding.
#[test]
fn a_superseding_motion_stops_the_one_before_and_says_so() {
    with_zeroed_stage(|bed| {
        let first = bed.begin(&slowly("x", 30.0));
        bed.under_way(&first);
        let second = MoveRequest {
            if_moving: IfMoving::Supersede,
            ..to("x", 1.0)
        };
        let second = bed.client.begin(&bert(), &second, None).unwrap();
        assert_eq!(bed.ended(&second).state, MotionState::Done);
        let view = bed.ended(&first);
        assert_eq!(view.state, MotionState::Stopped);
        let by = view.stopped.unwrap().by;
        assert!(by.contains("bert") && by.contains(&second), "{by}");
    });
}

/// Motions of axes that have none in common overlap; those that share one do not.
#[test]
fn motions_of_disjoint_axes_overlap() {
    with_three_axes(|bed| {
        let of = |targets: &[(&str, f64)]| MoveRequest {
            targets: targets
                .iter()
                .map(|(axis, mm)| ((*axis).to_owned(), length(*mm)))
                .collect(),
            uncompensated: true,
            ..slowly("x", 0.0)
        };
        let refused = MoveRequest {
            uncompensated: false,
            ..of(&[("x", 2.0)])
        };
        bed.refused(&refused, Code::Calibration);
        bed.refused(&compensated("x", 2.0), Code::Calibration);
        let corrected = path("0,1,1,1\n1,2,1,1\n");
        let problem = bed.client.plan(&anna(), &corrected).unwrap_err();
        assert_eq!(problem.code, Code::Calibration, "{problem:?}");
        let first = bed.begin(&of(&[("x", 2.0)]));
        let second = bed.begin(&of(&[("y", 1.0), ("z", 1.0)]));
        bed.refused(&of(&[("x", 3.0), ("y", 3.0)]), Code::AxisBusy);
        for axis in ["x", "y", "z"] {
            assert_eq!(
                bed.client.axis(axis).unwrap().state,
                AxisState::DiscreteMotion
            );
        }
        assert_eq!(bed.now(&first).state, MotionState::Moving);
        assert_eq!(bed.now(&second).state, MotionState::Moving);
        assert_eq!(bed.ended(&second).state, MotionState::Done);
        assert_eq!(bed.ended(&first).state, MotionState::Done);
    });
}

/// What cannot be driven is refused before anything moves.
#[test]
fn what_must_not_be_driven_is_refused_with_the_text_of_the_command_line() {
    with_stage(|bed: &Bed<'_>| {
        let problem = bed.refused(&to("x", 1.0), Code::NotZeroed);
        assert!(problem.detail().contains("not zeroed"), "{problem}");
        bed.client.zero(&anna(), None);
        let here = bed.encoder_mm("x");
        let problem = bed.refused(&to("x", 70.0), Code::SoftLimit);
        let said = "axis x: 70.000000 mm is outside the soft limits -3.000 to 63.000 mm; nothing was moved";
        assert_eq!((&*problem.detail(), problem.exit_code), (said, 3));
        bed.refused(&to("q", 1.0), Code::NoSuchAxis);
        let problem = bed.refused(&compensated("x", 1.0), Code::Calibration);
        let said = problem.detail();
        assert!(
            said.contains("axis x has no calibration") && said.contains("uncompensated"),
            "{said}"
        );
        assert_eq!(problem.exit_code, 3);
        let nothing = MoveRequest {
            targets: [].into(),
            ..to("x", 0.0)
        };
        bed.refused(&nothing, Code::BadRequest);
        bed.stage.simulation(|_| ());
        assert!((bed.encoder_mm("x") - here).abs() < 1e-3);
    });
}

/// The deviation of the stage was never measured there.
#[test]
fn beyond_the_calibrated_range_no_axis_goes_unasked() {
    with_zeroed_stage(|bed| {
        bed.calibrates();
        let beyond = compensated("x", 62.5);
        let problem = bed.refused(&beyond, Code::Calibration);
        assert!(
            problem.detail().contains("beyond the calibrated range"),
            "{problem}"
        );
        let agreed = MoveRequest {
            beyond: true,
            ..beyond
        };
        let ended = bed.ended(&bed.begin(&agreed));
        assert_eq!(ended.state, MotionState::Done);
        assert_ne!(ended.axes["x"].corrected, "yes");
    });
}

/// `move_timeout_s` (10 s) is for what an axis does at its own speed.
#[test]
fn a_slow_motion_has_the_time_that_its_way_takes_and_one_without_an_end_is_refused() {
    let unpatient = |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, |text| text);
    each(
        unpatient,
        zeroed(|bed: &Bed<'_>| {
            let at = |speed: f64| MoveRequest {
                speed: Some(MetresPerSecond(speed).into()),
                ..to("x", 10.0)
            };
            let view = bed.ended(&bed.begin(&at(0.5e-3)));
            assert_eq!(view.state, MotionState::Done, "{view:?}");
            let back = bed.ended(&bed.begin(&to("x", 0.0)));
            assert_eq!(back.state, MotionState::Done);
            let refused = bed.refused(&at(1e-30), Code::Refused);
            assert!(refused.to_string().contains("24 h"), "{refused}");
        }),
    );
}

/// Lost motion is taken up from the side that is asked for, wherever the axis comes from.
#[test]
fn an_axis_arrives_from_the_side_that_is_asked_for() {
    with_zeroed_stage(|bed| {
        let arrived = |from_mm: f64, approach| {
            bed.done(&to("x", from_mm));
            bed.done(&MoveRequest {
                approach: Some(approach),
                ..to("x", 10.0)
            });
            // The same again is done at once: that is how it came there.
            let before = bed.client.machine().newest_event;
            bed.done(&MoveRequest {
                approach: Some(approach),
                ..to("x", 10.0)
            });
            let events = bed.client.events(before);
            let of_motion: Vec<_> = events.iter().filter(|it| it.kind == "motion").collect();
            let [queued, done] = of_motion[..] else {
                panic!("{of_motion:?}")
            };
            let took_s = done.clock_s - queued.clock_s;
            assert!(took_s <= 0.05, "{took_s} s");
            bed.stage.true_mm()
        };
        for (side, other) in [(5.0, 15.0), (15.0, 5.0)] {
            let forward = [
                arrived(side, ApproachName::Forward),
                arrived(other, ApproachName::Forward),
            ];
            let reverse = [
                arrived(side, ApproachName::Reverse),
                arrived(other, ApproachName::Reverse),
            ];
            let lost = (forward[0] - reverse[0]).abs();
            assert!(lost > 3e-4, "it has lost motion: {lost} mm");
            for [first, second] in [forward, reverse] {
                assert!(
                    (first - second).abs() < lost / 4.0,
                    "{forward:?} {reverse:?}"
                );
            }
        }
        let refused = bed.refused(
            &MoveRequest {
                approach: Some(ApproachName::Forward),
                ..to("x", -2.99)
            },
            Code::SoftLimit,
        );
        assert!(refused.detail().contains("soft limits"), "{refused}");
    });
}
