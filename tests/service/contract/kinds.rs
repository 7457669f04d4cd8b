//! Runs of machines whose axes work together: an alignment platform, and three axes of a volume.

use core::time::Duration;
use std::path::Path;

use mock_bus::plant::{LineOptics, LineSetUp};
use service::{AxisState, Code, MotionState, RunKind, RunRequest, RunState, StopMode};
use tests::volume::quick;
use tests::{Edit, Rig, UVW, VOLUMETRIC};
use units::Metres;

use super::{Bed, SEED, anna, bert, compensated, each, each_here, to, zeroed};
use crate::client::{InProcess, PATIENCE};
use crate::stage::Stage;

const SCREWS: [&str; 3] = ["u", "v", "w"];

/// Fewer strokes and poses: how good they are is asked elsewhere.
fn short(text: String) -> String {
    text.edit("poses = 20", "poses = 4")
}

fn with_platform(body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &Path| Stage::new(rig, (UVW, SEED), folder, short);
    each(new, body);
}

#[test]
fn a_platform_is_zeroed_calibrated_and_verified_as_one() {
    with_platform(|bed| {
        let refused = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, Some("u")));
        let refused = refused.unwrap_err();
        assert_eq!(refused.code, Code::NotOffered);
        assert!(refused.to_string().contains("platform"), "{refused}");
        let drifted = RunRequest {
            accept_drift: true,
            ..RunRequest::of(RunKind::Calibrate, Some("platform"))
        };
        let refused = bed.client.plan(&anna(), &drifted).unwrap_err();
        assert!(refused.to_string().contains("drifted"), "{refused}");
        let early = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Calibrate, None));
        assert_eq!(early.unwrap_err().code, Code::NotZeroed);

        bed.client.zero(&anna(), None);
        let id = bed.run_of(RunKind::Calibrate);
        let made = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(made.state, RunState::Done, "{made:?}");
        assert_eq!((made.of.as_str(), made.axes.len()), ("platform", 3));
        for screw in SCREWS {
            let axis = bed.client.axis(screw).unwrap();
            assert_eq!((axis.state, axis.homed), (AxisState::Standstill, true));
            assert_eq!(axis.group, "platform");
            assert!(axis.calibration.is_some(), "{axis:?}");
        }
        let id = bed.run_of(RunKind::Verify);
        let judged = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(judged.state, RunState::Done, "{judged:?}");
        assert_eq!(judged.result["within_tolerance"], true, "{judged:?}");
        assert_eq!(judged.out_of_tolerance, None);
    });
}

#[test]
fn a_platform_that_is_stopped_in_a_run_stands_and_goes_on_without_a_reset() {
    with_platform(|bed| {
        bed.client.zero(&anna(), None);
        for mode in [StopMode::Controlled, StopMode::Quick] {
            let id = bed.run_of(RunKind::Calibrate);
            let refused = bed.client.pause(&bert(), &id).unwrap_err();
            assert_eq!(refused.code, Code::RunState, "{refused}");
            bed.let_time_pass(1.0);
            bed.client.stop(&bert(), mode).unwrap();
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
            assert_eq!(run.stopped.unwrap().by, "bert");
            let expected = match mode {
                StopMode::Controlled => AxisState::Standstill,
                StopMode::Quick => AxisState::Disabled,
            };
            for screw in SCREWS {
                assert_eq!(bed.client.axis(screw).unwrap().state, expected);
            }
        }
        bed.client.zero(&anna(), None);
    });
}

/// Three places on a short line.
fn short_line(text: String) -> String {
    text.edit(
        "to_mm = [500.0, 400.0, 150.0]",
        "to_mm = [60.0, 40.0, 150.0]",
    )
    .edit("points = 11", "points = 3")
    .edit("average_samples = 60", "average_samples = 20")
}

fn with_volume(body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &Path| Stage::new(rig, (VOLUMETRIC, SEED), folder, short_line);
    each(new, zeroed(body));
}

fn as_found() -> RunRequest {
    RunRequest {
        uncompensated: true,
        ..RunRequest::of(RunKind::Verify, None)
    }
}

#[test]
fn three_axes_read_a_line_that_somebody_sets_up_and_stand_enabled_afterwards() {
    with_volume(|bed| {
        let plan = RunRequest {
            start: false,
            ..RunRequest::of(RunKind::Calibrate, Some("volume"))
        };
        let planned = bed.client.plan(&anna(), &plan).unwrap();
        let planned = bed.client.run(&planned, Duration::ZERO).unwrap();
        let asks = &planned.plan.asks;
        assert!(asks.len() > 8 && asks[0].contains("line 1 of "), "{asks:?}");

        let id = bed.client.plan(&anna(), &as_found()).unwrap();
        let question = bed.asked(&id);
        assert_eq!(question.what, "set_up_line");
        assert!(question.text.contains("line 1 of 1"), "{question:?}");
        assert_eq!(question.task["end_mm"][0], 60.0);
        for axis in ["x", "y", "z"] {
            assert_eq!(bed.client.axis(axis).unwrap().group, "volume");
        }
        let tool = question.task["tool_mm"].clone();
        let tool = [0, 1, 2].map(|k| Metres::from_mm(tool[k].as_f64().expect("a place")));
        let line = LineSetUp {
            optics: LineOptics::Linear,
            along: [60.0, 40.0, 0.0],
            tool_offset: tool,
        };
        bed.stage
            .simulation(move |machine| machine.set_up_line(&line));
        bed.answer(&id, 1, "done").unwrap();
        let judged = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(judged.state, RunState::Done, "{judged:?}");
        assert!(judged.result["range_um"].as_f64().is_some(), "{judged:?}");
        // Nothing is asked after it, and yet it is told.
        let said = judged.said.join(" ");
        assert!(said.contains("may be packed up"), "{judged:?}");
        // As any axis that stands.
        let moved = bed.begin(&to("x", 12.5));
        assert_eq!(bed.ended(&moved).state, MotionState::Done);
        let id = bed.run_of(RunKind::Reference);
        let never = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(
            never.state,
            RunState::Failed,
            "nothing was measured: {never:?}"
        );
        assert_eq!(bed.client.machine().cause, None);
    });
}

#[test]
fn a_stop_while_three_axes_move_together_is_taken_at_once_and_needs_no_reset() {
    for (mode, expected) in [
        (StopMode::Controlled, AxisState::Standstill),
        (StopMode::Quick, AxisState::Disabled),
    ] {
        with_volume(|bed| {
            let id = bed.client.plan(&anna(), &as_found()).unwrap();
            // On the way to where the line begins, 150 mm above the zero.
            while bed.encoder_mm("z") < 20.0 {
                bed.let_time_pass(0.02);
            }
            bed.client.stop(&bert(), mode).unwrap();
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
            assert_eq!(run.stopped.unwrap().by, "bert");
            let stands = bed.encoder_mm("z");
            assert!(stands < 140.0, "it went on to {stands} mm");
            for axis in ["x", "y", "z"] {
                assert_eq!(bed.client.axis(axis).unwrap().state, expected);
            }
            if mode == StopMode::Controlled {
                let moved = bed.begin(&to("z", 10.0));
                assert_eq!(bed.ended(&moved).state, MotionState::Done);
            }
            bed.client.zero(&anna(), None);
        });
    }
}

/// As three axes say where a line is: the axis that straightness and angular optics see, as a direction.
fn line_of(task: &serde_json::Value) -> LineSetUp {
    let point = |name: &str| [0, 1, 2].map(|k| task[name][k].as_f64().expect("a place"));
    let (start, end, tool) = (point("start_mm"), point("end_mm"), point("tool_mm"));
    let side = ["x", "y", "z"].map(|it| f64::from(u8::from(task["side"] == it)));
    LineSetUp {
        optics: match task["optics"].as_str() {
            Some("straightness") => LineOptics::Straightness { across: side },
            Some("angular") => LineOptics::Angular { about: side },
            _ => LineOptics::Linear,
        },
        along: [0, 1, 2].map(|k| end[k] - start[k]),
        tool_offset: tool.map(Metres::from_mm),
    }
}

#[test]
fn three_axes_become_warm_between_their_lines_where_that_is_asked_for() {
    let new = |rig, folder: &Path| Stage::new(rig, (VOLUMETRIC, SEED), folder, short_line);
    let body = |bed: &Bed<'_>| {
        let request = |kind: RunKind, warm_up_min: Option<f64>| RunRequest {
            warm_up_min,
            start: false,
            ..RunRequest::of(kind, None)
        };
        let planned = |warm_up_min| {
            let request = request(RunKind::Calibrate, warm_up_min);
            let id = bed.client.plan(&anna(), &request).unwrap();
            bed.client.run(&id, Duration::ZERO).unwrap().plan
        };
        let (cold, warm) = (planned(None), planned(Some(2.5)));
        assert!(warm.asks.len() > cold.asks.len(), "{warm:?}");
        // Some of its lines are read once more.
        assert!(warm.seconds_at_least > cold.seconds_at_least + 150.0);
        let refused = |kind, minutes| {
            let problem = bed.client.plan(&anna(), &request(kind, Some(minutes)));
            let problem = problem.unwrap_err();
            assert_eq!(problem.exit_code, 2, "{problem:?}");
            assert!(problem.to_string().contains("warm_up_min"), "{problem}");
        };
        refused(RunKind::Calibrate, 0.0);
        refused(RunKind::Calibrate, 1e5);
        refused(RunKind::Verify, 1.0);
        refused(RunKind::Zero, 1.0);

        // What is read after that is among the lines of the run that begins.
        let begun = RunRequest {
            start: true,
            ..request(RunKind::Calibrate, Some(2.5))
        };
        let id = bed.client.plan(&anna(), &begun).unwrap();
        bed.asked(&id);
        bed.client.abort(&anna(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Stopped, "{run:?}");
        let journal = run.journal.expect("it was begun");
        let journal = std::fs::read_to_string(journal).expect("it can be read");
        assert!(journal.contains("\"warm\":true"), "{journal}");
    };
    each_here(new, zeroed(body));
}

/// The first line of a calibration that becomes warm is read; then the service is gone, and the next one goes on.
#[test]
fn three_axes_that_were_to_become_warm_go_on_with_the_next_service() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let new = || Stage::new(Rig::InProcess, (VOLUMETRIC, SEED), folder.path(), quick);
    let stage = new();
    let client = InProcess::of(&stage);
    let bed = Bed {
        stage: &stage,
        client: &client,
    };
    bed.client.zero(&anna(), None);
    let asked = RunRequest {
        warm_up_min: Some(2.5),
        ..RunRequest::of(RunKind::Calibrate, None)
    };
    let id = bed.client.plan(&anna(), &asked).unwrap();
    let planned = bed.client.run(&id, Duration::ZERO).unwrap().plan;
    let first = bed.asked(&id);
    let line = line_of(&first.task);
    bed.stage
        .simulation(move |machine| machine.set_up_line(&line));
    bed.answer(&id, first.number, "done").unwrap();
    let second = bed.asked(&id);
    stage.end();

    let stage = new();
    let client = InProcess::of(&stage);
    let bed = Bed {
        stage: &stage,
        client: &client,
    };
    let found = bed.client.runs();
    let [left] = &found[..] else {
        panic!("{found:?}");
    };
    assert_eq!((left.state, left.can_resume), (RunState::Paused, true));
    assert_eq!(left.plan, planned, "its warm lines and its time are known");
    let id = left.id.clone();
    bed.client.zero(&anna(), None);
    bed.client.resume(&anna(), &id).unwrap();
    // Not the first line again.
    assert_eq!(bed.asked(&id).task, second.task);
    bed.client.abort(&anna(), &id).unwrap();
    let run = bed.client.run(&id, PATIENCE).unwrap();
    assert_eq!(run.state, RunState::Stopped, "{run:?}");
    stage.end();
}

/// Once, and by the library alone.
#[test]
fn three_axes_are_calibrated_with_whoever_sets_up_their_lines_and_corrected_from_then_on() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let stage = Stage::new(Rig::InProcess, (VOLUMETRIC, SEED), folder.path(), quick);
    let client = InProcess::of(&stage);
    let bed = Bed {
        stage: &stage,
        client: &client,
    };
    bed.client.zero(&anna(), None);
    let id = bed.run_of(RunKind::Calibrate);
    let mut lines = 0;
    let made = loop {
        let run = bed.asks_or_ends(&id);
        let Some(question) = run.question else {
            break run;
        };
        let line = line_of(&question.task);
        bed.stage
            .simulation(move |machine| machine.set_up_line(&line));
        lines += 1;
        bed.answer(&id, question.number, "done").unwrap();
    };
    assert_eq!(made.state, RunState::Done, "{made:?}");
    assert_eq!(made.plan.asks.len(), lines);
    let geometry = made.result["geometry"].as_str().expect("it is stored");
    let axis = bed.client.axis("z").unwrap();
    assert_eq!(axis.calibration.as_deref(), Some(geometry));
    let moved = bed.begin(&compensated("x", 100.0));
    let view = bed.ended(&moved);
    assert_eq!(view.state, MotionState::Done, "{view:?}");
    assert_eq!(view.axes["x"].corrected, "yes");
    stage.end();
}
