//! Storms: faults and quirks by chance on every kind of machine while a cycle goes on, which most do not survive.
//!
//! The log of each is pinned. An undisturbed cycle shows no change that needs an odd moment.

use std::fmt::Write as _;

use mock_bus::config::MachineConfig as EmulatedConfig;
use mock_bus::fault::{Fault, FaultConfig};
use tests::cycles::PARTS;

use super::histories::{Dice, draw_quirks};
use super::pinned;

const SEEDS: core::ops::RangeInclusive<u64> = 1..=200;
/// Faults begin in so many seconds of a cycle.
const STRETCH_S: f64 = 30.0;

/// What a fault can be aimed at.
struct Aims {
    can: Vec<String>,
    serial: Vec<String>,
    nodes: Vec<String>,
}

impl Aims {
    fn new(emulated: &EmulatedConfig) -> Self {
        let (can, serial) = emulated.ports.iter().partition(|port| port.is_can());
        let names = |ports: Vec<&mock_bus::config::PortConfig>| {
            ports.iter().map(|port| port.name().to_owned()).collect()
        };
        Self {
            can: names(can),
            serial: names(serial),
            nodes: emulated
                .nodes
                .iter()
                .map(|node| node.name.clone())
                .collect(),
        }
    }
}

fn name_of(dice: &mut Dice, names: &[String]) -> String {
    let at = (dice.share() * names.len() as f64) as usize;
    names[at].clone()
}

/// A fault on a CAN bus.
fn draw_bus_fault(dice: &mut Dice, port: String) -> Fault {
    let cob_id = dice.one_of(&[None, Some(0x181), Some(0x281), Some(0x581), Some(0x701)]);
    match (dice.share() * 12.0) as u32 {
        0 => Fault::Drop { port, cob_id },
        1 => Fault::Duplicate { port, cob_id },
        2 => Fault::Reorder { port, cob_id },
        3 => Fault::Corrupt { port, cob_id },
        4 => Fault::Delay {
            port,
            cob_id,
            delay_ms: dice.between(0.05, 20.0),
        },
        5 => Fault::Babble {
            port,
            cob_id: dice.one_of(&[0x10, 0x181, 0x7FF]),
        },
        6 => Fault::ForeignSync {
            port,
            period_ms: dice.between(1.0, 20.0),
        },
        7 => Fault::ErrorPassive { port },
        8 => Fault::BusOff { port },
        9 => Fault::LinkDown { port },
        10 => Fault::DuplicateBootUp { port, node_id: 1 },
        _ => Fault::Emergency {
            port,
            node_id: 1,
            code: 0x3210,
            register: 4,
        },
    }
}

/// A fault on a serial line.
fn draw_line_fault(dice: &mut Dice, port: String) -> Fault {
    match (dice.share() * 6.0) as u32 {
        0 => Fault::Garbage { port },
        1 => Fault::Split { port },
        2 => Fault::Merge { port },
        3 => Fault::LateAnswer {
            port,
            delay_ms: dice.between(0.05, 200.0),
        },
        4 => Fault::Echo { port },
        _ => Fault::Silence { port },
    }
}

/// A fault of a device.
fn draw_device_fault(dice: &mut Dice, node: String) -> Fault {
    match (dice.share() * 5.0) as u32 {
        0 => Fault::Mute { node },
        1 => Fault::StopHeartbeat { node },
        2 => Fault::StopPdos { node },
        3 => Fault::StaleData { node },
        _ => Fault::PowerLoss { node },
    }
}

/// A fault of the machine.
fn draw_plant_fault(dice: &mut Dice) -> Fault {
    match (dice.share() * 12.0) as u32 {
        0 => Fault::BlockedAxis { axis: 0 },
        1 => Fault::SafeTorqueOff,
        2 => Fault::LimitSwitch {
            axis: 0,
            positive: dice.share() < 0.5,
            pressed: dice.share() < 0.5,
        },
        3 => Fault::BeamBlocked,
        4 => Fault::BeamWeak,
        5 => Fault::FringeJump {
            half_wavelengths: 3,
        },
        6 => Fault::TargetAbsent,
        7 => Fault::DetectorDead,
        8 => Fault::FrozenEnvironment,
        9 => Fault::InputOpen { channel: 0 },
        10 => Fault::InputsSwapped,
        _ => Fault::Vibration {
            amplitude_um: dice.between(0.1, 20.0),
        },
    }
}

fn draw_fault(dice: &mut Dice, aims: &Aims) -> FaultConfig {
    let fault = match dice.share() {
        ..0.3 if !aims.can.is_empty() => {
            let port = name_of(dice, &aims.can);
            draw_bus_fault(dice, port)
        }
        ..0.5 if !aims.serial.is_empty() => {
            let port = name_of(dice, &aims.serial);
            draw_line_fault(dice, port)
        }
        ..0.75 => {
            let node = name_of(dice, &aims.nodes);
            draw_device_fault(dice, node)
        }
        _ => draw_plant_fault(dice),
    };
    FaultConfig {
        from_s: dice.between(0.0, STRETCH_S),
        duration_s: Some(0.001 * 3000_f64.powf(dice.share())),
        probability: dice.one_of(&[1.0, 1.0, 0.3, 0.01]),
        count_max: dice.one_of(&[None, Some(1), Some(5)]),
        fault,
    }
}

#[test]
fn storms_have_the_logs_that_are_pinned() {
    let (mut text, mut survived) = (String::new(), 0);
    for seed in SEEDS {
        let mut dice = Dice::new(seed);
        let part = &PARTS[(seed % PARTS.len() as u64) as usize];
        let bench = part.bench_on(seed, |emulated| {
            let aims = Aims::new(emulated);
            if seed % 2 == 0 {
                draw_quirks(&mut dice, emulated);
            }
            let count = 1 + (dice.share() * 4.0) as usize;
            let faults = (0..count).map(|_| draw_fault(&mut dice, &aims));
            emulated.faults.extend(faults);
        });
        let (hash, failure) = part.try_run(bench);
        survived += u32::from(failure.is_none());
        writeln!(text, "{} {seed} {hash:016x}", part.name).expect("a text takes every line");
    }
    println!("{survived} of {} went on to their end", SEEDS.count());
    pinned::check_text("storms", &text);
}
