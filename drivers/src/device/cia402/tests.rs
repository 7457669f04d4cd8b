//! The drive driver against a small fake drive with the quirks of real ones.

use core::time::Duration;
use units::{Metres, MetresPerSecond, MetresPerSecondSquared, Scale, Time};
use wire::canopen::sdo::AbortCode;
use wire::canopen::{NodeId, Object};

use super::homing_place::HomingPlace;
use super::*;
use crate::device::canopen_node::{ExpectedIdentity, NodeSettings};
use crate::device::fake_node::FakeNode;
use crate::device::{Axis, AxisCommand, DriveCommand, ServoDrive};

pub(super) const SYNC_MS: u64 = 2;
const COUNT: Metres = Metres(10e-9);

/// A drive's behaviour over the fake node's objects; moves 200 µm per SYNC at most.
#[derive(Debug)]
pub(super) struct FakeDrive {
    pub(super) node: FakeNode,
    /// Statusword bits of the power state.
    state: u16,
    target: i64,
    moving: bool,
    acknowledged: bool,
    homed: bool,
    homing_samples: u32,
    last_control: u16,
    /// SYNCs until 0x6061 follows 0x6060.
    pub(super) mode_lag: u32,
    mode_countdown: u32,
    stays_in_quick_stop: bool,
    stuck: bool,
    /// SYNCs for which "target reached" stays set after a new target.
    reached_lag: u32,
    reached_countdown: u32,
    ignores_identical_target: bool,
    never_acknowledges: bool,
    homing_fails: bool,
    /// 0x607C is the way from home to zero, as CiA 402 has it.
    offset_leads_to_zero: bool,
    fault_remains: bool,
    fault_edges: u32,
    pub(super) following_error: bool,
    /// Further bits of the statusword.
    pub(super) also_says: u16,
    /// So many counts it goes on by itself from each frame to the next: nobody has stopped it.
    coasts: i64,
}

/// It counts in increments and seconds: its first motion need not be tried.
pub(super) fn state_units(node: &mut FakeNode) {
    node.set_u32(0x60A9, 0, 0x00B5_0300);
    node.set_u32(0x60AA, 0, 0x00B5_5700);
}

impl FakeDrive {
    fn new() -> Self {
        let mut node = FakeNode::new(0x0002_0192);
        for (index, sub, len) in [
            (0x6040, 0, 2),
            (0x6041, 0, 2),
            (0x6060, 0, 1),
            (0x6061, 0, 1),
            (0x6064, 0, 4),
            (0x607A, 0, 4),
            (0x60F4, 0, 4),
            (0x6067, 0, 4),
            (0x6068, 0, 2),
            (0x6065, 0, 4),
            (0x6066, 0, 2),
            (0x607D, 1, 4),
            (0x607D, 2, 4),
            (0x6081, 0, 4),
            (0x6083, 0, 4),
            (0x6084, 0, 4),
            (0x6085, 0, 4),
            (0x605A, 0, 2),
            (0x6007, 0, 2),
            (0x607C, 0, 4),
            (0x6098, 0, 1),
            (0x6099, 1, 4),
            (0x6099, 2, 4),
            (0x609A, 0, 4),
        ] {
            node.set(index, sub, &vec![0; len]);
        }
        node.set_u32(0x6502, 0, 0x21);
        state_units(&mut node);
        Self {
            node,
            state: 0x40,
            target: 0,
            moving: false,
            acknowledged: false,
            homed: false,
            homing_samples: 0,
            last_control: 0,
            mode_lag: 2,
            mode_countdown: 0,
            stays_in_quick_stop: false,
            stuck: false,
            reached_lag: 3,
            reached_countdown: 0,
            ignores_identical_target: false,
            never_acknowledges: false,
            homing_fails: false,
            offset_leads_to_zero: false,
            fault_remains: false,
            fault_edges: 0,
            following_error: false,
            also_says: 0,
            coasts: 0,
        }
    }

    fn coast(&mut self) {
        if self.coasts != 0 {
            self.set_position(self.position() + self.coasts);
        }
    }

    pub(super) fn position(&self) -> i64 {
        self.node.get(0x6064, 0)
    }

    pub(super) fn set_position(&mut self, counts: i64) {
        self.node.set(0x6064, 0, &(counts as i32).to_le_bytes());
    }

    fn hear(&mut self, frame: &CanFrame) {
        self.coast();
        if self.node.hear(frame) {
            let control = self.node.get(0x6040, 0) as u16;
            self.obey(control);
            self.last_control = control;
        }
    }

    fn obey(&mut self, control: u16) {
        let rises = |bit: u16| control & !self.last_control & (1 << bit) != 0;
        let (reset, edge) = (rises(7), rises(4));
        if self.state == 0x08 {
            if reset {
                self.fault_edges += 1;
                if !self.fault_remains {
                    self.state = 0x40;
                }
            }
            return;
        }
        if self.stuck {
            return;
        }
        let quick_stop = control & 0x06 == 0x02;
        self.state = match (self.state, control & 0x0F) {
            (_, word) if word & 0x02 == 0 => 0x40,
            (0x27, _) if quick_stop => 0x07,
            (0x07, 0x0F) if self.stays_in_quick_stop => 0x27,
            (0x07, _) => 0x07,
            (_, _) if quick_stop => 0x40,
            (_, 0x06) => 0x21,
            (0x21, 0x07) | (0x27, 0x07) => 0x23,
            (0x23, 0x0F) => 0x27,
            (state, _) => state,
        };
        if self.state != 0x27 {
            self.moving = false;
            return;
        }
        match self.node.get(0x6061, 0) {
            1 => self.obey_position(control, edge),
            6 if edge => {
                self.homing_samples = 4;
                self.homed = false;
            }
            _ => {}
        }
    }

    fn obey_position(&mut self, control: u16, edge: bool) {
        if control & 0x10 == 0 {
            self.acknowledged = false;
        } else if edge && !self.never_acknowledges {
            let target = self.node.get(0x607A, 0);
            let identical = target == self.target && !self.moving;
            if !(identical && self.ignores_identical_target) {
                self.target = target;
                self.moving = true;
                self.acknowledged = true;
                self.reached_countdown = self.reached_lag;
            }
        }
    }

    fn sync(&mut self) {
        self.coast();
        let mode = self.node.get(0x6060, 0);
        if mode != self.node.get(0x6061, 0) {
            self.mode_countdown += 1;
            if self.mode_countdown > self.mode_lag {
                self.mode_countdown = 0;
                self.homed = false;
                self.node.set(0x6061, 0, &(mode as i8).to_le_bytes());
            }
        }
        if self.state == 0x07 && !self.stays_in_quick_stop {
            self.state = 0x40;
        }
        let halted = self.last_control & 0x100 != 0;
        if self.moving && !halted {
            let step = (self.target - self.position()).clamp(-20_000, 20_000);
            let position = self.position() + step;
            self.set_position(position);
            self.moving = position != self.target;
        }
        self.run_homing();
        self.reached_countdown = self.reached_countdown.saturating_sub(1);
        let status = self.status(halted);
        self.node.set(0x6041, 0, &status.to_le_bytes());
        self.node.sync();
    }

    fn run_homing(&mut self) {
        if self.homing_samples == 0 {
            return;
        }
        self.homing_samples -= 1;
        if self.homing_samples == 0 && !self.homing_fails {
            self.homed = true;
            let offset = self.node.get(0x607C, 0);
            self.target = if self.offset_leads_to_zero {
                -offset
            } else {
                offset
            };
            self.set_position(self.target);
        }
    }

    fn status(&self, halted: bool) -> u16 {
        let mut status = self.state | 0x0210;
        if self.node.get(0x6061, 0) == 6 {
            let running = self.homing_samples > 0;
            status |= u16::from(!running) << 10 | u16::from(self.homed) << 12;
            let failed = self.homing_fails && !running && self.last_control & 0x10 != 0;
            status |= u16::from(failed) << 13;
        } else {
            let reached = !self.moving || halted || self.reached_countdown > 0;
            status |= u16::from(reached) << 10 | u16::from(self.acknowledged) << 12;
            status |= u16::from(self.following_error) << 13;
        }
        status | self.also_says
    }
}

pub(super) struct Rig {
    pub(super) drive: Cia402Drive,
    pub(super) fake: FakeDrive,
    pub(super) now: Time,
    /// Every frame the driver sent, as candump writes it.
    pub(super) sent: Vec<String>,
    pub(super) alarms: Vec<Alarm>,
}

pub(super) fn settings() -> Cia402Settings {
    let node = NodeId::new(5).unwrap();
    let master = NodeId::new(0x7F).unwrap();
    let common = NodeSettings::new(node, master, Duration::from_millis(SYNC_MS));
    Cia402Settings::new(
        common,
        Scale::new(COUNT).unwrap(),
        MetresPerSecond(0.5),
        MetresPerSecondSquared(10.0),
    )
}

impl Rig {
    fn new() -> Self {
        Self::with(settings())
    }

    pub(super) fn with(settings: Cia402Settings) -> Self {
        Self {
            drive: Cia402Drive::new(settings),
            fake: FakeDrive::new(),
            now: Time::ZERO,
            sent: Vec::new(),
            alarms: Vec::new(),
        }
    }

    fn hear(&mut self, frame: CanFrame) {
        self.drive
            .handle(self.now, &Input::Payload(Payload::Frame(frame)));
    }

    fn exchange(&mut self) {
        loop {
            let mut quiet = true;
            while let Some(Payload::Frame(frame)) = self.drive.poll_transmit() {
                self.sent.push(frame.to_string());
                self.fake.hear(&frame);
                quiet = false;
            }
            while let Some(frame) = self.fake.node.sent.pop_front() {
                self.hear(frame);
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

    /// One millisecond.
    pub(super) fn tick(&mut self) {
        self.exchange();
        self.now += Duration::from_millis(1);
        let ms = self.now.nanos() / 1_000_000;
        if ms.is_multiple_of(SYNC_MS) {
            self.fake.sync();
        }
        self.fake.node.beat(ms);
        self.exchange();
        if self.drive.poll_timeout() <= self.now {
            self.drive.handle_timeout(self.now);
        }
        self.exchange();
    }

    pub(super) fn passes_ms(&mut self, ms: u64) {
        (0..ms).for_each(|_| self.tick());
    }

    fn outcome(&mut self) -> Result<(), DeviceError> {
        for _ in 0..200_000 {
            if let Some(outcome) = self.drive.poll_outcome() {
                return outcome;
            }
            self.tick();
        }
        panic!("no outcome")
    }

    pub(super) fn start(&mut self) -> Result<(), DeviceError> {
        self.drive.start(self.now);
        self.outcome()
    }

    pub(super) fn does(&mut self, command: impl Into<AxisCommand>) -> Result<(), DeviceError> {
        self.drive.command(self.now, command.into());
        self.outcome()
    }

    #[track_caller]
    fn enabled() -> Self {
        let mut rig = Self::new();
        rig.start().unwrap();
        rig.does(DriveCommand::Enable).unwrap();
        rig
    }

    fn controlwords(&self) -> Vec<String> {
        let words = self.sent.iter().filter(|line| line.starts_with("205#"));
        let mut words: Vec<_> = words.map(|line| line[4..8].to_owned()).collect();
        words.dedup();
        words
    }
}

pub(super) fn move_to(um: f64) -> AxisCommand {
    AxisCommand::MoveTo {
        target: Metres::from_um(um),
        speed: MetresPerSecond(0.1),
        acceleration: MetresPerSecondSquared(1.0),
    }
}

fn home_here(um: f64) -> AxisCommand {
    let position = Metres::from_um(um);
    AxisCommand::HomeHere { position }
}

#[test]
fn a_start_identifies_configures_and_starts_the_drive() {
    let mut rig = Rig::new();
    assert_eq!(rig.start(), Ok(()));
    let identity = rig.drive.identity().unwrap();
    assert_eq!(identity.serial, 0xDD);
    assert_eq!(identity.name, "fake device");
    let node = &rig.fake.node;
    assert_eq!(node.get(0x1016, 1), 0x007F_0096);
    assert_eq!(node.get(0x1017, 0), 50);
    assert_eq!(node.get(0x6067, 0), 10);
    assert_eq!(node.get(0x6007, 0), 3);
    assert!(node.operational());
    assert_eq!(rig.drive.power_state(), Some(PowerState::SwitchOnDisabled));
    assert!(!rig.drive.is_homed());
    assert!(rig.alarms.is_empty(), "{:?}", rig.alarms);
}

#[test]
fn a_drive_that_somebody_left_in_motion_is_stopped_by_the_start() {
    // Enabled, or held under power by a quick stop.
    for state in [0x27, 0x07] {
        let mut rig = Rig::new();
        rig.fake.stays_in_quick_stop = true;
        (rig.fake.state, rig.fake.target, rig.fake.moving) = (state, 1_000_000, true);
        assert_eq!(rig.start(), Ok(()));
        assert_eq!(rig.fake.state, 0x40);
        assert_eq!(rig.drive.power_state(), Some(PowerState::SwitchOnDisabled));
        let counters = rig.drive.counters();
        assert!(counters.contains(&("found enabled, and stopped", 1)));
        // As good as one that was off.
        assert_eq!(rig.does(DriveCommand::Enable), Ok(()));
    }
}

#[test]
fn an_axis_that_gravity_pulls_is_never_let_go() {
    let mut rig = Rig::with(Cia402Settings {
        gravity: true,
        ..settings()
    });
    rig.fake.stays_in_quick_stop = true;
    rig.start().unwrap();
    rig.does(DriveCommand::Enable).unwrap();
    rig.sent.clear();
    assert_eq!(rig.does(DriveCommand::QuickStop), Ok(()));
    assert_eq!(rig.does(DriveCommand::Disable), Ok(()));
    assert_eq!(rig.fake.state, 0x07, "quick stop active");
    assert_eq!(rig.does(DriveCommand::Enable), Ok(()));
    assert_eq!(rig.fake.state, 0x27);
    let lets_go = |word: &String| word.starts_with("00") || word.starts_with("04");
    let words = rig.controlwords();
    assert!(!words.iter().any(lets_go), "{words:?}");
    // Out of operation enabled the drive closes its brake itself.
    assert_eq!(rig.does(DriveCommand::Disable), Ok(()));
    assert_eq!(rig.fake.state, 0x40);
}

/// CiA 301, 7.5.2.38: off, no mapping, map, count, type, on.
#[test]
fn a_pdo_is_remapped_in_the_standards_order() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    let about_tpdo_1 = |(index, _, _): &&(u16, u8, u64)| [0x1800, 0x1A00].contains(index);
    let written: Vec<_> = rig.fake.node.written.iter().filter(about_tpdo_1).collect();
    let expected = [
        (0x1800, 1, 0xC000_0185),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x6041_0010),
        (0x1A00, 2, 0x6064_0020),
        (0x1A00, 3, 0x6061_0008),
        (0x1A00, 0, 3),
        (0x1800, 2, 1),
        (0x1800, 3, 0),
        (0x1800, 1, 0x4000_0185),
    ];
    assert_eq!(written, expected.iter().collect::<Vec<_>>());
}

#[test]
fn a_drive_that_boots_late_is_waited_for() {
    let mut rig = Rig::new();
    rig.fake.node.nmt = None;
    rig.drive.start(rig.now);
    rig.passes_ms(3300);
    assert_eq!(rig.drive.poll_outcome(), None);
    rig.fake.node.boot();
    assert_eq!(rig.outcome(), Ok(()));
    assert!(rig.now < Time::from_seconds(5.0));
}

#[test]
fn a_drive_that_never_answers_is_named_after_the_boot_time_out() {
    let mut rig = Rig::new();
    rig.fake.node.nmt = None;
    let error = rig.start().unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5: waited 10s for boot-up or an answer to SDO, last saw nothing"
    );
}

#[test]
fn another_serial_number_is_refused_before_anything_is_written() {
    let mut settings = settings();
    settings.common.expected = ExpectedIdentity {
        vendor: Some(0xAA),
        serial: Some(0xEE),
        ..ExpectedIdentity::default()
    };
    let mut rig = Rig::with(settings);
    let error = rig.start().unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::WrongIdentity {
                what: "serial number",
                expected: 0xEE,
                seen: 0xDD,
                ..
            }
        ),
        "{error}"
    );
    assert!(rig.fake.node.written.is_empty());
}

#[test]
fn an_io_module_is_not_taken_for_a_drive() {
    let mut rig = Rig::new();
    rig.fake.node.set_u32(0x1000, 0, 0x0008_0191);
    let error = rig.start().unwrap_err();
    assert!(matches!(
        error,
        DeviceError::WrongIdentity {
            what: "device profile",
            seen: 0x191,
            ..
        }
    ));
}

#[test]
fn a_drive_without_homing_is_refused() {
    let mut rig = Rig::new();
    rig.fake.node.set_u32(0x6502, 0, 0x01);
    assert!(matches!(
        rig.start(),
        Err(DeviceError::WrongIdentity { .. })
    ));
}

#[test]
fn factors_that_contradict_the_scale_are_refused() {
    let mut rig = Rig::new();
    for (index, above) in [(0x608F, 1_000_000), (0x6092, 2_000_000)] {
        rig.fake.node.set_u32(index, 1, above);
        rig.fake.node.set_u32(index, 2, 1);
    }
    let error = rig.start().unwrap_err();
    assert!(
        matches!(error, DeviceError::WrongScale { seen, .. } if seen == 2.0),
        "{error}"
    );
}

#[test]
fn factors_that_agree_with_the_scale_are_accepted() {
    let mut rig = Rig::new();
    for (index, above) in [(0x608F, 1_000_000), (0x6091, 2), (0x6092, 2_000_000)] {
        rig.fake.node.set_u32(index, 1, above);
        rig.fake.node.set_u32(index, 2, 1);
    }
    assert_eq!(rig.start(), Ok(()));
}

#[test]
fn a_mapping_that_is_not_what_was_written_is_refused() {
    let mut rig = Rig::new();
    rig.fake.node.manners.lies.push((0x1A00, 2));
    let error = rig.start().unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5, 0x1A00:02: read back 0x60640021, wrote 0x60640020 (mapping an object to a PDO)"
    );
}

#[test]
fn an_object_that_cannot_be_mapped_is_named() {
    let mut rig = Rig::new();
    let refusal = (0x1A00, 3, AbortCode::NotMappable.raw());
    rig.fake.node.manners.refuses.push(refusal);
    assert!(matches!(
        rig.start(),
        Err(DeviceError::SdoAbort { object, code: AbortCode::NotMappable, .. })
            if object == Object::new(0x1A00, 3)
    ));
}

#[test]
fn a_mapping_that_is_carried_out_wrong_is_found_by_comparing() {
    let mut rig = Rig::new();
    rig.fake.node.manners.exchanged_objects = true;
    let error = rig.start().unwrap_err();
    assert!(
        error
            .to_string()
            .contains("comparing process data with the object it carries"),
        "{error}"
    );
}

/// A controller that was killed leaves an axis in motion until the drive misses its heartbeat.
#[test]
fn an_axis_that_still_moves_is_compared_between_two_process_data() {
    for coasts in [-40_000, -300, 0, 300, 40_000] {
        let mut rig = Rig::new();
        rig.fake.coasts = coasts;
        assert_eq!(rig.start(), Ok(()), "{coasts} counts");
    }
}

#[test]
fn a_lost_request_is_survived_by_a_bounded_retry() {
    let mut rig = Rig::new();
    rig.fake.node.manners.deaf_requests = 1;
    assert_eq!(rig.start(), Ok(()));
}

#[test]
fn a_drive_that_does_not_become_operational_is_named() {
    let mut rig = Rig::new();
    rig.fake.node.manners.never_operational = true;
    let error = rig.start().unwrap_err();
    assert!(error.to_string().contains("operational"), "{error}");
    let starts = rig.sent.iter().filter(|line| *line == "000#0105").count();
    assert_eq!(starts, 3);
}

#[test]
fn a_start_without_sync_says_so() {
    let mut rig = Rig::new();
    rig.fake.node.manners.no_pdos = true;
    let error = rig.start().unwrap_err();
    assert!(error.to_string().contains("does SYNC run?"), "{error}");
}

#[test]
fn enabling_and_disabling_walk_the_power_states() {
    let mut rig = Rig::enabled();
    assert_eq!(rig.controlwords(), ["0600", "0700", "0F00"]);
    assert_eq!(rig.drive.power_state(), Some(PowerState::OperationEnabled));
    assert_eq!(rig.does(DriveCommand::Disable), Ok(()));
    assert_eq!(rig.fake.state, 0x40);
    rig.passes_ms(100);
    assert!(rig.alarms.is_empty(), "{:?}", rig.alarms);
}

#[test]
fn a_drive_that_stays_where_it_is_times_out_naming_the_states() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    rig.fake.stuck = true;
    let error = rig.does(DriveCommand::Enable).unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 5: waited 2.002s for the state ready to switch on, last saw statusword 0x0650: switch \
         on disabled; target reached"
    );
}

#[test]
fn a_move_shakes_hands_and_ends_at_the_target() {
    let mut rig = Rig::enabled();
    rig.sent.clear();
    assert_eq!(rig.does(move_to(1500.0)), Ok(()));
    assert_eq!(rig.fake.position(), 150_000);
    // The target is on its way before its edge.
    assert_eq!(rig.controlwords(), ["0F00", "3F00", "0F00"]);
    let reading = rig.drive.reading().unwrap();
    assert!(reading.standing);
    assert!((reading.position.um() - 1500.0).abs() < 1e-6);
    // The drive says so at once; that it is so takes some samples at the same place.
    rig.passes_ms(20);
    assert!(rig.drive.reading().unwrap().at_rest);
    // Speed and acceleration were read back before; a second move needs no SDO.
    rig.sent.clear();
    assert_eq!(rig.does(move_to(-1500.0)), Ok(()));
    assert!(rig.sent.iter().all(|line| line.starts_with("205#")));
}

fn prepare(um: f64) -> AxisCommand {
    AxisCommand::Prepare {
        target: Metres::from_um(um),
        speed: MetresPerSecond(0.1),
        acceleration: MetresPerSecondSquared(1.0),
    }
}

#[test]
fn a_prepared_move_lacks_only_its_edge_and_the_start_sends_that_alone() {
    let mut rig = Rig::enabled();
    rig.sent.clear();
    assert_eq!(rig.does(prepare(1500.0)), Ok(()));
    // The target is there, the set-point bit is not.
    assert_eq!(rig.sent.last().unwrap(), "205#0F00F0490200");
    assert_eq!(rig.controlwords(), ["0F00"]);
    assert_eq!((rig.fake.position(), rig.drive.started_at()), (0, None));
    rig.sent.clear();
    let told = rig.now;
    assert_eq!(rig.does(AxisCommand::Start), Ok(()));
    assert_eq!(rig.fake.position(), 150_000);
    assert_eq!(rig.controlwords(), ["3F00", "0F00"]);
    assert!(rig.sent.iter().all(|line| line.starts_with("205#")));
    let started = rig.drive.started_at().unwrap();
    assert!(started.since(told) <= rig.drive.settings().common.sync_period * 2);
}

#[track_caller]
fn check_nothing_prepared(rig: &mut Rig) {
    rig.sent.clear();
    let refused = rig.does(AxisCommand::Start);
    let is_refused = matches!(
        refused,
        Err(DeviceError::NotPossible {
            step: "starting",
            ..
        })
    );
    assert!(is_refused, "{refused:?}");
    assert!(!rig.controlwords().contains(&"3F00".to_owned()));
}

#[test]
fn a_start_with_nothing_prepared_is_refused() {
    let mut rig = Rig::enabled();
    check_nothing_prepared(&mut rig);
    rig.does(prepare(1500.0)).unwrap();
    rig.does(DriveCommand::Halt).unwrap();
    check_nothing_prepared(&mut rig);
    rig.does(prepare(1500.0)).unwrap();
    rig.does(AxisCommand::Start).unwrap();
    check_nothing_prepared(&mut rig);
}

#[test]
fn a_drive_of_a_group_takes_its_controlword_over_at_sync() {
    let rpdo_1 = |synchronous_start| {
        let mut rig = Rig::with(Cia402Settings {
            synchronous_start,
            ..settings()
        });
        rig.start().unwrap();
        rig.fake.node.get(0x1400, 2) as u8
    };
    assert_eq!(rpdo_1(false), 255);
    assert_eq!(rpdo_1(true), 1);
}

#[test]
fn target_reached_of_the_move_before_does_not_end_a_move() {
    let mut rig = Rig::enabled();
    rig.fake.reached_lag = 20;
    assert_eq!(rig.does(move_to(3000.0)), Ok(()));
    assert_eq!(rig.fake.position(), 300_000);
}

#[test]
fn a_move_to_where_it_stands_is_done_even_if_the_drive_ignores_it() {
    let mut rig = Rig::enabled();
    rig.fake.ignores_identical_target = true;
    assert_eq!(rig.does(move_to(0.0)), Ok(()));
    assert_eq!(rig.does(move_to(500.0)), Ok(()));
    rig.sent.clear();
    assert_eq!(rig.does(move_to(500.0)), Ok(()));
    assert!(rig.sent.is_empty());
}

#[test]
fn a_new_target_supersedes_a_move_under_way() {
    let mut rig = Rig::enabled();
    rig.drive.command(rig.now, move_to(20_000.0));
    rig.passes_ms(40);
    assert!(rig.fake.moving);
    assert_eq!(rig.does(move_to(-1000.0)), Ok(()));
    assert_eq!(rig.fake.position(), -100_000);
}

#[test]
fn a_set_point_that_is_not_acknowledged_times_out() {
    let mut rig = Rig::enabled();
    rig.fake.never_acknowledges = true;
    let error = rig.does(move_to(500.0)).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("the set-point to be acknowledged"),
        "{error}"
    );
}

#[test]
fn a_target_beyond_the_soft_limits_never_reaches_the_bus() {
    let mut settings = settings();
    settings.soft_limits = Some((Metres::from_mm(-30.0), Metres::from_mm(30.0)));
    let mut rig = Rig::with(settings);
    rig.start().unwrap();
    assert_eq!(rig.fake.node.get(0x607D, 1), -3_000_000);
    assert_eq!(rig.fake.node.get(0x607D, 2), 3_000_000);
    rig.does(DriveCommand::Enable).unwrap();
    rig.sent.clear();
    let error = rig.does(move_to(30_001.0)).unwrap_err();
    assert!(matches!(error, DeviceError::OutOfRange { .. }), "{error}");
    let error = rig.does(move_to(f64::NAN)).unwrap_err();
    assert!(matches!(error, DeviceError::OutOfRange { .. }), "{error}");
    assert!(rig.sent.is_empty());
}

#[test]
fn a_speed_beyond_the_axis_is_refused() {
    let mut rig = Rig::enabled();
    let too_fast = AxisCommand::MoveTo {
        target: Metres::ZERO,
        speed: MetresPerSecond(0.6),
        acceleration: MetresPerSecondSquared(1.0),
    };
    assert!(matches!(
        rig.does(too_fast),
        Err(DeviceError::OutOfRange { what: "speed", .. })
    ));
}

#[test]
fn a_disabled_drive_does_not_move() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    assert!(matches!(
        rig.does(move_to(5.0)),
        Err(DeviceError::NotPossible {
            needs: "an enabled drive",
            ..
        })
    ));
}

#[test]
fn a_halt_stops_on_the_way_and_the_next_move_goes_on() {
    let mut rig = Rig::enabled();
    rig.drive.command(rig.now, move_to(20_000.0));
    rig.passes_ms(60);
    assert_eq!(rig.does(DriveCommand::Halt), Ok(()));
    let halted = rig.fake.position();
    assert!(halted > 0 && halted < 2_000_000, "{halted}");
    rig.passes_ms(100);
    assert_eq!(rig.fake.position(), halted);
    assert_eq!(rig.does(move_to(0.0)), Ok(()));
    assert_eq!(rig.fake.position(), 0);
}

#[test]
fn homing_after_a_halt_does_not_resume_the_interrupted_move() {
    let mut rig = Rig::enabled();
    rig.drive.command(rig.now, move_to(20_000.0));
    rig.passes_ms(60);
    rig.does(DriveCommand::Halt).unwrap();
    rig.drive.command(rig.now, home_here(0.0));
    let halted = rig.fake.position();
    while rig.fake.node.get(0x6061, 0) != 6 {
        rig.tick();
        assert_eq!(rig.fake.position(), halted);
    }
    assert_eq!(rig.outcome(), Ok(()));
}

#[test]
fn a_move_that_supersedes_homing_waits_for_its_own_mode() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.does(move_to(100.0)).unwrap();
    for ms in 0..40 {
        rig.fake.mode_lag = 5;
        rig.drive.command(rig.now, home_here(0.0));
        rig.passes_ms(ms);
        assert_eq!(rig.does(move_to(300.0)), Ok(()), "after {ms} ms");
        assert_eq!(rig.fake.position(), 30_000);
        assert_eq!(rig.does(move_to(100.0)), Ok(()), "after {ms} ms");
    }
}

#[test]
fn a_superseded_moves_velocity_is_not_believed() {
    let mut rig = Rig::enabled();
    rig.does(move_to(100.0)).unwrap();
    let slow = AxisCommand::MoveTo {
        target: Metres::from_um(200.0),
        speed: MetresPerSecond(0.01),
        acceleration: MetresPerSecondSquared(1.0),
    };
    rig.drive.command(rig.now, slow);
    // The drive takes the new velocity; its answer is lost with the superseded move.
    let Some(Payload::Frame(frame)) = rig.drive.poll_transmit() else {
        panic!("nothing sent")
    };
    rig.fake.hear(&frame);
    rig.fake.node.sent.clear();
    assert_eq!(rig.fake.node.get(0x6081, 0), 1_000_000);
    assert_eq!(rig.does(move_to(300.0)), Ok(()));
    assert_eq!(rig.fake.node.get(0x6081, 0), 10_000_000);
}

#[test]
fn a_quick_stop_goes_out_at_once_while_an_sdo_is_pending() {
    let mut rig = Rig::enabled();
    rig.does(move_to(100.0)).unwrap();
    rig.fake.node.manners.deaf_requests = 1000;
    rig.drive.command(rig.now, home_here(0.0));
    rig.exchange();
    rig.sent.clear();
    rig.drive.control(rig.now, DriveCommand::QuickStop);
    let Some(Payload::Frame(frame)) = rig.drive.poll_transmit() else {
        panic!("nothing sent")
    };
    // Controlword 0x0002, and the target of before, which no edge takes over.
    assert_eq!(frame.to_string(), "205#020010270000");
    rig.fake.hear(&frame);
    assert_eq!(rig.outcome(), Ok(()));
    assert_eq!(rig.fake.state, 0x40);
}

#[test]
fn a_stop_is_not_confirmed_by_what_the_drive_said_before_it() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    rig.drive.control(rig.now, DriveCommand::QuickStop);
    // Sampled before it heard the command: "switch on disabled", and it was so.
    rig.fake.sync();
    rig.exchange();
    assert_eq!(rig.drive.poll_outcome(), None);
    rig.passes_ms(3 * SYNC_MS);
    assert_eq!(rig.drive.poll_outcome(), Some(Ok(())));
}

#[test]
fn a_drive_that_stays_in_quick_stop_is_disabled_when_it_stands() {
    let mut rig = Rig::enabled();
    rig.fake.stays_in_quick_stop = true;
    rig.drive.command(rig.now, move_to(20_000.0));
    rig.passes_ms(60);
    assert_eq!(rig.does(DriveCommand::QuickStop), Ok(()));
    assert_eq!(rig.fake.state, 0x40);
    assert!(
        rig.controlwords()
            .ends_with(&["0200".into(), "0000".into()])
    );
}

#[test]
fn a_quick_stop_is_sent_even_before_the_start() {
    let mut rig = Rig::new();
    rig.drive.control(rig.now, DriveCommand::QuickStop);
    rig.exchange();
    // And, as nobody knows whether it listens to PDOs, by SDO too.
    assert_eq!(rig.sent, ["205#020000000000", "605#2B40600002000000"]);
}

#[test]
fn homing_here_sets_the_coordinate_and_goes_back_to_profile_position() {
    let mut rig = Rig::enabled();
    rig.does(move_to(100.0)).unwrap();
    assert_eq!(rig.does(home_here(-25_000.0)), Ok(()));
    assert!(rig.drive.is_homed());
    let reading = rig.drive.reading().unwrap();
    assert!((reading.position.mm() + 25.0).abs() < 1e-9);
    assert_eq!(rig.fake.node.get(0x6098, 0), 37);
    assert_eq!(rig.drive.mode(), Some(OperationMode::ProfilePosition));
    assert!(rig.alarms.is_empty(), "{:?}", rig.alarms);
    assert_eq!(rig.does(move_to(-24_000.0)), Ok(()));
}

#[test]
fn a_second_homing_is_not_done_by_the_status_of_the_first() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.does(home_here(100.0)).unwrap();
    rig.does(home_here(200.0)).unwrap();
    assert_eq!(rig.fake.position(), 20_000);
}

#[test]
fn homing_on_the_limit_switch_sets_method_and_speeds() {
    let mut rig = Rig::enabled();
    let command = AxisCommand::HomeNegativeLimit {
        position: Metres::from_mm(-31.0),
        speed: MetresPerSecond(0.01),
    };
    assert_eq!(rig.does(command), Ok(()));
    let node = &rig.fake.node;
    assert_eq!(node.get(0x6098, 0), 17);
    assert_eq!(node.get(0x6099, 1), 1_000_000);
    assert_eq!(node.get(0x6099, 2), 200_000);
    assert_eq!(node.get(0x607C, 0), -3_100_000);
}

#[test]
fn homing_on_an_index_pulse_sets_its_method_and_counts_the_other_way_with_the_drive() {
    let command = AxisCommand::HomeIndex {
        position: Metres::from_mm(-4.0),
        speed: MetresPerSecond(0.005),
    };
    let mut rig = Rig::enabled();
    assert_eq!(rig.does(command), Ok(()));
    assert_eq!(rig.fake.node.get(0x6098, 0), 1);
    assert_eq!(rig.fake.node.get(0x6099, 1), 500_000);
    assert_eq!(rig.fake.node.get(0x607C, 0), -400_000);
    let place: HomingPlace<MetresPerSecond> = HomingPlace::Index(MetresPerSecond(0.005));
    assert_eq!(place.method(true), 2);
}

#[test]
fn mirrored_coordinates_after_a_search_are_noticed_before_anything_moves_by_them() {
    let mut rig = Rig::enabled();
    rig.fake.offset_leads_to_zero = true;
    let command = AxisCommand::HomeNegativeLimit {
        position: Metres::from_mm(-6.0),
        speed: MetresPerSecond(0.01),
    };
    let error = rig.does(command).unwrap_err();
    assert!(matches!(error, DeviceError::NotAtHome { .. }), "{error}");
    assert!(!rig.drive.is_homed());
}

#[test]
fn a_failed_homing_is_told_and_the_mode_restored() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.fake.homing_fails = true;
    let error = rig.does(home_here(0.0)).unwrap_err();
    assert!(
        matches!(error, DeviceError::DriveRefused { step: "homing", .. }),
        "{error}"
    );
    assert!(!rig.drive.is_homed());
    assert_eq!(rig.fake.node.get(0x6060, 0), 1);
}

#[test]
fn a_fault_is_reset_by_a_single_edge() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    rig.fake.state = 0x08;
    rig.passes_ms(10);
    assert!(matches!(
        rig.does(DriveCommand::Enable),
        Err(DeviceError::DriveRefused {
            state: PowerState::Fault,
            ..
        })
    ));
    assert_eq!(rig.does(DriveCommand::ResetFault), Ok(()));
    assert_eq!(rig.fake.fault_edges, 1);
    assert_eq!(rig.does(DriveCommand::Enable), Ok(()));
}

#[test]
fn a_fault_whose_cause_remains_is_not_reset_in_a_loop() {
    let mut rig = Rig::new();
    rig.start().unwrap();
    rig.fake.state = 0x08;
    rig.fake.fault_remains = true;
    rig.passes_ms(10);
    let error = rig.does(DriveCommand::ResetFault).unwrap_err();
    assert!(error.to_string().contains("0x0618: fault"), "{error}");
    assert_eq!(rig.fake.fault_edges, 1);
}

#[test]
fn a_lost_heartbeat_is_an_alarm_and_ends_a_move() {
    let mut rig = Rig::enabled();
    rig.drive.command(rig.now, move_to(50_000.0));
    rig.passes_ms(60);
    rig.fake.node.manners.no_heartbeat = true;
    let error = rig.outcome().unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::Alarmed {
                alarm: Alarm::HeartbeatLost { .. },
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(rig.alarms.len(), 1);
}

#[test]
fn missing_process_data_is_told_within_four_periods() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.fake.node.manners.no_pdos = true;
    rig.passes_ms(4 * SYNC_MS);
    assert!(
        matches!(rig.alarms[..], [Alarm::PdoLost { missed: 3, .. }]),
        "{:?}",
        rig.alarms
    );
    rig.passes_ms(100);
    assert_eq!(rig.alarms.len(), 1);
}

#[test]
fn a_boot_up_in_service_is_an_alarm_and_takes_the_reference() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.does(home_here(0.0)).unwrap();
    assert!(rig.drive.is_homed());
    rig.fake.state = 0x40;
    rig.fake.node.boot();
    rig.passes_ms(50);
    assert!(!rig.drive.is_homed());
    assert!(matches!(rig.alarms[0], Alarm::UnexpectedBootUp { .. }));
    // It can be started again.
    assert_eq!(rig.start(), Ok(()));
    assert_eq!(rig.does(DriveCommand::Enable), Ok(()));
}

#[test]
fn leaving_operational_is_an_alarm() {
    let mut rig = Rig::enabled();
    rig.fake.node.nmt = Some(0x04);
    rig.passes_ms(60);
    let stopped = rig.alarms.iter().any(|alarm| {
        matches!(
            alarm,
            Alarm::UnexpectedNmtState {
                state: wire::canopen::nmt::NmtState::Stopped,
                ..
            }
        )
    });
    assert!(stopped, "{:?}", rig.alarms);
}

#[test]
fn a_node_that_left_operational_is_not_believed_to_be_enabled() {
    let mut rig = Rig::enabled();
    rig.fake.node.nmt = Some(0x7F);
    rig.passes_ms(60);
    assert!(matches!(
        rig.does(DriveCommand::Enable),
        Err(DeviceError::NotPossible { .. })
    ));
    // It can still be stopped: it hears SDO.
    rig.drive.control(rig.now, DriveCommand::QuickStop);
    rig.exchange();
    assert_eq!(rig.fake.node.get(0x6040, 0), 0x0002);
}

#[test]
fn an_emergency_is_an_alarm_but_its_end_is_not() {
    let mut rig = Rig::enabled();
    rig.fake.node.emergency(0x8611);
    rig.tick();
    assert!(matches!(rig.alarms[..], [Alarm::Emergency { .. }]));
    rig.fake.node.emergency(0x0000);
    rig.tick();
    assert_eq!(rig.alarms.len(), 1);
}

#[test]
fn a_drive_that_disables_itself_is_an_alarm_and_ends_a_move() {
    let mut rig = Rig::enabled();
    rig.drive.command(rig.now, move_to(20_000.0));
    rig.passes_ms(60);
    rig.fake.state = 0x40;
    rig.fake.stuck = true;
    let error = rig.outcome().unwrap_err();
    assert!(
        matches!(
            error,
            DeviceError::Alarmed {
                alarm: Alarm::DriveState {
                    seen: PowerState::SwitchOnDisabled,
                    ..
                },
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_following_error_is_told_once() {
    let mut rig = Rig::enabled();
    rig.fake.following_error = true;
    rig.passes_ms(50);
    assert!(matches!(rig.alarms[..], [Alarm::FollowingError { .. }]));
}

#[test]
fn one_corrupted_position_is_not_believed() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    let before = rig.drive.reading().unwrap();
    rig.hear(CanFrame::standard(
        0x185,
        &[0x37, 0x06, 0, 0, 0, 0x40, 0x01],
    ));
    assert_eq!(rig.drive.reading().unwrap().counts, before.counts);
    rig.passes_ms(20);
    assert!(rig.alarms.is_empty(), "{:?}", rig.alarms);
    assert!(
        rig.drive
            .counters()
            .contains(&("positions not believed", 1))
    );
}

#[test]
fn a_position_that_stays_away_is_a_jump_and_takes_the_reference() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    rig.does(home_here(0.0)).unwrap();
    rig.fake.set_position(1_000_000);
    rig.passes_ms(10);
    assert!(matches!(rig.alarms[..], [Alarm::PositionJump { .. }]));
    assert!(!rig.drive.is_homed());
}

#[test]
fn a_short_pdo_is_an_alarm_and_no_reading() {
    let mut rig = Rig::enabled();
    rig.fake.node.manners.short_pdos = true;
    rig.passes_ms(10);
    let short = Alarm::PdoTooShort {
        node: NodeId::new(5).unwrap(),
        expected: 7,
        seen: 6,
    };
    assert_eq!(rig.alarms[0], short);
}

#[test]
fn frames_of_other_nodes_are_ignored() {
    let mut rig = Rig::enabled();
    rig.passes_ms(20);
    let before = rig.drive.reading();
    for (id, payload) in [
        (0x186_u16, &[0_u8; 7][..]),
        (0x706, &[0]),
        (0x086, &[0x11, 0x86, 0x20, 0, 0, 0, 0, 0]),
        (0x586, &[0x80, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        rig.hear(CanFrame::standard(id, payload));
    }
    assert_eq!(rig.drive.reading(), before);
    assert_eq!(rig.drive.poll_alarm(), None);
}

#[test]
fn a_negative_scale_turns_directions_and_limits() {
    let mut settings = settings();
    settings.scale = Scale::new(-COUNT).unwrap();
    settings.soft_limits = Some((Metres::from_mm(-10.0), Metres::from_mm(30.0)));
    let mut rig = Rig::with(settings);
    rig.start().unwrap();
    assert_eq!(rig.fake.node.get(0x607D, 1), -3_000_000);
    assert_eq!(rig.fake.node.get(0x607D, 2), 1_000_000);
    rig.does(DriveCommand::Enable).unwrap();
    assert_eq!(rig.does(move_to(200.0)), Ok(()));
    assert_eq!(rig.fake.position(), -20_000);
}
