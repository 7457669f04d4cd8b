//! Line 6: the same request never moves twice, not even after a restart.

use core::time::Duration;

use service::{Code, MotionState, RunKind, RunRequest, RunState};
use tests::LINEAR;

use super::{Bed, SEED, anna, meetings, patient, slowly, to, with_zeroed_stage};
use crate::client::PATIENCE;
use crate::stage::Stage;

fn zero() -> RunRequest {
    RunRequest::of(RunKind::Zero, None)
}

#[test]
fn the_same_request_moves_once_and_another_one_with_its_key_is_refused() {
    with_zeroed_stage(|bed| {
        let first = bed
            .client
            .begin(&anna(), &to("x", 10.0), Some("key"))
            .unwrap();
        assert_eq!(bed.ended(&first).state, MotionState::Done);
        let back = bed.begin(&to("x", 1.0));
        bed.ended(&back);
        let again = bed
            .client
            .begin(&anna(), &to("x", 10.0), Some("key"))
            .unwrap();
        assert_eq!(again, first);
        assert_eq!(bed.ended(&again).state, MotionState::Done);
        assert!((bed.encoder_mm("x") - 1.0).abs() < 0.05, "it moved twice");
        let other = bed.client.begin(&anna(), &to("x", 11.0), Some("key"));
        assert_eq!(other.unwrap_err().code, Code::KeyReused);
        // What was refused has not moved, and may be asked for again.
        let refused = bed.client.begin(&anna(), &to("x", 99.0), Some("far"));
        assert_eq!(refused.unwrap_err().code, Code::SoftLimit);
        let near = bed
            .client
            .begin(&anna(), &to("x", 2.0), Some("far"))
            .unwrap();
        assert_eq!(bed.ended(&near).state, MotionState::Done);
    });
}

#[test]
fn after_a_restart_the_same_request_has_the_end_that_was_written_down_and_does_not_move() {
    for (rig, meet) in meetings() {
        let folder = tempfile::tempdir().unwrap();
        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        client.zero(&anna(), None);
        let first = client.begin(&anna(), &to("x", 10.0), Some("key")).unwrap();
        let before = Bed {
            stage: &stage,
            client: &*client,
        }
        .ended(&first);
        let heard = client.machine().newest_event;
        drop(client);
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        let bed = Bed {
            stage: &stage,
            client: &*client,
        };
        let events = client.events(heard);
        assert!(
            events[0].id > heard + 1,
            "whoever goes on with what he heard hears of a gap: {:?}",
            events[0]
        );
        client.zero(&anna(), None);
        let again = client.begin(&anna(), &to("x", 10.0), Some("key")).unwrap();
        assert_eq!(again, first);
        assert_eq!(bed.ended(&again), before);
        bed.let_time_pass(1.0);
        assert!(bed.encoder_mm("x").abs() < 0.05, "it moved again");
        let other = bed.begin(&to("x", 3.0));
        assert_ne!(other, first, "names are never given twice");
        bed.ended(&other);
    }
}

/// What a killed service leaves: the line that was synced before the order was given, and no end.
#[test]
fn after_a_crash_a_motion_without_an_end_has_failed_and_does_not_move_again() {
    for (rig, meet) in meetings() {
        let (folder, crashed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        client.zero(&anna(), None);
        let first = client
            .begin(&anna(), &slowly("x", 30.0), Some("key"))
            .unwrap();
        Bed {
            stage: &stage,
            client: &*client,
        }
        .under_way(&first);
        let of = |root: &std::path::Path| root.join("linear/service");
        std::fs::create_dir_all(of(crashed.path())).unwrap();
        let ledger = "ledger.jsonl";
        std::fs::copy(
            of(folder.path()).join(ledger),
            of(crashed.path()).join(ledger),
        )
        .unwrap();
        drop(client);
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), crashed.path(), patient);
        let client = meet(&stage);
        let bed = Bed {
            stage: &stage,
            client: &*client,
        };
        client.zero(&anna(), None);
        let again = client
            .begin(&anna(), &slowly("x", 30.0), Some("key"))
            .unwrap();
        assert_eq!(again, first);
        let view = bed.ended(&again);
        assert_eq!(view.state, MotionState::Failed);
        assert_eq!(view.cause.unwrap().code, Code::ServiceRestarted);
        bed.let_time_pass(1.0);
        assert!(bed.encoder_mm("x").abs() < 0.05, "it moved again");
    }
}

#[test]
fn the_same_request_makes_one_run_and_another_one_with_its_key_is_refused() {
    with_zeroed_stage(|bed| {
        let once = |request: &RunRequest, key| bed.client.plan_once(&anna(), request, Some(key));
        let first = once(&zero(), "key").unwrap();
        // Also while it is under way, and not only afterwards.
        assert_eq!(once(&zero(), "key").unwrap(), first);
        let done = bed.client.run(&first, PATIENCE).unwrap();
        assert_eq!(done.state, RunState::Done, "{done:?}");
        let count = bed.client.runs().len();
        assert_eq!(once(&zero(), "key").unwrap(), first);
        assert_eq!(bed.client.runs().len(), count, "it was run twice");
        assert_eq!(bed.client.run(&first, Duration::ZERO).unwrap(), done);
        let other = RunRequest {
            start: false,
            ..zero()
        };
        let reused = once(&other, "key").unwrap_err();
        assert_eq!(reused.code, Code::KeyReused, "{reused}");
        // A motion is another one, too, and so is a run with the key of a motion.
        let moved = bed.client.begin(&anna(), &to("x", 1.0), Some("key"));
        assert_eq!(moved.unwrap_err().code, Code::KeyReused);
        let moved = bed.client.begin(&anna(), &to("x", 1.0), Some("moved"));
        bed.ended(&moved.unwrap());
        let reused = once(&zero(), "moved").unwrap_err();
        assert_eq!(reused.code, Code::KeyReused, "{reused}");
        // What was refused has not moved, and may be asked for again.
        let nowhere = RunRequest::of(RunKind::Zero, Some("q"));
        let refused = once(&nowhere, "free").unwrap_err();
        assert_eq!(refused.code, Code::NoSuchAxis, "{refused}");
        let without = RunRequest::of(RunKind::Job, None);
        let refused = once(&without, "free").unwrap_err();
        assert_eq!(refused.code, Code::Refused, "{refused}");
        let again = once(&zero(), "free").unwrap();
        let done = bed.client.run(&again, PATIENCE).unwrap();
        assert_eq!(done.state, RunState::Done, "{done:?}");
    });
}

#[test]
fn after_a_restart_the_same_request_has_the_run_that_was_written_down_and_does_not_move() {
    for (rig, meet) in meetings() {
        let folder = tempfile::tempdir().unwrap();
        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        let first = client.plan_once(&anna(), &zero(), Some("key")).unwrap();
        let before = client.run(&first, PATIENCE).unwrap();
        assert_eq!(before.state, RunState::Done, "{before:?}");
        drop(client);
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        let bed = Bed {
            stage: &stage,
            client: &*client,
        };
        let again = client.plan_once(&anna(), &zero(), Some("key")).unwrap();
        assert_eq!(again, first);
        assert_eq!(client.run(&again, Duration::ZERO).unwrap(), before);
        bed.let_time_pass(1.0);
        assert!(!client.axis("x").unwrap().homed, "it was run again");
        let other = RunRequest::of(RunKind::Calibrate, None);
        let reused = client.plan_once(&anna(), &other, Some("key")).unwrap_err();
        assert_eq!(reused.code, Code::KeyReused, "{reused}");
    }
}

/// What a killed service leaves: the line that was synced before the order was given, and no end.
#[test]
fn after_a_crash_a_run_without_an_end_has_failed_and_is_not_run_again() {
    for (rig, meet) in meetings() {
        let (folder, crashed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let stage = Stage::new(rig, (LINEAR, SEED), folder.path(), patient);
        let client = meet(&stage);
        let first = client.plan_once(&anna(), &zero(), Some("key")).unwrap();
        let of = |root: &std::path::Path| root.join("linear/service");
        std::fs::create_dir_all(of(crashed.path())).unwrap();
        let ledger = "ledger.jsonl";
        std::fs::copy(
            of(folder.path()).join(ledger),
            of(crashed.path()).join(ledger),
        )
        .unwrap();
        drop(client);
        stage.end();

        let stage = Stage::new(rig, (LINEAR, SEED), crashed.path(), patient);
        let client = meet(&stage);
        let bed = Bed {
            stage: &stage,
            client: &*client,
        };
        let again = client.plan_once(&anna(), &zero(), Some("key")).unwrap();
        assert_eq!(again, first);
        let run = client.run(&again, PATIENCE).unwrap();
        assert_eq!((run.state, run.can_resume), (RunState::Failed, false));
        assert_eq!(run.cause.unwrap().code, Code::ServiceRestarted);
        bed.let_time_pass(1.0);
        assert!(!client.axis("x").unwrap().homed, "it was run again");
    }
}
