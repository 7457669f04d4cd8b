//! Runs that end where they are, and go on: when somebody asks for that, and after a restart.

use core::time::Duration;

use service::{AxisState, Code, MotionState, RunKind, RunRequest, RunState, RunView};
use tests::LINEAR;

use super::runs::short;
use super::{Bed, SEED, anna, bert, each, meetings, to, zeroed};
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
