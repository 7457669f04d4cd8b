//! Axes that move as one: a platform, and three axes that are corrected together. The contract is that of every motion.

use core::time::Duration;
use std::path::Path;

use mock_bus::fault::Fault;
use service::{
    AxisState, Code, Coordinate, Event, IfMoving, MachineState, MotionState, MotionView,
    MoveRequest, PathRows, PathTable, RunKind, RunPlanView, RunRequest, RunState, StopMode,
};
use tests::volume::{Volume, good, quick};
use tests::{Edit, UVW, VOLUMETRIC};
use units::{Metres, Radians};

use super::{Bed, SEED, anna, bert, compensated, each, each_here, length, to, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// Few strokes: how good the screws' models become is asked elsewhere.
pub(super) fn few_strokes(text: String) -> String {
    text.edit("step_mm = 0.25", "step_mm = 0.625")
        .edit("runs = 2", "runs = 1")
}

pub(super) fn with_platform(body: impl Fn(&Bed<'_>)) {
    with_platform_of(few_strokes, body);
}

/// One that can be stopped on its way by somebody who asks now and then.
fn with_slow_platform(body: impl Fn(&Bed<'_>)) {
    let slow = |text: String| text.edit("speed_mm_per_s = 10.0  ", "speed_mm_per_s = 1.0  ");
    with_platform_of(slow, body);
}

fn with_platform_of(change: fn(String) -> String, body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &Path| Stage::new(rig, (UVW, SEED), folder, change);
    each(new, zeroed(body));
}

pub(super) fn pose(x_mm: f64, y_mm: f64, arcsec: f64) -> MoveRequest {
    let theta = Coordinate::Angle(Radians::from_arcsec(arcsec));
    MoveRequest {
        targets: [
            ("x".to_owned(), length(x_mm)),
            ("y".to_owned(), length(y_mm)),
            ("theta".to_owned(), theta),
        ]
        .into(),
        ..to("x", 0.0)
    }
}

/// Where the part `name` is, in mm or degrees.
fn at(view: &MotionView, name: &str) -> f64 {
    let leg = &view.axes[name];
    let position = leg.position.as_ref();
    position.unwrap_or_else(|| panic!("{view:?}")).value
}

impl Bed<'_> {
    pub(super) fn done(&self, request: &MoveRequest) -> MotionView {
        let view = self.ended(&self.begin(request));
        assert_eq!(view.state, MotionState::Done, "{view:?}");
        view
    }

    pub(super) fn screws_mm(&self) -> [f64; 3] {
        ["u", "v", "w"].map(|it| self.encoder_mm(it))
    }

    /// Waits until the axis is `beyond_mm`.
    fn goes_beyond(&self, axis: &str, beyond_mm: f64) {
        for _ in 0..5000 {
            if self.encoder_mm(axis).abs() > beyond_mm {
                return;
            }
            self.let_time_pass(0.01);
        }
        panic!("it does not move");
    }
}

/// Line 2: where each part is, and how uncertain that is, is published before the end.
fn shows_its_parts_before_it_ends(events: &[Event]) {
    let first = |is: &dyn Fn(&Event) -> bool| {
        let found = events.iter().find(|it| is(it));
        found.unwrap_or_else(|| panic!("{events:#?}")).id
    };
    let end = first(&|it| it.kind == "motion" && it.data["state"] == "done");
    for part in ["x", "y", "theta"] {
        let position = first(&|it| {
            let is_of_part = it.kind == "position" && it.of == part;
            is_of_part && it.data["standard_uncertainty"].is_object()
        });
        assert!(position < end, "{part}: {events:#?}");
    }
    let moves = first(&|it| it.data["state"] == "SynchronizedMotion" && it.of == "w");
    assert!(moves < end);
}

#[test]
fn a_platform_is_sent_to_poses_and_what_cannot_be_is_refused_before_it_moves() {
    with_platform(|bed| {
        let asked = |targets: &[(&str, Coordinate)]| MoveRequest {
            targets: targets
                .iter()
                .map(|(it, to)| ((*it).to_owned(), *to))
                .collect(),
            ..to("x", 0.0)
        };
        let here = bed.screws_mm();
        let never = bed.refused(&compensated("x", 0.5), Code::Calibration);
        assert!(
            never
                .to_string()
                .contains("screws without a calibration (u, v, w)"),
            "{never}"
        );
        let far = bed.refused(&to("x", 1.6), Code::Refused);
        assert_eq!(far.exit_code, 3, "{far}");
        let screw = bed.refused(&to("u", 1.0), Code::NotOffered);
        assert!(screw.to_string().contains("theta"), "{screw}");
        let mixed = asked(&[("x", length(1.0)), ("u", length(1.0))]);
        bed.refused(&mixed, Code::NotOffered);
        bed.refused(&asked(&[("theta", length(1.0))]), Code::NotOffered);
        let fast = MoveRequest {
            beyond: true,
            ..to("x", 0.5)
        };
        bed.refused(&fast, Code::NotOffered);
        bed.refused(&to("z", 0.5), Code::NoSuchAxis);
        bed.let_time_pass(0.2);
        for (before, after) in here.into_iter().zip(bed.screws_mm()) {
            assert!((after - before).abs() < 1e-3, "a screw moved");
        }

        let before = bed.client.machine().newest_event;
        let view = bed.done(&pose(0.5, -0.3, 100.0));
        assert_eq!(view.axes["x"].corrected, "no");
        shows_its_parts_before_it_ends(&bed.client.events(before));
        // By uncalibrated screws, and yet nearly there.
        assert!((at(&view, "x") - 0.5).abs() < 0.02, "{view:?}");
        assert!(
            (at(&view, "theta") * 3600.0 - 100.0).abs() < 20.0,
            "{view:?}"
        );
        assert_eq!(
            view.axes["theta"]
                .standard_uncertainty
                .clone()
                .unwrap()
                .unit,
            "arcsec"
        );

        // Line 5: what stands there does not move.
        let here = bed.screws_mm();
        bed.done(&pose(0.5, -0.3, 100.0));
        assert_eq!(bed.screws_mm(), here);
        // What nobody names stays where the camera sees it.
        let view = bed.done(&to("y", 0.4));
        assert!((at(&view, "x") - 0.5).abs() < 0.02 && (at(&view, "y") - 0.4).abs() < 0.02);
        is_not_sent_where_the_camera_sees_nothing(bed);
    });
}

/// It has to look where the parts are that nobody names, before anything is sent: nothing is lost.
fn is_not_sent_where_the_camera_sees_nothing(bed: &Bed<'_>) {
    let here = bed.screws_mm();
    let absent = bed.stage.inject(Fault::TargetAbsent);
    let view = bed.ended(&bed.begin(&to("y", 0.3)));
    assert_eq!(view.state, MotionState::Failed, "{view:?}");
    let cause = view.cause.expect("it failed");
    assert!(cause.cause.contains("no target"), "{cause:?}");
    assert_eq!(bed.screws_mm(), here);
    assert_eq!(bed.client.machine().state, MachineState::Running);
    bed.stage.end_fault(absent);
    let view = bed.done(&to("y", 0.3));
    assert!((at(&view, "y") - 0.3).abs() < 0.02, "{view:?}");
}

#[test]
fn a_calibrated_platform_is_corrected_and_aligned_through_the_service() {
    with_platform(|bed| {
        let id = bed.run_of(RunKind::Calibrate);
        let made = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(made.state, RunState::Done, "{made:?}");
        let request = MoveRequest {
            uncompensated: false,
            ..pose(0.7, -1.1, 600.0)
        };
        // Line 6: once, however often it is asked for.
        let id = bed.client.begin(&anna(), &request, Some("part-1")).unwrap();
        let view = bed.ended(&id);
        assert_eq!(
            (view.state, view.axes["y"].corrected.as_str()),
            (MotionState::Done, "yes")
        );
        let again = bed.client.begin(&anna(), &request, Some("part-1")).unwrap();
        assert_eq!((again, bed.now(&id)), (id, view.clone()));
        assert!((at(&view, "x") - 0.7).abs() < 0.002, "{view:?}");
        let aligned = bed.done(&MoveRequest {
            align: true,
            ..request
        });
        assert!((at(&aligned, "x") - 0.7).abs() < 0.001, "{aligned:?}");
    });
}

/// Lines 3, 7 and 8.
#[test]
fn a_platform_that_is_stopped_under_way_stands_and_says_who_did_it() {
    with_slow_platform(|bed| {
        let id = bed.begin(&pose(1.4, 1.4, 0.0));
        bed.goes_beyond("w", 0.2);
        let busy = bed.refused(&pose(0.0, 0.0, 0.0), Code::AxisBusy);
        assert!(busy.to_string().contains(&id), "{busy}");
        let queued = bed.begin(&MoveRequest {
            if_moving: IfMoving::Queue,
            ..pose(0.0, 0.0, 0.0)
        });
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        for id in [&id, &queued] {
            let view = bed.ended(id);
            assert_eq!(view.state, MotionState::Stopped, "{view:?}");
            assert_eq!(view.stopped.unwrap().by, "bert");
        }
        assert!(bed.encoder_mm("w") < 1.3, "it went on");
        let axis = bed.client.axis("w").unwrap();
        assert_eq!((axis.state, axis.homed), (AxisState::Standstill, true));

        let watched = bed.begin(&MoveRequest {
            dead_man_ms: Some(60),
            ..pose(-1.4, -1.4, 0.0)
        });
        let view = bed.ended(&watched);
        assert_eq!(
            view.stopped.expect("nobody renews it").by,
            "the dead-man of anna"
        );

        let slow = bed.begin(&pose(1.4, 1.4, 0.0));
        bed.let_time_pass(0.05);
        let next = MoveRequest {
            if_moving: IfMoving::Supersede,
            ..pose(0.0, 0.0, 0.0)
        };
        let view = bed.done(&next);
        assert!(at(&view, "x").abs() < 0.02, "{view:?}");
        let view = bed.ended(&slow);
        assert!(view.stopped.expect("superseded").by.contains("superseded"));

        // Line 4.
        let id = bed.begin(&pose(1.4, 1.4, 0.0));
        bed.goes_beyond("w", 0.1);
        let node = "drive_w".to_owned();
        bed.stage.inject(Fault::StopHeartbeat { node });
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::Failed, "{view:?}");
        assert_eq!(view.cause.unwrap().code, Code::Silent);
        assert_eq!(bed.client.machine().state, MachineState::ErrorStop);
        bed.refused(&pose(0.0, 0.0, 0.0), Code::ErrorStop);
    });
}

/// Line 1, the fourth end: what its procedure waits for longer than it may.
#[test]
fn a_pose_that_takes_too_long_has_timed_out_and_what_is_queued_has_failed() {
    // What an axis that is held fast cannot do is seen by its time only.
    let lenient = |text: String| {
        text.edit(
            "following_error_limit_um = 200.0",
            "following_error_limit_um = 50000.0",
        )
    };
    let new = |rig, folder: &Path| Stage::new(rig, (UVW, SEED), folder, lenient);
    let body = |bed: &Bed<'_>| {
        bed.stage.inject(Fault::BlockedAxis { axis: 2 });
        let id = bed.begin(&pose(1.4, 1.4, 0.0));
        let queued = bed.begin(&MoveRequest {
            if_moving: IfMoving::Queue,
            ..pose(0.0, 0.0, 0.0)
        });
        let view = bed.ended(&id);
        assert_eq!(view.state, MotionState::TimedOut, "{view:?}");
        assert_eq!(view.cause.expect("it was late").code, Code::Overdue);
        let view = bed.ended(&queued);
        assert_eq!(view.state, MotionState::Failed, "{view:?}");
        assert_eq!(bed.client.machine().state, MachineState::ErrorStop);
    };
    each(new, zeroed(body));
}

/// Three axes whose errors are known, and what their detectors read.
pub(super) fn with_known_volume(body: impl Fn(&Bed<'_>)) {
    with_known_volume_of(quick, body);
}

/// The same after `change` of its configuration.
pub(super) fn with_known_volume_of(change: fn(String) -> String, body: impl Fn(&Bed<'_>)) {
    let mut before = Volume::zeroed(SEED, quick, |text| text);
    before.know_errors();
    let store = before.bench.store.clone();
    good(before.work().reference(&store));
    let new = |rig, folder: &Path| {
        before.bequeath(&folder.join("volumetric"));
        Stage::new(rig, (VOLUMETRIC, SEED), folder, change)
    };
    each_here(new, zeroed(body));
}

/// By how much the tool is off where the axes are to be, in µm.
pub(super) fn off_um(bed: &Bed<'_>, mm: [f64; 3]) -> [f64; 3] {
    bed.stage.simulation(move |simulation| {
        let truth = simulation.truth();
        let truth = truth.volumetric().expect("three axes");
        let (is, should) = (
            truth.tool_point(),
            truth.nominal_for(mm.map(Metres::from_mm)),
        );
        core::array::from_fn(|k| (is[k] - should[k]).um())
    })
}

#[test]
fn three_axes_that_are_corrected_together_move_as_one_and_follow_paths() {
    with_known_volume(|bed| {
        moves_as_one(bed);
        forgets_where_an_axis_rests_that_is_switched_off(bed);
        follows_paths(bed);
    });
}

fn moves_as_one(bed: &Bed<'_>) {
    let point = MoveRequest {
        targets: [("x", 60.0), ("y", 40.0), ("z", 30.0)]
            .map(|(it, mm)| (it.to_owned(), length(mm)))
            .into(),
        ..compensated("x", 0.0)
    };
    let view = bed.done(&point);
    let leg = &view.axes["x"];
    assert_eq!(leg.corrected, "yes");
    let (position, encoder) = (at(&view, "x"), leg.encoder.as_ref().unwrap().value);
    assert!((position - 60.0).abs() < 0.3e-3, "{view:?}");
    let u_um = leg
        .standard_uncertainty
        .as_ref()
        .expect("it is known")
        .value;
    assert!((position - encoder).abs() > 1e-3 && u_um < 1.0, "{view:?}");
    let off = off_um(bed, [60.0, 40.0, 30.0]);
    assert!(off.iter().all(|it| it.abs() < 1.0), "{off:?}");
    let axis = bed.client.axis("x").unwrap();
    assert!(
        axis.corrected && axis.standard_uncertainty.is_some(),
        "{axis:?}"
    );

    // Line 5: the tool stays where it is, also while the correction is taken up again.
    let id = bed.begin(&point);
    let mut farthest = 0.0_f64;
    for _ in 0..1000 {
        if bed.now(&id).state.is_end() {
            break;
        }
        farthest = farthest.max((bed.encoder_mm("x") - encoder).abs());
        bed.let_time_pass(0.05);
    }
    assert_eq!(bed.now(&id).state, MotionState::Done);
    assert!(farthest < 0.5e-3, "it went away by {farthest} mm");
    // What nobody names stays.
    let view = bed.done(&compensated("z", 20.0));
    assert!(
        (view.axes["x"].target.value - 60.0).abs() < 1e-9,
        "{view:?}"
    );

    let outside = bed.refused(&compensated("x", 502.0), Code::Refused);
    assert!(
        outside.to_string().contains("outside the calibrated"),
        "{outside}"
    );
    bed.refused(&compensated("x", 510.0), Code::SoftLimit);
    bed.refused(
        &MoveRequest {
            align: true,
            ..point.clone()
        },
        Code::Configuration,
    );

    let id = bed.begin(&compensated("z", 120.0));
    bed.goes_beyond("z", 40.0);
    bed.client.stop(&bert(), StopMode::Controlled).unwrap();
    let view = bed.ended(&id);
    assert_eq!(view.state, MotionState::Stopped, "{view:?}");
    assert_eq!(view.stopped.unwrap().by, "bert");
    assert!(bed.encoder_mm("z") < 110.0);
    assert_eq!(bed.client.axis("z").unwrap().state, AxisState::Standstill);
    // Alone by its encoder, and then again together with the others.
    bed.done(&to("z", 25.0));
    assert!(!bed.client.axis("z").unwrap().corrected);
    bed.done(&point);
    let off = off_um(bed, [60.0, 40.0, 30.0]);
    assert!(off.iter().all(|it| it.abs() < 1.0), "{off:?}");
}

/// Where nothing holds an axis, nobody knows by a move where it is.
fn forgets_where_an_axis_rests_that_is_switched_off(bed: &Bed<'_>) {
    assert!(bed.client.axis("x").unwrap().corrected);
    for on in [false, true] {
        bed.client.power(&anna(), "x", on).unwrap();
        bed.let_time_pass(0.05);
        assert!(!bed.client.axis("x").unwrap().corrected, "on: {on}");
    }
}

pub(super) fn path(rows: &str) -> RunRequest {
    RunRequest {
        path: Some(format!("time_s,x_mm,y_mm,z_mm\n{rows}").into()),
        start: false,
        ..RunRequest::of(RunKind::Path, None)
    }
}

/// The same rows with straight lines, as the text says: the corner is passed within what that allows.
fn has_straight_lines_too(bed: &Bed<'_>, corner: &RunRequest, planned: &RunPlanView) {
    assert_eq!(planned.join.as_deref(), Some("spline"));
    assert_eq!(planned.seconds_at_least, 2.0);
    let Some(PathRows::Csv(rows)) = &corner.path else {
        panic!("{:?}", corner.path);
    };
    let straight = RunRequest {
        path: Some(format!("# join: linear 100um\n{rows}").into()),
        ..corner.clone()
    };
    let id = bed.client.plan(&anna(), &straight).unwrap();
    let plan = bed.client.run(&id, Duration::ZERO).unwrap().plan;
    assert_eq!(plan.join.as_deref(), Some("linear 100um"));
    let size = plan.departure.expect("it turns a corner").size.value;
    assert!(size > 0.0 && size <= 0.1, "{size} mm");
    assert!(plan.seconds_at_least > 2.0, "it begins and ends at rest");
}

/// Rows as a table: one that cannot be followed, and what is planned of one that turns a corner.
fn plans_tables(bed: &Bed<'_>) -> RunPlanView {
    let table = |rows: &[[f64; 4]]| RunRequest {
        path: Some(PathRows::Table(PathTable {
            join: None,
            columns: ["time_s", "x_mm", "y_mm", "z_mm"].map(str::to_owned).into(),
            rows: rows.iter().map(|it| it.to_vec()).collect(),
        })),
        ..path("")
    };
    let beyond = table(&[[0.0, 499.0, 40.0, 30.0], [1.0, 501.0, 40.0, 30.0]]);
    let refused = bed.client.plan(&anna(), &beyond).unwrap_err();
    assert_eq!(refused.code, Code::Refused, "{refused}");
    let corner = [
        [0.0, 60.0, 40.0, 30.0],
        [1.0, 64.0, 40.0, 30.0],
        [2.0, 64.0, 44.0, 30.0],
    ];
    let id = bed.client.plan(&anna(), &table(&corner)).unwrap();
    let planned = bed.client.run(&id, Duration::ZERO).unwrap();
    bed.client.abort(&anna(), &id).unwrap();
    planned.plan
}

/// Paths that cannot be followed, each with its reason.
fn refuses_paths(bed: &Bed<'_>) {
    let refused = |request: &RunRequest, code: Code, words: &[&str]| {
        let problem = bed.client.plan(&anna(), request).unwrap_err();
        assert_eq!(problem.code, code, "{problem:?}");
        for word in words {
            assert!(problem.to_string().contains(word), "{word}: {problem}");
        }
    };
    let slip = path("0,60,40,30\n1,6O,40,30\n");
    refused(&slip, Code::Refused, &["line 3, column x_mm", "`6O`"]);
    let joined = |request: &RunRequest, join: &str| RunRequest {
        join: Some(join.to_owned()),
        ..request.clone()
    };
    let slip_too = joined(&slip, "linear 50um");
    refused(&slip_too, Code::Refused, &["line 3, column x_mm", "`6O`"]);
    refused(
        &joined(&slip, "circles"),
        Code::Refused,
        &["`join`", "circles"],
    );
    let no_path = joined(&RunRequest::of(RunKind::Verify, None), "spline");
    refused(&no_path, Code::Refused, &["`join` is for"]);
    let beyond = path("0,499,40,30\n1,501,40,30\n");
    refused(&beyond, Code::Refused, &["outside the calibrated"]);
    let hasty = path("0,60,40,30\n0.1,90,40,30\n");
    refused(&hasty, Code::Refused, &["axis x"]);
    refused(
        &path("0,60,40,30\n601,61,40,30\n"),
        Code::Refused,
        &["601 s"],
    );
    let none = RunRequest {
        path: None,
        ..slip.clone()
    };
    refused(&none, Code::Refused, &["`path`"]);
    let other = RunRequest {
        kind: RunKind::Verify,
        ..slip
    };
    refused(&other, Code::Refused, &["`path`"]);
}

fn follows_paths(bed: &Bed<'_>) {
    let before = bed.encoder_mm("x");
    refuses_paths(bed);
    let of_table = plans_tables(bed);

    // A corner, which a spline does not turn straight.
    let corner = path("0,60,40,30\n1,64,40,30\n2,64,44,30\n");
    let id = bed.client.plan(&anna(), &corner).unwrap();
    let planned = bed.client.run(&id, Duration::ZERO).unwrap();
    assert_eq!(
        (planned.state, planned.plan.points),
        (RunState::Planned, 1001)
    );
    assert_eq!(planned.plan, of_table, "the same rows are the same path");
    has_straight_lines_too(bed, &corner, &planned.plan);
    let travel = planned.plan.travel.expect("it is known").value;
    assert!((8.0..9.0).contains(&travel), "{travel} mm");
    let departure = planned.plan.departure.expect("it turns a corner");
    assert!(
        departure.size.value > 0.1 && departure.lines.contains(&3),
        "{departure:?}"
    );
    assert!(
        (bed.encoder_mm("x") - before).abs() < 1e-3,
        "nothing moves before it is started"
    );
    bed.client.start(&anna(), &id).unwrap();
    let run = bed.client.run(&id, PATIENCE).unwrap();
    assert_eq!(run.state, RunState::Done, "{run:?}");
    assert_eq!(
        (&run.result["points"], &run.result["corrected"]),
        (&1001.into(), &true.into())
    );
    let off = off_um(bed, [64.0, 44.0, 30.0]);
    assert!(off.iter().all(|it| it.abs() < 1.0), "{off:?}");
    stops_on_its_way(bed);
}

fn stops_on_its_way(bed: &Bed<'_>) {
    let id = bed
        .client
        .plan(&anna(), &path("0,64,44,30\n60,124,44,30\n"))
        .unwrap();
    bed.client.start(&anna(), &id).unwrap();
    bed.goes_beyond("x", 64.5);
    bed.client.abort(&bert(), &id).unwrap();
    let run = bed.client.run(&id, PATIENCE).unwrap();
    assert_eq!(run.state, RunState::Stopped, "{run:?}");
    assert_eq!(run.stopped.unwrap().by, "bert");
    assert!(bed.encoder_mm("x") < 100.0, "it went on");
    assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Standstill);
    assert_eq!(bed.client.machine().state, MachineState::Running);
}
