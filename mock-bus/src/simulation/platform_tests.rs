//! The platform as its configuration file describes it, driven by bare frames and lines.

use super::*;
use crate::fault::Fault;
use crate::node::in_sight_controller::InSightControllerNode;
use crate::plant::HallDrift;
use crate::plant::PlatformTruth;
use core::time::Duration;
use units::Metres;
use wire::can::CanFrame;
use wire::in_sight::Inspection;

const CAN: Port = Port(0);
const VISION: Port = Port(1);

fn text() -> &'static str {
    include_str!("../../../configs/emulated/uvw.toml")
}

/// A client that knows just enough to move the drives and to look.
struct Client {
    machine: Simulation,
    heard: Vec<CanFrame>,
    said: String,
}

impl Client {
    fn new(seed: u64) -> Self {
        let config = MachineConfig::parse(text()).unwrap();
        let mut client = Self {
            machine: Simulation::new(&config, seed).unwrap(),
            heard: Vec::new(),
            said: String::new(),
        };
        client.wait(2000);
        client
    }

    fn truth(&self) -> PlatformTruth<'_> {
        self.machine.truth().platform().expect("it is a platform")
    }

    fn wait(&mut self, ms: u64) {
        let until = self.machine.now() + Duration::from_millis(ms);
        while let Some(delivery) = self.machine.advance_to_delivery(until) {
            match delivery.event {
                Event::Payload(Payload::Frame(frame)) => self.heard.push(frame),
                Event::Payload(Payload::Bytes(bytes)) => {
                    self.said.push_str(core::str::from_utf8(&bytes).unwrap());
                }
                Event::Payload(Payload::Control(_)) | Event::BusError(_) | Event::Link(_) => {}
            }
        }
    }

    fn say(&mut self, id: u16, data: &[u8]) {
        let frame = Payload::Frame(CanFrame::standard(id, data));
        let now = self.machine.now();
        self.machine.deliver(now, CAN, &frame).unwrap();
    }

    fn sdo(&mut self, node: u16, request: [u8; 8]) -> u32 {
        self.say(0x600 + node, &request);
        self.heard.clear();
        self.wait(5);
        let id = Some(0x580 + node);
        let answer = self.heard.iter().find(|frame| frame.standard_id() == id);
        let data = answer.expect("the drive answers").data();
        assert_ne!(data[0], 0x80, "abort of {request:02X?}: {data:02X?}");
        u32::from_le_bytes([data[4], data[5], data[6], data[7]])
    }

    fn write(&mut self, node: u16, index: u16, bytes: u8, value: u32) {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - bytes) << 2;
        self.sdo(node, [command, low, high, 0, a, b, c, d]);
    }

    fn read(&mut self, node: u16, index: u16) -> u32 {
        let [low, high] = index.to_le_bytes();
        self.sdo(node, [0x40, low, high, 0, 0, 0, 0, 0])
    }

    fn enable(&mut self) {
        self.say(0x000, &[1, 0]);
        for node in 1..=3 {
            self.write(node, 0x6060, 1, 1);
            for controlword in [0x06, 0x07, 0x0F] {
                self.write(node, 0x6040, 2, controlword);
                self.wait(10);
            }
            assert_eq!(self.read(node, 0x6041) & 0x6F, 0x27);
        }
    }

    /// Homes every screw on the first index pulse off its negative switch, which is at -4 mm.
    fn home(&mut self) {
        for node in 1..=3 {
            self.write(node, 0x6060, 1, 6);
            self.write(node, 0x6098, 1, 1);
            self.write(node, 0x607C, 4, -400_000_i32 as u32);
            self.wait(10);
            self.write(node, 0x6040, 2, 0x1F);
        }
        let mut left = 100;
        while (1..=3).any(|node| self.read(node, 0x6041) & 0x3400 != 0x1400) {
            self.wait(100);
            left -= 1;
            assert!(left > 0, "homing never ends");
        }
        for node in 1..=3 {
            self.write(node, 0x6040, 2, 0x0F);
            self.write(node, 0x6060, 1, 1);
            self.wait(10);
        }
    }

    fn go(&mut self, counts: [i32; 3]) {
        for (node, counts) in (1..).zip(counts) {
            self.write(node, 0x607A, 4, counts as u32);
            self.write(node, 0x6040, 2, 0x1F);
        }
        self.wait(5);
        for node in 1..=3 {
            self.write(node, 0x6040, 2, 0x0F);
        }
        self.wait(1500);
    }

    fn ask(&mut self, line: &str) -> String {
        self.said.clear();
        let bytes = Payload::Bytes(format!("{line}\r").into_bytes());
        let now = self.machine.now();
        self.machine.deliver(now, VISION, &bytes).unwrap();
        self.wait(100);
        core::mem::take(&mut self.said).replace('\r', "|")
    }

    fn look(&mut self) -> Inspection {
        assert_eq!(self.ask("SW8"), "1|");
        let said = self.ask("GVC7");
        let text = said.strip_prefix("1|").unwrap().trim_end_matches('|');
        Inspection::parse(text).unwrap_or_else(|error| panic!("{said}: {error}"))
    }
}

#[test]
fn the_file_says_what_the_defaults_are() {
    use crate::plant::config::PlantConfig;
    use crate::plant::platform::config::PlatformConfig;
    let plant = PlantConfig {
        platform: Some(PlatformConfig::default()),
        ..PlantConfig::default()
    };
    assert_eq!(MachineConfig::parse(text()).unwrap().plant, plant);
}

#[test]
fn the_files_example_of_faults_is_right() {
    let (_, example) = text().split_once("#   [[faults]]").unwrap();
    let example = format!("[[faults]]{}", example.replace("#  ", ""));
    let whole = format!("{}\n{}", text(), example.replace('#', ""));
    let config = MachineConfig::parse(&whole).unwrap();
    assert_eq!(config.faults.len(), 2);
    assert_eq!(config.faults[0].fault, Fault::BlockedAxis { axis: 1 });
}

#[test]
fn a_platform_that_is_held_by_nothing_is_refused() {
    let across = "direction = [0.0, 1.0]";
    assert!(text().contains(across));
    let text = text().replace(across, "direction = [1.0, 0.0]");
    let error = MachineConfig::parse(&text).unwrap_err().to_string();
    assert!(error.contains("actuators"), "{error}");
}

#[test]
fn homed_on_their_index_pulses_the_screws_agree_with_their_counts() {
    for seed in 0..3 {
        let mut client = Client::new(seed);
        client.enable();
        client.home();
        client.go([100_000, -50_000, 25_000]);
        for (screw, wanted_mm) in [1.0, -0.5, 0.25].into_iter().enumerate() {
            let off = client.truth().screw_position(screw) - Metres::from_mm(wanted_mm);
            assert!(off.abs().nm() < 150.0, "seed {seed}: {} nm", off.nm());
        }
        let pose = client.truth().pose();
        // U is 80 mm above the middle: pushed forward it turns the platform clockwise.
        let angle: f64 = -1.5 / 160.0;
        // Points 80 mm from the middle come back by what the turn shortens them.
        let middle_um = 250.0 - 80e3 * (1.0 - angle.cos());
        assert!((pose.x.um() - middle_um).abs() < 5.0, "{pose:?}");
        assert!((pose.y.um() - middle_um).abs() < 5.0, "{pose:?}");
        assert!((pose.angle.value() - angle).abs() < 60e-6, "{pose:?}");
    }
}

/// A drive's trapezoid must not overrun its goal by so much that the nut's flank comes off.
#[test]
fn profile_moves_end_engaged_the_way_they_went() {
    let mut client = Client::new(4);
    client.enable();
    client.home();
    for (counts, sign) in [(50_000, 1.0), (-50_000, -1.0), (0, 1.0), (-10_000, -1.0)] {
        client.go([counts; 3]);
        for screw in 0..3 {
            let truth = client.truth();
            let full = truth.lost_motion(screw).value() / 2.0;
            let off = truth.engagement(screw).value() + sign * full;
            assert!(off.abs() < 80e-9, "{counts}: {} nm off", off * 1e9);
        }
    }
}

#[test]
fn the_image_controller_sees_what_the_drives_did() {
    let mut client = Client::new(5);
    client.enable();
    client.home();
    for counts in [[50_000; 3], [-20_000, 20_000, 0]] {
        client.go(counts);
        let seen = client.look();
        assert!(seen.judged_ok, "{seen:?}");
        let pose = client.truth().pose();
        assert!((seen.x - pose.x.um()).abs() < 0.6, "{seen:?} {pose:?}");
        assert!((seen.y - pose.y.um()).abs() < 0.6, "{seen:?} {pose:?}");
        assert!((seen.angle - pose.angle.arcsec()).abs() < 2.0, "{seen:?}");
    }
}

#[test]
fn a_blocked_screw_faults_its_own_drive() {
    let mut client = Client::new(6);
    client.enable();
    let blocked = FaultConfig::permanent(Fault::BlockedAxis { axis: 1 });
    let fault = client.machine.inject(blocked).unwrap();
    client.go([100_000; 3]);
    assert_eq!(client.machine.fault_deliveries(fault), 1);
    assert_eq!(client.read(2, 0x603F), 0x8611);
    assert_eq!(client.read(1, 0x6041) & 0x4F, 0x07);
    assert_eq!(client.read(3, 0x6041) & 0x4F, 0x07);
}

#[test]
fn targets_vanish_and_come_back_with_their_faults() {
    let mut client = Client::new(7);
    for fault in [Fault::TargetAbsent, Fault::TargetCovered] {
        let injected = client.machine.inject(FaultConfig::permanent(fault));
        let injected = injected.unwrap();
        assert!(!client.look().judged_ok);
        client.machine.end_fault(injected);
        assert!(client.look().judged_ok);
        assert_eq!(client.machine.fault_deliveries(injected), 1);
    }
}

#[test]
fn the_whole_platform_repeats_bit_by_bit() {
    let run = |seed| {
        let mut client = Client::new(seed);
        client.enable();
        client.home();
        client.go([30_000, 20_000, -10_000]);
        client.look();
        client.machine.power_cycle(HallDrift::default());
        client.wait(1000);
        client.look();
        let pose = client.truth().pose();
        (client.machine.log_hash(), pose.x.value().to_bits())
    };
    assert_eq!(run(8), run(8));
    assert_ne!(run(8), run(9));
}

#[test]
fn the_image_controllers_own_quirks_can_be_reached() {
    let mut client = Client::new(1);
    let node = client
        .machine
        .node_mut::<InSightControllerNode>("image_controller");
    node.expect("it is there").set_online(false);
    assert_eq!(client.ask("SW8"), "-2|");
    assert_eq!(client.ask("SO1"), "-5|");
}
