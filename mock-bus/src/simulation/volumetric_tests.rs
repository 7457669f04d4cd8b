//! The three-axis machine as its configuration file describes it, driven by bare frames.

use super::*;
use crate::fault::Fault;
use crate::plant::HallDrift;
use crate::plant::config::PlantConfig;
use crate::plant::volumetric::config::VolumetricConfig;
use crate::plant::{LineOptics, LineSetUp};
use core::time::Duration;
use std::collections::BTreeMap;

use units::Metres;
use wire::can::CanFrame;
use wire::umd2::{Line, Sample};

const CAN: Port = Port(0);
const LASER: Port = Port(1);
const PERIOD: Duration = Duration::from_millis(2);
const DRIVES: [u8; 3] = [1, 2, 3];
const MODULES: [u8; 4] = [11, 12, 13, 14];
/// How often the modules send, in SYNCs.
const EVERY: u8 = 8;

fn config() -> MachineConfig {
    let text = include_str!("../../../configs/emulated/volumetric.toml");
    MachineConfig::parse(text).unwrap()
}

/// A master that knows just enough CANopen to run the drives cyclically.
struct Master {
    machine: Simulation,
    heard: Vec<CanFrame>,
    targets: [i32; 3],
    /// What modules have said and nobody has taken: all speak at one SYNC, and the last of them
    /// only when the set-points of the next one are through.
    samples: BTreeMap<u16, [i16; 4]>,
}

impl Master {
    /// Everything mapped, operational, drives enabled in mode 8 where they stand.
    fn new(seed: u64) -> Self {
        let mut master = Self {
            machine: Simulation::new(&config(), seed).unwrap(),
            heard: Vec::new(),
            targets: [0; 3],
            samples: BTreeMap::new(),
        };
        master.wait(Duration::from_millis(300));
        DRIVES.into_iter().for_each(|node| master.map_drive(node));
        MODULES.into_iter().for_each(|node| master.map_module(node));
        master.say(0, &[1, 0]);
        for controlword in [0x06_u16, 0x07, 0x0F] {
            for _ in 0..5 {
                master.cycle(controlword);
            }
        }
        master
    }

    fn wait(&mut self, span: Duration) {
        let until = self.machine.now() + span;
        while let Some(delivery) = self.machine.advance_to_delivery(until) {
            if let Event::Payload(Payload::Frame(frame)) = delivery.event {
                self.heard.push(frame);
            }
        }
    }

    fn say(&mut self, id: u16, data: &[u8]) {
        let frame = Payload::Frame(CanFrame::standard(id, data));
        let now = self.machine.now();
        self.machine.deliver(now, CAN, &frame).unwrap();
    }

    #[track_caller]
    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: usize, value: u32) {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - bytes as u8) << 2;
        self.heard.clear();
        self.say(
            0x600 + u16::from(node),
            &[command, low, high, sub, a, b, c, d],
        );
        self.wait(Duration::from_millis(2));
        let answer = 0x580 + u16::from(node);
        let answer = self
            .heard
            .iter()
            .find(|it| it.standard_id() == Some(answer));
        assert_eq!(
            answer.unwrap().data()[0],
            0x60,
            "{index:04X}:{sub} of {node}"
        );
    }

    /// One PDO: off, map, transmission type, on.
    fn map(&mut self, node: u8, communication: u16, cob_id: u32, kind: u8, mapped: &[u32]) {
        let cob_id = cob_id + u32::from(node);
        let mapping = communication + 0x200;
        self.write(node, communication, 1, 4, 0x8000_0000 | cob_id);
        self.write(node, mapping, 0, 1, 0);
        for (sub, object) in (1..).zip(mapped) {
            self.write(node, mapping, sub, 4, *object);
        }
        self.write(node, mapping, 0, 1, mapped.len() as u32);
        self.write(node, communication, 2, 1, kind.into());
        if !mapped.is_empty() {
            self.write(node, communication, 1, 4, cob_id);
        }
    }

    fn map_drive(&mut self, node: u8) {
        self.map(node, 0x1400, 0x200, 1, &[0x6040_0010, 0x607A_0020]);
        self.map(
            node,
            0x1800,
            0x180,
            1,
            &[0x6041_0010, 0x6064_0020, 0x6061_0008],
        );
        self.map(node, 0x1801, 0x280, 1, &[0x60F4_0020]);
        for spare in [2, 3] {
            self.map(
                node,
                0x1800 + spare,
                0x180 + u32::from(spare) * 0x100,
                255,
                &[],
            );
        }
        self.write(node, 0x60C2, 1, 1, 2);
        self.write(node, 0x6060, 0, 1, 8);
    }

    fn map_module(&mut self, node: u8) {
        for input in 1..=8 {
            let thermometer = node == 14 && input > 2;
            let (sensor, unit, digits) = match thermometer {
                true => (30, 0x002D_0000, 2),
                false => (40, 0xFD26_0000, 1),
            };
            self.write(node, 0x6110, input, 2, sensor);
            self.write(node, 0x6131, input, 4, unit);
            self.write(node, 0x6132, input, 1, digits);
            self.write(node, 0x6112, input, 1, 1);
        }
        for spare in [0, 1] {
            self.map(
                node,
                0x1800 + spare,
                0x180 + u32::from(spare) * 0x100,
                255,
                &[],
            );
        }
        let values = |first: u32| [0, 1, 2, 3].map(|k| 0x7130_0010 + (first + k) * 0x100);
        self.map(node, 0x1802, 0x380, EVERY, &values(1));
        self.map(node, 0x1803, 0x480, EVERY, &values(5));
    }

    /// SYNC, answers, set-points for the next one.
    fn cycle(&mut self, controlword: u16) {
        self.heard.clear();
        let start = self.machine.now();
        self.say(0x80, &[]);
        self.wait(Duration::from_micros(1200));
        for (axis, node) in DRIVES.into_iter().enumerate() {
            if let Some((_, position)) = self.drive(node)
                && controlword != 0x0F
            {
                self.targets[axis] = position;
            }
            let mut data = controlword.to_le_bytes().to_vec();
            data.extend(self.targets[axis].to_le_bytes());
            self.say(0x200 + u16::from(node), &data);
        }
        let passed = self.machine.now() - start;
        self.wait(PERIOD - passed);
        self.keep_samples();
    }

    /// Statusword and position in what was heard in this cycle.
    fn drive(&self, node: u8) -> Option<(u16, i32)> {
        let id = Some(0x180 + u16::from(node));
        let frame = self.heard.iter().find(|it| it.standard_id() == id)?;
        let data = frame.data();
        let position = i32::from_le_bytes(data[2..6].try_into().unwrap());
        Some((u16::from_le_bytes([data[0], data[1]]), position))
    }

    fn keep_samples(&mut self) {
        for frame in &self.heard {
            let id = frame.standard_id().unwrap_or(0);
            if matches!(id & 0x780, 0x380 | 0x480) {
                let mut values = [0; 4];
                for (value, raw) in values.iter_mut().zip(frame.data().chunks(2)) {
                    *value = i16::from_le_bytes([raw[0], raw[1]]);
                }
                self.samples.insert(id, values);
            }
        }
    }

    /// All eight values of a module, when both halves have come.
    fn module(&mut self, node: u8) -> Option<[i16; 8]> {
        let ids = [0x380, 0x480].map(|base| base + u16::from(node));
        if !ids.iter().all(|id| self.samples.contains_key(id)) {
            return None;
        }
        let mut values = [0; 8];
        for (half, id) in values.chunks_mut(4).zip(ids) {
            half.copy_from_slice(&self.samples.remove(&id)?);
        }
        Some(values)
    }

    /// Cycles until a module has spoken.
    #[track_caller]
    fn next_module(&mut self, node: u8) -> [i16; 8] {
        self.samples.clear();
        for _ in 0..2 * EVERY {
            self.cycle(0x0F);
            if let Some(values) = self.module(node) {
                return values;
            }
        }
        panic!("module {node} is silent")
    }
}

#[test]
fn the_file_says_what_the_defaults_are() {
    let expected = PlantConfig {
        volumetric: Some(VolumetricConfig::default()),
        ..PlantConfig::default()
    };
    assert_eq!(config().plant, expected);
}

#[test]
fn what_no_machine_can_be_is_refused() {
    let text = include_str!("../../../configs/emulated/volumetric.toml");
    for (from, to, key) in [
        ("chain = \"FXYZ\"", "chain = \"FXY\"", "chain"),
        (
            "axis = 0\ndistance_mm",
            "axis = 3\ndistance_mm",
            "roll.axis",
        ),
        (
            "travel_mm = [500.0, 400.0",
            "travel_mm = [500.0, 30.0",
            "travel_mm - start_max_mm",
        ),
        ("[24, 25, 26,", "[24, 25, 26, 26,", "plant_channels"),
        (
            "[plant.volumetric]",
            "[plant.gantry]\n[plant.volumetric]",
            "volumetric",
        ),
        ("sum_v = 8.0", "sum_v = 0.0", "sum_v"),
    ] {
        assert!(text.contains(from), "{from}");
        let refused = MachineConfig::parse(&text.replace(from, to));
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains(key), "{refused}");
    }
}

/// 50 mm in a second on all axes, with every detector on the bus.
#[test]
fn three_drives_follow_at_2_ms_beside_all_detectors() {
    let mut master = Master::new(3);
    let start = master.targets;
    let mut spoken = 0;
    for step in 1..=500 {
        let share = f64::from(step) / 500.0;
        let smooth = share * share * share * (10.0 - 15.0 * share + 6.0 * share * share);
        master.targets = start.map(|start| start + (5e6 * smooth).round() as i32);
        master.cycle(0x0F);
        for node in MODULES {
            spoken += usize::from(master.module(node).is_some());
        }
        for node in DRIVES {
            let (status, _) = master.drive(node).unwrap();
            assert_eq!(status & 0x206F, 0x0027, "drive {node} in cycle {step}");
        }
    }
    assert!((4 * 61..=4 * 63).contains(&spoken), "{spoken}");
    for _ in 0..50 {
        master.cycle(0x0F);
    }
    for (axis, node) in DRIVES.into_iter().enumerate() {
        let (status, position) = master.drive(node).unwrap();
        assert_eq!(status & 0x106F, 0x1027);
        assert!((position - master.targets[axis]).abs() <= 5, "{position}");
        let truth = master.machine.truth();
        let truth = truth.volumetric().unwrap();
        let scale = truth.scales()[axis] - truth.count_zero(axis);
        assert!((scale - Metres(1e-8 * f64::from(position))).um().abs() < 0.05);
    }
    // Some of the 300 ms of start-up is silent.
    let load = master.machine.bus_load(CAN).unwrap();
    println!("bus load {load:.2}");
    assert!(load < 0.8, "{load}");
}

#[test]
fn the_machine_repeats_bit_by_bit() {
    let run = |seed| {
        let mut master = Master::new(seed);
        for step in 1..=50 {
            master.targets = master.targets.map(|it| it + step * 100);
            master.cycle(0x0F);
        }
        master.machine.log_hash()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[track_caller]
fn check_fault(fault: Fault, node: u8, seen: impl Fn([i16; 8], [i16; 8]) -> bool) {
    let mut master = Master::new(5);
    let before = master.next_module(node);
    let text = format!("{fault:?}");
    let id = master
        .machine
        .inject(FaultConfig::permanent(fault))
        .unwrap();
    let _ = master.next_module(node);
    let during = master.next_module(node);
    assert!(seen(before, during), "{text}: {before:?} {during:?}");
    assert!(master.machine.fault_deliveries(id) > 0, "{text}");
    master.machine.end_fault(id);
    let _ = master.next_module(node);
    let after = master.next_module(node);
    let back = before.iter().zip(after);
    for (before, after) in back {
        assert!(
            (i32::from(*before) - i32::from(after)).abs() < 100,
            "{text}: {after}"
        );
    }
}

#[test]
fn every_fault_of_a_beam_shows_at_its_module_and_ends() {
    let blocked = |behind_slide| Fault::ReferenceBeamBlocked {
        axis: 1,
        behind_slide,
    };
    let dark = |values: &[i16]| values.iter().all(|it| it.abs() < 20);
    check_fault(blocked(false), 12, |_, during| dark(&during));
    check_fault(blocked(true), 12, |before, during| {
        dark(&during[4..]) && (during[0] - before[0]).abs() < 100
    });
    check_fault(Fault::ReferenceBeamBright { axis: 0 }, 11, |_, during| {
        during == [i16::MAX; 8]
    });
    // 100 µm of a spot of 1 mm: 16 % of the sum from one side to the other.
    let knocked = Fault::ReferenceBeamKnocked {
        axis: 2,
        by_um: 100.0,
    };
    check_fault(knocked, 13, |before, during| {
        let right = |v: [i16; 8]| i32::from(v[0]) + i32::from(v[3]);
        (right(during) - right(before) - 6_400).abs() < 500
    });
    // A fifth of the light 500 µm beside, where 84 % of it are on the one side: a hundredth of the sum and more.
    let reflected = Fault::ReferenceBeamReflected {
        axis: 2,
        at: crate::plant::BeamPlace::End,
        by_um: [500.0, 0.0],
        share: 0.2,
    };
    check_fault(reflected, 13, |before, during| {
        let right = |v: [i16; 8]| i32::from(v[4]) + i32::from(v[7]);
        let left = |v: [i16; 8]| i32::from(v[5]) + i32::from(v[6]);
        let own = (during[0] - before[0]).abs() < 100;
        own && right(during) - right(before) > 2 * (left(during) - left(before))
    });
    check_fault(Fault::InputStuck { channel: 8 }, 12, |_, _| true);
    check_fault(Fault::InputOpen { channel: 27 }, 14, |_, during| {
        during[3] == i16::MIN
    });
    // Hundredths of degrees.
    let shifted = Fault::InputShifted {
        channel: 27,
        by: 3.0,
    };
    check_fault(shifted, 14, |before, during| {
        (during[3] - before[3] - 300).abs() < 5
    });
}

#[test]
fn a_module_that_repeats_itself_says_the_same_for_ever() {
    let mut master = Master::new(5);
    let stale = Fault::StaleData {
        node: "beams_x".into(),
    };
    let id = master
        .machine
        .inject(FaultConfig::permanent(stale))
        .unwrap();
    let first = master.next_module(11);
    for _ in 0..20 {
        assert_eq!(master.next_module(11), first, "noise stands still");
    }
    assert_eq!(
        master.machine.fault_deliveries(id),
        40,
        "two PDOs each time"
    );
    master.machine.end_fault(id);
    assert_ne!(master.next_module(11), first);
}

/// What a stuck channel shows while the others tremble on.
#[test]
fn a_stuck_channel_stands_still_alone() {
    let mut master = Master::new(6);
    let stuck = FaultConfig::permanent(Fault::InputStuck { channel: 1 });
    let id = master.machine.inject(stuck).unwrap();
    let samples: Vec<[i16; 8]> = (0..20).map(|_| master.next_module(11)).collect();
    let varies = |place: usize| samples.iter().any(|it| it[place] != samples[0][place]);
    let still: Vec<usize> = (0..8).filter(|place| !varies(*place)).collect();
    assert_eq!(still, [1]);
    assert_eq!(master.machine.fault_deliveries(id), 1);
}

/// What the laser says for a while.
fn listen(machine: &mut Simulation, span: Duration) -> Vec<Sample> {
    let (until, mut text) = (machine.now() + span, String::new());
    while let Some(delivery) = machine.advance_to_delivery(until) {
        if let (LASER, Event::Payload(Payload::Bytes(bytes))) = (delivery.port, delivery.event) {
            text += core::str::from_utf8(&bytes).unwrap();
        }
    }
    let lines = text.lines().map(|line| Line::parse(line).unwrap());
    lines
        .filter_map(|line| match line {
            Line::Sample(sample) => Some(sample),
            Line::Debug => None,
        })
        .collect()
}

#[test]
fn a_laser_speaks_from_when_a_line_is_set_up_until_it_is_taken_away() {
    let mut machine = Simulation::new(&config(), 1).unwrap();
    let second = Duration::from_secs(1);
    assert_eq!(listen(&mut machine, second), [], "it is in its case");
    let set_up = LineSetUp {
        optics: LineOptics::Linear,
        along: [0.0, 1.0, 0.0],
        tool_offset: [Metres::ZERO; 3],
    };
    machine.set_up_line(&set_up);
    let samples = listen(&mut machine, second);
    // It boots while hands are in the beam.
    let lit = samples.iter().filter(|it| it.measurement_count > 0);
    assert!((400..500).contains(&lit.count()), "{}", samples.len());
    assert!(samples[0].measurement_count == 0 && samples[400].phase_is_valid());
    // Another line: it stays on and loses the beam for a while, and its count with it.
    machine.set_up_line(&set_up);
    let samples = listen(&mut machine, second);
    assert!((600..620).contains(&samples.len()), "{}", samples.len());
    let dark = samples.iter().filter(|it| it.measurement_count == 0);
    assert!((175..190).contains(&dark.count()));
    machine.power_cycle(HallDrift::default());
    let still_there = listen(&mut machine, second).len();
    assert!(
        (600..620).contains(&still_there),
        "{still_there}: own mains"
    );
    machine.take_line_away();
    assert_eq!(listen(&mut machine, second), []);
    machine.power_cycle(HallDrift::default());
    assert_eq!(listen(&mut machine, second), [], "nobody has set it up");
}
