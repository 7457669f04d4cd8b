//! The cyclic engine over whole machines, the same on every bus; on live ones in real time, with
//! no more patience than a machine of metal has.
//!
//! How often a busy computer is late, no test decides. What is asserted is that nothing goes
//! unflagged: whatever the loop was late by is counted and reacted to, and what it did until then
//! was the path, with every axis within its window.

use core::time::Duration;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use drivers::transport::real_time::RealTime;
use machine::engine::Timing;
use machine::engine::{Cause, Engine, NoCorrection};
use mock_bus::simulation::Simulation;
use tests::stream::{
    self, Bounds, RADIUS, Writer, check_lives, circle, diagonal, is_lateness, is_overrun,
    nothing_known,
};
use tests::{Rig, Setup, Stand, not_run, rigs, true_pose};
use truestage::Failure;
use truestage::volumetric::VolumetricCorrection;
use units::{Metres, MetresPerSecond};

const SCREWS: [&str; 4] = ["u", "v", "w", "r"];
const AXES: [&str; 3] = ["x", "y", "z"];
/// As configured.
const WINDOW: Bounds = Bounds {
    axes: 4,
    speed: MetresPerSecond(20e-3),
    deviation: Metres(200e-6),
};
/// How often a machine is tried whose computer was late.
const TRIES: usize = 3;
/// A machine that was stopped stands after this time, whatever it did.
const STOPPED_WITHIN: Duration = Duration::from_secs(2);

/// What came of one run.
struct Run {
    period: Duration,
    outcome: Result<Cause, Failure>,
    timing: Timing,
    writer: Writer,
    /// The furthest that the platform's middle was off the circle.
    off_circle: Metres,
}

/// Four screws lead the platform along a circle; `host` is called in every period.
fn along_a_circle(
    stand: &mut Stand,
    seconds: f64,
    host: &mut dyn FnMut(u32),
) -> Result<Run, Failure> {
    let (mut engine, desk) = Engine::new(&stand.machine, &SCREWS, Box::new(NoCorrection))?;
    if stand.rig() != Rig::InProcess {
        engine.in_real_time();
    }
    let writer = Writer::new(desk, circle(engine.period(), seconds, seconds / 1.5));
    let from = stand.simulation(|it| true_pose(it));
    let furthest = Arc::new(Mutex::new(Metres::ZERO));
    let noted = Arc::clone(&furthest);
    let look = move |simulation: &mut Simulation| {
        let pose = true_pose(simulation);
        let (x, y) = (pose.x - from.x - RADIUS, pose.y - from.y);
        let off = (Metres(x.value().hypot(y.value())) - RADIUS).abs();
        let mut furthest = noted.lock().expect("nobody panics with it");
        *furthest = furthest.max(off);
    };
    let watch = stand.emulator.watch();
    let machine = &mut stand.machine;
    let (outcome, writer) = stream::follow(machine, &mut engine, writer, &watch, look, host);
    let off_circle = *furthest.lock().expect("nobody panics with it");
    Ok(Run {
        period: engine.period(),
        outcome,
        timing: engine.timing().clone(),
        writer,
        off_circle,
    })
}

/// `what` with a machine that was started and zeroed, on every bus. A computer that is too busy
/// for that in real time is flagged too: the machine is tried again with longer periods, and at
/// last the test counts as not run.
fn with_zeroed(
    test: &str,
    setups: &[Setup; TRIES],
    mut what: impl FnMut(&mut Stand) -> Result<bool, Failure>,
) {
    for rig in rigs() {
        // The emulator's thread is begun by this one, and scheduled like it.
        let granted = RealTime::ask();
        let done = setups.iter().any(|setup| {
            let done = tried(rig, setup, &mut what);
            assert!(done || rig != Rig::InProcess);
            done
        });
        if done {
            println!("{rig:?}, {granted}: done");
        } else {
            too_busy(test, rig, &granted);
        }
    }
}

/// All tries were spoilt by the computer.
#[track_caller]
fn too_busy(test: &str, rig: Rig, granted: &RealTime) {
    let why = format!("{TRIES} times this computer was too busy ({rig:?}, {granted})");
    not_run(test, &why);
}

/// The same with another SYNC period: what a busier computer may bear.
fn with_period(setup: &Setup, ms: &str) -> Setup {
    let period = format!("sync_period_ms = {ms}");
    setup.clone().machine("sync_period_ms = 2.0", &period)
}

fn tried(
    rig: Rig,
    setup: &Setup,
    what: &mut impl FnMut(&mut Stand) -> Result<bool, Failure>,
) -> bool {
    let mut stand = Stand::new(rig, setup);
    let done = zero(&mut stand).and_then(|()| what(&mut stand));
    match done {
        Ok(true) => stand.machine.shut_down().is_ok() || rig != Rig::InProcess,
        Ok(false) | Err(_) => {
            stand.machine.make_safe();
            stands_still(&stand);
            let failure = done.err();
            assert!(failure.as_ref().is_none_or(is_lateness), "{failure:?}");
            println!("{rig:?}: again, {failure:?}");
            false
        }
    }
}

fn zero(stand: &mut Stand) -> Result<(), Failure> {
    let store = stand.store.clone();
    let machine = &mut stand.machine;
    machine.start()?;
    if machine.config().volumetric.is_some() {
        machine.volumetric()?.zero()
    } else {
        machine.platform()?.zero(&store).map(drop)
    }
}

/// After it was made safe.
fn stands_still(stand: &Stand) {
    let look = || stand.simulation(|it| (it.now(), places(it)));
    let (begin, mut last) = look();
    let mut since = begin;
    loop {
        let (now, places) = look();
        let moved = last
            .iter()
            .zip(&places)
            .any(|(a, b)| (*a - *b).abs() > Metres::from_um(0.5));
        if moved {
            (since, last) = (now, places);
        }
        if now.since(since) > Duration::from_millis(100) {
            return;
        }
        assert!(now < begin + STOPPED_WITHIN, "it still moves");
    }
}

/// Where the scales or screws of a machine are.
fn places(simulation: &mut Simulation) -> Vec<Metres> {
    // In virtual time nothing lives between two looks.
    let later = simulation.now() + Duration::from_millis(10);
    simulation.advance(later);
    let truth = simulation.truth();
    match (truth.platform(), truth.volumetric()) {
        (Some(platform), _) => (0..platform.screws())
            .map(|it| platform.screw_position(it))
            .collect(),
        (None, Some(volumetric)) => {
            let scales = volumetric.scales();
            (0..3).map(|k| scales[k]).collect()
        }
        (None, None) => Vec::new(),
    }
}

/// What every run must be, however it ended; whether it got to its end.
fn judged(run: &Run, rig: Rig, bounds: Bounds) -> bool {
    check_lives(&run.writer.lives, run.period, bounds);
    println!(
        "{rig:?}, {:?}: {:?}\n{}",
        run.period, run.outcome, run.timing
    );
    match &run.outcome {
        Ok(Cause::PathDone) => {
            assert_eq!(run.timing.overruns, 0, "an overrun went unflagged");
            true
        }
        Ok(Cause::Overrun { periods }) => {
            assert!(run.timing.overruns > 0 && run.timing.skipped >= u64::from(*periods));
            assert!(run.writer.lives.iter().any(is_overrun));
            false
        }
        Ok(other) => panic!("nobody asked for that: {other}"),
        Err(failure) => {
            assert!(is_lateness(failure), "{failure}");
            false
        }
    }
}

#[test]
fn four_axes_at_two_milliseconds_follow_a_circle_on_every_bus() {
    let setup = Setup::four_cyclic_axes(1).in_real_time();
    let setups = ["2.0", "5.0", "20.0"].map(|ms| with_period(&setup, ms));
    with_zeroed("four axes along a circle", &setups, |stand| {
        let run = along_a_circle(stand, 3.0, &mut |_| {})?;
        let rig = stand.rig();
        let limit = match rig {
            // Deviations and play of the screws, and what the servos lag.
            Rig::InProcess => Metres::from_um(15.0),
            Rig::Pty | Rig::Vcan => WINDOW.deviation,
        };
        let done = judged(&run, rig, WINDOW);
        if done {
            let off = run.off_circle;
            assert!(off < limit, "{} um off the circle", off.um());
            assert!(off > Metres::ZERO, "nobody looked");
            println!("{rig:?}: {:.1} um off the circle", off.um());
        }
        run.outcome.map(|_| done)
    });
}

/// In which period the loop of the next test is held up.
const HELD_UP_AT: u32 = 100;

#[test]
fn a_loop_that_is_held_up_in_real_time_drops_its_path_and_stops_all_axes_together() {
    // From shortly after a SYNC: one is missed, and the drives do not stop by themselves yet.
    const HELD_UP: Duration = Duration::from_millis(21);
    let setup = with_period(&Setup::four_cyclic_axes(2).in_real_time(), "10.0");
    // In virtual time: faults/cyclic_host.rs.
    for rig in rigs().into_iter().filter(|rig| *rig != Rig::InProcess) {
        let granted = RealTime::ask();
        let done = (0..TRIES).any(|_| {
            let mut stand = Stand::new(rig, &setup);
            let run = zero(&mut stand).and_then(|()| {
                along_a_circle(&mut stand, 3.0, &mut |periods| {
                    let begin = Instant::now();
                    while periods == HELD_UP_AT && begin.elapsed() < HELD_UP {}
                })
            });
            let done = dropped_its_path(run, rig);
            stand.machine.make_safe();
            stands_still(&stand);
            done
        });
        if !done {
            too_busy("a loop that is held up", rig, &granted);
        }
    }
}

/// Whether the run got as far as the moment at which it was held up; what came of it then.
fn dropped_its_path(run: Result<Run, Failure>, rig: Rig) -> bool {
    let run = match run {
        Ok(run) => run,
        Err(failure) => {
            assert!(is_lateness(&failure), "{failure}");
            println!("{rig:?}: again, {failure}");
            return false;
        }
    };
    assert!(!judged(&run, rig, WINDOW), "an overrun went unflagged");
    let last = run.writer.lives.last().map(|it| it.cycle);
    // Who is late before that has not come to what is tried here.
    let Some(last) = last.filter(|cycle| *cycle >= u64::from(HELD_UP_AT)) else {
        println!("{rig:?}: again, late in cycle {last:?}");
        return false;
    };
    assert!(last < 200, "the path went on to cycle {last}");
    true
}

#[test]
fn three_axes_are_corrected_by_what_they_see_while_they_follow_on_every_bus() {
    const BOUNDS: Bounds = Bounds {
        axes: 3,
        speed: MetresPerSecond(202e-3),
        deviation: Metres(500e-6),
    };
    let setup = Setup::volumetric(1).in_real_time();
    // The modules' samples must not get older.
    let rarely = with_period(&setup, "20.0").machine("every_syncs = 10", "every_syncs = 2");
    let setups = [setup.clone(), with_period(&setup, "5.0"), rarely];
    with_zeroed("three axes corrected as they go", &setups, |stand| {
        let config = stand.emulator.loaded.config.clone();
        let correction = VolumetricCorrection::new(&config, nothing_known(&config))?;
        let (mut engine, desk) = Engine::new(&stand.machine, &AXES, Box::new(correction))?;
        if stand.rig() != Rig::InProcess {
            engine.in_real_time();
        }
        let mut writer = Writer::new(desk, diagonal(engine.period(), 4.0));
        writer.desk().correct(true).expect("it listens");
        let watch = stand.emulator.watch();
        let machine = &mut stand.machine;
        let look = |_: &mut Simulation| {};
        let (outcome, writer) =
            stream::follow(machine, &mut engine, writer, &watch, look, &mut |_| {});
        let run = Run {
            period: engine.period(),
            outcome,
            timing: engine.timing().clone(),
            writer,
            off_circle: Metres::ZERO,
        };
        let done = judged(&run, stand.rig(), BOUNDS);
        if done {
            let last = run.writer.lives.last().expect("it ran");
            let largest = |values: &[Metres]| {
                values
                    .iter()
                    .fold(Metres::ZERO, |most, it| most.max(it.abs()))
            };
            assert!(last.corrected);
            assert!(
                largest(&last.offset[..3]) > Metres::from_um(1.0),
                "{last:?}"
            );
            assert!(largest(&last.uncertainty[..3]) > Metres::ZERO, "{last:?}");
        }
        run.outcome.map(|_| done)
    });
}
