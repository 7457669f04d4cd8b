//! An emulated CiA 401 module with analog inputs.
//!
//! Purpose: the ADC that reads the Hall sensors. Channels are sampled when they are asked
//! for: at the SYNC of a synchronous TPDO, by SDO, and, once 0x6423 enables it, at the
//! sampling period of the event-driven TPDO.
//!
//! Source: CiA 401 (V3), clause "analog inputs"; default PDOs and the disabled 0x6423 as in
//! SYSTEC's Chip F40. Absent: digital inputs and outputs, 0x6403 and other float inputs,
//! negative and positive deltas apart.
//!
//! | object | name |
//! |---|---|
//! | 0x6401 | reading = (raw + 0x6431) · 0x6432, an i16 that saturates; raw is left-justified |
//! | 0x6424, 0x6425, 0x6426 | upper limit, lower limit, delta of the event, in 0x6401's unit |

use serde::{Deserialize, Serialize};
use wire::canopen::pdo::MappedObject;
use wire::canopen::{Function, NodeId, Object};

use super::analog_module::{AnalogModule, Module, Profile, Wires};
use super::canopen_server::dictionary::{Access, Bounds, Dictionary, Entry, Kind, Mapping};
use super::canopen_server::{CanopenServer, Description, Identity, Manners, PdoDefault};
use super::cia402_drive::checked_node_id;
use super::{Node, Section};
use crate::config::error::ConfigError;
use crate::plant::config::PlantConfig;

/// CiA 401 with analog inputs.
const DEVICE_TYPE: u32 = 0x0004_0191;
/// Channels per TPDO: 8 bytes of i16.
const PER_PDO: usize = 4;

/// An emulated analog module; every key has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cia401AnalogConfig {
    /// CANopen node identifier, 1 to 127.
    #[serde(deserialize_with = "checked_node_id")]
    pub node_id: u8,
    /// 0x1018.
    pub identity: Identity,
    /// 0x1008.
    pub device_name: String,
    /// 0x1009.
    pub hardware_version: String,
    /// 0x100A.
    pub software_version: String,
    /// From power-on to the boot-up message.
    pub boot_delay_ms: u64,
    /// 0x1017 at power-on.
    pub heartbeat_ms: u16,
    /// Which of the plant's analog inputs each channel is wired to.
    pub plant_channels: Vec<usize>,
    /// What 32768 would read, per channel; a missing one is as the last.
    pub full_scale_v: Vec<f64>,
    /// Bits of the converter; the others are 0.
    pub resolution_bits: u8,
    /// How often the channels are sampled for the event-driven TPDO.
    pub sampling_period_ms: u64,
    /// How badly it behaves.
    pub manners: Manners,
}

impl Default for Cia401AnalogConfig {
    fn default() -> Self {
        Self {
            node_id: 2,
            identity: Identity {
                product_code: 0x0040_0001,
                ..Identity::default()
            },
            device_name: "truestage mock analog input".into(),
            hardware_version: "mock-bus 1".into(),
            software_version: concat!("mock-bus ", env!("CARGO_PKG_VERSION")).into(),
            boot_delay_ms: 50,
            heartbeat_ms: 0,
            plant_channels: vec![0, 1],
            full_scale_v: vec![10.0],
            resolution_bits: 16,
            sampling_period_ms: 10,
            manners: Manners::default(),
        }
    }
}

/// An emulated analog module on the bus.
pub type Cia401AnalogNode = AnalogModule<Cia401AnalogConfig>;

impl Profile for Cia401AnalogConfig {
    fn module(&self) -> Module<'_> {
        Module {
            node_id: self.node_id,
            boot_delay_ms: self.boot_delay_ms,
            sampling_period_ms: self.sampling_period_ms,
            inputs: self.plant_channels.len(),
            manners: &self.manners,
        }
    }

    fn description(&self, node: NodeId) -> Description {
        description(self, node)
    }

    fn dictionary(&self) -> Dictionary {
        dictionary(self)
    }

    fn sample(&self, server: &mut CanopenServer, wires: &mut dyn Wires) {
        for (place, wired) in self.plant_channels.iter().enumerate() {
            let volts = wires.volts(*wired);
            let raw = convert(volts, full_scale(self, place), self.resolution_bits);
            let sub = place as u8 + 1;
            let offset = server.get(0x6431, sub);
            let scaled = (raw + offset) * server.get(0x6432, sub);
            let reading = scaled.clamp(i64::from(i16::MIN), i64::from(i16::MAX));
            server.set(0x6401, sub, reading);
        }
    }

    fn samples_at_sync(&self, server: &CanopenServer) -> bool {
        server.has_synchronous_tpdo()
    }

    fn reports_events(&self, server: &CanopenServer) -> bool {
        server.get(0x6423, 0) != 0
    }

    fn event(&self, server: &CanopenServer, sub: u8, last: Option<i64>) -> Option<(i64, Object)> {
        let reading = server.get(0x6401, sub);
        let cause = interrupt_cause(server, sub, reading, last);
        (cause != 0).then(|| (reading, Object::new(0x6401, sub)))
    }
}

/// The bits of 0x6421 that hold: 0 above the upper limit, 1 below the lower one, 2 changed
/// by more than delta. A limit repeats only after a change by more than delta.
fn interrupt_cause(server: &CanopenServer, sub: u8, reading: i64, reported: Option<i64>) -> i64 {
    let delta = server.get(0x6426, sub);
    let changed = reported.is_none_or(|last| (reading - last).abs() > delta);
    let above = reading >= server.get(0x6424, sub);
    let below = reading < server.get(0x6425, sub);
    let causes = i64::from(above) | i64::from(below) << 1 | 1 << 2;
    if changed {
        causes & server.get(0x6421, sub)
    } else {
        0
    }
}

fn full_scale(config: &Cia401AnalogConfig, place: usize) -> f64 {
    let own = config.full_scale_v.get(place);
    *own.or(config.full_scale_v.last()).unwrap_or(&10.0)
}

/// Volts to a left-justified 16-bit reading; beyond its range the converter stays at the rail.
fn convert(volts: f64, full_scale: f64, resolution_bits: u8) -> i64 {
    let step = 1_i64 << (16 - resolution_bits.clamp(1, 16));
    let steps = (volts / full_scale * 32768.0 / step as f64).round() as i64;
    let highest = 32768 / step - 1;
    steps.clamp(-highest - 1, highest) * step
}

fn dictionary(config: &Cia401AnalogConfig) -> Dictionary {
    use Kind::{I16, I32, U8, U32};
    const REAL32_ONE: i64 = 0x3F80_0000;
    let mut dictionary = Dictionary::default();
    let channels = config.plant_channels.len();
    let mut array = |index, entry: Entry| dictionary.insert_array(index, vec![entry; channels]);
    array(0x6401, Entry::read_only(I16, 0).mapped(Mapping::Transmit));
    let trigger = Entry::read_write(U8, 7).bounded(Bounds::Between(0, 7));
    array(0x6421, trigger);
    array(0x6424, Entry::read_write(I32, 0));
    array(0x6425, Entry::read_write(I32, 0));
    array(0x6426, Entry::read_write(U32, 0));
    array(0x642F, Entry::read_write(U32, REAL32_ONE));
    array(0x6431, Entry::read_write(I32, 0));
    array(0x6432, Entry::read_write(I32, 1));
    let enable = Entry::number(U8, Access::ReadWrite, 0).bounded(Bounds::Between(0, 1));
    dictionary.insert(0x6423, 0, enable);
    dictionary
}

/// TPDO1 is the digital inputs' and switched off here; TPDO2 and 3 carry four channels each.
fn description(config: &Cia401AnalogConfig, node: NodeId) -> Description {
    const OFF: u32 = 1 << 31;
    let channels = config.plant_channels.len();
    let mapped = |first: usize| {
        let last = channels.min(first + PER_PDO - 1);
        (first..=last).map(|sub| MappedObject::new(0x6401, sub as u8, 16))
    };
    let tpdo = |function, flags: u32, mapping: Vec<MappedObject>| PdoDefault {
        cob_id: flags | u32::from(node.cob_id(function)),
        transmission: 255,
        inhibit_100us: 500,
        event_timer_ms: 0,
        mapping,
    };
    let third = if channels > PER_PDO { 0 } else { OFF };
    Description {
        device_type: DEVICE_TYPE,
        device_name: config.device_name.clone(),
        hardware_version: config.hardware_version.clone(),
        software_version: config.software_version.clone(),
        identity: config.identity,
        heartbeat_ms: config.heartbeat_ms,
        rpdos: Vec::new(),
        tpdos: vec![
            tpdo(Function::Tpdo1, OFF, Vec::new()),
            tpdo(Function::Tpdo2, 0, mapped(1).collect()),
            tpdo(Function::Tpdo3, third, mapped(PER_PDO + 1).collect()),
        ],
    }
}

impl Section for Cia401AnalogConfig {
    fn is_on_can(&self) -> bool {
        true
    }

    fn check(&self, _: &PlantConfig) -> Result<(), ConfigError> {
        Ok(())
    }

    fn build(&self, _: u64, _: &str) -> Box<dyn Node> {
        Box::new(Cia401AnalogNode::new(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use units::Time;
    use wire::can::CanFrame;

    use super::super::Node;
    use super::*;

    struct Bench(Vec<f64>);

    impl Wires for Bench {
        fn volts(&mut self, channel: usize) -> f64 {
            self.0[channel]
        }
    }

    fn module() -> Cia401AnalogNode {
        let mut module = Cia401AnalogNode::new(Cia401AnalogConfig::default());
        module.pass_time(Time::from_seconds(0.1), &mut Bench(vec![0.0; 2]));
        let _ = frames(&mut module);
        module
    }

    fn frames(module: &mut Cia401AnalogNode) -> Vec<String> {
        std::iter::from_fn(|| module.next_frame())
            .map(|frame| frame.to_string())
            .collect()
    }

    fn send(
        module: &mut Cia401AnalogNode,
        seconds: f64,
        id: u16,
        data: &[u8],
        volts: [f64; 2],
    ) -> Vec<String> {
        let now = Time::from_seconds(seconds);
        let frame = CanFrame::standard(id, data);
        module.handle_frame(now, &frame, &mut Bench(volts.to_vec()));
        frames(module)
    }

    const START: [u8; 2] = [1, 2];
    const ENABLE_EVENTS: [u8; 8] = [0x2F, 0x23, 0x64, 0, 1, 0, 0, 0];

    #[test]
    fn volts_become_left_justified_readings_that_stop_at_the_rails() {
        assert_eq!(convert(5.0, 10.0, 16), 16384);
        assert_eq!(convert(-5.0, 10.0, 16), -16384);
        assert_eq!(convert(11.0, 10.0, 16), 32767);
        assert_eq!(convert(-11.0, 10.0, 16), -32768);
        assert_eq!(convert(11.0, 10.0, 12), 32752);
        assert_eq!(convert(0.0049, 10.0, 12) % 16, 0);
    }

    #[test]
    fn no_analog_pdo_comes_before_6423_enables_it() {
        let mut module = module();
        assert!(send(&mut module, 0.2, 0, &START, [1.0, 2.0]).is_empty());
        assert_eq!(module.next_event(), Time::NEVER);
        let reply = send(&mut module, 0.3, 0x602, &ENABLE_EVENTS, [5.0, -5.0]);
        assert_eq!(reply, ["582#6023640000000000"]);
        module.pass_time(Time::from_seconds(0.3), &mut Bench(vec![5.0, -5.0]));
        assert_eq!(frames(&mut module), ["282#004000C0"]);
    }

    #[test]
    fn an_event_needs_more_than_delta_and_waits_for_the_inhibit_time() {
        let mut module = module();
        let _ = send(&mut module, 0.2, 0, &START, [0.0; 2]);
        let delta = [0x23, 0x26, 0x64, 1, 100, 0, 0, 0];
        let _ = send(&mut module, 0.3, 0x602, &delta, [0.0; 2]);
        let _ = send(&mut module, 0.3, 0x602, &ENABLE_EVENTS, [0.0; 2]);
        module.pass_time(Time::from_seconds(0.30), &mut Bench(vec![0.0; 2]));
        assert_eq!(frames(&mut module), ["282#00000000"]);
        module.pass_time(Time::from_seconds(0.31), &mut Bench(vec![0.03, 0.0]));
        assert!(
            frames(&mut module).is_empty(),
            "98 digits are less than delta"
        );
        module.pass_time(Time::from_seconds(0.32), &mut Bench(vec![5.0, 0.0]));
        assert!(frames(&mut module).is_empty(), "inhibited for 50 ms");
        module.pass_time(Time::from_seconds(0.35), &mut Bench(vec![5.0, 0.0]));
        assert_eq!(frames(&mut module), ["282#00400000"]);
    }

    #[test]
    fn remapped_to_synchronous_it_samples_at_every_sync() {
        let mut module = module();
        let off = [0x23, 0x01, 0x18, 1, 0x82, 0x02, 0, 0x80];
        let synchronous = [0x2F, 0x01, 0x18, 2, 1, 0, 0, 0];
        let on = [0x23, 0x01, 0x18, 1, 0x82, 0x02, 0, 0x00];
        for request in [off, synchronous, on] {
            let reply = send(&mut module, 0.2, 0x602, &request, [0.0; 2]);
            assert!(reply[0].starts_with("582#60"), "{reply:?}");
        }
        let _ = send(&mut module, 0.3, 0, &START, [0.0; 2]);
        assert_eq!(
            send(&mut module, 0.4, 0x80, &[], [2.5, 0.0]),
            ["282#00200000"]
        );
        assert_eq!(
            send(&mut module, 0.5, 0x80, &[], [0.0, 2.5]),
            ["282#00000020"]
        );
    }

    #[test]
    fn an_upload_reads_the_present_voltage() {
        let mut module = module();
        let read = [0x40, 0x01, 0x64, 1, 0, 0, 0, 0];
        let reply = send(&mut module, 0.2, 0x602, &read, [5.0, 0.0]);
        assert_eq!(reply, ["582#4B01640100400000"]);
        let beyond = [0x40, 0x01, 0x64, 3, 0, 0, 0, 0];
        let reply = send(&mut module, 0.2, 0x602, &beyond, [5.0, 0.0]);
        assert_eq!(reply, ["582#8001640311000906"]);
    }

    #[test]
    fn offset_and_scaling_change_the_reading() {
        let mut module = module();
        let offset = [0x23, 0x31, 0x64, 1, 0x9C, 0xFF, 0xFF, 0xFF];
        let scaling = [0x23, 0x32, 0x64, 1, 0xFF, 0xFF, 0xFF, 0xFF];
        let _ = send(&mut module, 0.2, 0x602, &offset, [0.0; 2]);
        let _ = send(&mut module, 0.2, 0x602, &scaling, [0.0; 2]);
        let read = [0x40, 0x01, 0x64, 1, 0, 0, 0, 0];
        let reply = send(&mut module, 0.2, 0x602, &read, [0.0; 2]);
        assert_eq!(reply, ["582#4B01640164000000"]);
    }

    #[test]
    fn a_node_id_of_zero_and_an_unknown_key_are_refused_when_the_file_is_read() {
        let zero = toml::from_str::<Cia401AnalogConfig>("node_id = 0");
        assert!(zero.unwrap_err().to_string().contains("1 to 127"));
        assert!(toml::from_str::<Cia401AnalogConfig>("full_scale = 10").is_err());
        let two = toml::from_str::<Cia401AnalogConfig>("full_scale_v = [10.0, 5.0]");
        assert_eq!(full_scale(&two.unwrap(), 1), 5.0);
    }
}
