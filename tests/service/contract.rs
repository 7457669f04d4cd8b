//! The contract of a motion, line by line, on every interface.

mod after_stops;
mod aside;
mod by_hand;
mod calibrations;
mod files;
mod groups;
mod jobs;
mod jogs;
mod kinds;
mod machine;
mod memories;
mod motions;
mod paused;
pub(crate) mod questions;
mod repeated;
mod runs;
mod speeds;
mod together;
mod turns;

use core::time::Duration;
use std::path::Path;

use service::{Caller, Code, Coordinate, MotionState, MotionView, MoveRequest, Problem};
use tests::{Edit, LINEAR, Rig, VOLUMETRIC};
use units::{Metres, MetresPerSecond};

use crate::client::{Client, InProcess, PATIENCE};
use crate::http::Http;
use crate::stage::Stage;

/// The same stage everywhere: what differs is asked of seeds elsewhere.
const SEED: u64 = 51;

/// A service and somebody who asks it.
pub(crate) struct Bed<'b> {
    pub(crate) stage: &'b Stage,
    pub(crate) client: &'b dyn Client,
}

/// A linear stage that gives a slow move all the time that it wants.
fn patient(text: String) -> String {
    text.edit("move_timeout_s = 10.0", "move_timeout_s = 10000.0")
}

/// Makes somebody who asks a service.
type Meet = fn(&Stage) -> Box<dyn Client>;

/// Each bus of this run over HTTP, and once by the library.
fn meetings() -> Vec<(Rig, Meet)> {
    let over_http: Meet = |stage| Box::new(Http::of(stage));
    let by_the_library: Meet = |stage| Box::new(InProcess::of(stage));
    let mut meetings: Vec<_> = tests::rigs()
        .into_iter()
        .map(|it| (it, over_http))
        .collect();
    if meetings.iter().any(|it| it.0 == Rig::InProcess) {
        meetings.push((Rig::InProcess, by_the_library));
    }
    meetings
}

fn each(new: impl Fn(Rig, &Path) -> Stage, body: impl Fn(&Bed<'_>)) {
    each_of(meetings(), new, body);
}

/// Where the machine is in this process: three axes that follow a set-point every 2 ms take minutes elsewhere.
fn each_here(new: impl Fn(Rig, &Path) -> Stage, body: impl Fn(&Bed<'_>)) {
    let mut meetings = meetings();
    meetings.retain(|it| it.0 == Rig::InProcess);
    each_of(meetings, new, body);
}

fn each_of(meetings: Vec<(Rig, Meet)>, new: impl Fn(Rig, &Path) -> Stage, body: impl Fn(&Bed<'_>)) {
    for (rig, meet) in meetings {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let stage = new(rig, folder.path());
        let client = meet(&stage);
        println!("{rig:?}, {}", client.interface());
        let client = &*client;
        body(&Bed {
            stage: &stage,
            client,
        });
        stage.end();
    }
}

/// A linear stage that has its zero, on each interface.
fn with_zeroed_stage(body: impl Fn(&Bed<'_>)) {
    with_stage(zeroed(body));
}

/// The same where no bus is: for what is told alike on any.
fn with_zeroed_stage_in_process(body: impl Fn(&Bed<'_>)) {
    each_here(linear, zeroed(body));
}

/// First its zero, then the rest.
fn zeroed(body: impl Fn(&Bed<'_>)) -> impl Fn(&Bed<'_>) {
    move |bed| {
        bed.client.zero(&anna(), None);
        body(bed);
    }
}

fn linear(rig: Rig, folder: &Path) -> Stage {
    Stage::new(rig, (LINEAR, SEED), folder, patient)
}

/// A linear stage as it is after its start, on each interface.
fn with_stage(body: impl Fn(&Bed<'_>)) {
    each(linear, body);
}

/// Three axes that have their zero, on each interface.
fn with_three_axes(body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &Path| Stage::new(rig, (VOLUMETRIC, SEED), folder, |text| text);
    each(new, zeroed(body));
}

fn anna() -> Caller {
    Caller::named("anna")
}

fn bert() -> Caller {
    Caller::named("bert")
}

/// By the encoder alone: most of these stages have no calibration.
fn to(axis: &str, mm: f64) -> MoveRequest {
    MoveRequest {
        uncompensated: true,
        ..compensated(axis, mm)
    }
}

fn compensated(axis: &str, mm: f64) -> MoveRequest {
    MoveRequest::of(axis, Metres::from_mm(mm))
}

/// A motion that takes minutes.
fn slowly(axis: &str, mm: f64) -> MoveRequest {
    MoveRequest {
        speed: Some(MetresPerSecond(0.1e-3).into()),
        ..to(axis, mm)
    }
}

impl Bed<'_> {
    fn begin(&self, request: &MoveRequest) -> String {
        let begun = self.client.begin(&anna(), request, None);
        begun.unwrap_or_else(|problem| panic!("{problem}"))
    }

    #[track_caller]
    fn refused(&self, request: &MoveRequest, code: Code) -> Problem {
        let refused = self.client.begin(&anna(), request, None);
        let problem = refused.expect_err("it must be refused");
        assert_eq!(problem.code, code, "{problem:?}");
        problem
    }

    fn ended(&self, id: &str) -> MotionView {
        let view = self.client.motion(id, PATIENCE).expect("it was begun");
        assert!(view.state.is_end(), "{view:?}");
        view
    }

    fn now(&self, id: &str) -> MotionView {
        self.client
            .motion(id, Duration::ZERO)
            .expect("it was begun")
    }

    /// Waits until the axis is under way.
    fn under_way(&self, id: &str) {
        for _ in 0..1000 {
            self.let_time_pass(0.01);
            let view = self.now(id);
            let encoder = self.client.axis("x").expect("there is x").encoder;
            let moves = encoder.is_some_and(|it| it.value.abs() > 1e-3);
            if view.state == MotionState::Moving && moves {
                return;
            }
            assert!(!view.state.is_end(), "{view:?}");
        }
        panic!("it does not move");
    }

    fn encoder_mm(&self, axis: &str) -> f64 {
        let view = self.client.axis(axis).expect("there is such an axis");
        view.encoder.expect("it was read").value
    }

    /// Lets `seconds` pass by the machine's clock.
    fn let_time_pass(&self, seconds: f64) {
        self.stage.gate.let_pass(Duration::from_secs_f64(seconds));
    }
}

fn length(mm: f64) -> Coordinate {
    Coordinate::Length(Metres::from_mm(mm))
}
