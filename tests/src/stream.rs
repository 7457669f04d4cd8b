//! A path for the cyclic engine, whoever writes it, and the judgement of what came of it.

use core::time::Duration;
use std::sync::mpsc::sync_channel;
use std::vec::IntoIter;

use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::online::BeamReference;
use machine::engine::{AXES_MAX, PushError};
use machine::engine::{Cause, Desk, Engine, Live, State};
use mock_bus::runner::Running;
use mock_bus::simulation::Simulation;
use truestage::config::MachineConfig;
use truestage::emulated::Emulated;
use truestage::volumetric::VolumetricState;
use truestage::{Failure, Machine};
use units::{Celsius, Metres, MetresPerSecond, Radians};

/// How many set-points an axis may be behind: as many as the engine grants.
const BEHIND: usize = 4;
/// After so many periods whoever writes is woken.
const WAKE_EVERY: u32 = 16;

/// Where the screws of the platform with four of them push it, and which way (in millimetres).
const SCREWS: [([f64; 2], [f64; 2]); 4] = [
    ([-80.0, 80.0], [1.0, 0.0]),
    ([-80.0, -80.0], [1.0, 0.0]),
    ([0.0, -80.0], [0.0, 1.0]),
    ([0.0, 80.0], [0.0, 1.0]),
];
/// Of the circle that the platform's middle goes along.
pub const RADIUS: Metres = Metres(1e-3);
/// How far the platform turns meanwhile, to and fro.
const TURN_RAD: f64 = 5e-4;

/// Strokes of four screws that lead the platform along a circle through where it stands, so many
/// times in so many seconds, from rest to rest.
pub fn circle(period: Duration, seconds: f64, laps: f64) -> Vec<Vec<Metres>> {
    let count = (seconds / period.as_secs_f64()) as u32;
    let points = (0..=count).map(|at| {
        let phi = laps * smooth(f64::from(at) / f64::from(count));
        let radius_mm = RADIUS.mm();
        let (x, y) = (radius_mm * (1.0 - phi.cos()), radius_mm * phi.sin());
        let (sin, cos) = (TURN_RAD * phi.sin()).sin_cos();
        let stroke = |([px, py], [dx, dy]): ([f64; 2], [f64; 2])| {
            let moved_x = x + cos * px - sin * py - px;
            let moved_y = y + sin * px + cos * py - py;
            Metres::from_mm(dx * moved_x + dy * moved_y)
        };
        SCREWS.map(stroke).to_vec()
    });
    points.collect()
}

/// A turn (in radians) for a share from 0 to 1 of the time: at rest at both ends, even between.
fn smooth(share: f64) -> f64 {
    const EASE: f64 = 0.1;
    // Speed rises and falls as the integral of a raised cosine; its area is 1 - EASE.
    let rise = |u: f64| {
        (u - (core::f64::consts::PI * u / EASE).sin() * EASE / core::f64::consts::PI) / 2.0
    };
    let way = if share < EASE {
        rise(share)
    } else if share <= 1.0 - EASE {
        share - EASE / 2.0
    } else {
        1.0 - EASE - rise(1.0 - share)
    };
    core::f64::consts::TAU * way / (1.0 - EASE)
}

/// Nothing is known to deviate and nothing was seen: what detectors and thermometers say from
/// now on is the correction.
///
/// # Panics
/// When the configuration has become another one.
pub fn nothing_known(config: &MachineConfig) -> VolumetricState {
    let config = config.volumetric.as_ref().expect("it has one");
    let ends = [Metres(-0.01), Metres(0.51)];
    let zero = || Function::new(&ends, &[Metres::ZERO; 2], Shape::Linear).expect("it is good");
    let beams = config.beam.each().map(|beam| {
        let drift = truestage::for_tests::beam_drift(beam?).expect("it was checked");
        BeamReference::new([zero(), zero()], [Metres::ZERO; 2], drift).ok()
    });
    let roll = Function::new(&ends, &[Radians(0.0); 2], Shape::Linear);
    VolumetricState {
        beams,
        rolls: [roll.ok(), None, None],
        temperatures: vec![Celsius(21.0); config.temperature.len()],
        ..VolumetricState::default()
    }
}

/// To and fro along a diagonal of the volume.
pub fn diagonal(period: Duration, seconds: f64) -> Vec<Vec<Metres>> {
    let points = circle(period, seconds, seconds / 4.0).into_iter();
    // The strokes of the first screw go from 0 to 2 mm and back.
    points
        .map(|it| vec![it[0] * 6.0, it[0] * 5.0, it[0] * 4.0])
        .collect()
}

/// Writes a path as there is room for it, and keeps what the loop says that it did.
pub struct Writer {
    desk: Desk,
    points: IntoIter<Vec<Metres>>,
    /// What the loop did, period by period.
    pub lives: Vec<Live>,
}

impl Writer {
    /// For `points`, of which the queue takes the first ones now.
    pub fn new(desk: Desk, points: Vec<Vec<Metres>>) -> Self {
        let lives = Vec::with_capacity(2 * points.len());
        let mut writer = Self {
            desk,
            points: points.into_iter(),
            lives,
        };
        writer.serve();
        writer
    }

    /// Where orders are given.
    pub const fn desk(&mut self) -> &mut Desk {
        &mut self.desk
    }

    /// Reads what the loop did, and writes on.
    ///
    /// # Panics
    /// When the path cannot be driven.
    pub fn serve(&mut self) {
        while let Some(live) = self.desk.next_live() {
            self.lives.push(live);
        }
        match self.desk.path.write(&mut self.points) {
            // Stopped: of no use any more.
            Ok(_) | Err(PushError::Stopped) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

/// Whose truth is looked at while a path is followed.
#[derive(Clone)]
pub enum Watch<'a> {
    /// A machine with a thread of its own.
    Running(&'a Running),
    /// A machine in virtual time.
    InProcess(Emulated),
    /// Nobody's: it is not ours.
    Nobody,
}

/// Follows what `writer` writes in a thread of its own, which looks at the emulated machine each
/// time that it wakes; in virtual time, where there is no other thread, once a few periods.
/// `host` is called in every period with its number.
pub fn follow(
    machine: &mut Machine,
    engine: &mut Engine,
    writer: Writer,
    watch: &Watch<'_>,
    look: impl Fn(&mut Simulation) + Clone + Send + Sync + 'static,
    host: &mut dyn FnMut(u32),
) -> (Result<Cause, Failure>, Writer) {
    match watch {
        Watch::InProcess(emulated) => {
            let look = || look(&mut emulated.simulation_mut());
            follow_alone(machine, engine, writer, look, host)
        }
        Watch::Running(running) => {
            let look = || {
                let look = look.clone();
                running.with(move |it| look(it)).expect("the emulator runs");
            };
            follow_together(machine, engine, writer, look, host)
        }
        Watch::Nobody => follow_together(machine, engine, writer, || {}, host),
    }
}

fn follow_alone(
    machine: &mut Machine,
    engine: &mut Engine,
    mut writer: Writer,
    look: impl Fn(),
    host: &mut dyn FnMut(u32),
) -> (Result<Cause, Failure>, Writer) {
    let mut periods = 0;
    let outcome = machine.follow_with(engine, &mut || {
        periods += 1;
        host(periods);
        if periods % WAKE_EVERY == 0 {
            writer.serve();
            look();
        }
    });
    writer.serve();
    (outcome.map_err(Failure::from), writer)
}

fn follow_together(
    machine: &mut Machine,
    engine: &mut Engine,
    mut writer: Writer,
    look: impl Fn() + Send,
    host: &mut dyn FnMut(u32),
) -> (Result<Cause, Failure>, Writer) {
    let (wake, woken) = sync_channel(1);
    std::thread::scope(|scope| {
        let thread = scope.spawn(move || {
            while woken.recv().is_ok() {
                writer.serve();
                look();
            }
            writer.serve();
            writer
        });
        let mut periods = 0;
        let outcome = machine.follow_with(engine, &mut || {
            periods += 1;
            host(periods);
            if periods % WAKE_EVERY == 0 {
                // Awake already, when there is no room.
                let _ = wake.try_send(());
            }
        });
        drop(wake);
        (
            outcome.map_err(Failure::from),
            thread.join().expect("the writer ends"),
        )
    })
}

/// What bounds the motion of each axis.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// How many axes.
    pub axes: usize,
    /// From set-point to set-point at most this fast.
    pub speed: MetresPerSecond,
    /// From the latest set-points at most so far.
    pub deviation: Metres,
}

/// What the loop says that it did: no set-point steps, no axis is away from them for long.
///
/// # Panics
/// When that is not so.
pub fn check_lives(lives: &[Live], period: Duration, bounds: Bounds) {
    let set_points = |live: &Live| -> [Metres; AXES_MAX] {
        core::array::from_fn(|axis| live.nominal[axis] + live.offset[axis])
    };
    let reach = bounds.speed.value() * period.as_secs_f64() * 1.02;
    for pair in lives.windows(2) {
        let cycles = pair[1].cycle - pair[0].cycle;
        let (before, after) = (set_points(&pair[0]), set_points(&pair[1]));
        for axis in 0..bounds.axes {
            let step = (after[axis] - before[axis]).abs().value();
            assert!(step <= reach * cycles as f64, "axis {axis}, {pair:?}");
        }
    }
    let mut away = [0; AXES_MAX];
    for window in lives.windows(BEHIND + 1) {
        // Some were not looked at in time.
        if window[BEHIND].cycle - window[0].cycle != BEHIND as u64 {
            continue;
        }
        let now = &window[BEHIND];
        for (axis, away) in away.iter_mut().enumerate().take(bounds.axes) {
            let recent = window[..BEHIND].iter().map(|it| set_points(it)[axis]);
            let (low, high) = recent.fold((Metres(f64::MAX), Metres(f64::MIN)), |(l, h), it| {
                (l.min(it), h.max(it))
            });
            let lag = (low - now.actual[axis]).max(now.actual[axis] - high);
            *away = if lag > bounds.deviation { *away + 1 } else { 0 };
            assert!(*away < 2, "axis {axis}: {} um away, {now:?}", lag.um());
        }
    }
}

/// Whether `failure` is one by which a loop says that it was not served in time: by the
/// computer, or by devices that share the computer with it.
pub const fn is_lateness(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Machine(
            machine::Failure::Engine(_)
                | machine::Failure::Alarm { .. }
                | machine::Failure::Device { .. }
                | machine::Failure::Overdue { .. }
                | machine::Failure::HeldUp { .. }
                | machine::Failure::Explained { .. }
        )
    )
}

/// Whether the loop was stopped because of the computer.
pub const fn is_overrun(live: &Live) -> bool {
    matches!(
        live.state,
        State::Stopping(Cause::Overrun { .. }) | State::Stopped(Cause::Overrun { .. })
    )
}
