//! The detectors that watch three axes while they are corrected: a beam that is blocked, too
//! bright, knocked aside or seen no more, a channel that is stuck (classes 28, 32, 50). The
//! correction is held, fades out or stops the machine, as configured; the set-points never jump.

use core::time::Duration;
use std::sync::{Arc, Mutex};

use compensator::volumetric::Axis;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::online::{BeamDetector, BeamReference, Sample};
use machine::engine::{Cause, Correction, Engine, Live};
use machine::engine::{Channel, Corrected, Observed, Source, ThermometerSample, Validity};
use machine::{Observer, Stage};
use mock_bus::fault::{Fault, FaultConfig};
use mock_bus::simulation::Simulation;
use tests::volume::{Volume, good};
use tests::{Bench, Edit, VOLUMETRIC};
use truestage::Failure;
use truestage::for_tests::{beam_detector, beam_drift, roll_optics};
use truestage::volumetric::{VolumetricCorrection, VolumetricState};
use units::{Celsius, Metres, Quantity, Radians};

const AXES: [&str; 3] = ["x", "y", "z"];
/// Where the machine stands.
const PLACE: [Metres; 3] = [Metres::from_mm(30.0); 3];
/// What x's slide is seen to have risen by since its references were taken.
const RISEN: Metres = Metres::from_um(20.0);
/// From one period to the next no set-point changes by more.
const JUMP: Metres = Metres::from_um(0.2);
/// Periods of 2 ms in a second.
const SECOND: usize = 500;
/// From the beginning to the fault, and to the end.
const FAULT_AT: usize = 5 * SECOND;
const END_AT: usize = 12 * SECOND;

/// The newest channels and temperatures that the engine has seen.
type Seen = (Vec<Option<Channel>>, Vec<Option<ThermometerSample>>);

/// Corrects nothing and keeps what it saw last.
struct Watcher(Arc<Mutex<Seen>>);

impl Correction for Watcher {
    fn correct(&mut self, observed: &Observed<'_>) -> Corrected {
        let mut seen = self.0.lock().expect("nobody panics with it");
        *seen = (observed.channels.to_vec(), observed.temperatures.to_vec());
        Corrected::default()
    }
}

/// The shipped machine with this reaction and a quick feed, standing at its place.
fn standing(reaction: &'static str) -> (Bench, Seen) {
    let (name, fade) = match reaction {
        "fade_out" => ("reaction = \"fade_out\"", "fade_out_s = 1.0"),
        "hold" => ("reaction = \"hold\"", ""),
        _ => ("reaction = \"stop\"", ""),
    };
    let quick = |text: String| {
        let text = text.edit("reaction = \"fade_out\"", name);
        let text = text.edit("fade_out_s = 60.0", fade);
        text.edit("blend_s = 2.0", "blend_s = 0.5")
    };
    let mut bench = Bench::shaped(&VOLUMETRIC, 7, quick, |text| text);
    bench.machine.start().unwrap_or_else(|it| panic!("{it}"));
    let zeroed = bench.machine.volumetric().unwrap().zero();
    zeroed.unwrap_or_else(|it| panic!("{it}"));
    let seen = Arc::new(Mutex::new((Vec::new(), Vec::new())));
    let watcher = Box::new(Watcher(Arc::clone(&seen)));
    let (cause, _) = follow(&mut bench, watcher, 4 * SECOND, |_, _| {});
    assert_eq!(cause, Cause::Asked);
    let seen = seen.lock().expect("nobody panics with it").clone();
    (bench, seen)
}

/// Goes to the place with the correction on; `each` is called in every period with its number.
fn follow(
    bench: &mut Bench,
    correction: Box<dyn Correction>,
    periods: usize,
    mut each: impl FnMut(&mut Simulation, usize),
) -> (Cause, Vec<Live>) {
    let rested = bench.machine.now() + Duration::from_millis(100);
    let rested = bench.machine.run_until(rested);
    rested.unwrap_or_else(|it| panic!("{it}"));
    let (mut engine, mut desk) =
        Engine::new(&bench.machine, &AXES, correction).unwrap_or_else(|it| panic!("{it}"));
    desk.correct(true).expect("it listens");
    desk.move_to(&PLACE).expect("within the limits");
    let mut lives: Vec<Live> = Vec::new();
    let emulated = bench.emulated.clone();
    let outcome = bench.machine.follow_with(&mut engine, &mut || {
        let Some(live) = desk.live() else {
            return;
        };
        lives.push(live);
        each(&mut emulated.simulation_mut(), lives.len());
        if lives.len() == periods {
            desk.stop().expect("it runs");
        }
    });
    (outcome.unwrap_or_else(|it| panic!("{it}")), lives)
}

fn constant<Q: Quantity>(value: Q) -> Function<Q> {
    let nodes = [0.0, 500.0].map(Metres::from_mm);
    Function::new(&nodes, &[value; 2], Shape::Linear).expect("two nodes")
}

/// What a detector whose channels begin at `first` sees.
fn place(mut detector: BeamDetector, first: usize, seen: &Seen) -> [Metres; 2] {
    let channel = |k: usize| seen.0[first + k].expect("all have sent");
    let sample = Sample {
        channels: core::array::from_fn(|k| channel(k).volts),
        at: channel(0).at,
    };
    let place = detector.read(sample.at, Some(&sample));
    place.unwrap_or_else(|it| panic!("{it}"))
}

/// A machine without errors whose x slide has risen since it was calibrated.
fn risen(bench: &Bench, seen: &Seen) -> VolumetricState {
    let config = bench.loaded.config.volumetric.as_ref().expect("it has one");
    let detector = |config| beam_detector(config).expect("it was checked");
    let beams = Axis::ALL.map(|axis| {
        let at = axis.index();
        let beam = config.beam.each()[at].expect("it has one");
        let slide = beam.slider.as_ref().expect("it has one");
        let [first, second] = place(detector(slide), 8 * at, seen);
        let up = if axis == Axis::X { RISEN } else { Metres::ZERO };
        let end = detector(beam.end.as_ref().expect("it has one"));
        let end = place(end, 8 * at + 4, seen);
        let drift = beam_drift(beam).expect("it was checked");
        let slider = [constant(first), constant(second - up)];
        Some(BeamReference::new(slider, end, drift).expect("sound"))
    });
    let roll = config.rolls()[0].expect("it has one");
    let optics = roll_optics(roll).expect("it was checked");
    let reading = |k: usize| {
        let volts = seen.0[24 + k].expect("all have sent").volts;
        Metres::from_mm(volts.value() * roll.mm_per_v[k])
    };
    let angle = optics.solve(reading(0), reading(1)).expect("a roll").angle;
    let temperatures = seen.1.iter().flatten().filter_map(|it| it.celsius);
    VolumetricState {
        beams,
        rolls: [Some(constant::<Radians>(angle)), None, None],
        temperatures: temperatures.collect::<Vec<Celsius>>(),
        ..VolumetricState::default()
    }
}

/// What the set-points did while the fault was there for a while.
struct Day {
    cause: Cause,
    lives: Vec<Live>,
    /// In periods.
    lasting: usize,
}

impl Day {
    /// What was added to z before the fault, so long after it came, and at the end.
    fn offset_um(&self, at: usize) -> f64 {
        self.lives[at - 1].offset[2].um()
    }

    fn u_um(&self, at: usize) -> f64 {
        self.lives[at - 1].uncertainty[2].um()
    }
}

/// The machine with `reaction` while `fault` is there for `lasting` periods; no set-point jumps.
#[track_caller]
fn play(reaction: &'static str, fault: Fault, lasting: usize) -> Day {
    let (mut bench, seen) = standing(reaction);
    let state = risen(&bench, &seen);
    let correction = VolumetricCorrection::new(&bench.loaded.config, state);
    let correction = Box::new(correction.unwrap_or_else(|it| panic!("{it}")));
    let text = format!("{reaction}, {fault:?}");
    let fault = FaultConfig::lasting(fault, Duration::from_millis(2) * lasting as u32);
    let mut id = None;
    let (cause, lives) = follow(&mut bench, correction, END_AT, |simulation, period| {
        if period == FAULT_AT {
            id = Some(simulation.inject(fault.clone()).expect("its port is there"));
        }
    });
    let id = id.expect("it came");
    let delivered = bench.emulated.simulation().fault_deliveries(id);
    assert!(delivered > 0, "{text}: it never struck");
    for (period, pair) in lives.windows(2).enumerate() {
        for axis in 0..3 {
            let step = (pair[1].offset[axis] - pair[0].offset[axis]).abs();
            assert!(
                step <= JUMP,
                "{text}: {step} in period {period}, axis {axis}"
            );
        }
    }
    let day = Day {
        cause,
        lives,
        lasting,
    };
    let before = day.offset_um(FAULT_AT);
    assert!((before + 20.0).abs() < 1.0, "{text}: {before} um at first");
    assert!(day.u_um(FAULT_AT) < 3.0, "{text}");
    day
}

fn x_blocked() -> Fault {
    Fault::ReferenceBeamBlocked {
        axis: 0,
        behind_slide: false,
    }
}

fn x_bright() -> Fault {
    Fault::ReferenceBeamBright { axis: 0 }
}

/// One of the two frames of a sample gets lost: the module lives, its samples are no more.
fn x_stale() -> Fault {
    Fault::Drop {
        port: "can0".into(),
        cob_id: Some(0x480 + 11),
    }
}

fn x_knocked() -> Fault {
    Fault::ReferenceBeamKnocked {
        axis: 0,
        by_um: 100.0,
    }
}

#[track_caller]
fn check_back(day: &Day) {
    assert_eq!(day.cause, Cause::Asked);
    let end = day.offset_um(END_AT);
    assert!((end + 20.0).abs() < 1.0, "{end} um in the end");
    assert!(day.u_um(END_AT) < 3.0);
}

#[test]
fn a_detector_in_trouble_is_held_where_that_is_wanted() {
    for (fault, lasting) in [
        (x_blocked(), 2 * SECOND),
        (x_bright(), 2 * SECOND),
        (x_stale(), 2 * SECOND),
        (x_knocked(), SECOND / 2),
    ] {
        let day = play("hold", fault, lasting);
        for at in [FAULT_AT + 10, FAULT_AT + day.lasting] {
            let held = day.offset_um(at);
            assert!((held + 20.0).abs() < 1.0, "{held} um after a while");
        }
        let u = day.u_um(FAULT_AT + day.lasting - 1);
        assert!(u > 10.0, "{u} um while nobody sees anything");
        check_back(&day);
    }
}

#[test]
fn a_detector_in_trouble_fades_out_where_that_is_wanted_and_comes_back() {
    for fault in [x_blocked(), x_bright(), x_stale()] {
        let day = play("fade_out", fault, 2 * SECOND);
        let tolerated = day.offset_um(FAULT_AT + 90);
        assert!((tolerated + 20.0).abs() < 1.0, "{tolerated} um at first");
        let half_way = day.offset_um(FAULT_AT + 110 + SECOND / 2);
        assert!((half_way + 10.0).abs() < 4.0, "{half_way} um half way");
        let faded = day.offset_um(FAULT_AT + day.lasting);
        assert!(faded.abs() < 1.0, "{faded} um in the end");
        check_back(&day);
    }
}

/// A knock shorter than the time in which a beam at its place may wander so far.
#[test]
fn a_knocked_beam_is_not_believed() {
    let day = play("fade_out", x_knocked(), SECOND / 20);
    let tolerated = day.offset_um(FAULT_AT + day.lasting);
    assert!((tolerated + 20.0).abs() < 1.0, "{tolerated} um");
    check_back(&day);
}

#[test]
fn a_detector_in_trouble_stops_the_machine_where_that_is_wanted() {
    for fault in [x_blocked(), x_bright(), x_stale()] {
        let day = play("stop", fault, 2 * SECOND);
        let Cause::CorrectionLost { lack } = day.cause else {
            panic!("{}", day.cause)
        };
        // A beam knocked off or a module that is stale takes both detectors of the beam.
        let of_x = [Source::Slide(Axis::X), Source::EndOfTravel(Axis::X)];
        assert!(of_x.contains(&lack.source), "{lack}");
        // 200 ms of patience, 100 ms until a sample is old, and some periods.
        let stopped = day.lives.len();
        let soon = FAULT_AT + 100..=FAULT_AT + 170;
        assert!(soon.contains(&stopped), "{}", stopped - FAULT_AT);
        let last = day.lives.last().expect("there were some");
        assert!((last.offset[2].um() + 20.0).abs() < 1.0);
    }
}

/// A channel shows what it showed last, which is true at first: its noise is missing.
#[test]
fn a_channel_that_is_stuck_is_noticed_and_named() {
    let stuck = || Fault::InputStuck { channel: 1 };
    let day = play("stop", stuck(), 5 * SECOND);
    let Cause::CorrectionLost { lack } = day.cause else {
        panic!("{}", day.cause)
    };
    assert_eq!(lack.source, Source::Slide(Axis::X), "{lack}");
    assert!(lack.to_string().contains("its input 2 is stuck"), "{lack}");
    // 100 samples, each tenth SYNC, of which the first comes within ten; 200 ms of patience and some periods.
    let stopped = day.lives.len();
    let soon = FAULT_AT + 1080..=FAULT_AT + 1170;
    assert!(soon.contains(&stopped), "{}", stopped - FAULT_AT);
    let day = play("hold", stuck(), 4 * SECOND);
    let u = day.u_um(FAULT_AT + day.lasting - 1);
    assert!(u > 10.0, "{u} um while nobody sees anything");
    check_back(&day);
}

/// The shutter of x is closed before the correction is switched on: what does the machine say?
fn switched_on_blind(reaction: &'static str) -> (Result<Live, Failure>, Vec<String>) {
    let (mut bench, seen) = standing(reaction);
    let state = risen(&bench, &seen);
    let fault = FaultConfig::permanent(x_blocked());
    let id = bench.emulated.simulation_mut().inject(fault);
    let id = id.expect("its port is there");
    let correction = VolumetricCorrection::new(&bench.loaded.config, state);
    let correction = Box::new(correction.unwrap_or_else(|it| panic!("{it}")));
    let told = Arc::new(Mutex::new(Vec::new()));
    bench.machine.observe(Box::new(Told(Arc::clone(&told))));
    let mover = bench.machine.volumetric().unwrap().mover(correction);
    let mut mover = mover.unwrap_or_else(|it| panic!("{it}"));
    let outcome = bench
        .machine
        .volumetric()
        .unwrap()
        .correct(&mut mover, true);
    assert!(bench.emulated.simulation().fault_deliveries(id) > 0);
    let told = told.lock().expect("nobody panics with it").clone();
    (outcome, told)
}

/// Keeps the warnings.
struct Told(Arc<Mutex<Vec<String>>>);

impl Observer for Told {
    fn progress(&mut self, _: Stage, _: &str, _: u64, _: u64) {}

    fn warning(&mut self, text: &str) {
        let mut told = self.0.lock().expect("nobody panics with it");
        told.push(text.to_owned());
    }
}

#[test]
fn a_detector_that_is_blind_from_the_beginning_is_never_passed_over_in_silence() {
    for reaction in ["stop", "hold"] {
        let (outcome, _) = switched_on_blind(reaction);
        let text = outcome.map(drop).unwrap_err().to_string();
        for word in ["axis x: the detector on its slide", "beam is blocked"] {
            assert!(
                text.contains(word),
                "{reaction}: `{word}` is not in: {text}"
            );
        }
    }
    let (outcome, told) = switched_on_blind("fade_out");
    let live = outcome.unwrap_or_else(|it| panic!("{it}"));
    let Validity::Without(lack) = live.validity else {
        panic!("{:?}", live.validity)
    };
    assert_eq!(lack.source, Source::Slide(Axis::X));
    assert!(live.uncertainty[2] > Metres::from_um(10.0));
    let named = |it: &String| it.contains("axis x") && it.contains("faded out");
    assert!(told.iter().any(named), "{told:?}");
}

/// The same machine with another correction from one period to the next: what the detectors said
/// stays in it.
#[test]
fn a_correction_that_is_exchanged_on_the_way_leaves_nothing_out_meanwhile() {
    let (mut bench, seen) = standing("hold");
    let state = risen(&bench, &seen);
    let make = || {
        let correction = VolumetricCorrection::new(&bench.loaded.config, state.clone());
        Box::new(correction.unwrap_or_else(|it| panic!("{it}")))
    };
    let (first, second) = (make(), make());
    let (mut engine, mut desk) =
        Engine::new(&bench.machine, &AXES, first).unwrap_or_else(|it| panic!("{it}"));
    desk.correct(true).expect("it listens");
    let (mut second, mut offsets) = (Some(second), Vec::new());
    let outcome = bench.machine.follow_with(&mut engine, &mut || {
        let Some(live) = desk.live() else {
            return;
        };
        offsets.push(live.offset[2].um());
        match offsets.len() {
            FAULT_AT => {
                let second = second.take().expect("once");
                desk.swap(second).expect("it listens");
            }
            END_AT => desk.stop().expect("it runs"),
            _ => {}
        }
    });
    assert_eq!(outcome.unwrap_or_else(|it| panic!("{it}")), Cause::Asked);
    assert!(second.is_none());
    for (at, um) in offsets.iter().enumerate().skip(FAULT_AT - 10) {
        assert!((um + 20.0).abs() < 1.0, "{um} um in period {at}");
    }
}

/// All samples of a module lost, not one frame of each: that is a device in trouble, like a drive.
#[test]
fn a_module_that_falls_silent_is_an_alarm_whatever_its_detectors_do() {
    let (mut bench, seen) = standing("hold");
    let state = risen(&bench, &seen);
    let correction = VolumetricCorrection::new(&bench.loaded.config, state);
    let correction = Box::new(correction.unwrap_or_else(|it| panic!("{it}")));
    let mover = bench.machine.volumetric().unwrap().mover(correction);
    let mut mover = mover.unwrap_or_else(|it| panic!("{it}"));
    let silent = Fault::StopPdos {
        node: "beams_x".into(),
    };
    let silent = FaultConfig::permanent(silent);
    let id = bench.emulated.simulation_mut().inject(silent);
    let id = id.expect("it is there");
    let failure = bench
        .machine
        .volumetric()
        .unwrap()
        .correct(&mut mover, true);
    let failure = failure.map(drop).unwrap_err();
    assert!(bench.emulated.simulation().fault_deliveries(id) > 0);
    assert!(
        matches!(&failure, Failure::Machine(machine::Failure::Alarm { device, .. }) if device == "beams_x"),
        "{failure}"
    );
}

/// A module with thermometers alone never says a voltage.
#[test]
fn a_module_of_thermometers_alone_is_heard() {
    let cold = |text: String| {
        let from = text.find("[volumetric.roll]").expect("it has some");
        let to = text
            .find("# Over and under the neutral")
            .expect("it is said");
        let text = text[..from].to_owned() + &text[to..];
        let own = "channels = [0, 1]              # the roll detectors of the x slide\n\
                   full_scale_v = [3.2, 3.2]\n";
        assert!(text.contains(own));
        text.edit(own, "")
    };
    let mut volume = Volume::zeroed(7, cold, |text| text);
    good(volume.bench.machine.idle(Duration::from_secs(2)));
    volume.know_errors();
    let store = volume.bench.store.clone();
    let taken = good(volume.work().reference(&store));
    assert_eq!(taken.references.temperatures.len(), 6);
}

/// Another axis's trouble takes nothing from what the others see.
#[test]
fn the_other_axes_stay_corrected() {
    let z_blocked = Fault::ReferenceBeamBlocked {
        axis: 2,
        behind_slide: true,
    };
    let day = play("fade_out", z_blocked, 2 * SECOND);
    let meanwhile = day.offset_um(FAULT_AT + day.lasting);
    assert!((meanwhile + 20.0).abs() < 1.0, "{meanwhile} um meanwhile");
    check_back(&day);
}

/// A roll of 100 urad is 7 um at the tool, 70 mm below the slide's zero, and -2.5 um at the detector 25 mm
/// above it: no displacement, and nothing at all once the detector sees no more.
#[test]
fn what_a_detector_sees_of_a_roll_comes_and_goes_with_it() {
    let (mut bench, seen) = standing("fade_out");
    let mut state = risen(&bench, &seen);
    let [roll, ..] = &mut state.rolls;
    let seen = roll.as_ref().expect("it has one").at(PLACE[0]);
    *roll = Some(constant(seen - Radians(100e-6)));
    let correction = VolumetricCorrection::new(&bench.loaded.config, state);
    let correction = Box::new(correction.unwrap_or_else(|it| panic!("{it}")));
    let fault = FaultConfig::lasting(x_blocked(), Duration::from_millis(2) * END_AT as u32);
    let mut id = None;
    let (_, lives) = follow(&mut bench, correction, END_AT, |simulation, period| {
        if period == FAULT_AT {
            id = Some(simulation.inject(fault.clone()).expect("its port is there"));
        }
    });
    let delivered = bench.emulated.simulation();
    let delivered = delivered.fault_deliveries(id.expect("it came"));
    assert!(delivered > 0, "it never struck");
    let y_um = |at: usize| lives[at - 1].offset[1].um();
    let (seen, faded) = (y_um(FAULT_AT), y_um(END_AT));
    assert!((seen + 9.5).abs() < 1.0, "{seen} um");
    assert!((faded + 7.0).abs() < 1.0, "{faded} um");
}
