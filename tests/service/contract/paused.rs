//! Runs that end before their result, and go on: when somebody asks for that, whatever ended them, and after a restart.

use core::time::Duration;

use mock_bus::fault::Fault;
use service::{
    AxisState, Code, MachineState, MotionState, RunKind, RunRequest, RunState, RunView, StopMode,
};
use tests::LINEAR;

use super::runs::{fewer, lenient, short};
use super::{Bed, SEED, anna, bert, each, each_here, meetings, to, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// The points of one run of two: seven places, from both sides.
const A_RUN: u64 = 14;

impl Bed<'_> {
    fn run_now(&self, id: &str) -> RunView {
        self.client.run(id, Duration::ZERO).expect("it was planned")
    }

    /// A calibration that has measured so many points.
    fn calibrating(&self, points: u64) -> String {
        let asked = RunRequest::of(RunKind::Calibrate, None);
        let id = self.client.plan(&anna(), &asked);
        let id = id.unwrap_or_else(|problem| panic!("{problem}"));
        while self.run_now(&id).steps_done < points {
            self.let_time_pass(0.05);
        }
        id
    }

    /// The run `id`, which has ended so and goes on, and how many points its journal has.
    fn has_left(&self, id: &str, state: RunState) -> (RunView, usize) {
        let run = self.client.run(id, PATIENCE).expect("it was planned");
        assert_eq!((run.state, run.can_resume), (state, true), "{run:?}");
        let journal = run.journal.as_ref().expect("it says where its points are");
        let kept = points_in(journal);
        assert!((A_RUN as usize..28).contains(&kept), "{kept} points");
        (run, kept)
    }

    /// It goes on with what it has, and not twice.
    fn goes_on(&self, left: &RunView, kept: usize) {
        self.client.resume(&anna(), &left.id).unwrap();
        let run = self.run_now(&left.id);
        assert_eq!((&run.stopped, &run.cause), (&None, &None), "{run:?}");
        assert_eq!(run.begun, left.begun + 1);
        let twice = self.client.resume(&anna(), &left.id).unwrap_err();
        assert_eq!(twice.code, Code::RunState, "{twice}");
        let done = self.client.run(&left.id, PATIENCE).unwrap();
        assert_eq!((done.state, done.can_resume), (RunState::Done, false));
        let journal = left.journal.as_deref().expect("it was told");
        assert_eq!(done.result["journal"], journal);
        assert_eq!(done.journal.as_deref(), Some(journal));
        assert_eq!(points_in(journal), kept + A_RUN as usize);
        let over = self.client.resume(&anna(), &left.id).unwrap_err();
        assert_eq!(over.code, Code::RunState, "{over}");
    }

    /// The machine may be used again.
    fn reset_and_zero(&self) {
        if self.client.machine().state == MachineState::ErrorStop {
            self.client.reset(&anna()).unwrap();
        }
        if !self.client.axis("x").unwrap().homed {
            self.client.zero(&anna(), None);
        }
    }

    /// Waits until it is paused.
    pub(super) fn paused(&self, id: &str) -> RunView {
        for _ in 0..1000 {
            let run = self.run_now(id);
            if run.state == RunState::Paused {
                return run;
            }
            assert_eq!(run.state, RunState::Stopping, "{run:?}");
            self.let_time_pass(0.01);
        }
        panic!("it is not paused: {:?}", self.run_now(id))
    }
}

fn with_short_runs(body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &std::path::Path| Stage::new(rig, (LINEAR, SEED), folder, short);
    each(new, zeroed(body));
}

#[test]
fn a_run_that_is_paused_before_it_measured_goes_on_with_nothing_of_an_earlier_one() {
    with_short_runs(|bed| {
        let earlier = bed.calibrating(A_RUN + 2);
        bed.client.pause(&bert(), &earlier).unwrap();
        let left = bed.paused(&earlier).journal.expect("it measured something");
        let id = bed.calibrating(0);
        bed.client.pause(&bert(), &id).unwrap();
        let paused = bed.paused(&id);
        assert_ne!(paused.journal, Some(left.clone()), "{paused:?}");
        bed.client.resume(&anna(), &id).unwrap();
        let done = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(done.state, RunState::Done, "{done:?}");
        let made_of = done.result["journal"].as_str().unwrap();
        assert_ne!(made_of, left);
        assert_eq!(points_in(made_of), 2 * A_RUN as usize);
    });
}

/// How many points a journal holds.
fn points_in(journal: &str) -> usize {
    let text = std::fs::read_to_string(journal).expect("it is there");
    text.matches("\"point\"").count()
}

#[test]
fn a_run_that_is_paused_leaves_its_axis_free_and_goes_on_with_what_it_measured() {
    with_short_runs(|bed| {
        let id = bed.calibrating(A_RUN + 2);
        bed.client.pause(&bert(), &id).unwrap();
        let paused = bed.paused(&id);
        let journal = paused.journal.expect("it says where its points are");
        let kept = points_in(&journal);
        assert!((A_RUN as usize..28).contains(&kept), "{kept} points");
        // A level: it stays paused, and its axis is free.
        bed.client.pause(&bert(), &id).unwrap();
        let axis = bed.client.axis("x").unwrap();
        assert_eq!((axis.state, axis.used_by), (AxisState::Standstill, None));
        let moved = bed.begin(&to("x", 12.5));
        assert_eq!(bed.ended(&moved).state, MotionState::Done);
        bed.client.resume(&anna(), &id).unwrap();
        let done = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(done.state, RunState::Done, "{done:?}");
        // The run that was interrupted is measured again, those before it are not.
        assert_eq!(points_in(&journal), kept + A_RUN as usize);
        let made_of = done.result["journal"].as_str().unwrap();
        assert_eq!(made_of, journal);
        let over = bed.client.resume(&anna(), &id).unwrap_err();
        assert_eq!(over.code, Code::RunState, "{over}");
        let over = bed.client.pause(&anna(), &id).unwrap_err();
        assert_eq!(over.code, Code::RunState, "{over}");
    });
}

#[test]
fn a_run_that_somebody_stopped_goes_on_with_what_it_measured() {
    for mode in [StopMode::Controlled, StopMode::Quick] {
        let new = |rig, folder: &std::path::Path| Stage::new(rig, (LINEAR, SEED), folder, short);
        let body = |bed: &Bed<'_>| {
            let id = bed.calibrating(A_RUN + 2);
            bed.client.stop(&bert(), mode).unwrap();
            let (left, kept) = bed.has_left(&id, RunState::Stopped);
            assert_eq!(left.stopped.as_ref().unwrap().by, "bert");
            bed.reset_and_zero();
            bed.goes_on(&left, kept);
        };
        each_here(new, zeroed(body));
    }
}

#[test]
fn a_run_that_failed_keeps_its_cause_until_it_goes_on() {
    let new = |rig, folder: &std::path::Path| Stage::new(rig, (LINEAR, SEED), folder, short);
    let body = |bed: &Bed<'_>| {
        let id = bed.calibrating(A_RUN + 2);
        let fault = bed.stage.inject(Fault::BeamBlocked);
        let (left, kept) = bed.has_left(&id, RunState::Failed);
        bed.stage.end_fault(fault);
        bed.reset_and_zero();
        let still = bed.run_now(&id);
        assert_eq!(still.cause.as_ref().unwrap().code, Code::Beam);
        assert_eq!(still, left);
        bed.goes_on(&left, kept);
    };
    each_here(new, zeroed(body));
}

#[test]
fn a_run_that_timed_out_goes_on_once_its_axis_may_move_again() {
    let hurried = |text| fewer(lenient(text));
    let new = |rig, folder: &std::path::Path| Stage::new(rig, (LINEAR, SEED), folder, hurried);
    let body = |bed: &Bed<'_>| {
        let id = bed.calibrating(A_RUN + 2);
        let fault = bed.stage.inject(Fault::BlockedAxis { axis: 0 });
        let (left, kept) = bed.has_left(&id, RunState::TimedOut);
        bed.stage.end_fault(fault);
        let refused = bed.client.resume(&anna(), &id).unwrap_err();
        assert_eq!(refused.code, Code::ErrorStop, "{refused}");
        bed.reset_and_zero();
        assert_eq!(bed.run_now(&id), left, "it was refused, and not begun");
        bed.goes_on(&left, kept);
    };
    each_here(new, zeroed(body));
}

#[test]
fn what_has_left_nothing_does_not_go_on_and_says_so() {
    with_short_runs(|bed| {
        let id = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, None));
        let id = id.unwrap();
        bed.let_time_pass(0.2);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        let zero = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!((zero.state, zero.can_resume), (RunState::Stopped, false));
        bed.client.zero(&anna(), None);
        let planned = RunRequest {
            start: false,
            ..RunRequest::of(RunKind::Calibrate, None)
        };
        let planned = bed.client.plan(&anna(), &planned).unwrap();
        assert!(bed.run_now(&planned).can_resume, "it can be paused");
        bed.client.abort(&bert(), &planned).unwrap();
        assert!(!bed.run_now(&planned).can_resume, "it was never begun");
        for id in [id, planned] {
            let refused = bed.client.resume(&anna(), &id).unwrap_err();
            assert_eq!(refused.code, Code::RunState, "{refused}");
        }
    });
}

#[test]
fn a_zero_is_not_paused_and_a_paused_run_can_be_given_up() {
    with_short_runs(|bed| {
        let id = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, None));
        let id = id.unwrap();
        bed.let_time_pass(0.2);
        let refused = bed.client.pause(&anna(), &id).unwrap_err();
        assert_eq!(refused.code, Code::RunState, "{refused}");
        let zeroed = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(zeroed.state, RunState::Done, "it goes on: {zeroed:?}");
        let id = bed.calibrating(3);
        bed.client.pause(&anna(), &id).unwrap();
        bed.paused(&id);
        bed.client.abort(&bert(), &id).unwrap();
        let given_up = bed.run_now(&id);
        assert_eq!(given_up.state, RunState::Stopped, "{given_up:?}");
        assert_eq!(given_up.stopped.unwrap().by, "bert");
        assert_eq!(bed.client.axis("x").unwrap().calibration, None);
    });
}

#[test]
fn a_run_that_an_earlier_service_left_is_found_and_goes_on() {
    for (rig, meet) in meetings() {
        let folder = tempfile::tempdir().unwrap();
        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), short);
        let client = meet(&stage);
        client.zero(&anna(), None);
        let bed = Bed {
            stage: &stage,
            client: &*client,
        };
        bed.calibrating(A_RUN + 5);
        drop(client);
        // Its machine is a new one afterwards, and what it measured is of the same.
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), short);
        let client = meet(&stage);
        let found = client.runs();
        let [left] = &found[..] else {
            panic!("{found:?}");
        };
        assert_eq!(
            (left.kind, left.state),
            (RunKind::Calibrate, RunState::Paused)
        );
        let journal = left.journal.clone().expect("it says where its points are");
        let kept = points_in(&journal);
        assert!((A_RUN as usize..28).contains(&kept), "{kept} points");
        // As any run: not before the axis has its zero.
        let refused = client.resume(&anna(), &left.id).unwrap_err();
        assert_eq!(refused.code, Code::NotZeroed, "{refused}");
        client.zero(&anna(), None);
        client.resume(&anna(), &left.id).unwrap();
        let done = client.run(&left.id, PATIENCE).unwrap();
        assert_eq!(done.state, RunState::Done, "{done:?}");
        // The run that was interrupted is measured again, those before it are not.
        assert_eq!(points_in(&journal), kept + A_RUN as usize);
        drop(client);
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), short);
        let client = meet(&stage);
        assert_eq!(client.runs(), [], "what is complete is not offered");
        drop(client);
        stage.end();
    }
}
