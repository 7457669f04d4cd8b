//! How punctual the cyclic engine is, beside a tokio interval in the same run.
//!
//! `cycle follow MACHINE BUS SECONDS PERIOD_MS...` follows a path in real time, for that long in sum,
//! and prints one JSON object. MACHINE is `screws` (four axes along a circle) or `volumetric` (three
//! axes along a diagonal, corrected by what their detectors and thermometers show), BUS is `vcan0`
//! or `pty`. The first period is taken that the computer bears (or the last one). What stops the
//! engine before its end is counted and named, and it is begun anew. The tokio interval, in a thread
//! of its own under the ordinary scheduler, only notes how late it wakes.
//!
//! `cycle show MACHINE BUS SECONDS PERIOD_MS...` prints the same for a person.
//!
//! `cycle cost` prints what a period costs the processor apart from its bus: samples taken in,
//! judged, the path, the correction, set-points encoded.

use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Instant;

use drivers::transport::real_time::RealTime;
use machine::engine::{Cause, Correction, Engine, NoCorrection};
use machine::engine::{Histogram, Timing};
use serde_json::{Value, json};
use tests::apart::{Apart, used_by_the_loop};
use tests::stream::{self, Writer, circle, diagonal, nothing_known};
use tests::{Rig, Setup, Stand};
use truestage::Failure;
use truestage::config::MachineConfig;
use truestage::volumetric::VolumetricCorrection;
use units::Metres;

const SCREWS: [&str; 4] = ["u", "v", "w", "r"];
const AXES: [&str; 3] = ["x", "y", "z"];
/// One path is no longer than this, so that a stop costs little.
const PATH_S: f64 = 20.0;
/// A computer that bears nothing is given up after so many times the seconds asked for.
const PATIENCE: f64 = 3.0;
/// How often each period is tried, and for how long.
const TRIES: u32 = 3;
const TRIAL_S: f64 = 2.0;
const REPETITIONS: usize = 9;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    if words == ["cost"] {
        println!("{}", costs());
        return;
    }
    let [
        how @ ("follow" | "show"),
        machine,
        bus,
        seconds,
        ref periods_ms @ ..,
    ] = words[..]
    else {
        eprintln!("cycle: run by tests/bench/run, or as `cycle show screws pty 60 2.0 5.0 20.0`");
        return;
    };
    let place = Place::new(machine, bus);
    let run = measure(place, bearable(place, periods_ms), seconds.parse().unwrap());
    if how == "show" {
        run.show();
    } else {
        println!("{}", run.json());
    }
}

/// Which machine, on which bus.
#[derive(Clone, Copy)]
struct Place {
    axes: &'static [&'static str],
    rig: Rig,
}

impl Place {
    fn new(machine: &str, bus: &str) -> Self {
        let axes: &[&str] = match machine {
            "screws" => &SCREWS,
            "volumetric" => &AXES,
            other => panic!("machine {other}: known are screws and volumetric"),
        };
        let rig = match bus {
            "pty" => Rig::Pty,
            "vcan0" => Rig::Vcan,
            other => panic!("bus {other}: known are pty and vcan0"),
        };
        Self { axes, rig }
    }

    fn stand(self, period_ms: &str) -> Stand {
        let period = format!("sync_period_ms = {period_ms}");
        let mut setup = setup_of(self.axes)
            .in_real_time()
            .machine("sync_period_ms = 2.0", &period);
        if is_volumetric(self.axes) && period_ms.parse::<f64>().unwrap() > 5.0 {
            // Modules' samples must not get older when SYNC is rarer.
            setup = setup.machine("every_syncs = 10", "every_syncs = 2");
        }
        Stand::new(self.rig, &setup)
    }
}

fn setup_of(axes: &[&str]) -> Setup {
    if is_volumetric(axes) {
        Setup::volumetric(1)
    } else {
        Setup::four_cyclic_axes(1)
    }
}

fn is_volumetric(axes: &[&str]) -> bool {
    axes[0] == AXES[0]
}

/// Lateness of a tokio interval until it is told to end.
struct Tokio {
    end: Arc<AtomicBool>,
    thread: JoinHandle<Histogram>,
}

impl Tokio {
    fn begin(period: Duration) -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&end);
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_time()
                .build()
                .unwrap();
            runtime.block_on(async {
                let mut lateness = Histogram::default();
                let mut interval = tokio::time::interval(period);
                while !ended.load(Ordering::Relaxed) {
                    let due = interval.tick().await;
                    lateness.note(due.elapsed());
                }
                lateness
            })
        });
        Self { end, thread }
    }

    fn end(self) -> Histogram {
        self.end.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// The first period with which the machine is zeroed and follows a short path.
fn bearable<'a>(place: Place, periods_ms: &[&'a str]) -> &'a str {
    let _granted = RealTime::ask();
    let bears = |period_ms: &&&str| {
        (0..TRIES).any(|_| {
            let mut stand = place.stand(period_ms);
            let mut run = Measured::new(place, period_ms);
            let well = zero(&mut stand).is_ok() && follow(&mut stand, TRIAL_S, &mut run).is_none();
            stand.machine.make_safe();
            well
        })
    };
    let last = periods_ms.last().expect("a period");
    periods_ms.iter().find(bears).unwrap_or(last)
}

/// What was measured.
struct Measured {
    axes: &'static [&'static str],
    period: Duration,
    /// Along paths.
    cycles: u64,
    wall: Duration,
    timing: Timing,
    tokio: Histogram,
    /// What ended a run before its path, and how often.
    stops: BTreeMap<String, u32>,
}

fn measure(place: Place, period_ms: &str, seconds: f64) -> Measured {
    let begun = Instant::now();
    let mut run = Measured::new(place, period_ms);
    let period = run.period;
    let tokio = Tokio::begin(period);
    // Of this thread and the emulator's, which it begins.
    let granted = RealTime::ask();
    let followed = |run: &Measured| run.cycles as f64 * period.as_secs_f64();
    while followed(&run) < seconds && begun.elapsed().as_secs_f64() < PATIENCE * seconds {
        let mut stand = place.stand(period_ms);
        let mut stopped = zero(&mut stand).err().map(|it| it.to_string());
        while stopped.is_none() && followed(&run) < seconds {
            let path_s = PATH_S.min(seconds - followed(&run)).max(1.0);
            stopped = follow(&mut stand, path_s, &mut run);
        }
        if let Some(stopped) = stopped {
            *run.stops.entry(stopped).or_default() += 1;
        }
        stand.machine.make_safe();
    }
    drop(granted);
    run.tokio = tokio.end();
    run.wall = begun.elapsed();
    run
}

fn zero(stand: &mut Stand) -> Result<(), Failure> {
    let store = stand.store.clone();
    stand.machine.start()?;
    if stand.machine.config().volumetric.is_some() {
        stand.machine.volumetric()?.zero()
    } else {
        stand.machine.platform()?.zero(&store).map(drop)
    }
}

/// None for screws; for three axes what their detectors and thermometers make of nothing known.
fn correction_of(config: &MachineConfig) -> Box<dyn Correction> {
    if config.volumetric.is_none() {
        return Box::new(NoCorrection);
    }
    Box::new(VolumetricCorrection::new(config, nothing_known(config)).unwrap())
}

/// From rest to rest; screws beyond those of the engine stand still.
fn path_of(axes: &[&str], period: Duration, path_s: f64) -> Vec<Vec<Metres>> {
    let points = if is_volumetric(axes) {
        diagonal(period, path_s)
    } else {
        circle(period, path_s, path_s / 1.5)
    };
    let points = points.into_iter();
    points.map(|it| it[..axes.len()].to_vec()).collect()
}

/// One path; what stopped it before its end.
fn follow(stand: &mut Stand, path_s: f64, run: &mut Measured) -> Option<String> {
    let correction = correction_of(stand.machine.config());
    let engine = Engine::new(&stand.machine, run.axes, correction);
    let (mut engine, mut desk) = engine.unwrap_or_else(|failure| panic!("{failure}"));
    engine.in_real_time();
    desk.correct(true).unwrap();
    let writer = Writer::new(desk, path_of(run.axes, engine.period(), path_s));
    let watch = stand.emulator.watch();
    let machine = &mut stand.machine;
    let (outcome, _) = stream::follow(machine, &mut engine, writer, &watch, |_| {}, &mut |_| {});
    run.cycles += engine.counts().cycles;
    run.timing.add(engine.timing());
    match outcome {
        Ok(Cause::PathDone) => None,
        Ok(cause) => Some(cause.to_string()),
        Err(failure) => Some(failure.to_string()),
    }
}

fn micros(histogram: &Histogram) -> Value {
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    json!({
        "p50_us": us(histogram.percentile(0.5)),
        "p99_us": us(histogram.percentile(0.99)),
        "p999_us": us(histogram.percentile(0.999)),
        "max_us": us(histogram.greatest()),
        "count": histogram.total(),
    })
}

impl Measured {
    fn new(place: Place, period_ms: &str) -> Self {
        Self {
            axes: place.axes,
            period: Duration::from_secs_f64(period_ms.parse::<f64>().unwrap() * 1e-3),
            cycles: 0,
            wall: Duration::ZERO,
            timing: Timing::default(),
            tokio: Histogram::default(),
            stops: BTreeMap::new(),
        }
    }

    fn json(&self) -> Value {
        json!({
            "period_us": self.period.as_secs_f64() * 1e6,
            "axes": self.axes.len(),
            "followed_s": self.cycles as f64 * self.period.as_secs_f64(),
            "wall_s": self.wall.as_secs_f64(),
            "lateness": micros(&self.timing.lateness),
            "jitter": micros(&self.timing.jitter),
            "answers": micros(&self.timing.answers),
            "work": micros(&self.timing.work),
            "overruns": self.timing.overruns,
            "left_out": self.timing.skipped,
            "stops": self.stops,
            "scheduling": self.timing.scheduling,
            "tokio": micros(&self.tokio),
        })
    }

    #[expect(clippy::print_stdout, reason = "this is what it is for")]
    fn show(&self) {
        let followed_s = self.cycles as f64 * self.period.as_secs_f64();
        println!(
            "{} axes at {:?}: {followed_s:.1} s followed in {:.1} s",
            self.axes.len(),
            self.period,
            self.wall.as_secs_f64()
        );
        println!("{}\ntokio     {}", self.timing, self.tokio);
        for (stop, count) in &self.stops {
            println!("{count} times: {stop}");
        }
    }
}

/// Nanoseconds since the first call.
fn nanos() -> u64 {
    static BEGUN: OnceLock<Instant> = OnceLock::new();
    BEGUN.get_or_init(Instant::now).elapsed().as_nanos() as u64
}

/// For each case the median and the least of the repetitions, in microseconds per period.
fn costs() -> Value {
    let cases: [(&str, &[&str]); 4] = [
        ("1 axis", &SCREWS[..1]),
        ("2 axes", &SCREWS[..2]),
        ("4 axes", &SCREWS),
        ("3 axes, corrected by what they see", &AXES),
    ];
    let costs = cases.map(|(name, axes)| {
        let mut each: Vec<f64> = (0..REPETITIONS).map(|_| cost_us(axes)).collect();
        each.sort_by(f64::total_cmp);
        json!({ "case": name, "us": each[each.len() / 2], "us_min": each[0] })
    });
    json!({ "cases": costs })
}

/// Of one run in virtual time: what the loop took outside of its transport.
fn cost_us(axes: &[&str]) -> f64 {
    let mut inside = None;
    let mut stand = Stand::wrapped(Rig::InProcess, &setup_of(axes), |inner| {
        let (apart, cell) = Apart::new(inner, nanos);
        inside = Some(cell);
        Box::new(apart)
    });
    let inside = inside.unwrap();
    zero(&mut stand).unwrap();
    let correction = correction_of(stand.machine.config());
    let machine = &mut stand.machine;
    let (mut engine, mut desk) = Engine::new(machine, axes, correction).unwrap();
    desk.correct(true).unwrap();
    let writer = Writer::new(desk, path_of(axes, engine.period(), 8.0));
    let meter = (nanos as fn() -> u64, &*inside);
    let used = used_by_the_loop(machine, &mut engine, writer, meter, (200, 3_500));
    let (_, nanos, periods) = used.unwrap();
    nanos as f64 * 1e-3 / periods as f64
}
