//! A rotary axis and its touch probe against a small fake table that wraps or counts on.

use core::time::Duration;
use units::{Approach, Radians, RadiansPerSecond, RadiansPerSecondSquared, Scale, Time};
use wire::canopen::NodeId;

use super::tests::state_units;
use super::*;
use crate::device::canopen_node::NodeSettings;
use crate::device::fake_node::FakeNode;
use crate::device::{
    Axis, AxisCommand, DriveCommand, LatchCommand, Latched, PositionLatch, Repeat, RotaryAxis,
    ServoDrive,
};

const SYNC_MS: u64 = 2;
/// 0.01 degrees.
const TURN: i64 = 36_000;
const LINE_COUNTS: i64 = 100;
const LINE: f64 = 1.0;

/// A table that goes straight to its target, a line every degree.
#[derive(Debug)]
struct FakeTable {
    node: FakeNode,
    state: u16,
    /// The table itself, which nothing wraps.
    at: i64,
    target: i64,
    counts_per_sync: i64,
    /// It goes at that speed, whatever 0x6081 says.
    ignores_speed: bool,
    acknowledged: bool,
    last_control: u16,
    homed: bool,
    /// So many SYNCs until its home is found.
    homing_samples: u8,
    /// The targets that were taken, as shown.
    taken: Vec<i64>,
    function: u16,
    edges: u16,
    /// The drive shows each new position by a toggling bit 6 of 0x60B9.
    toggles: bool,
    smudged: Vec<i64>,
}

impl FakeTable {
    fn new(at: i64) -> Self {
        let mut node = FakeNode::new(0x0002_0192);
        for (index, sub, len) in [
            (0x6040, 0, 2),
            (0x6041, 0, 2),
            (0x6060, 0, 1),
            (0x6061, 0, 1),
            (0x6064, 0, 4),
            (0x607A, 0, 4),
            (0x607B, 1, 4),
            (0x607B, 2, 4),
            (0x60F2, 0, 2),
            (0x60F4, 0, 4),
            (0x6065, 0, 4),
            (0x6066, 0, 2),
            (0x6067, 0, 4),
            (0x6068, 0, 2),
            (0x6081, 0, 4),
            (0x6083, 0, 4),
            (0x6084, 0, 4),
            (0x6007, 0, 2),
            (0x607C, 0, 4),
            (0x6098, 0, 1),
            (0x6099, 1, 4),
            (0x6099, 2, 4),
            (0x609A, 0, 4),
            (0x60B8, 0, 2),
            (0x60B9, 0, 2),
            (0x60BA, 0, 4),
            (0x60D5, 0, 2),
        ] {
            node.set(index, sub, &vec![0; len]);
        }
        state_units(&mut node);
        let mut table = Self {
            node,
            state: 0x40,
            at,
            target: at,
            counts_per_sync: 40,
            ignores_speed: false,
            acknowledged: false,
            last_control: 0,
            homed: false,
            homing_samples: 0,
            taken: Vec::new(),
            function: 0,
            edges: 0,
            toggles: false,
            smudged: Vec::new(),
        };
        table.publish();
        table
    }

    fn shown(&self, at: i64) -> i32 {
        match self.node.get(0x607B, 2) {
            0 => at as i32,
            last => at.rem_euclid(if last == TURN { TURN } else { last + 1 }) as i32,
        }
    }

    fn hear(&mut self, frame: &CanFrame) {
        if self.node.hear(frame) {
            let control = self.node.get(0x6040, 0) as u16;
            self.obey(control);
            self.last_control = control;
        }
    }

    fn obey(&mut self, control: u16) {
        let edge = control & !self.last_control & 0x10 != 0;
        self.state = match control & 0x0F {
            0x06 => 0x21,
            0x07 => 0x23,
            0x0F => 0x27,
            _ => 0x40,
        };
        let mode = self.node.get(0x6060, 0);
        self.acknowledged = control & 0x10 != 0;
        if self.state == 0x27 && mode == 6 && edge {
            (self.homing_samples, self.homed) = (3, false);
        } else if self.state == 0x27 && mode == 1 && edge {
            let raw = self.node.get(0x607A, 0);
            self.taken.push(raw);
            let turn = match self.node.get(0x607B, 2) {
                0 => 1 << 32,
                _ => TURN,
            };
            // The shortest way.
            self.target = self.at + (raw - self.at + turn / 2).rem_euclid(turn) - turn / 2;
        }
    }

    fn probe(&mut self, from: i64) {
        let function = self.node.get(0x60B8, 0) as u16;
        let armed = function & 1 != 0;
        if armed != (self.function & 1 != 0) {
            self.node.set(0x60B9, 0, &u16::from(armed).to_le_bytes());
        }
        self.function = function;
        let (low, high) = (from.min(self.at), from.max(self.at));
        let first = low.div_euclid(LINE_COUNTS) + 1;
        let mut passed: Vec<i64> = (first..=high.div_euclid(LINE_COUNTS)).collect();
        if self.at < from {
            passed.reverse();
        }
        for line in passed.into_iter().filter(|_| armed) {
            let status = self.node.get(0x60B9, 0) as u16;
            let once = function & 2 == 0 && status & 2 != 0;
            if once || self.smudged.contains(&line.rem_euclid(360)) {
                continue;
            }
            self.edges = self.edges.wrapping_add(1);
            let toggled = if self.toggles { status ^ 0x40 } else { status };
            self.node.set(0x60B9, 0, &(toggled | 2).to_le_bytes());
            let shown = self.shown(line * LINE_COUNTS);
            self.node.set(0x60BA, 0, &shown.to_le_bytes());
            if self.node.objects.contains_key(&(0x60D5, 0)) {
                self.node.set(0x60D5, 0, &self.edges.to_le_bytes());
            }
        }
    }

    fn sync(&mut self) {
        let from = self.at;
        let asked = self.node.get(0x6081, 0) * SYNC_MS as i64 / 1000;
        let step = match self.is_halted() {
            true => 0,
            // Before the first move: turned by hand.
            false if asked == 0 || self.ignores_speed => self.counts_per_sync,
            false => self.counts_per_sync.min(asked),
        };
        self.at += (self.target - self.at).clamp(-step, step);
        self.probe(from);
        self.homing_samples = self.homing_samples.saturating_sub(1);
        if self.homing_samples == 1 {
            let offset = self.node.get(0x607C, 0);
            (self.at, self.target, self.homed) = (offset, offset, true);
        }
        let mode = self.node.get(0x6060, 0) as i8;
        self.node.set(0x6061, 0, &mode.to_le_bytes());
        self.publish();
        self.node.sync();
    }

    fn is_halted(&self) -> bool {
        self.last_control & 0x100 != 0
    }

    fn publish(&mut self) {
        let shown = self.shown(self.at);
        self.node.set(0x6064, 0, &shown.to_le_bytes());
        let homing = self.node.get(0x6061, 0) == 6;
        let reached = self.at == self.target || self.is_halted();
        let status = self.state
            | 0x0210
            | u16::from(reached && self.homing_samples <= 1) << 10
            | u16::from(if homing {
                self.homed
            } else {
                self.acknowledged
            }) << 12;
        self.node.set(0x6041, 0, &status.to_le_bytes());
    }
}

struct Rig {
    drive: Cia402Drive<Radians>,
    fake: FakeTable,
    now: Time,
    alarms: Vec<Alarm>,
}

fn degrees(value: f64) -> Radians {
    Radians::from_degrees(value)
}

fn settings(range: PositionRange) -> Cia402Settings<Radians> {
    let node = NodeId::new(5).unwrap();
    let master = NodeId::new(0x7F).unwrap();
    let common = NodeSettings::new(node, master, Duration::from_millis(SYNC_MS));
    let turn = Turn {
        counts: TURN as u32,
        range,
    };
    let speed = RadiansPerSecond(degrees(400.0).value());
    let acceleration = RadiansPerSecondSquared(degrees(4000.0).value());
    let latch = LatchSettings {
        edge: Edge::Positive,
        source: None,
    };
    Cia402Settings {
        latch: Some(latch),
        jump_margin: degrees(5.0),
        position_window: degrees(0.01),
        ..Cia402Settings::rotary(common, turn, speed, acceleration).unwrap()
    }
}

fn to(target: f64, per_s: f64) -> AxisCommand<Radians> {
    AxisCommand::MoveTo {
        target: degrees(target),
        speed: RadiansPerSecond(degrees(per_s).value()),
        acceleration: RadiansPerSecondSquared(degrees(1000.0).value()),
    }
}

impl Rig {
    fn new(range: PositionRange, at: i64) -> Self {
        Self {
            drive: Cia402Drive::new(settings(range)),
            fake: FakeTable::new(at),
            now: Time::ZERO,
            alarms: Vec::new(),
        }
    }

    /// Started and enabled.
    fn enabled(range: PositionRange, at: i64) -> Self {
        Self::with(Self::new(range, at))
    }

    fn with(mut rig: Self) -> Self {
        rig.drive.start(rig.now);
        rig.outcome().unwrap();
        rig.does(DriveCommand::Enable).unwrap();
        rig.tick_ms(20);
        rig
    }

    fn exchange(&mut self) {
        loop {
            let mut quiet = true;
            while let Some(Payload::Frame(frame)) = self.drive.poll_transmit() {
                self.fake.hear(&frame);
                quiet = false;
            }
            while let Some(frame) = self.fake.node.sent.pop_front() {
                let input = Input::Payload(Payload::Frame(frame));
                self.drive.handle(self.now, &input);
                quiet = false;
            }
            if quiet {
                break;
            }
        }
        while let Some(alarm) = self.drive.poll_alarm() {
            self.alarms.push(alarm);
        }
    }

    fn tick_ms(&mut self, ms: u64) {
        for _ in 0..ms {
            self.exchange();
            self.now += Duration::from_millis(1);
            let now_ms = self.now.nanos() / 1_000_000;
            if now_ms.is_multiple_of(SYNC_MS) {
                self.fake.sync();
            }
            self.fake.node.beat(now_ms);
            self.exchange();
            if self.drive.poll_timeout() <= self.now {
                self.drive.handle_timeout(self.now);
            }
            self.exchange();
        }
    }

    fn outcome(&mut self) -> Result<(), DeviceError> {
        for _ in 0..200_000 {
            if let Some(outcome) = self.drive.poll_outcome() {
                return outcome;
            }
            self.tick_ms(1);
        }
        panic!("no outcome; {:?}", self.alarms)
    }

    fn does(&mut self, command: impl Into<AxisCommand<Radians>>) -> Result<(), DeviceError> {
        self.drive.command(self.now, command.into());
        self.outcome()
    }

    fn arms(&mut self, repeat: Repeat) -> Result<(), DeviceError> {
        let spacing = degrees(LINE);
        self.drive
            .latch(self.now, LatchCommand::Arm { repeat, spacing });
        self.outcome()
    }

    fn reads(&self) -> f64 {
        self.drive.reading().unwrap().position.degrees()
    }

    fn latched(&mut self) -> Vec<Latched<Radians>> {
        std::iter::from_fn(|| self.drive.poll_latched()).collect()
    }
}

#[track_caller]
fn check_near(seen: f64, expected: f64) {
    assert!((seen - expected).abs() < 1e-6, "{seen} for {expected}");
}

#[test]
fn a_drive_that_wraps_is_told_where_and_to_take_the_shortest_way() {
    let rig = Rig::enabled(PositionRange::ToLastCount, 0);
    assert_eq!(rig.fake.node.get(0x607B, 1), 0);
    assert_eq!(rig.fake.node.get(0x607B, 2), TURN - 1);
    assert_eq!(rig.fake.node.get(0x60F2, 0), 0xC0);
    let rig = Rig::enabled(PositionRange::ToFirstCount, 0);
    assert_eq!(rig.fake.node.get(0x607B, 2), TURN);
}

#[test]
fn a_drive_that_cannot_take_the_shortest_way_is_refused() {
    let mut rig = Rig::new(PositionRange::ToLastCount, 0);
    rig.fake.node.objects.remove(&(0x60F2, 0));
    rig.drive.start(rig.now);
    let error = rig.outcome().unwrap_err();
    let text = error.to_string();
    assert!(text.contains("0x60F2") || text.contains("60F2"), "{text}");
}

#[test]
fn a_drive_that_counts_on_needs_no_range() {
    let mut rig = Rig::new(PositionRange::CountsOn, 0);
    rig.fake.node.objects.remove(&(0x607B, 1));
    rig.fake.node.objects.remove(&(0x60F2, 0));
    rig.drive.start(rig.now);
    rig.outcome().unwrap();
}

#[test]
fn a_move_across_the_seam_reads_on_beyond_a_turn() {
    for range in [PositionRange::ToLastCount, PositionRange::ToFirstCount] {
        let mut rig = Rig::enabled(range, 35_000);
        rig.does(to(370.0, 100.0)).unwrap();
        check_near(rig.reads(), 370.0);
        assert_eq!(rig.fake.at, 37_000);
        assert_eq!(rig.fake.taken, [1_000]);
        rig.does(to(-10.0, 100.0)).unwrap();
        check_near(rig.reads(), -10.0);
        assert_eq!(rig.fake.at, -1_000);
        assert_eq!(rig.alarms, []);
    }
}

#[test]
fn several_turns_are_made_of_set_points_less_than_half_a_turn_ahead() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 0);
    rig.does(to(1234.5, 100.0)).unwrap();
    check_near(rig.reads(), 1234.5);
    assert_eq!(rig.fake.at, 123_450);
    assert!(rig.fake.taken.len() >= 9, "{:?}", rig.fake.taken);
    rig.does(to(-725.0, 100.0)).unwrap();
    assert_eq!(rig.fake.at, -72_500);
    assert_eq!(rig.alarms, []);
}

#[test]
fn a_register_that_is_full_goes_on_in_the_reading_and_refuses_what_lies_beyond_it() {
    let end = i64::from(i32::MAX);
    let mut rig = Rig::enabled(PositionRange::CountsOn, end - 500);
    let beyond = rig.reads() + 10.0;
    let error = rig.does(to(beyond, 100.0)).unwrap_err();
    assert!(
        matches!(error, DeviceError::OutOfRange { unit: "°", .. }),
        "{error}"
    );
    // It is switched off, and turned by hand.
    rig.does(DriveCommand::Disable).unwrap();
    rig.fake.target = end + 500;
    rig.tick_ms(200);
    rig.does(DriveCommand::Enable).unwrap();
    check_near(rig.reads(), beyond);
    assert!(rig.fake.shown(rig.fake.at) < 0);
    rig.does(to(beyond + 3.0, 100.0)).unwrap();
    assert_eq!(rig.fake.at, end + 800);
    assert_eq!(rig.alarms, []);
}

#[test]
fn the_last_position_is_reached_before_the_register_is_full_and_the_way_back_stays_open() {
    for scale_sign in [1.0, -1.0] {
        let end = i64::from(i32::MAX);
        let mut rig = Rig::new(PositionRange::CountsOn, end - 5_000);
        let mut reversed = settings(PositionRange::CountsOn);
        reversed.scale = Scale::new(reversed.scale.resolution() * scale_sign).unwrap();
        reversed.following_error = Some((degrees(2.0), Duration::from_millis(50)));
        rig.drive = Cia402Drive::new(reversed);
        let mut rig = Rig::with(rig);
        let (on, back) = match scale_sign > 0.0 {
            true => (Approach::Forward, Approach::Reverse),
            false => (Approach::Reverse, Approach::Forward),
        };
        let last = rig.drive.last_position(on).unwrap();
        rig.does(to(last.degrees(), 100.0)).unwrap();
        // As far as it may lag, and twice its window.
        assert_eq!(rig.fake.at, end - 203);
        // Pushed on a little: there is nowhere to go on to, and no way that leads back.
        rig.fake.target += 15;
        rig.tick_ms(100);
        let here = rig.drive.reading().unwrap().position;
        assert_eq!(rig.drive.last_position(on), Some(here));
        let other = rig.drive.last_position(back).unwrap();
        // No farther than 31 bits of counts: from the other end to this one are 32.
        assert!((other.degrees().abs() - 0.15).abs() < 1e-6, "{other}");
        rig.drive.command(rig.now, to(other.degrees(), 100.0));
        rig.tick_ms(1_000);
        assert!(rig.fake.at < end - 5_000, "{}", rig.fake.at);
        assert_eq!(rig.alarms, []);
    }
}

#[test]
fn a_drive_that_wraps_turns_on_and_on() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 0);
    for (way, sign) in [(Approach::Forward, 1), (Approach::Reverse, -1)] {
        let last = rig.drive.last_position(way).unwrap().degrees();
        assert!(last * sign as f64 > 360e9, "{last}");
        let from = rig.fake.at;
        rig.drive.command(rig.now, to(last, 300.0));
        rig.tick_ms(10_000);
        let turns = (rig.fake.at - from) / TURN * sign;
        assert!(turns >= 4, "{turns} turns");
        rig.does(DriveCommand::Halt).unwrap();
        assert_eq!(rig.alarms, []);
    }
}

#[test]
fn homing_on_the_index_asks_for_the_direction_and_begins_the_turns_anew() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 0);
    rig.does(to(800.0, 200.0)).unwrap();
    for (approach, method) in [(Approach::Reverse, 33), (Approach::Forward, 34)] {
        let home = AxisCommand::HomeNextIndex {
            position: degrees(370.0),
            speed: RadiansPerSecond(degrees(20.0).value()),
            approach,
        };
        rig.does(home).unwrap();
        assert_eq!(rig.fake.node.get(0x6098, 0), method);
        assert_eq!(rig.fake.node.get(0x607C, 0), 1_000);
        assert!(rig.drive.is_homed());
        check_near(rig.reads(), 370.0);
    }
}

/// Arms, turns once around, and gives what was latched.
fn sweep(rig: &mut Rig, from: f64, to_degrees: f64) -> Vec<Latched<Radians>> {
    rig.does(to(from, 100.0)).unwrap();
    rig.tick_ms(20);
    rig.arms(Repeat::Continuous).unwrap();
    rig.does(to(to_degrees, 100.0)).unwrap();
    rig.tick_ms(10);
    rig.latched()
}

#[test]
fn every_line_is_latched_once_in_both_directions_across_the_seam() {
    for (counted, toggles) in [(true, false), (false, true), (false, false)] {
        for range in [PositionRange::ToLastCount, PositionRange::CountsOn] {
            let mut rig = Rig::new(range, 0);
            rig.fake.toggles = toggles;
            rig.fake.edges = 65_500;
            rig.fake.node.set(0x60D5, 0, &65_500_u16.to_le_bytes());
            if !counted {
                rig.fake.node.objects.remove(&(0x60D5, 0));
            }
            let mut rig = Rig::with(rig);
            let lines = sweep(&mut rig, 100.5, 460.5);
            assert_eq!(lines.len(), 360);
            for (line, latched) in (101..).zip(&lines) {
                check_near(latched.position.degrees(), f64::from(line));
                assert_eq!(latched.missed, 0);
            }
            let lines = sweep(&mut rig, 460.5, 100.5);
            assert_eq!(lines.len(), 360);
            check_near(lines[0].position.degrees(), 460.0);
            check_near(lines[359].position.degrees(), 101.0);
            assert_eq!(rig.alarms, []);
        }
    }
}

#[test]
fn edges_that_were_overwritten_before_they_were_read_are_counted() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    // Two and a half lines in each period.
    (rig.fake.counts_per_sync, rig.fake.ignores_speed) = (250, true);
    rig.arms(Repeat::Continuous).unwrap();
    rig.does(to(10.5, 100.0)).unwrap();
    rig.tick_ms(10);
    let latched = rig.latched();
    let missed: u32 = latched.iter().map(|it| it.missed).sum();
    assert_eq!(latched.len() as u32 + missed, 10);
    assert!(missed > 0);
    assert!(
        rig.drive
            .counters()
            .contains(&("edges missed", missed.into()))
    );
}

#[test]
fn one_edge_only_where_one_was_asked_for() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    rig.arms(Repeat::Once).unwrap();
    rig.does(to(5.5, 100.0)).unwrap();
    rig.tick_ms(10);
    let latched = rig.latched();
    assert_eq!(latched.len(), 1);
    check_near(latched[0].position.degrees(), 1.0);
    assert!(!rig.drive.is_latching());
}

#[test]
fn a_move_too_fast_for_its_lines_is_refused_with_the_speed_that_fits() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    let limit = rig.drive.latch_speed_max(degrees(LINE));
    check_near(limit.value().to_degrees(), 250.0);
    rig.arms(Repeat::Continuous).unwrap();
    let error = rig.does(to(90.0, 300.0)).unwrap_err();
    let DeviceError::OutOfRange { value, limit, .. } = error else {
        panic!("{error}");
    };
    check_near(value, 300.0);
    check_near(limit, 250.0);
    assert!(rig.fake.taken.is_empty());
    rig.drive.latch(rig.now, LatchCommand::Disarm);
    rig.outcome().unwrap();
    rig.does(to(90.0, 300.0)).unwrap();
    assert_eq!(rig.latched(), []);
}

#[test]
fn a_probe_is_armed_on_an_axis_that_stands_and_does_nothing_else() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    rig.drive.command(rig.now, to(90.0, 100.0));
    rig.tick_ms(50);
    let refused = rig.arms(Repeat::Continuous);
    assert!(matches!(refused, Err(DeviceError::NotPossible { .. })));
    // The move goes on.
    rig.outcome().unwrap();
    check_near(rig.reads(), 90.0);
}

#[test]
fn a_probe_that_somebody_else_switches_off_is_an_alarm() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    rig.arms(Repeat::Continuous).unwrap();
    rig.fake.node.set(0x60B8, 0, &[0, 0]);
    rig.tick_ms(10);
    assert!(matches!(rig.alarms[..], [Alarm::LatchDisarmed { .. }]));
    assert!(!rig.drive.is_latching());
}

#[test]
fn a_smudged_line_leaves_a_gap_and_nothing_else() {
    let mut rig = Rig::enabled(PositionRange::ToLastCount, 50);
    rig.fake.smudged = vec![7];
    let lines = sweep(&mut rig, 0.5, 360.5);
    assert_eq!(lines.len(), 359);
    assert!(lines.iter().all(|it| it.missed == 0));
    let seventh = |it: &Latched<Radians>| (it.position.degrees() - 7.0).abs() < 0.5;
    assert!(!lines.iter().any(seventh));
}
