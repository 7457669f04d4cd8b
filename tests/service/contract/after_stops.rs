//! Requests after a stop: no axis goes on to a target of before. Judged by the plant.

use core::time::Duration;

use machine::{Driving, Moving};
use service::{AxisState, MotionState, MoveRequest, RunKind, RunRequest, StopMode};
use tests::volume::{good, quick};
use tests::{Bench, Edit, PlantTrace, VOLUMETRIC};
use truestage::Machine;
use units::{Metres, MetresPerSecond};

use super::together::{path, with_known_volume_of};
use super::{Bed, SEED, anna, bert, to};
use crate::client::PATIENCE;

const AXES: [&str; 3] = ["x", "y", "z"];
/// The target of before, and how fast the axes are on their way there.
const TARGET_MM: f64 = 280.0;
const SPEED: MetresPerSecond = MetresPerSecond(20e-3);
/// An axis that is this far on its way to it is going on.
const GOING_ON_MM: f64 = 1.0;

/// Whatever stops what is under way.
#[derive(Clone, Copy, Debug)]
enum Stop {
    /// `POST /v1/stop`.
    Asked,
    /// A dead-man that nobody renews.
    Lapse,
}

fn patient(text: String) -> String {
    quick(text).edit("\nmove_timeout_s = 30.0", "\nmove_timeout_s = 300.0")
}

impl Bed<'_> {
    /// The axes are sent far away, each by itself, and are stopped on their way.
    fn is_stopped_on_its_way(&self, stop: Stop) {
        let begun = AXES.map(|axis| {
            self.begin(&MoveRequest {
                speed: Some(SPEED.into()),
                dead_man_ms: match stop {
                    Stop::Asked => None,
                    Stop::Lapse => Some(2000),
                },
                ..to(axis, TARGET_MM)
            })
        });
        self.let_time_pass(2.0);
        if let Stop::Asked = stop {
            self.client.stop(&bert(), StopMode::Controlled).unwrap();
        }
        for id in begun {
            assert_eq!(self.ended(&id).state, MotionState::Stopped, "{stop:?}");
        }
        self.stage.trace_anew();
        self.let_time_pass(3.0);
        self.none_goes_on("it was stopped", 0.0);
        for axis in AXES {
            let state = self.client.axis(axis).unwrap().state;
            assert_eq!(state, AxisState::Standstill, "{axis}");
        }
        self.stage.trace_anew();
    }

    /// Since the trace was begun, no axis was ahead by more than `asked_mm` and a little.
    #[track_caller]
    fn none_goes_on(&self, what: &str, asked_mm: f64) {
        judge(&self.stage.traced(), what, asked_mm);
    }
}

#[track_caller]
fn judge(trace: &PlantTrace, what: &str, asked_mm: f64) {
    for (at, axis) in AXES.into_iter().enumerate() {
        let ahead = trace.ahead(at) * 1e3;
        assert!(
            ahead < asked_mm + GOING_ON_MM,
            "after {what}, {axis} went on by {ahead} mm"
        );
    }
}

fn with_stopped_axes(begin: impl Fn(&Bed<'_>), what: &str, asked_mm: f64) {
    with_known_volume_of(patient, |bed| {
        for stop in [Stop::Asked, Stop::Lapse] {
            bed.is_stopped_on_its_way(stop);
            begin(bed);
            bed.none_goes_on(&format!("{what} ({stop:?})"), asked_mm);
            for axis in AXES {
                let back = bed.begin(&to(axis, 10.0));
                assert_eq!(bed.ended(&back).state, MotionState::Done, "{axis}");
            }
        }
    });
}

/// It has ended, or asks a person.
fn run(bed: &Bed<'_>, request: &RunRequest) {
    let id = bed.client.plan(&anna(), request);
    let id = id.unwrap_or_else(|problem| panic!("{problem}"));
    if !request.start {
        bed.client.start(&anna(), &id).unwrap();
    }
    let seen = bed.asks_or_ends(&id);
    if !seen.state.is_end() {
        bed.client.abort(&anna(), &id).unwrap();
    }
    bed.client.run(&id, PATIENCE).unwrap();
}

#[test]
fn a_path_after_a_stop_sets_no_axis_free() {
    let here = "0,60,60,60\n1,61,60,60\n";
    let begin = |bed: &Bed<'_>| {
        let places = AXES.map(|axis| bed.encoder_mm(axis));
        assert!(
            places.iter().all(|mm| (35.0..59.0).contains(mm)),
            "{places:?}"
        );
        run(bed, &path(here));
    };
    with_stopped_axes(begin, "a path", 26.0);
}

#[test]
fn a_zero_after_a_stop_sets_no_axis_free() {
    let begin = |bed: &Bed<'_>| run(bed, &RunRequest::of(RunKind::Zero, None));
    with_stopped_axes(begin, "a zero", 0.0);
}

#[test]
fn references_after_a_stop_set_no_axis_free() {
    let begin = |bed: &Bed<'_>| run(bed, &RunRequest::of(RunKind::Reference, None));
    // They are read along each axis up to its end.
    with_known_volume_of(patient, |bed| {
        bed.is_stopped_on_its_way(Stop::Asked);
        let id = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Reference, None))
            .unwrap();
        // The first axis is on its way; the others stand.
        bed.let_time_pass(2.0);
        let trace = bed.stage.traced();
        let going = AXES.iter().enumerate();
        let going = going.filter(|(at, _)| trace.ahead(*at) * 1e3 > GOING_ON_MM);
        let going: Vec<_> = going.map(|(_, axis)| *axis).collect();
        assert!(going.len() <= 1, "{going:?} went on at one time");
        bed.client.abort(&anna(), &id).unwrap();
        bed.client.run(&id, PATIENCE).unwrap();
        bed.stage.trace_anew();
        begin(bed);
    });
}

#[test]
fn a_verification_after_a_stop_sets_no_axis_free() {
    let verify = RunRequest {
        uncompensated: true,
        ..RunRequest::of(RunKind::Verify, None)
    };
    // It goes to where its line begins, 150 mm above the zero, straight: x and y go back.
    with_known_volume_of(patient, |bed| {
        bed.is_stopped_on_its_way(Stop::Asked);
        run(bed, &verify);
        let trace = bed.stage.traced();
        for (at, asked_mm) in [(0, 0.0), (1, 0.0), (2, 112.0)] {
            let ahead = trace.ahead(at) * 1e3;
            assert!(ahead < asked_mm + GOING_ON_MM, "{}: {ahead} mm", AXES[at]);
        }
    });
}

#[test]
fn enabling_after_a_stop_sets_no_axis_free() {
    let begin = |bed: &Bed<'_>| {
        for axis in AXES {
            bed.client.power(&anna(), axis, true).unwrap();
        }
        bed.let_time_pass(3.0);
        for axis in AXES {
            let state = bed.client.axis(axis).unwrap().state;
            assert_eq!(state, AxisState::Standstill, "{axis}");
        }
    };
    with_stopped_axes(begin, "enabling", 0.0);
}

#[test]
fn switching_off_and_on_after_a_stop_sets_no_axis_free() {
    let begin = |bed: &Bed<'_>| {
        for on in [false, true] {
            for axis in AXES {
                bed.client.power(&anna(), axis, on).unwrap();
            }
            bed.let_time_pass(1.0);
        }
    };
    with_stopped_axes(begin, "switching off and on", 0.0);
}

#[test]
fn a_reset_after_a_stop_sets_no_axis_free() {
    let begin = |bed: &Bed<'_>| {
        bed.client.reset(&anna()).unwrap();
        bed.let_time_pass(3.0);
    };
    with_stopped_axes(begin, "a reset", 0.0);
}

/// The reading of an axis that a drive moves although it calls itself halted is what counts.
#[test]
fn another_program_sets_no_axis_free() {
    let mut bench = Bench::of(&VOLUMETRIC, SEED, patient);
    good(bench.machine.start());
    good(bench.machine.volumetric().unwrap().zero());
    for axis in AXES {
        let mut moving = Moving::of(&mut bench.machine, axis).unwrap();
        moving.begin(Metres::from_mm(TARGET_MM), SPEED).unwrap();
    }
    wait(&mut bench.machine, 2.0);
    for axis in AXES {
        assert!(Driving::of(&mut bench.machine, axis).unwrap().halt());
    }
    wait(&mut bench.machine, 3.0);
    // It ends as a program that is killed: its drives stay in HALT.
    bench.machine = Machine::new(&bench.loaded, Box::new(bench.emulated.transport()));
    good(bench.machine.start());
    let mut trace = PlantTrace::default();
    trace.note(bench.machine.now(), &bench.emulated.simulation());
    for axis in AXES {
        // Drives that have fallen into fault without a master are reset first.
        let _ = bench.machine.reset_fault(axis);
        good(bench.machine.enable(axis));
        for _ in 0..300 {
            wait(&mut bench.machine, 0.01);
            trace.note(bench.machine.now(), &bench.emulated.simulation());
        }
    }
    judge(&trace, "another program's start", 0.0);
}

fn wait(machine: &mut Machine, seconds: f64) {
    let until = machine.now() + Duration::from_secs_f64(seconds);
    while machine.now() < until {
        machine
            .tick(until)
            .unwrap_or_else(|failure| panic!("{failure}"));
    }
}
