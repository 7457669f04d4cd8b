//! Line 6: the same request never moves twice, not even after a restart.

use service::{Code, MotionState};
use tests::LINEAR;

use super::{Bed, SEED, anna, meetings, patient, slowly, to, with_zeroed_stage};
use crate::stage::Stage;

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
