//! Three axes corrected throughout their volume while they work, judged by the plant's truth.

use std::sync::{Arc, Mutex};

use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::model::{AxisErrors, Squareness};
use compensator::volumetric::online::{BeamReference, Sample};
use tests::{Bench, VOLUMETRIC};
use truestage::assemble;
use truestage::config::BeamDetectorConfig;
use truestage::cycle::volumetric::{VolumetricCorrection, VolumetricState};
use truestage::engine::{
    Cause, Channel, Corrected, Correction, Engine, Live, Observed, State, ThermometerSample,
};
use units::{Celsius, Metres, Radians, Time};

const AXES: [&str; 3] = ["x", "y", "z"];
const TRAVEL_MM: [f64; 3] = [500.0, 400.0, 300.0];
const NODE_MM: f64 = 25.0;

/// What the channels said, and where the axes were.
#[derive(Clone)]
struct Seen {
    at: Time,
    actual: [Metres; 3],
    channels: Vec<Option<Channel>>,
    temperatures: Vec<Option<ThermometerSample>>,
}

/// Corrects nothing and writes down each new sample.
struct Recorder(Arc<Mutex<Vec<Seen>>>);

impl Correction for Recorder {
    fn correct(&mut self, observed: &Observed<'_>) -> Corrected {
        let mut seen = self.0.lock().expect("nobody panics with it");
        let newest = observed.channels.iter().flatten().map(|it| it.at).max();
        if let Some(at) = newest.filter(|at| seen.last().is_none_or(|it| it.at < *at)) {
            seen.push(Seen {
                at,
                actual: core::array::from_fn(|k| observed.actual[k]),
                channels: observed.channels.to_vec(),
                temperatures: observed.temperatures.to_vec(),
            });
        }
        Corrected::default()
    }
}

/// The shipped machine, zeroed.
fn zeroed(seed: u64, emulated: impl Fn(String) -> String) -> Bench {
    let mut bench = Bench::shaped(&VOLUMETRIC, seed, |text| text, emulated);
    bench.machine.start().unwrap_or_else(|it| panic!("{it}"));
    let zeroed = bench.machine.zero_volumetric();
    zeroed.unwrap_or_else(|it| panic!("{it}"));
    bench
}

fn mm(point: [f64; 3]) -> [Metres; 3] {
    point.map(Metres::from_mm)
}

/// Visits `points`, stands at each for `periods`, and says by how much the tool was off there.
fn visit(
    bench: &mut Bench,
    engine: &mut Engine,
    desk: &mut truestage::engine::Desk,
    points: &[[f64; 3]],
    periods: u32,
) -> Vec<[Metres; 3]> {
    let emulated = bench.emulated.clone();
    let (mut next, mut standing, mut errors) = (0, 0, Vec::new());
    let set_point = |live: Live| -> [Metres; 3] {
        core::array::from_fn(|axis| live.nominal[axis] + live.offset[axis])
    };
    let mut last = desk.live().map(set_point);
    let outcome = bench.machine.follow_with(engine, &mut || {
        let Some(live) = desk.live() else {
            return;
        };
        let now = set_point(live);
        if let Some(last) = last {
            let step = |axis: usize| (now[axis] - last[axis]).abs();
            assert!((0..3).all(|axis| step(axis) < Metres::from_mm(0.5)));
        }
        last = Some(now);
        if live.state == State::Holding {
            standing += 1;
        } else {
            standing = 0;
        }
        if standing < periods {
            return;
        }
        if next > 0 {
            let simulation = emulated.simulation();
            let truth = simulation.truth().volumetric().expect("three axes");
            let (is, should) = (truth.tool_point(), truth.nominal_for(mm(points[next - 1])));
            errors.push(core::array::from_fn(|k| is[k] - should[k]));
        }
        if next == points.len() {
            desk.stop().expect("it runs");
        } else {
            desk.move_to(&mm(points[next])).expect("within the limits");
            next += 1;
        }
        standing = 0;
    });
    assert_eq!(outcome.unwrap_or_else(|it| panic!("{it}")), Cause::Asked);
    errors
}

fn nodes(axis: usize) -> Vec<Metres> {
    let count = (TRAVEL_MM[axis] / NODE_MM) as u32;
    let each = (0..=count).map(|at| Metres::from_mm(f64::from(at) * NODE_MM));
    each.collect()
}

/// The errors as the plant has them now: what a perfect calibration would find.
fn true_errors(bench: &Bench) -> ([AxisErrors; 3], Squareness) {
    let simulation = bench.emulated.simulation();
    let truth = simulation.truth().volumetric().expect("three axes");
    let axes = [0, 1, 2].map(|axis| {
        let nodes = nodes(axis);
        let motions: Vec<_> = nodes
            .iter()
            .map(|it| truth.error_motion(axis, *it))
            .collect();
        let along = core::array::from_fn(|k| {
            let values: Vec<Metres> = motions.iter().map(|it| it.shift[k]).collect();
            Some(Function::new(&nodes, &values, Shape::Spline).expect("they are good"))
        });
        let about = core::array::from_fn(|k| {
            let values: Vec<Radians> = motions.iter().map(|it| it.turn[k]).collect();
            Some(Function::new(&nodes, &values, Shape::Spline).expect("they are good"))
        });
        AxisErrors { along, about }
    });
    let [y_to_x, z_to_x, z_to_y] = truth.squareness();
    let squareness = Squareness {
        y_to_x,
        z_to_x,
        z_to_y,
        u: [Radians(0.0); 3],
    };
    (axes, squareness)
}

/// The means of what a detector saw near each node of its axis.
fn reference(
    config: &BeamDetectorConfig,
    first: usize,
    axis: usize,
    seen: &[Seen],
) -> [Function<Metres>; 2] {
    let nodes = nodes(axis);
    let mut sums = vec![([0.0; 2], 0.0); nodes.len()];
    for it in seen {
        let position_mm = it.actual[axis].mm();
        let node = (position_mm / NODE_MM).round();
        if (position_mm - node * NODE_MM).abs() > 5.0 || node < 0.0 {
            continue;
        }
        let mut detector = assemble::beam_detector(config).expect("it was checked");
        let volts = |k: usize| it.channels[first + k].map(|it| it.volts);
        let channels = core::array::from_fn(|k| volts(k).expect("all have sent"));
        let sample = Sample {
            channels,
            at: it.at,
        };
        let place = detector
            .read(it.at, Some(&sample))
            .expect("the beam is seen");
        let (sum, count) = &mut sums[node as usize];
        sum[0] += place[0].value();
        sum[1] += place[1].value();
        *count += 1.0;
    }
    [0, 1].map(|k| {
        let values: Vec<_> = sums.iter().map(|(sum, n)| Metres(sum[k] / n)).collect();
        Function::new(&nodes, &values, Shape::Spline).expect("every node was passed")
    })
}

/// What the machine is now: errors by the truth, references as the detectors are read.
fn calibrated(bench: &mut Bench) -> VolumetricState {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let recorder = Box::new(Recorder(Arc::clone(&seen)));
    let (mut engine, mut desk) =
        Engine::new(&bench.machine, &AXES, recorder).unwrap_or_else(|it| panic!("{it}"));
    let corners = [
        [0.0, 0.0, 0.0],
        [500.0, 0.0, 0.0],
        [500.0, 400.0, 0.0],
        [500.0, 400.0, 300.0],
    ];
    visit(bench, &mut engine, &mut desk, &corners, 100);
    let seen = seen.lock().expect("nobody panics with it").clone();
    let volumetric = bench.loaded.config.volumetric.clone().expect("it has one");
    let beams = [0, 1, 2].map(|axis| {
        let beam = volumetric.beam.each()[axis].expect("it has one");
        let slider = reference(&beam.slider, 8 * axis, axis, &seen);
        let end = beam.end.as_ref().expect("it has one");
        // The end detector does not mind where the slide is: the mean of what it saw.
        let ends = reference(end, 8 * axis + 4, axis, &seen);
        let mean = |f: &Function<Metres>| {
            let nodes = nodes(axis);
            let sum: f64 = nodes.iter().map(|it| f.at(*it).value()).sum();
            Metres(sum / nodes.len() as f64)
        };
        let drift = assemble::beam_drift(beam).expect("it was checked");
        Some(BeamReference::new(slider, [mean(&ends[0]), mean(&ends[1])], drift).expect("sound"))
    });
    let last = seen.last().expect("something was seen");
    let temperatures = last.temperatures.iter().flatten();
    let temperatures: Vec<Celsius> = temperatures.filter_map(|it| it.celsius).collect();
    let (axes, squareness) = true_errors(bench);
    VolumetricState {
        axes,
        squareness,
        beams,
        roll: Some(roll_reference(bench, &seen)),
        temperatures,
        ..VolumetricState::default()
    }
}

/// What the roll detectors read along x, in millimetres of 10 V.
fn roll_reference(bench: &Bench, seen: &[Seen]) -> Function<Radians> {
    let volumetric = bench.loaded.config.volumetric.as_ref().expect("it has one");
    let roll = volumetric.roll.as_ref().expect("it has one");
    let optics = assemble::roll_optics(roll).expect("it was checked");
    let nodes = nodes(0);
    let mut sums = vec![(0.0, 0.0); nodes.len()];
    for it in seen {
        let position_mm = it.actual[0].mm();
        let node = (position_mm / NODE_MM).round();
        if (position_mm - node * NODE_MM).abs() > 5.0 || node < 0.0 {
            continue;
        }
        let reading = |k: usize| {
            let volts = it.channels[24 + k].expect("all have sent").volts;
            Metres::from_mm(volts.value() * roll.mm_per_v[k])
        };
        let angle = optics.solve(reading(0), reading(1)).expect("a roll").angle;
        let (sum, count) = &mut sums[node as usize];
        *sum += angle.value();
        *count += 1.0;
    }
    let values: Vec<_> = sums.iter().map(|(sum, n)| Radians(sum / n)).collect();
    Function::new(&nodes, &values, Shape::Spline).expect("every node was passed")
}

/// All over the volume, the same for everybody.
fn spread(count: u32) -> Vec<[f64; 3]> {
    let part = |at: u32, ratio: f64| (f64::from(at) * ratio).fract();
    let each = (1..=count).map(|at| {
        [
            500.0 * part(at, 0.819_172_513),
            400.0 * part(at, 0.671_043_607),
            300.0 * part(at, 0.549_700_478),
        ]
    });
    each.collect()
}

fn percentile_95(errors: &[[Metres; 3]]) -> Metres {
    let mut sizes: Vec<f64> = errors
        .iter()
        .map(|[x, y, z]| x.value().hypot(y.value()).hypot(z.value()))
        .collect();
    sizes.sort_by(f64::total_cmp);
    Metres(sizes[(sizes.len() * 95).div_ceil(100) - 1])
}

#[test]
fn three_axes_start_with_all_their_modules_and_find_their_zero() {
    let mut bench = zeroed(1, |text| text);
    for (axis, at_mm) in [("x", 30.0), ("y", 20.0), ("z", 10.0)] {
        let target = Metres::from_mm(at_mm);
        let moved = bench.machine.move_to(axis, target);
        moved.unwrap_or_else(|it| panic!("{it}"));
    }
    let simulation = bench.emulated.simulation();
    let scales = simulation
        .truth()
        .volumetric()
        .expect("three axes")
        .scales();
    for (scale, at_mm) in scales.into_iter().zip([30.0, 20.0, 10.0]) {
        let off = scale - Metres::from_mm(at_mm);
        assert!(off.abs() < Metres::from_um(0.3), "{} um", off.um());
    }
}

#[test]
fn a_machine_calibrated_just_now_puts_its_tool_where_the_path_says() {
    let mut bench = zeroed(1, |text| text);
    let state = calibrated(&mut bench);
    let correction = VolumetricCorrection::new(&bench.loaded.config, state);
    let correction = correction.unwrap_or_else(|it| panic!("{it}"));
    let (mut engine, mut desk) = Engine::new(&bench.machine, &AXES, Box::new(correction))
        .unwrap_or_else(|it| panic!("{it}"));
    let points = spread(20);
    let found = percentile_95(&visit(&mut bench, &mut engine, &mut desk, &points, 100));
    desk.correct(true).expect("it listens");
    // Long enough for detectors to be believed, blended to and smoothed.
    visit(&mut bench, &mut engine, &mut desk, &points[..1], 5000);
    let left = percentile_95(&visit(&mut bench, &mut engine, &mut desk, &points, 100));
    assert!(found > Metres::from_um(15.0), "{} um", found.um());
    assert!(left < Metres::from_um(1.0), "{} um", left.um());
}
