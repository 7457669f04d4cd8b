//! Jobs of one axis: judged, planned, done, with whoever is waited for, and gone on with.

use core::time::Duration;

use service::{AxisState, Code, MotionState, RunKind, RunRequest, RunState};
use tests::Edit;

use super::{Bed, anna, bert, to, with_zeroed_stage, with_zeroed_stage_in_process};
use crate::client::PATIENCE;

const JOB: &str = r#"schema_version = 1
axis = "x"
repetitions = 2
settle_ms = 20
[[point]]
name = "load"
position_mm = 5.0
go_on = { operator = "lay a part on the stage" }
[[point]]
position_mm = 12.5
go_on = { after_s = 0.2 }
"#;

fn job(text: &str) -> RunRequest {
    RunRequest {
        job: Some(text.to_owned()),
        start: false,
        ..RunRequest::of(RunKind::Job, None)
    }
}

impl Bed<'_> {
    fn refuses_job(&self, request: &RunRequest, code: Code, words: &[&str]) {
        let problem = self.client.plan(&anna(), request).unwrap_err();
        assert_eq!(problem.code, code, "{problem:?}");
        for word in words {
            assert!(problem.to_string().contains(word), "{word}: {problem}");
        }
    }
}

#[test]
fn a_job_is_judged_planned_and_done_with_whoever_is_waited_for() {
    with_zeroed_stage(|bed| {
        bed.refuses_job(&job(JOB), Code::Refused, &["no active calibration"]);
        let calibration = bed.calibrates();
        is_judged(bed);
        let id = bed.client.plan(&anna(), &job(JOB)).unwrap();
        let planned = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!((planned.plan.points, planned.of.as_str()), (4, "x"));
        assert_eq!(planned.plan.asks, ["lay a part on the stage"]);
        assert!(planned.plan.seconds_at_least >= 0.4, "{:?}", planned.plan);
        let travel = planned.plan.travel.expect("it is known").value;
        assert!((travel - 22.5).abs() < 0.1, "{travel} mm");
        bed.client.start(&anna(), &id).unwrap();

        let first = bed.asked(&id);
        assert_eq!((first.number, first.what.as_str()), (1, "go_on"));
        assert!(
            first.text.contains("load: lay a part on the stage"),
            "{first:?}"
        );
        assert!(
            first.safety.contains("be out of its way first"),
            "{first:?}"
        );
        // It holds its place under power, and nobody else moves it.
        let stands = bed.encoder_mm("x");
        assert!((stands - 5.0).abs() < 0.05, "{stands}");
        assert_ne!(bed.client.axis("x").unwrap().state, AxisState::Disabled);
        bed.refused(&to("x", 20.0), Code::AxisBusy);
        bed.let_time_pass(0.5);
        assert!((bed.encoder_mm("x") - stands).abs() < 1e-3, "it went on");
        bed.answer(&id, 1, "done").unwrap();
        assert_eq!(bed.asked(&id).number, 2);
        bed.answer(&id, 2, "done").unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Done, "{run:?}");
        assert_eq!(run.result["points"], 4);
        assert_eq!(run.result["calibration"], calibration);
        assert!((bed.stage.true_mm() - 12.5).abs() < 3e-3);
        let view = bed.ended(&bed.begin(&to("x", 1.0)));
        assert_eq!(view.state, MotionState::Done, "the axis is free: {view:?}");
    });
}

fn is_judged(bed: &Bed<'_>) {
    let wrong = job(&JOB.edit("position_mm = 12.5", "position_mm = 99.0"));
    let words = ["job:10:", "position_mm", "99 mm is outside"];
    bed.refuses_job(&wrong, Code::Refused, &words);
    let other = job(&JOB.edit("axis = \"x\"", "axis = \"q\""));
    bed.refuses_job(&other, Code::Refused, &["no linear axis `q`"]);
    let long = job(&JOB.edit("repetitions = 2", "repetitions = 1001"));
    bed.refuses_job(&long, Code::Refused, &["2002 points", "divide"]);
    let beyond = JOB.edit("position_mm = 12.5", "position_mm = 62.0");
    bed.refuses_job(&job(&beyond), Code::Calibration, &["calibrated"]);
    let agreed = RunRequest {
        beyond: true,
        ..job(&beyond)
    };
    bed.client.plan(&anna(), &agreed).unwrap();
    let nothing = RunRequest {
        job: None,
        ..job(JOB)
    };
    bed.refuses_job(&nothing, Code::Refused, &["`job`"]);
    let elsewhere = RunRequest {
        kind: RunKind::Verify,
        ..job(JOB)
    };
    bed.refuses_job(&elsewhere, Code::Refused, &["`job` is for"]);
    let never = RunRequest {
        resume: Some("nothing".to_owned()),
        ..job(JOB)
    };
    bed.refuses_job(&never, Code::NotFound, &["no journal"]);
    let path = RunRequest {
        path: Some("time_s,x_mm\n0,0\n1,1\n".to_owned().into()),
        ..RunRequest::of(RunKind::Path, None)
    };
    bed.refuses_job(&path, Code::NotOffered, &["follows paths"]);
}

#[test]
fn a_job_that_is_paused_goes_on_at_the_point_that_was_not_left_and_as_the_same_job_only() {
    with_zeroed_stage(|bed| {
        bed.calibrates();
        let begun = RunRequest {
            start: true,
            ..job(JOB)
        };
        let id = bed.client.plan(&anna(), &begun).unwrap();
        bed.asked(&id);
        bed.answer(&id, 1, "done").unwrap();
        // In its second repetition.
        assert_eq!(bed.asked(&id).number, 2);
        bed.client.pause(&bert(), &id).unwrap();
        let paused = bed.asks_or_ends(&id);
        assert_eq!(paused.state, RunState::Paused, "{paused:?}");
        let journal = paused.journal.as_ref().expect("points were reached");
        let journal = std::path::Path::new(journal).file_stem().unwrap();
        let anew = |text: &str| RunRequest {
            resume: Some(journal.to_string_lossy().into_owned()),
            ..job(text)
        };
        let other = JOB.edit("after_s = 0.2", "after_s = 0.3");
        let words = ["was `after 0.2 s`", "is now `after 0.3 s`"];
        bed.refuses_job(&anew(&other), Code::Refused, &words);

        bed.client.resume(&anna(), &id).unwrap();
        // The point at which it was paused is gone to again.
        assert_eq!(bed.asked(&id).number, 3);
        bed.client.abort(&bert(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(
            (run.state, run.can_resume),
            (RunState::Stopped, true),
            "{run:?}"
        );
        let id = bed.client.plan(&anna(), &anew(JOB)).unwrap();
        bed.client.start(&anna(), &id).unwrap();
        bed.asked(&id);
        bed.answer(&id, 1, "done").unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Done, "{run:?}");
        assert_eq!(
            (&run.result["points_before"], &run.result["points"]),
            (&2.into(), &2.into())
        );
        // What another run went on with is not gone on with twice.
        let first = bed.client.run(&paused.id, Duration::ZERO).unwrap();
        assert!(!first.can_resume, "{first:?}");
        let twice = bed.client.resume(&anna(), &first.id).unwrap_err();
        assert_eq!(twice.code, Code::RunState, "{twice}");
    });
}

#[test]
fn a_job_that_was_judged_with_another_calibration_is_not_begun() {
    with_zeroed_stage_in_process(|bed| {
        bed.calibrates();
        let id = bed.client.plan(&anna(), &job(JOB)).unwrap();
        bed.calibrates();
        bed.client.start(&anna(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Failed, "{run:?}");
        let cause = run.cause.unwrap().cause;
        assert!(cause.contains("uses another calibration"), "{cause}");
        assert_eq!(run.steps_done, 0);
    });
}
