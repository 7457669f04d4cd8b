//! The linear machine as its configuration file describes it, driven by bare frames.

use super::*;
use crate::fault::Fault;
use crate::plant::HallDrift;
use core::time::Duration;
use wire::can::CanFrame;

const CAN: Port = Port(0);

fn machine(seed: u64) -> Simulation {
    let text = include_str!("../../../configs/emulated/linear.toml");
    Simulation::new(&MachineConfig::parse(text).unwrap(), seed).unwrap()
}

/// A client that knows just enough CANopen to move a drive.
struct Client {
    machine: Simulation,
    heard: Vec<CanFrame>,
}

impl Client {
    fn new(seed: u64) -> Self {
        let mut client = Self {
            machine: machine(seed),
            heard: Vec::new(),
        };
        client.wait(300);
        client
    }

    fn wait(&mut self, ms: u64) {
        let until = self.machine.now() + Duration::from_millis(ms);
        while let Some(delivery) = self.machine.advance_to_delivery(until) {
            if let Event::Payload(Payload::Frame(frame)) = delivery.event {
                self.heard.push(frame);
            }
        }
    }

    fn say(&mut self, id: u16, data: &[u8]) {
        let frame = Payload::Frame(CanFrame::standard(id, data));
        self.machine
            .deliver(self.machine.now(), CAN, &frame)
            .unwrap();
    }

    /// The answer's four data bytes.
    fn sdo(&mut self, request: [u8; 8]) -> u32 {
        self.say(0x601, &request);
        self.heard.clear();
        self.wait(5);
        let answer = self
            .heard
            .iter()
            .find(|frame| frame.standard_id() == Some(0x581));
        let data = answer.expect("the drive answers").data();
        assert_ne!(data[0], 0x80, "abort of {request:02X?}: {data:02X?}");
        u32::from_le_bytes([data[4], data[5], data[6], data[7]])
    }

    fn write(&mut self, index: u16, bytes: u8, value: u32) {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - bytes) << 2;
        self.sdo([command, low, high, 0, a, b, c, d]);
    }

    fn read(&mut self, index: u16) -> u32 {
        let [low, high] = index.to_le_bytes();
        self.sdo([0x40, low, high, 0, 0, 0, 0, 0])
    }

    fn enable(&mut self) {
        self.say(0x000, &[1, 0]);
        self.write(0x6060, 1, 1);
        for controlword in [0x06, 0x07, 0x0F] {
            self.write(0x6040, 2, controlword);
            self.wait(10);
        }
        assert_eq!(self.read(0x6041) & 0x6F, 0x27);
    }

    fn go(&mut self, counts: i32, ms: u64) {
        self.write(0x607A, 4, counts as u32);
        self.write(0x6040, 2, 0x1F);
        self.wait(5);
        self.write(0x6040, 2, 0x0F);
        self.wait(ms);
    }
}

#[test]
fn the_file_says_what_the_defaults_are() {
    let machine = machine(1);
    assert_eq!(
        machine.config().plant,
        crate::plant::config::PlantConfig::default()
    );
}

#[test]
fn the_files_example_of_faults_is_right() {
    let text = include_str!("../../../configs/emulated/linear.toml");
    let (_, example) = text.split_once("#   [[faults]]").unwrap();
    let example = format!("[[faults]]{}", example.replace("#  ", ""));
    let whole = format!("{text}\n{}", example.replace('#', ""));
    let config = MachineConfig::parse(&whole).unwrap();
    assert_eq!(config.faults.len(), 2);
}

#[test]
fn a_drive_that_is_enabled_moves_the_stage_to_its_target() {
    let mut client = Client::new(1);
    let from = client.machine.truth().position();
    client.enable();
    client.go(1_000_000, 2000);
    let at = client.read(0x6064) as i32;
    assert!((at - 1_000_000).abs() <= 2, "{at}");
    let moved = client.machine.truth().position() - from;
    assert!((moved.mm() - 10.0).abs() < 0.02, "{moved}");
    assert_eq!(client.read(0x6041) & 0x0400, 0x0400, "target reached");
}

#[test]
fn the_hall_adc_shows_what_the_plant_feels() {
    let mut client = Client::new(1);
    client.say(0x000, &[1, 0]);
    client.say(0x602, &[0x40, 0x01, 0x64, 1, 0, 0, 0, 0]);
    client.wait(5);
    let answer = client
        .heard
        .iter()
        .find(|frame| frame.standard_id() == Some(0x582));
    let data = answer.expect("the module answers").data();
    assert_eq!(data[0], 0x4B, "{data:02X?}");
    let volts = f64::from(i16::from_le_bytes([data[4], data[5]])) * 5.0 / 32768.0;
    assert!(volts.abs() > 0.05 && volts.abs() < 2.0, "{volts}");
}

#[test]
fn a_blocked_stage_is_a_following_error() {
    let mut client = Client::new(2);
    client.enable();
    client
        .machine
        .inject(FaultConfig::permanent(Fault::BlockedAxis { axis: 0 }))
        .unwrap();
    client.go(1_000_000, 500);
    let status = client.read(0x6041);
    assert_eq!(status & 0x4F, 0x08, "{status:04X}");
    assert_eq!(client.read(0x603F), 0x8611);
}

#[test]
fn an_open_sto_circuit_faults_the_drive_and_lets_the_stage_coast() {
    let mut client = Client::new(3);
    client.enable();
    client.go(2_000_000, 300);
    client
        .machine
        .inject(FaultConfig::permanent(Fault::SafeTorqueOff))
        .unwrap();
    client.wait(300);
    assert_eq!(client.read(0x603F), 0xFF01);
    let before = client.machine.truth().scale_position();
    client.wait(100);
    assert_eq!(client.machine.truth().scale_position(), before);
}

#[test]
fn a_power_cycle_loses_the_encoders_origin() {
    let mut client = Client::new(4);
    client.enable();
    client.go(500_000, 1500);
    client.machine.power_cycle(HallDrift::default());
    client.wait(1000);
    assert!((client.read(0x6064) as i32).abs() <= 1);
    let truth = client.machine.truth();
    assert!(
        truth.count_zero().mm().abs() > 3.0,
        "{}",
        truth.count_zero()
    );
}

#[test]
fn the_whole_machine_repeats_bit_by_bit() {
    let run = |seed| {
        let mut client = Client::new(seed);
        client.enable();
        client.go(300_000, 1000);
        client.machine.power_cycle(HallDrift::default());
        client.wait(1000);
        client.machine.log_hash()
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn a_devices_own_faults_can_be_reached() {
    use crate::node::cia402_drive::Cia402DriveNode;
    let mut machine = machine(1);
    assert!(machine.node_mut::<Cia402DriveNode>("drive").is_some());
    assert!(machine.node_mut::<Cia402DriveNode>("hall_adc").is_none());
}

/// What a commissioning asks of the emulator: 150 s with SYNC every 5 ms, PDOs, and the
/// interferometer's stream, while the stage moves. It asserts the work, not its duration;
/// `--nocapture` prints that.
#[test]
fn a_commissioning_of_minutes_passes_in_virtual_time() {
    let mut client = Client::new(1);
    client.enable();
    let started = std::time::Instant::now();
    let begin = client.machine.now();
    let mut arrived = 0;
    for tick in 1..=30_000_u64 {
        let now = begin + Duration::from_millis(5) * tick as u32;
        while client.machine.advance_to_delivery(now).is_some() {
            arrived += 1;
        }
        client.say(0x080, &[]);
        if tick % 400 == 1 {
            let target = if tick % 800 == 1 { 3_000_000 } else { 0 };
            client.go(target, 0);
        }
    }
    println!("{arrived} deliveries of 150 s in {:?}", started.elapsed());
    assert!(arrived > 15_000, "{arrived}");
}
