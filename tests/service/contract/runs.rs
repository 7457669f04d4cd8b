//! Runs: planned, started, answered meanwhile, stopped.

use core::time::Duration;
use std::path::Path;

use mock_bus::fault::Fault;
use service::{
    AxisState, Caller, Code, LeaseRequest, MachineState, MotionState, RunKind, RunRequest,
    RunState, StopMode,
};
use tests::{Edit, LINEAR};

use super::{
    Bed, SEED, anna, bert, compensated, each, patient, to, with_stage, with_zeroed_stage,
    with_zeroed_stage_in_process, zeroed,
};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// Fewer measurements: how good they are is asked elsewhere.
pub(super) fn short(text: String) -> String {
    fewer(patient(text))
}

/// The same of any stage.
pub(super) fn fewer(text: String) -> String {
    text.edit("runs = 3", "runs = 2")
        .edit("step_mm = 3.0", "step_mm = 10.0")
        .edit("targets = 8\nruns = 5", "targets = 4\nruns = 2")
}

#[test]
fn a_stage_is_zeroed_calibrated_verified_and_moved_without_a_second_zero() {
    each(
        |rig, folder| Stage::new(rig, (LINEAR, SEED), folder, short),
        |bed| {
            bed.client.zero(&anna(), Some("x"));
            let plan = RunRequest {
                start: false,
                ..RunRequest::of(RunKind::Calibrate, Some("x"))
            };
            let id = bed.client.plan(&anna(), &plan).unwrap();
            let planned = bed.client.run(&id, core::time::Duration::ZERO).unwrap();
            assert_eq!(planned.state, RunState::Planned);
            assert_eq!(planned.plan.points, 28, "7 places, 2 runs, both sides");
            bed.client.start(&anna(), &id).unwrap();
            let made = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(made.state, RunState::Done, "{made:?}");
            let calibration = bed.client.axis("x").unwrap().calibration;
            assert_eq!(made.result["calibration"], calibration.unwrap());

            let id = bed
                .client
                .plan(&anna(), &RunRequest::of(RunKind::Verify, None));
            let judged = bed.client.run(&id.unwrap(), PATIENCE).unwrap();
            assert_eq!(judged.state, RunState::Done, "{judged:?}");
            assert_eq!(judged.result["within_tolerance"], true, "{judged:?}");

            let id = bed.begin(&compensated("x", 31.0));
            let view = bed.ended(&id);
            assert_eq!(view.state, MotionState::Done);
            let leg = &view.axes["x"];
            assert_eq!(leg.corrected, "yes");
            assert!(leg.standard_uncertainty.is_some());
            let position = leg.position.as_ref().unwrap().value;
            assert!((position - 31.0).abs() < 1e-3, "{position}");
            // The stage's deviation of up to 10 µm is corrected; what is left are its zero and its repeatability.
            assert!(
                (bed.stage.true_mm() - 31.0).abs() < 3e-3,
                "{}",
                bed.stage.true_mm()
            );

            // However short a move is, it ends as the calibration's moves did: with an approach over a millimetre.
            let sent_mm = || bed.client.axis("x").unwrap().set_point.unwrap().value;
            // However slowly this computer answers, it looks many times on either way.
            bed.stage.gate.limit(Duration::from_millis(2));
            let id = bed.begin(&compensated("x", 31.05));
            let mut sent = Vec::new();
            while bed.now(&id).state != MotionState::Done {
                sent.push(sent_mm());
                bed.let_time_pass(0.002);
            }
            bed.stage.gate.lift_limit();
            let by_way_of = sent.iter().copied().fold(f64::INFINITY, f64::min);
            assert!((by_way_of - 30.05).abs() < 0.02, "{sent:?}");
            let view = bed.ended(&id);
            assert_eq!(view.state, MotionState::Done, "{view:?}");
            assert!((sent_mm() - 31.05).abs() < 0.02);
            // There already: nothing moves.
            let id = bed.begin(&compensated("x", 31.05));
            bed.let_time_pass(0.02);
            assert!((sent_mm() - 31.05).abs() < 0.02);
            assert_eq!(bed.ended(&id).state, MotionState::Done);
        },
    );
}

#[test]
fn while_a_run_is_under_way_everything_is_answered_and_its_axis_is_refused() {
    with_stage(|bed| {
        let id = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, None));
        let id = id.unwrap();
        let axis = bed.client.axis("x").unwrap();
        assert_eq!(axis.used_by.as_deref(), Some(&*id));
        let busy = bed.client.power(&bert(), "x", false).unwrap_err();
        assert_eq!(busy.code, Code::AxisBusy, "{busy}");
        let second = bed
            .client
            .plan(&bert(), &RunRequest::of(RunKind::Zero, None));
        assert_eq!(second.unwrap_err().code, Code::AxisBusy);
        bed.let_time_pass(0.2);
        let run = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!(run.state, RunState::Running);
        assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Homing);
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Done, "{run:?}");
    });
}

#[test]
fn a_stop_by_anybody_ends_a_run_at_once_and_names_who() {
    for mode in [StopMode::Controlled, StopMode::Quick] {
        with_stage(|bed| {
            let id = bed
                .client
                .plan(&anna(), &RunRequest::of(RunKind::Zero, None));
            let id = id.unwrap();
            bed.let_time_pass(0.2);
            bed.client.stop(&bert(), mode).unwrap();
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
            assert_eq!(run.stopped.unwrap().by, "bert");
            let axis = bed.client.axis("x").unwrap();
            let expected = match mode {
                StopMode::Controlled => AxisState::Standstill,
                StopMode::Quick => AxisState::Disabled,
            };
            assert_eq!(axis.state, expected);
            assert!(!axis.homed);
            // The machine is as it was: the next zero needs no reset.
            bed.client.zero(&anna(), None);
        });
    }
}

/// Line 4 of the contract, for what only a run looks at.
#[test]
fn a_beam_that_is_lost_fails_the_run_with_its_cause_and_nothing_is_stored() {
    with_zeroed_stage_in_process(|bed| {
        let injected = bed.stage.inject(Fault::BeamBlocked);
        let run = RunRequest::of(RunKind::Calibrate, Some("x"));
        let id = bed.client.plan(&anna(), &run).unwrap();
        let view = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(view.state, RunState::Failed, "{view:?}");
        assert_eq!(view.cause.expect("it has a cause").code, Code::Beam);
        assert!(bed.stage.deliveries(injected) > 0, "it was delivered");
        assert_eq!(bed.client.axis("x").unwrap().calibration, None);
    });
}

/// A drive that lets its axis be held fast: what it cannot do is seen by its time only.
pub(super) fn lenient(text: String) -> String {
    text.edit(
        "following_error_limit_um = 500.0",
        "following_error_limit_um = 100000.0",
    )
}

/// The fourth end: a step that takes longer than it may.
#[test]
fn a_run_whose_axis_does_not_arrive_in_time_is_stopped_and_timed_out() {
    let new = |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, lenient);
    let body = |bed: &Bed<'_>| {
        bed.stage.inject(Fault::BlockedAxis { axis: 0 });
        let id = bed.run_of(RunKind::Calibrate);
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::TimedOut, "{run:?}");
        assert_eq!(run.cause.expect("it did not end").code, Code::Overdue);
        // Whatever did not answer may still move: as at the command line, everything is stopped.
        assert_eq!(bed.client.machine().state, MachineState::ErrorStop);
        assert_eq!(bed.client.axis("x").unwrap().used_by, None);
    };
    each(new, zeroed(body));
}

#[test]
fn a_run_that_is_aborted_before_it_begins_never_moves() {
    with_zeroed_stage(|bed| {
        let plan = RunRequest {
            start: false,
            ..RunRequest::of(RunKind::Zero, None)
        };
        let id = bed.client.plan(&anna(), &plan).unwrap();
        // What is only planned has no axis.
        let moved = bed.begin(&to("x", 2.0));
        assert_eq!(bed.ended(&moved).state, MotionState::Done);
        let before = bed.client.machine().newest_event;
        bed.client.abort(&bert(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!((run.state, run.steps_done), (RunState::Stopped, 0));
        assert_eq!(run.stopped.as_ref().unwrap().by, "bert");
        assert_eq!((&run.cause, &run.journal), (&None, &None));
        let told = bed.client.events(before);
        let [told] = &told[..] else {
            panic!("an end, and nothing that moved: {told:?}");
        };
        assert_eq!((told.kind.as_str(), told.of.as_str()), ("run", &*id));
        assert_eq!(told.data["state"], "stopped");
        assert_eq!(told.data["stopped"]["by"], "bert");
        // A level: nobody ends it otherwise, or goes on with it.
        bed.client.abort(&anna(), &id).unwrap();
        let after = [
            bed.client.start(&anna(), &id),
            bed.client.pause(&anna(), &id),
            bed.client.resume(&anna(), &id),
        ];
        for refused in after {
            assert_eq!(refused.unwrap_err().code, Code::RunState);
        }
        assert_eq!(bed.client.run(&id, Duration::ZERO).unwrap(), run);
        let axis = bed.client.axis("x").unwrap();
        assert!(axis.homed, "nothing was done");
        assert_eq!((axis.state, axis.used_by), (AxisState::Standstill, None));
    });
}

#[test]
fn only_the_holder_of_the_lease_ends_what_is_planned() {
    with_zeroed_stage(|bed| {
        let plan = RunRequest {
            start: false,
            ..RunRequest::of(RunKind::Zero, None)
        };
        let id = bed.client.plan(&bert(), &plan).unwrap();
        let asked = LeaseRequest {
            name: "anna".into(),
            seconds: 3600,
            force: false,
        };
        let leased = bed.client.lease(&anna(), &asked).unwrap();
        let refused = bed.client.abort(&bert(), &id).unwrap_err();
        assert_eq!(refused.code, Code::Leased, "{refused}");
        let planned = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!(planned.state, RunState::Planned);
        let holder = Caller {
            lease: Some(leased.token),
            ..anna()
        };
        bed.client.abort(&holder, &id).unwrap();
        let run = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!(run.stopped.expect("she did").by, "anna");
        // The lease is hers still.
        let refused = bed.client.begin(&bert(), &to("x", 1.0), None).unwrap_err();
        assert_eq!(refused.code, Code::Leased, "{refused}");
        bed.client.release(&holder).unwrap();
    });
}
