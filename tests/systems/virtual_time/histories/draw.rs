//! Parts of a history: the drive's quirks, the requests and their moments.

use core::time::Duration;

use mock_bus::config::{DeviceConfig, MachineConfig as EmulatedConfig};
use mock_bus::fault::Fault;
use mock_bus::node::canopen_server::{ChangedWrite, Manners, NamedObject};
use mock_bus::node::cia402_drive::{Cia402DriveConfig, DriveQuirks, RpdoDeadline};
use tests::random;

use super::kind::Kind;

/// Numbers by chance.
pub(in crate::virtual_time) struct Dice(u64);

impl Dice {
    pub(in crate::virtual_time) const fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x2545_F491_4F6C_DD1D))
    }

    pub(in crate::virtual_time) fn share(&mut self) -> f64 {
        random(&mut self.0)
    }

    pub(in crate::virtual_time) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn falls(&mut self, probability: f64) -> bool {
        self.share() < probability
    }

    fn ms(&mut self, low: f64, high: f64) -> Duration {
        Duration::from_millis(self.between(low, high) as u64)
    }

    pub(super) fn axis(&mut self, kind: &Kind) -> usize {
        let axes: Vec<usize> = (0..kind.axes.len()).collect();
        self.one_of(&axes)
    }

    pub(in crate::virtual_time) fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        let at = (self.share() * choices.len() as f64) as usize;
        choices[at.min(choices.len() - 1)]
    }
}

/// One thing that is asked or done.
#[derive(Clone, Debug)]
pub(super) enum Step {
    Zero,
    /// A run that measures.
    Measure {
        calibrates: bool,
    },
    Enable {
        axis: usize,
    },
    Disable {
        axis: usize,
    },
    Stop,
    QuickStop,
    Reset,
    Move(MoveStep),
    /// A jog that is renewed so long, and then lapses.
    Jog {
        axis: usize,
        speed: f64,
        held: Duration,
        /// Another person jogs it the other way.
        has_rival: bool,
    },
    /// A path of all axes from one place to another.
    Path {
        from: f64,
        to: f64,
    },
    /// The program ends; another one starts after a while.
    Restart {
        after: Duration,
    },
    Fault {
        axis: usize,
        fault: Fault,
        lasts: Duration,
    },
    Nothing,
}

/// A motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct MoveStep {
    pub(super) axis: usize,
    pub(super) target: f64,
    /// The file's when absent.
    pub(super) speed: Option<f64>,
    pub(super) supersedes: bool,
    /// It lapses unless it is renewed, and is not renewed.
    pub(super) lapses: bool,
}

/// A step, and how long it is let be before the next one; to its end when absent.
#[derive(Clone, Debug)]
pub(super) struct Timed {
    pub(super) step: Step,
    pub(super) cut: Option<Duration>,
}

/// Returns the steps of a history.
pub(super) fn draw_steps(dice: &mut Dice, kind: &Kind) -> Vec<Timed> {
    let count = 4 + (dice.share() * 6.0) as usize;
    let mut steps = vec![];
    if dice.falls(0.85) {
        steps.push(whole(Step::Zero));
    }
    for _ in 0..count {
        steps.push(draw_step(dice, kind));
    }
    steps
}

const fn whole(step: Step) -> Timed {
    Timed { step, cut: None }
}

fn draw_step(dice: &mut Dice, kind: &Kind) -> Timed {
    let share = dice.share();
    let axis = dice.axis(kind);
    let step = match share {
        ..0.08 if kind.follows_paths => Step::Path {
            from: dice.between(kind.targets.0, kind.targets.1),
            to: dice.between(kind.targets.0, kind.targets.1),
        },
        ..0.34 => draw_move(dice, kind, axis),
        ..0.46 => Step::Stop,
        ..0.51 => Step::QuickStop,
        ..0.62 => Step::Enable { axis },
        ..0.65 => Step::Disable { axis },
        ..0.70 => Step::Reset,
        ..0.77 => Step::Zero,
        ..0.80 => Step::Measure {
            calibrates: dice.falls(0.5),
        },
        ..0.87 => Step::Jog {
            axis,
            speed: dice.one_of(&[-0.5, 0.5, 1.0]) * kind.speed,
            held: dice.ms(50.0, 400.0),
            has_rival: dice.falls(0.25),
        },
        ..0.92 => Step::Restart {
            after: dice.ms(50.0, 2500.0),
        },
        ..0.96 => draw_fault(dice, kind, axis),
        _ => Step::Nothing,
    };
    let cut = match step {
        Step::Measure { .. } => Some(dice.ms(200.0, 2500.0)),
        Step::Move(_) | Step::Zero | Step::Path { .. } if dice.falls(0.6) => {
            Some(dice.ms(30.0, 1200.0))
        }
        Step::Move(_) | Step::Zero | Step::Path { .. } | Step::Jog { .. } => None,
        _ => Some(dice.ms(20.0, 700.0)),
    };
    Timed { step, cut }
}

fn draw_move(dice: &mut Dice, kind: &Kind, axis: usize) -> Step {
    let (low, high) = kind.targets;
    Step::Move(MoveStep {
        axis,
        target: dice.between(low, high),
        speed: dice.falls(0.5).then(|| dice.between(0.1, 1.0) * kind.speed),
        supersedes: dice.falls(0.3),
        lapses: dice.falls(0.15),
    })
}

fn draw_fault(dice: &mut Dice, kind: &Kind, axis: usize) -> Step {
    let node = kind.axes[axis].node.to_owned();
    let fault = match dice.share() {
        ..0.35 => Fault::SafeTorqueOff,
        ..0.55 => Fault::StopHeartbeat { node },
        ..0.75 => Fault::StopPdos { node },
        _ => Fault::PowerLoss { node },
    };
    Step::Fault {
        axis,
        fault,
        lasts: dice.ms(50.0, 800.0),
    }
}

/// Gives a drive of `emulated` its quirks; returns what they are.
pub(in crate::virtual_time) fn draw_quirks(
    dice: &mut Dice,
    emulated: &mut EmulatedConfig,
) -> Vec<String> {
    let drives = emulated.nodes.iter_mut();
    let drives = drives.filter_map(|node| match &mut node.device {
        DeviceConfig::Cia402Drive(drive) => Some(drive),
        _ => None,
    });
    let mut drives: Vec<_> = drives.collect();
    let at = (dice.share() * drives.len() as f64) as usize;
    // Some drives are polite.
    if dice.falls(0.25) || drives.is_empty() {
        return vec![];
    }
    let drive = &mut drives[at];
    let mut drawn = vec![];
    for quirk in QUIRKS {
        if dice.falls(2.5 / QUIRKS.len() as f64) {
            (quirk.set)(dice, drive);
            drawn.push(quirk.name.to_owned());
        }
    }
    drawn
}

/// Quirks that no alarm may come of.
const MANNERS: &[&str] = &[
    "stale_homing_ms",
    "edge_before_target",
    "edge_in_mapping_order",
    "halt_blocks_mode",
    "identical_target_ignored",
    "statusword_bits",
    "sdo_response_delay_us",
    "sdo_size_bit_omitted",
    "sdo_always_four_bytes",
    "upper_soft_limit_first",
];

/// Gives each drive of a sound machine manners that a driver has to bear; returns which.
pub(super) fn draw_manners(dice: &mut Dice, emulated: &mut EmulatedConfig) -> Vec<&'static str> {
    let mut drawn = vec![];
    for node in &mut emulated.nodes {
        let DeviceConfig::Cia402Drive(drive) = &mut node.device else {
            continue;
        };
        for quirk in QUIRKS.iter().filter(|quirk| MANNERS.contains(&quirk.name)) {
            if dice.falls(0.1) {
                (quirk.set)(dice, drive);
                drawn.push(quirk.name);
            }
        }
    }
    drawn
}

/// One key of the emulated drive.
struct Quirk {
    name: &'static str,
    set: fn(&mut Dice, &mut Cia402DriveConfig),
}

macro_rules! quirks {
    ($($name:ident: |$dice:ident, $quirks:ident, $manners:ident| $set:block)*) => {
        const QUIRKS: &[Quirk] = &[$(Quirk {
            name: stringify!($name),
            set: |$dice: &mut Dice, drive: &mut Cia402DriveConfig| {
                let $quirks: &mut DriveQuirks = &mut drive.quirks;
                let $manners: &mut Manners = &mut drive.manners;
                // Most keys need only one of the three.
                let _ = (&$dice, &$quirks, &$manners);
                $set
            },
        }),*];
    };
}

quirks! {
    stale_homing_ms: |dice, quirks, manners| {
        quirks.stale_homing_ms = dice.between(5.0, 250.0) as u64;
        quirks.stale_homing_from_power_on = dice.falls(0.5);
    }
    homing_ends_without_bit_10: |dice, quirks, manners| { quirks.homing_ends_without_bit_10 = true; }
    homing_attained_stuck: |dice, quirks, manners| { quirks.homing_attained_stuck = true; }
    mode_ignored_while_off: |dice, quirks, manners| { quirks.mode_ignored_while_off = true; }
    mode_display_stuck: |dice, quirks, manners| {
        quirks.mode_display_stuck = Some(dice.one_of(&[1, 3, 6]));
    }
    left_mode: |dice, quirks, manners| {
        quirks.left_mode = Some(3);
        quirks.left_velocity = dice.between(-100_000.0, 100_000.0) as i32;
        quirks.mode_ignored_while_off = dice.falls(0.7);
    }
    edge_before_target: |dice, quirks, manners| { quirks.edge_before_target = true; }
    edge_in_mapping_order: |dice, quirks, manners| { quirks.edge_in_mapping_order = true; }
    enable_delay_ms: |dice, quirks, manners| {
        quirks.enable_delay_ms = dice.between(100.0, 4000.0) as u64;
    }
    halt_blocks_mode: |dice, quirks, manners| { quirks.halt_blocks_mode = true; }
    halt_blocks_acknowledge: |dice, quirks, manners| { quirks.halt_blocks_acknowledge = true; }
    faults_on_lost_heartbeat: |dice, quirks, manners| { quirks.faults_on_lost_heartbeat = true; }
    acknowledge_inverted: |dice, quirks, manners| { quirks.acknowledge_inverted = true; }
    acknowledge_never_falls: |dice, quirks, manners| { quirks.acknowledge_never_falls = true; }
    identical_target_ignored: |dice, quirks, manners| { quirks.identical_target_ignored = true; }
    rpdo_deadline: |dice, quirks, manners| {
        quirks.rpdo_deadline_ms = 100;
        quirks.rpdo_deadline = dice.one_of(&[RpdoDeadline::QuickStop, RpdoDeadline::Fault]);
    }
    statusword_bits: |dice, quirks, manners| {
        quirks.statusword_bits = dice.one_of(&[0x0100, 0x4000, 0x8000]);
    }
    speed_unit: |dice, quirks, manners| {
        quirks.speed_unit = Some(dice.one_of(&[0.1, 2.0, 6.17, 10.0]));
    }
    acceleration_unit: |dice, quirks, manners| {
        quirks.acceleration_unit = Some(dice.one_of(&[0.1, 0.3, 3.0, 10.0]));
    }
    homing_speed_factor: |dice, quirks, manners| {
        quirks.homing_speed_factor = Some(dice.between(1.3, 3.4));
    }
    sdo_response_delay_us: |dice, quirks, manners| {
        manners.sdo_response_delay_us = dice.between(1000.0, 60_000.0) as u64;
    }
    sdo_size_bit_omitted: |dice, quirks, manners| { manners.sdo_size_bit_omitted = true; }
    sdo_always_four_bytes: |dice, quirks, manners| { manners.sdo_always_four_bytes = true; }
    absent_objects: |dice, quirks, manners| {
        let index = dice.one_of(&[0x6066, 0x60F4, 0x6067, 0x6084, 0x607C, 0x6065, 0x6007]);
        manners.absent_objects.push(NamedObject::whole(index));
    }
    read_only_objects: |dice, quirks, manners| {
        let index = dice.one_of(&[0x1A00, 0x1600, 0x6085]);
        manners.read_only_objects.push(NamedObject::whole(index));
    }
    pdo_identifiers_fixed: |dice, quirks, manners| { manners.pdo_identifiers_fixed = true; }
    changed_writes: |dice, quirks, manners| {
        let index = dice.one_of(&[0x6081, 0x6083, 0x6085, 0x6065, 0x6067]);
        manners.changed_writes.push(ChangedWrite {
            object: NamedObject::whole(index),
            step: 7,
            maximum: dice.falls(0.3).then_some(500_000),
        });
    }
    upper_soft_limit_first: |dice, quirks, manners| { manners.upper_soft_limit_first = true; }
    boots_twice_after_ms: |dice, quirks, manners| {
        manners.boots_twice_after_ms = dice.between(50.0, 3000.0) as u64;
    }
    own_sync_ms: |dice, quirks, manners| { manners.own_sync_ms = 20; }
    node_guarding_only: |dice, quirks, manners| { manners.node_guarding_only = true; }
}
