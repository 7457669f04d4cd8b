//! False alarms of the motion envelope: sound machines of all sorts, whose plant, drive and settings are drawn together.
//!
//! Each zeroes, moves, jogs, follows a path, is stopped and goes on; no axis may be called astray.
//!
//! `HEALTHY=600 cargo test -p tests --test systems sound_machines -- --nocapture` counts more of them, with
//! `FROM=1001` other ones.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use core::f64::consts::TAU;
use core::time::Duration;

use mock_bus::config::MachineConfig as EmulatedConfig;
use tests::{Bench, Edit, UVW, shipped_config};
use truestage::Failure;
use truestage::platform::Pose;
use units::Metres;

use super::draw::{Dice, MoveStep, Step, Timed, draw_manners};
use super::judge::{AxisFacts, Judge};
use super::kind::{Kind, LINEAR_STAGE, ROTARY_TABLE, THREE_AXES};
use super::player::Player;
use super::stage::Stage;
use super::{first_seed, number};

/// So many machines in every run.
const USUAL: u64 = 48;

/// What the envelope says, and what else stops a sound machine.
const FALSE_ALARMS: &[(&str, &str)] = &[
    ("although it was asked to hold its place", "hold"),
    ("left the way to its set-point", "way"),
    ("the search of its home met nothing", "search"),
    ("the axis does not stop", "stop"),
    ("left its set-points", "set-points"),
    ("at most; the drive counts", "speed"),
    ("the drive is in mode", "mode"),
    ("this controller did not enable it", "enabled"),
];

/// The judge looks at nothing: what the program says is counted.
const fn unjudged(facts: AxisFacts) -> AxisFacts {
    AxisFacts {
        following_error: f64::INFINITY,
        standing_speed: f64::INFINITY,
        ..facts
    }
}

const LINEAR: [AxisFacts; 1] = [unjudged(LINEAR_STAGE.axes[0])];
const ROTARY: [AxisFacts; 1] = [unjudged(ROTARY_TABLE.axes[0])];
const VOLUMETRIC: [AxisFacts; 3] = [
    unjudged(THREE_AXES.axes[0]),
    unjudged(THREE_AXES.axes[1]),
    unjudged(THREE_AXES.axes[2]),
];

/// Keys of a text and what they are set to, of every axis; calibrations and verifications keep theirs.
type Keys = Vec<(&'static str, String)>;

fn with_keys(text: &str, keys: &Keys) -> String {
    let mut set = vec![false; keys.len()];
    let (mut lines, mut is_run) = (String::new(), false);
    for line in text.lines() {
        if line.starts_with('[') {
            is_run = line.contains("calibrate") || line.contains("verify");
        }
        let key = line.split_once(" = ").map_or("", |(key, _)| key);
        let at = keys
            .iter()
            .position(|(wanted, _)| *wanted == key && !is_run);
        match at {
            Some(at) => {
                set[at] = true;
                writeln!(lines, "{key} = {}", keys[at].1)
            }
            None => writeln!(lines, "{line}"),
        }
        .expect("a text takes every line");
    }
    let unset = keys.iter().zip(set).find(|(_, set)| !set);
    assert!(unset.is_none(), "no line sets {unset:?}");
    lines
}

/// A number between these, each decade as likely as the next.
fn over(dice: &mut Dice, low: f64, high: f64) -> f64 {
    low * (high / low).powf(dice.share())
}

/// A search accelerates and brakes with this share of what its axis can do.
const HOMING_SHARE: f64 = 0.1;

/// The keys of a motion by its unit.
struct MotionKeys {
    speed: &'static str,
    acceleration: &'static str,
    quick_stop: &'static str,
}

const MILLIMETRES: MotionKeys = MotionKeys {
    speed: "speed_mm_per_s",
    acceleration: "acceleration_mm_per_s2",
    quick_stop: "quick_stop_deceleration_mm_per_s2",
};

const DEGREES: MotionKeys = MotionKeys {
    speed: "speed_deg_per_s",
    acceleration: "acceleration_deg_per_s2",
    quick_stop: "quick_stop_deceleration_deg_per_s2",
};

/// What a servo can do, and what is asked of it, in mm (or degrees) and seconds.
struct Servo {
    speed: f64,
    acceleration: f64,
    quick_stop: f64,
    bandwidth_hz: f64,
    damping: f64,
    feed_forward: f64,
}

impl Servo {
    fn draw(dice: &mut Dice, speeds: (f64, f64), accelerations: (f64, f64)) -> Self {
        let acceleration = over(dice, accelerations.0, accelerations.1);
        Self {
            speed: over(dice, speeds.0, speeds.1),
            acceleration,
            quick_stop: acceleration * over(dice, 1.0, 2.0),
            bandwidth_hz: over(dice, 10.0, 200.0),
            damping: dice.between(0.6, 1.2),
            feed_forward: dice.between(0.8, 1.0),
        }
    }

    /// How far its axis is behind at most, also in a search at `reference`; a sound machine's limit is some
    /// times that.
    fn lag(&self, reference: f64) -> f64 {
        let omega = TAU * self.bandwidth_hz;
        let by_speed =
            self.speed.max(reference) * (1.0 - self.feed_forward) * 2.0 * self.damping / omega;
        by_speed + self.quick_stop / (omega * omega)
    }

    /// The fastest search that comes to rest between a limit switch and the end of the travel.
    fn reference_max(&self) -> f64 {
        const ROOM_MM: f64 = 0.7;
        (2.0 * HOMING_SHARE * self.acceleration.max(self.quick_stop) * ROOM_MM).sqrt()
    }

    /// The keys of a machine file: `others`, and what is asked of the servo.
    fn machine_keys(&self, units: MotionKeys, mut others: Keys) -> Keys {
        others.extend([
            (units.speed, format!("{:?}", self.speed)),
            (units.acceleration, format!("{:?}", self.acceleration)),
            (units.quick_stop, format!("{:?}", self.quick_stop)),
        ]);
        others
    }

    fn plant_keys(&self) -> Keys {
        vec![
            ("servo_bandwidth_hz", format!("{:?}", self.bandwidth_hz)),
            ("servo_damping", format!("{:?}", self.damping)),
            ("feed_forward_fraction", format!("{:?}", self.feed_forward)),
        ]
    }
}

/// A machine, as it was drawn.
struct Drawn {
    kind: Kind,
    machine: Keys,
    emulated: Keys,
}

fn period_ms(dice: &mut Dice) -> String {
    format!("{:?}", dice.one_of(&[2.0, 4.0, 5.0, 10.0, 20.0]))
}

fn adapter_us(dice: &mut Dice) -> String {
    format!("{:?}", over(dice, 125.0, 4000.0))
}

fn draw_linear(dice: &mut Dice) -> Drawn {
    let servo = Servo::draw(dice, (5.0, 500.0), (100.0, 5000.0));
    let reference = over(dice, 2.0, 50.0).min(servo.reference_max());
    let limit_um = (servo.lag(reference) * 1e3 * over(dice, 3.0, 20.0)).clamp(50.0, 5000.0);
    let window_um = over(dice, 0.05, 5.0);
    let resolution = format!("{:?}", dice.one_of(&[5.0, 10.0, 20.0]));
    let mut emulated = servo.plant_keys();
    emulated.extend([
        ("hands_over_every_us", adapter_us(dice)),
        (
            "friction_deceleration_m_per_s2",
            format!("{:?}", over(dice, 0.3, 6.0)),
        ),
        (
            "rest_error_nm",
            format!("{:?}", window_um * over(dice, 10.0, 80.0)),
        ),
        ("encoder_resolution_nm", resolution.clone()),
        ("resolution_nm", resolution.clone()),
    ]);
    Drawn {
        kind: Kind {
            axes: &LINEAR,
            speed: servo.speed * 1e-3,
            ..LINEAR_STAGE
        },
        machine: servo.machine_keys(
            MILLIMETRES,
            vec![
                ("sync_period_ms", period_ms(dice)),
                ("following_error_limit_um", format!("{limit_um:?}")),
                ("position_window_um", format!("{window_um:?}")),
                ("reference_speed_mm_per_s", format!("{:?}", reference)),
                ("move_timeout_s", "60.0".into()),
                ("resolution_nm", resolution),
            ],
        ),
        emulated,
    }
}

fn draw_rotary(dice: &mut Dice) -> Drawn {
    let servo = Servo::draw(dice, (3.0, 150.0), (20.0, 500.0));
    let reference = over(dice, 10.0, 120.0);
    let limit = (servo.lag(reference) * 3600.0 * over(dice, 3.0, 20.0)).clamp(60.0, 7200.0);
    let window = over(dice, 0.1, 5.0);
    let mut emulated = servo.plant_keys();
    emulated.extend([
        ("hands_over_every_us", adapter_us(dice)),
        (
            "friction_deceleration_deg_per_s2",
            format!("{:?}", over(dice, 10.0, 200.0)),
        ),
        (
            "rest_error_arcsec",
            format!("{:?}", window * over(dice, 0.01, 0.08)),
        ),
    ]);
    Drawn {
        kind: Kind {
            axes: &ROTARY,
            speed: servo.speed.to_radians(),
            ..ROTARY_TABLE
        },
        machine: servo.machine_keys(
            DEGREES,
            vec![
                ("sync_period_ms", period_ms(dice)),
                ("following_error_limit_arcsec", format!("{limit:?}")),
                ("position_window_arcsec", format!("{window:?}")),
                ("index_speed_deg_per_s", format!("{:?}", reference)),
            ],
        ),
        emulated,
    }
}

fn draw_volumetric(dice: &mut Dice) -> Drawn {
    // Its slides search at 20 mm/s.
    let servo = Servo::draw(dice, (20.0, 190.0), (3000.0, 9000.0));
    let period_ms = dice.one_of(&[4.0, 5.0, 10.0]);
    // Between two set-points the speed is constant.
    let by_steps = servo.acceleration * period_ms * 1e-3 / (TAU * servo.bandwidth_hz);
    let lag = servo.lag(20.0) + by_steps;
    let limit_um = (lag * 1e3 * over(dice, 3.0, 20.0)).clamp(100.0, 5000.0);
    let window_um = over(dice, 0.1, 5.0);
    let mut emulated = servo.plant_keys();
    emulated.extend([
        (
            "friction_deceleration_m_per_s2",
            format!("{:?}", over(dice, 0.3, 6.0)),
        ),
        (
            "rest_error_nm",
            format!("{:?}", window_um * over(dice, 10.0, 60.0)),
        ),
    ]);
    Drawn {
        kind: Kind {
            axes: &VOLUMETRIC,
            speed: servo.speed * 1e-3,
            ..THREE_AXES
        },
        machine: servo.machine_keys(
            MILLIMETRES,
            vec![
                ("sync_period_ms", format!("{period_ms:?}")),
                ("following_error_limit_um", format!("{limit_um:?}")),
                ("deviation_limit_um", format!("{limit_um:?}")),
                ("position_window_um", format!("{window_um:?}")),
            ],
        ),
        emulated,
    }
}

fn draw_platform(dice: &mut Dice) -> (Keys, Keys) {
    let servo = Servo::draw(dice, (1.0, 19.0), (10.0, 500.0));
    let limit_um = (servo.lag(2.0) * 1e3 * over(dice, 3.0, 20.0)).clamp(20.0, 2000.0);
    let window_um = over(dice, 0.1, 1.0);
    let mut emulated = servo.plant_keys();
    emulated.extend([
        ("hands_over_every_us", adapter_us(dice)),
        (
            "friction_deceleration_m_per_s2",
            format!("{:?}", over(dice, 1.0, 10.0)),
        ),
        (
            "rest_error_nm",
            format!("{:?}", window_um * over(dice, 10.0, 60.0)),
        ),
    ]);
    let machine = servo.machine_keys(
        MILLIMETRES,
        vec![
            ("sync_period_ms", period_ms(dice)),
            ("following_error_limit_um", format!("{limit_um:?}")),
            ("position_window_um", format!("{window_um:?}")),
        ],
    );
    (machine, emulated)
}

/// Moves that end, moves that are stopped or superseded, jogs, paths, switching off and on.
fn draw_day(dice: &mut Dice, kind: &Kind) -> Vec<Timed> {
    let mut steps = vec![Timed {
        step: Step::Zero,
        cut: None,
    }];
    let mut add = |step, cut_ms: Option<f64>| {
        let cut = cut_ms.map(|cut_ms| Duration::from_millis(cut_ms as u64));
        steps.push(Timed { step, cut });
    };
    for _ in 0..2 {
        let axis = dice.axis(kind);
        add(Step::Move(draw_move(dice, kind, axis)), None);
        add(
            Step::Move(draw_move(dice, kind, axis)),
            Some(dice.between(50.0, 900.0)),
        );
        add(Step::Stop, Some(1500.0));
        add(Step::Enable { axis }, Some(500.0));
        add(
            Step::Move(draw_move(dice, kind, axis)),
            Some(dice.between(50.0, 400.0)),
        );
        let superseding = MoveStep {
            supersedes: true,
            ..draw_move(dice, kind, axis)
        };
        add(Step::Move(superseding), None);
        let speed = dice.one_of(&[-0.5, 0.5, 1.0]) * kind.speed;
        let held = Duration::from_millis(dice.between(50.0, 600.0) as u64);
        let jog = Step::Jog {
            axis,
            speed,
            held,
            has_rival: false,
        };
        add(jog, None);
        if kind.follows_paths {
            let from = dice.between(kind.targets.0, kind.targets.1);
            let to = dice.between(kind.targets.0, kind.targets.1);
            add(Step::Path { from, to }, None);
        }
        add(Step::Disable { axis }, Some(600.0));
        add(Step::Enable { axis }, Some(1000.0));
        add(Step::QuickStop, Some(1000.0));
        add(Step::Reset, Some(600.0));
    }
    steps
}

fn draw_move(dice: &mut Dice, kind: &Kind, axis: usize) -> MoveStep {
    MoveStep {
        axis,
        target: dice.between(kind.targets.0, kind.targets.1),
        speed: (dice.share() < 0.5).then(|| dice.between(0.1, 1.0) * kind.speed),
        supersedes: false,
        lapses: false,
    }
}

/// What a machine said.
struct Day {
    seed: u64,
    name: &'static str,
    story: String,
}

fn live(seed: u64) -> Day {
    let mut dice = Dice::new(seed ^ 0x5EA1_0000);
    let drawn = match seed % 8 {
        0 => return live_platform(seed, &mut dice),
        1..=3 => draw_linear(&mut dice),
        4 | 5 => draw_rotary(&mut dice),
        _ => draw_volumetric(&mut dice),
    };
    let kind = &drawn.kind;
    let text = with_keys(kind.shipped.emulated, &drawn.emulated);
    let mut emulated = EmulatedConfig::parse(&text).expect("the drawn keys are plausible");
    let manners = draw_manners(&mut dice, &mut emulated);
    let steps = draw_day(&mut dice, kind);
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let edit = |text| {
        let text = with_keys(&kind.edited(text), &drawn.machine);
        match kind.name {
            // A line of a plate must last two SYNC periods.
            "rotary" => text.edit("\nspeed_deg_per_s = 60.0", "\nspeed_deg_per_s = 9.0"),
            _ => text,
        }
    };
    let loaded = shipped_config(&kind.shipped, folder.path(), edit);
    let judges = kind.axes.iter().copied().map(Judge::new).collect();
    let stage = Stage::new(&emulated, seed, &loaded, judges);
    let mut player = Player::new(kind, loaded, stage);
    player.play(&steps);
    let story = player.story.join("\n  ");
    let (machine, plant) = (&drawn.machine, &drawn.emulated);
    Day {
        seed,
        name: kind.name,
        story: format!("{machine:?}\n  {plant:?}\n  {manners:?}\n  {story}"),
    }
}

/// A group that starts together; its screws are moved by its pose only.
fn live_platform(seed: u64, dice: &mut Dice) -> Day {
    let (machine, plant) = draw_platform(dice);
    let edit = |text: String| with_keys(&text, &machine);
    let shape = |text: String| with_keys(&text, &plant);
    let mut bench = Bench::shaped(&UVW, seed, edit, shape);
    let store = bench.store.clone();
    let ended = bench.machine.guarded(|machine| {
        machine.start()?;
        machine.platform()?.zero(&store)?;
        for _ in 0..6 {
            let mut stroke = || Metres::from_mm(dice.between(-1.0, 1.0));
            let (x, y) = (stroke(), stroke());
            let pose = Pose {
                x,
                y,
                ..Pose::default()
            };
            machine.platform()?.move_to(pose)?;
            machine.idle(Duration::from_secs(1))?;
        }
        machine.shut_down()
    });
    let ended = ended.map_err(|failure: Failure| failure.to_string());
    Day {
        seed,
        name: "uvw",
        story: format!("{machine:?}\n  {plant:?}\n  {ended:?}"),
    }
}

fn live_all(count: u64) -> Vec<Day> {
    let (next, days) = (AtomicU64::new(first_seed()), Mutex::new(vec![]));
    let end = first_seed() + count;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..4 * cores {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        return;
                    }
                    let day = live(seed);
                    days.lock().expect("no machine panics").push(day);
                }
            });
        }
    });
    let mut days = days.into_inner().expect("no machine panics");
    days.sort_by_key(|day| day.seed);
    days
}

#[test]
fn sound_machines_of_all_sorts_raise_no_alarm() {
    let count = number("HEALTHY").unwrap_or(USUAL);
    if let Some(seed) = number("HEALTHY_SEED") {
        let day = live(seed);
        println!("{} {}\n  {}", day.seed, day.name, day.story);
        return;
    }
    let days = live_all(count);
    let mut kinds: BTreeMap<&str, (u32, u32)> = BTreeMap::new();
    let mut wrong = String::new();
    for day in &days {
        let told = FALSE_ALARMS
            .iter()
            .find(|(words, _)| day.story.contains(words));
        let stopped = day.story.contains("the machine was stopped") || day.story.contains("Failed");
        let kind = kinds.entry(day.name).or_default();
        (kind.0, kind.1) = (kind.0 + 1, kind.1 + u32::from(stopped));
        if let Some((_, what)) = told {
            writeln!(wrong, "{} {} {what}\n  {}", day.seed, day.name, day.story)
                .expect("a text takes every line");
        } else if stopped && std::env::var_os("TELL").is_some() {
            println!("{} {} otherwise\n  {}", day.seed, day.name, day.story);
        }
    }
    println!("machines, and those of them that ended otherwise: {kinds:?}");
    assert!(wrong.is_empty(), "{wrong}");
}
