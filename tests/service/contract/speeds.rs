//! Speeds: no motion that is no path is faster than its axis's file, or its request, says. Judged by the plant.

use std::path::Path;

use mock_bus::plant::{LineOptics, LineSetUp};
use service::{JogRequest, MotionState, MoveRequest, RunKind, RunRequest, RunState, WayName};
use tests::volume::quick;
use tests::{Edit, LINEAR, ROTARY, UVW};
use units::{AxisSpeed, Metres, MetresPerSecond, RadiansPerSecond};

use super::questions::few_placements;
use super::together::{few_strokes, path, pose, with_known_volume_of};
use super::turns::turned;
use super::{Bed, SEED, anna, compensated, each_here, length, to, zeroed};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// So much faster than asked is still as asked.
const TOLERANCE: f64 = 1.1;
/// What is slower than this share has not been asked for.
const LEAST: f64 = 0.9;

const fn mm_per_s(speed: f64) -> AxisSpeed {
    AxisSpeed::Linear(MetresPerSecond(speed * 1e-3))
}

const fn deg_per_s(speed: f64) -> AxisSpeed {
    AxisSpeed::Angular(RadiansPerSecond(speed * DEGREE))
}

fn at_speed(speed: AxisSpeed, request: MoveRequest) -> MoveRequest {
    MoveRequest {
        speed: Some(speed.into()),
        ..request
    }
}

/// Directions of a trace that are judged together, and the unit of their speed.
#[derive(Clone, Copy)]
struct Along {
    parts: &'static [usize],
    unit: f64,
}

const MM: f64 = 1e-3;
const DEGREE: f64 = core::f64::consts::PI / 180.0;
const X: Along = Along {
    parts: &[0],
    unit: MM,
};
const TABLE: Along = Along {
    parts: &[0],
    unit: DEGREE,
};
const TOOL: Along = Along {
    parts: &[0, 1, 2],
    unit: MM,
};
/// Of the pose of a platform.
const SHIFT: Along = Along {
    parts: &[3, 4],
    unit: MM,
};
const TURN: Along = Along {
    parts: &[5],
    unit: DEGREE / 3600.0,
};

impl Bed<'_> {
    /// The greatest speed `along` some directions while `act` acts.
    fn fastest(&self, along: Along, act: impl FnOnce()) -> f64 {
        self.stage.trace_anew();
        act();
        let trace = self.stage.traced();
        assert!(trace.len() > 100, "only {} samples", trace.len());
        trace.fastest_along(along.parts) / along.unit
    }

    /// Whether it is as fast as `limit` there, and no faster.
    #[track_caller]
    fn keeps_speed(&self, what: &str, along: Along, limit: f64, act: impl FnOnce()) {
        let seen = self.fastest(along, act);
        println!("{what}: {seen:.3} of {limit}");
        assert!(
            (limit * LEAST..=limit * TOLERANCE).contains(&seen),
            "{what}: {seen} where {limit} was asked for"
        );
    }

    fn moves(&self, request: &MoveRequest) {
        let view = self.ended(&self.begin(request));
        assert_eq!(view.state, MotionState::Done, "{view:?}");
    }

    fn jogs_for(&self, axis: &str, speed: AxisSpeed, seconds: f64) {
        let request = JogRequest {
            axis: axis.into(),
            speed: speed.into(),
        };
        let begun = self.client.machine().clock_s;
        self.stage.gate.limit(core::time::Duration::from_millis(8));
        let mut id = String::new();
        while self.client.machine().clock_s - begun < seconds {
            id = self
                .client
                .jog(&anna(), &request)
                .unwrap_or_else(|problem| panic!("{problem}"));
        }
        self.stage.gate.lift_limit();
        self.ended(&id);
        // Whoever held the key has let go of it by then.
        self.let_time_pass(0.5);
    }

    fn runs(&self, request: &RunRequest) {
        let id = self.client.plan(&anna(), request);
        let id = id.unwrap_or_else(|problem| panic!("{problem}"));
        if !request.start {
            self.client
                .start(&anna(), &id)
                .unwrap_or_else(|problem| panic!("{problem}"));
        }
        let run = self.client.run(&id, PATIENCE).expect("it was planned");
        assert_eq!(run.state, RunState::Done, "{run:?}");
    }
}

#[test]
fn a_linear_axis_keeps_its_speed_in_every_motion() {
    let slow = |text: String| {
        text.edit("\nspeed_mm_per_s = 200.0", "\nspeed_mm_per_s = 20.0")
            .edit("move_timeout_s = 10.0", "move_timeout_s = 100.0")
    };
    let new = move |rig, folder: &Path| Stage::new(rig, (LINEAR, SEED), folder, slow);
    each_here(new, |bed| {
        // Its zero has speeds of its own in the file: to the limit switch and over the magnet.
        bed.keeps_speed("zero", X, 20.0, || bed.client.zero(&anna(), None));
        bed.keeps_speed("move", X, 20.0, || bed.moves(&to("x", 60.0)));
        let slower = at_speed(mm_per_s(5.0), to("x", 40.0));
        bed.keeps_speed("a slower move", X, 5.0, || bed.moves(&slower));
        let faster = at_speed(mm_per_s(500.0), to("x", 10.0));
        bed.keeps_speed("a faster move", X, 20.0, || bed.moves(&faster));
        bed.keeps_speed("jog", X, 20.0, || bed.jogs_for("x", mm_per_s(100.0), 0.6));
        bed.keeps_speed("a slower jog", X, 4.0, || {
            bed.jogs_for("x", mm_per_s(-4.0), 0.6)
        });
        bed.keeps_speed("calibrate", X, 20.0, || {
            bed.runs(&RunRequest::of(RunKind::Calibrate, None));
        });
        bed.keeps_speed("verify", X, 20.0, || {
            bed.runs(&RunRequest::of(RunKind::Verify, None))
        });
        bed.keeps_speed("a compensated move", X, 20.0, || {
            bed.moves(&compensated("x", 10.0))
        });
    });
}

#[test]
fn a_table_keeps_its_speed_in_every_motion() {
    let new = |rig, folder: &Path| Stage::new(rig, (ROTARY, SEED), folder, few_placements);
    each_here(new, |bed| {
        bed.keeps_speed("zero", TABLE, 60.0, || bed.client.zero(&anna(), None));
        bed.keeps_speed("move", TABLE, 30.0, || bed.moves(&turned(90.0)));
        let slower = at_speed(deg_per_s(5.0), turned(60.0));
        bed.keeps_speed("a slower move", TABLE, 5.0, || bed.moves(&slower));
        let faster = MoveRequest {
            way: Some(WayName::Turns),
            ..at_speed(deg_per_s(170.0), turned(400.0))
        };
        bed.keeps_speed("a faster move", TABLE, 30.0, || bed.moves(&faster));
        bed.keeps_speed("jog", TABLE, 30.0, || {
            bed.jogs_for("c", deg_per_s(-100.0), 1.0)
        });
        bed.keeps_speed("a slower jog", TABLE, 4.0, || {
            bed.jogs_for("c", deg_per_s(4.0), 0.6)
        });
    });
}

#[test]
fn a_platform_keeps_its_speed_in_every_motion() {
    let slow = |text: String| {
        few_strokes(text)
            .edit("speed_mm_per_s = 10.0  ", "speed_mm_per_s = 4.0  ")
            .edit("poses = 20", "poses = 2")
    };
    let new = move |rig, folder: &Path| Stage::new(rig, (UVW, SEED), folder, slow);
    each_here(
        new,
        zeroed(|bed| {
            let screws = |what: &str, limit: f64, act: &dyn Fn()| {
                let mut seen = 0.0_f64;
                bed.stage.trace_anew();
                act();
                let trace = bed.stage.traced();
                for screw in 0..3 {
                    seen = seen.max(trace.fastest(screw) / MM);
                }
                println!("{what}: {seen:.3} of {limit}");
                assert!(seen <= limit * TOLERANCE, "{what}: a screw at {seen} mm/s");
                seen
            };
            let there_and_back = |speed: Option<AxisSpeed>, there: MoveRequest| {
                for request in [there, pose(0.0, 0.0, 0.0)] {
                    bed.moves(&MoveRequest {
                        speed: speed.map(Into::into),
                        ..request
                    });
                }
            };
            screws("zero", 4.0, &|| bed.client.zero(&anna(), None));
            let seen = screws("move", 4.0, &|| there_and_back(None, pose(1.2, 1.2, 0.0)));
            assert!(seen > 4.0 * LEAST, "{seen} mm/s");
            bed.keeps_speed("a slower move", SHIFT, 1.0, || {
                there_and_back(Some(mm_per_s(1.0)), pose(1.2, 1.2, 0.0));
            });
            bed.keeps_speed("a slower turn", TURN, 300.0, || {
                there_and_back(Some(deg_per_s(300.0 / 3600.0)), pose(0.0, 0.0, 1500.0));
            });
            screws("a faster move", 4.0, &|| {
                there_and_back(Some(mm_per_s(100.0)), pose(1.2, -1.2, 0.0));
            });
            let aligned = MoveRequest {
                align: true,
                ..pose(0.8, 0.4, 200.0)
            };
            bed.keeps_speed("an aligned move", SHIFT, 0.5, || {
                there_and_back(Some(mm_per_s(0.5)), aligned);
            });
            bed.keeps_speed("jog", SHIFT, 2.0, || bed.jogs_for("x", mm_per_s(2.0), 0.5));
            bed.runs(&RunRequest::of(RunKind::Calibrate, None));
            screws("verify", 4.0, &|| {
                bed.runs(&RunRequest::of(RunKind::Verify, None))
            });
        }),
    );
}

/// Three axes as slow as a tutorial begins with them.
fn slow_volume(text: String) -> String {
    quick(text)
        .edit("\nspeed_mm_per_s = 200.0", "\nspeed_mm_per_s = 20.0")
        .edit("\nmove_timeout_s = 30.0", "\nmove_timeout_s = 300.0")
        .edit(
            "to_mm = [500.0, 400.0, 150.0]",
            "to_mm = [60.0, 40.0, 150.0]",
        )
        .edit("points = 11", "points = 3")
}

fn point(x: f64, y: f64, z: f64) -> MoveRequest {
    MoveRequest {
        targets: [("x", x), ("y", y), ("z", z)]
            .map(|(axis, mm)| (axis.to_owned(), length(mm)))
            .into(),
        ..compensated("x", 0.0)
    }
}

/// Along x by 120 mm in 3 s, begun and ended slowly.
fn smooth_rows() -> String {
    use core::f64::consts::TAU;
    let rows = (0..=30).map(|at| {
        let u = f64::from(at) / 30.0;
        let x = 60.0 + 120.0 * (u - (TAU * u).sin() / TAU);
        format!("{},{x},40,30\n", 3.0 * u)
    });
    rows.collect()
}

#[test]
fn three_axes_keep_their_speed_in_every_motion() {
    with_known_volume_of(slow_volume, |bed| {
        bed.keeps_speed("zero", X, 20.0, || bed.client.zero(&anna(), None));
        bed.keeps_speed("a move of one", X, 20.0, || bed.moves(&to("x", 60.0)));
        let slower = at_speed(mm_per_s(5.0), to("x", 40.0));
        bed.keeps_speed("a slower move of one", X, 5.0, || bed.moves(&slower));
        bed.keeps_speed("a move", X, 20.0, || bed.moves(&point(100.0, 10.0, 10.0)));
        let slower = at_speed(mm_per_s(8.0), point(60.0, 50.0, 40.0));
        bed.keeps_speed("a slower move", TOOL, 8.0, || bed.moves(&slower));
        let faster = at_speed(mm_per_s(150.0), point(100.0, 10.0, 10.0));
        bed.keeps_speed("a faster move", X, 20.0, || bed.moves(&faster));
        bed.keeps_speed("jog", X, 20.0, || bed.jogs_for("x", mm_per_s(100.0), 0.6));
        // The way to a path is no path; the path is as fast as its rows say.
        let row = "0,60,40,30\n1,61,40,30\n2,62,40,30\n";
        bed.keeps_speed("the way to a path", X, 20.0, || bed.runs(&path(row)));
        let seen = bed.fastest(X, || bed.runs(&path(&smooth_rows())));
        assert!(seen > 50.0, "a path at {seen} mm/s");
        bed.moves(&to("x", 60.0));
        verifies_slowly(bed);
    });
}

fn verifies_slowly(bed: &Bed<'_>) {
    let verify = RunRequest::of(RunKind::Verify, None);
    let id = bed.client.plan(&anna(), &verify).expect("it can be");
    bed.stage.trace_anew();
    let question = bed.asked(&id);
    let place = |name: &str| [0, 1, 2].map(|k| question.task[name][k].as_f64().expect("a place"));
    let (start, end, tool) = (place("start_mm"), place("end_mm"), place("tool_mm"));
    let line = LineSetUp {
        optics: LineOptics::Linear,
        along: [0, 1, 2].map(|k| end[k] - start[k]),
        tool_offset: tool.map(Metres::from_mm),
    };
    bed.stage
        .simulation(move |machine| machine.set_up_line(&line));
    bed.answer(&id, question.number, "done").expect("it waits");
    let run = bed.client.run(&id, PATIENCE).expect("it was planned");
    assert_eq!(run.state, RunState::Done, "{run:?}");
    let trace = bed.stage.traced();
    for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let seen = trace.fastest(at) / MM;
        println!("verify, {axis}: {seen:.3} of 20");
        assert!(seen <= 20.0 * TOLERANCE, "{axis}: {seen} mm/s");
    }
    let seen = trace.fastest(2) / MM;
    assert!(
        seen > 20.0 * LEAST,
        "z goes to where the line begins: {seen} mm/s"
    );
    // What an angle is no speed of.
    let turning = at_speed(
        AxisSpeed::Angular(RadiansPerSecond(1.0)),
        point(60.0, 40.0, 30.0),
    );
    let refused = bed.client.begin(&anna(), &turning, None).unwrap_err();
    assert!(refused.to_string().contains("2mm/s"), "{refused}");
}
