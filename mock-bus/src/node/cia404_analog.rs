//! An emulated CiA 404 measuring module: voltages and resistance thermometers.
//!
//! Purpose: the module that reads beam detectors and temperatures. It is as real ones are: every
//! input is off and has no sensor type until somebody sets both, the default unit is the degree,
//! and the default TPDOs carry two inputs each with their status. Inputs are sampled when they
//! are asked for: at the SYNC of a synchronous TPDO that is due, by SDO, and at the sampling
//! period for the event-driven ones.
//!
//! Source: CiA 404, analogue input function block; defaults as in the EDS of SYS TEC's IO-X7.
//! Absent: 0x6124 and 0x6125 (tare and zero), limits 0x7134 and 0x7135, the two-point scaling
//! 0x7120 to 0x7123, filters, 0x6130 and 0x9130 (the same value as REAL32 and INTEGER32), digital
//! inputs, controllers and alarms.
//!
//! | object | name |
//! |---|---|
//! | 0x7100 | field value: what the converter counts |
//! | 0x7130 | process value = (measured · 0x6126 + 0x6127) in 0x6131's unit with 0x6132's digits |
//! | 0x6150 | what is wrong with it; a value that is not valid reads −32768 |

use serde::{Deserialize, Serialize};
use wire::canopen::pdo::MappedObject;
use wire::canopen::{Function, NodeId, Object};
use wire::cia404::{self, InputStatus, PhysicalUnit, SensorType, Unit};

use super::analog_module::{AnalogModule, Module, Profile, Wires};
use super::canopen_server::dictionary::{Bounds, Dictionary, Entry, Kind, Mapping};
use super::canopen_server::{CanopenServer, Description, Identity, Manners, PdoDefault};
use super::cia402_drive::checked_node_id;
use super::{Node, Section};
use crate::config::error::{ConfigError, positive};
use crate::plant::config::PlantConfig;

/// Inputs of one module.
pub const INPUTS_MAX: usize = 8;
/// Inputs of one default TPDO, each with its status.
const PER_PDO: usize = 2;
const TPDOS: usize = 4;
/// The units that a process value may have.
const UNITS: &[i64] = &[
    PhysicalUnit::CELSIUS.raw() as i64,
    PhysicalUnit::of(0, Unit::Volt).raw() as i64,
    PhysicalUnit::MILLIVOLT.raw() as i64,
    PhysicalUnit::of(-6, Unit::Volt).raw() as i64,
];
/// The sensors that an input may have.
const SENSORS: &[i64] = &[
    SensorType::Unset.raw() as i64,
    SensorType::Pt100.raw() as i64,
    SensorType::Voltage.raw() as i64,
];
/// What a resistance thermometer's input resolves.
const STEP_C: f64 = 0.001;

/// An emulated measuring module; every key has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cia404AnalogConfig {
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
    /// Which of the plant's terminals each input is wired to, at most 8.
    pub plant_channels: Vec<usize>,
    /// What a voltage input can measure, either way.
    pub full_scale_v: f64,
    /// Bits of the converter.
    pub resolution_bits: u8,
    /// How often the inputs are sampled for event-driven TPDOs.
    pub sampling_period_ms: u64,
    /// How badly it behaves.
    pub manners: Manners,
}

impl Default for Cia404AnalogConfig {
    fn default() -> Self {
        Self {
            node_id: 10,
            identity: Identity {
                product_code: 0x0040_0004,
                ..Identity::default()
            },
            device_name: "truestage mock measuring module".into(),
            hardware_version: "mock-bus 1".into(),
            software_version: concat!("mock-bus ", env!("CARGO_PKG_VERSION")).into(),
            boot_delay_ms: 50,
            heartbeat_ms: 0,
            plant_channels: (0..INPUTS_MAX).collect(),
            full_scale_v: 5.0,
            resolution_bits: 16,
            sampling_period_ms: 10,
            manners: Manners::default(),
        }
    }
}

/// An emulated measuring module on the bus.
pub type Cia404AnalogNode = AnalogModule<Cia404AnalogConfig>;

impl Profile for Cia404AnalogConfig {
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
        for (sub, terminal) in (1..).zip(&self.plant_channels) {
            let on = server.get(cia404::OPERATION_MODE, sub) == i64::from(cia404::MODE_NORMAL);
            let sensor = server.get(cia404::SENSOR_TYPE, sub) as u16;
            let measured = match SensorType::from_raw(sensor) {
                SensorType::Voltage if on => {
                    Some(self.convert(server, sub, wires.volts(*terminal)))
                }
                SensorType::Pt100 if on => {
                    let celsius = wires.celsius(*terminal);
                    celsius.map(|it| ((it / STEP_C).round() * STEP_C, InputStatus::default()))
                }
                _ => None,
            };
            let (value, status) = match measured {
                Some((value, status)) => process_value(server, sub, value, status),
                None => (i64::from(i16::MIN), InputStatus::NOT_VALID),
            };
            server.set(cia404::PROCESS_VALUE, sub, value);
            server.set(cia404::STATUS, sub, i64::from(status.0));
        }
    }

    fn samples_at_sync(&self, server: &CanopenServer) -> bool {
        server.is_tpdo_turn()
    }

    fn reports_events(&self, server: &CanopenServer) -> bool {
        server.reports_changes()
    }

    /// An event is a change by more than 0x7133.
    fn event(&self, server: &CanopenServer, sub: u8, last: Option<i64>) -> Option<(i64, Object)> {
        let value = server.get(cia404::PROCESS_VALUE, sub);
        let delta = server.get(cia404::INTERRUPT_DELTA, sub);
        let changed = last.is_none_or(|last| (value - last).abs() > delta);
        changed.then(|| (value, Object::new(cia404::PROCESS_VALUE, sub)))
    }
}

impl Cia404AnalogConfig {
    /// Volts as the converter counts them, and whether it is at an end of its range.
    fn convert(&self, server: &mut CanopenServer, sub: u8, volts: f64) -> (f64, InputStatus) {
        let half = f64::from(1_u32 << (self.resolution_bits.clamp(2, 16) - 1));
        let wanted = (volts / self.full_scale_v * half).round();
        let counts = wanted.clamp(-half, half - 1.0);
        server.set(cia404::FIELD_VALUE, sub, counts as i64);
        (counts * self.full_scale_v / half, overload(wanted, counts))
    }
}

/// Scaled, in the unit and digits that are set, as far as 16 bits go.
fn process_value(
    server: &CanopenServer,
    sub: u8,
    measured: f64,
    seen: InputStatus,
) -> (i64, InputStatus) {
    let real = |index| f64::from(f32::from_bits(server.get(index, sub) as u32));
    let scaled = measured * real(cia404::SCALING_FACTOR) + real(cia404::SCALING_OFFSET);
    let unit = PhysicalUnit::from_raw(server.get(cia404::PHYSICAL_UNIT, sub) as u32);
    let digits = server.get(cia404::DECIMAL_DIGITS, sub) as u8;
    let wanted = (scaled / unit.per_count(digits)).round();
    let value = wanted.clamp(f64::from(i16::MIN), f64::from(i16::MAX));
    (value as i64, seen.and(overload(wanted, value)))
}

fn overload(wanted: f64, given: f64) -> InputStatus {
    if wanted > given {
        InputStatus::POSITIVE_OVERLOAD
    } else if wanted < given {
        InputStatus::NEGATIVE_OVERLOAD
    } else {
        InputStatus::default()
    }
}

fn dictionary(config: &Cia404AnalogConfig) -> Dictionary {
    use Kind::{I16, U8, U16, U32};
    const REAL32_ONE: i64 = 0x3F80_0000;
    let mut dictionary = Dictionary::default();
    let inputs = config.plant_channels.len();
    let mut array = |index, entry: Entry| dictionary.insert_array(index, vec![entry; inputs]);
    let shown = |kind, value| Entry::read_only(kind, value).mapped(Mapping::Transmit);
    let sensor = Entry::read_write(U16, 0).bounded(Bounds::OneOf(SENSORS));
    array(cia404::SENSOR_TYPE, sensor);
    let mode = Entry::read_write(U8, 0).bounded(Bounds::Between(0, 1));
    array(cia404::OPERATION_MODE, mode);
    array(cia404::SCALING_FACTOR, Entry::read_write(U32, REAL32_ONE));
    array(cia404::SCALING_OFFSET, Entry::read_write(U32, 0));
    let celsius = i64::from(PhysicalUnit::CELSIUS.raw());
    let unit = Entry::read_write(U32, celsius).bounded(Bounds::OneOf(UNITS));
    array(cia404::PHYSICAL_UNIT, unit);
    let digits = Entry::read_write(U8, 1).bounded(Bounds::Between(0, 3));
    array(cia404::DECIMAL_DIGITS, digits);
    array(
        cia404::STATUS,
        shown(U8, i64::from(InputStatus::NOT_VALID.0)),
    );
    array(cia404::FIELD_VALUE, shown(I16, 0));
    array(cia404::PROCESS_VALUE, shown(I16, i64::from(i16::MIN)));
    array(cia404::INTERRUPT_DELTA, Entry::read_write(I16, 10));
    dictionary
}

fn description(config: &Cia404AnalogConfig, node: NodeId) -> Description {
    const OFF: u32 = 1 << 31;
    let inputs = config.plant_channels.len();
    let mapping = |pdo: usize| {
        let first = pdo * PER_PDO + 1;
        let last = inputs.min(first + PER_PDO - 1);
        let pair = |sub: usize| {
            let sub = sub as u8;
            [
                MappedObject::new(cia404::PROCESS_VALUE, sub, 16),
                MappedObject::new(cia404::STATUS, sub, 8),
            ]
        };
        (first..=last).flat_map(pair).collect::<Vec<_>>()
    };
    let functions = [
        Function::Tpdo1,
        Function::Tpdo2,
        Function::Tpdo3,
        Function::Tpdo4,
    ];
    let tpdos = (0..TPDOS).zip(functions).map(|(pdo, function)| {
        let mapping = mapping(pdo);
        let off = if mapping.is_empty() { OFF } else { 0 };
        PdoDefault {
            cob_id: off | u32::from(node.cob_id(function)),
            transmission: 255,
            inhibit_100us: 500,
            event_timer_ms: 0,
            mapping,
        }
    });
    Description {
        device_type: cia404::DEVICE_TYPE_ANALOG_INPUT,
        device_name: config.device_name.clone(),
        hardware_version: config.hardware_version.clone(),
        software_version: config.software_version.clone(),
        identity: config.identity,
        heartbeat_ms: config.heartbeat_ms,
        rpdos: Vec::new(),
        tpdos: tpdos.collect(),
    }
}

impl Section for Cia404AnalogConfig {
    fn is_on_can(&self) -> bool {
        true
    }

    fn check(&self, _: &PlantConfig) -> Result<(), ConfigError> {
        let inputs = self.plant_channels.len();
        if inputs > INPUTS_MAX {
            return Err(ConfigError::Value {
                key: "plant_channels",
                seen: inputs as f64,
                expected: "at most 8 inputs",
            });
        }
        positive("full_scale_v", self.full_scale_v)
    }

    fn build(&self, _: u64, _: &str) -> Box<dyn Node> {
        Box::new(Cia404AnalogNode::new(self.clone()))
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use units::Time;
    use wire::can::CanFrame;

    use super::super::Node;
    use super::*;
    use wire::canopen::sdo::{AbortCode, Expedited, SdoRequest, SdoResponse};

    #[derive(Default)]
    struct Bench {
        volts: f64,
        celsius: Option<f64>,
        samples: u32,
    }

    impl Wires for Bench {
        fn volts(&mut self, terminal: usize) -> f64 {
            self.samples += 1;
            self.volts + terminal as f64
        }

        fn celsius(&mut self, _terminal: usize) -> Option<f64> {
            self.celsius
        }
    }

    struct Rig {
        module: Cia404AnalogNode,
        bench: Bench,
        now: Time,
    }

    impl Rig {
        /// Booted, input 1 a voltage, input 2 a Pt100, both in operation.
        fn new() -> Self {
            let config = Cia404AnalogConfig {
                plant_channels: vec![0, 1, 2],
                ..Cia404AnalogConfig::default()
            };
            let mut rig = Self {
                module: Cia404AnalogNode::new(config),
                bench: Bench::default(),
                now: Time::from_seconds(0.1),
            };
            rig.module.pass_time(rig.now, &mut rig.bench);
            assert_eq!(rig.sent(), ["70A#00"]);
            rig
        }

        fn set_up() -> Self {
            let mut rig = Self::new();
            let [sensor, unit] = [cia404::SENSOR_TYPE, cia404::PHYSICAL_UNIT];
            rig.write(sensor, 1, &SensorType::Voltage.raw().to_le_bytes());
            rig.write(unit, 1, &PhysicalUnit::MILLIVOLT.raw().to_le_bytes());
            rig.write(sensor, 2, &SensorType::Pt100.raw().to_le_bytes());
            rig.write(cia404::DECIMAL_DIGITS, 2, &[2]);
            for sub in [1, 2] {
                rig.write(cia404::OPERATION_MODE, sub, &[1]);
            }
            rig
        }

        fn sent(&mut self) -> Vec<String> {
            std::iter::from_fn(|| self.module.next_frame())
                .map(|frame| frame.to_string())
                .collect()
        }

        fn send(&mut self, id: u16, data: &[u8]) -> Vec<String> {
            let frame = CanFrame::standard(id, data);
            self.module.handle_frame(self.now, &frame, &mut self.bench);
            self.sent()
        }

        fn request(&mut self, request: SdoRequest) -> SdoResponse {
            let frame = CanFrame::standard(0x60A, &request.emit());
            self.module.handle_frame(self.now, &frame, &mut self.bench);
            let answer = self.module.next_frame().unwrap();
            SdoResponse::parse(answer.data()).unwrap()
        }

        fn try_write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
            let object = Object::new(index, sub);
            let data = Expedited::new(data).unwrap();
            match self.request(SdoRequest::DownloadExpedited { object, data }) {
                SdoResponse::DownloadInitiate { .. } => Ok(()),
                SdoResponse::Abort { code, .. } => Err(code),
                other => panic!("{other:?}"),
            }
        }

        #[track_caller]
        fn write(&mut self, index: u16, sub: u8, data: &[u8]) {
            self.try_write(index, sub, data).unwrap();
        }

        /// The process value and the status.
        fn read(&mut self, sub: u8) -> (i16, u8) {
            let mut raw = |index| {
                let object = Object::new(index, sub);
                match self.request(SdoRequest::UploadInitiate { object }) {
                    SdoResponse::UploadExpedited { data, .. } => data.data().to_vec(),
                    other => panic!("{other:?}"),
                }
            };
            let value = raw(cia404::PROCESS_VALUE);
            (
                i16::from_le_bytes([value[0], value[1]]),
                raw(cia404::STATUS)[0],
            )
        }
    }

    #[test]
    fn an_input_says_nothing_before_it_has_a_sensor_and_is_on() {
        let mut rig = Rig::new();
        rig.bench.volts = 1.0;
        assert_eq!(rig.read(1), (i16::MIN, 1));
        rig.write(cia404::SENSOR_TYPE, 1, &[40, 0]);
        assert_eq!(rig.read(1), (i16::MIN, 1));
        rig.write(cia404::OPERATION_MODE, 1, &[1]);
        rig.write(cia404::PHYSICAL_UNIT, 1, &0xFD26_0000_u32.to_le_bytes());
        let (value, status) = rig.read(1);
        assert_eq!(status, 0);
        assert!((value - 10_000).abs() <= 1, "{value}");
    }

    /// 5 V over 2^15 counts: 0.1526 mV a count, shown in tenths of millivolts.
    #[test]
    fn volts_are_counted_by_the_converter_and_shown_in_the_unit() {
        let mut rig = Rig::set_up();
        for (volts, value, status) in [
            (0.0, 0, 0),
            (-2.0, -20_000, 0),
            (3.0, 30_000, 0),
            (3.5, i16::MAX, 2),
            (-3.5, i16::MIN, 4),
        ] {
            rig.bench.volts = volts;
            let seen = rig.read(1);
            assert!(
                (i32::from(seen.0) - i32::from(value)).abs() <= 1,
                "{seen:?}"
            );
            assert_eq!(seen.1, status, "{volts} V");
        }
        rig.write(cia404::DECIMAL_DIGITS, 1, &[0]);
        rig.bench.volts = 7.0;
        assert_eq!(rig.read(1), (5000, 2), "the converter's own end");
    }

    #[test]
    fn scaling_is_applied_before_the_unit() {
        let mut rig = Rig::set_up();
        rig.bench.volts = 1.0;
        rig.write(cia404::SCALING_FACTOR, 1, &0.5_f32.to_le_bytes());
        rig.write(cia404::SCALING_OFFSET, 1, &0.25_f32.to_le_bytes());
        let (value, _) = rig.read(1);
        assert!((value - 7_500).abs() <= 1, "{value}");
    }

    #[test]
    fn a_thermometer_reads_degrees_and_an_open_one_nothing() {
        let mut rig = Rig::set_up();
        rig.bench.celsius = Some(21.2344);
        assert_eq!(rig.read(2), (2123, 0));
        rig.bench.celsius = None;
        assert_eq!(rig.read(2), (i16::MIN, 1));
    }

    #[test]
    fn what_it_does_not_know_is_refused() {
        let mut rig = Rig::new();
        let refused = Err(AbortCode::InvalidValue);
        assert_eq!(rig.try_write(cia404::SENSOR_TYPE, 1, &[50, 0]), refused);
        let ampere = 0xFD04_0000_u32.to_le_bytes();
        assert_eq!(rig.try_write(cia404::PHYSICAL_UNIT, 1, &ampere), refused);
    }

    #[test]
    fn the_default_pdos_carry_two_inputs_with_their_status_at_changes() {
        let mut rig = Rig::set_up();
        rig.bench.celsius = Some(20.0);
        let _ = rig.send(0, &[1, 10]);
        rig.module.pass_time(rig.now, &mut rig.bench);
        let sent = rig.sent();
        // 0 V; 20.00 °C is 2000, 0x07D0; the third input is off.
        assert_eq!(sent, ["18A#000000D00700", "28A#008001"]);
        // Each input has an event of its own: the first PDO's second one waits for its inhibit
        // time.
        rig.now += Duration::from_millis(100);
        rig.module.pass_time(rig.now, &mut rig.bench);
        assert_eq!(rig.sent(), ["18A#000000D00700"]);
        rig.now += Duration::from_millis(100);
        rig.module.pass_time(rig.now, &mut rig.bench);
        assert!(rig.sent().is_empty(), "nothing has changed");
    }

    #[test]
    fn at_every_nth_sync_it_samples_and_sends_and_not_in_between() {
        let mut rig = Rig::set_up();
        for pdo in 0..4_u16 {
            let cob_id = 0x8000_018A_u32 + u32::from(pdo) * 0x100;
            rig.write(0x1800 + pdo, 1, &cob_id.to_le_bytes());
        }
        rig.write(0x1A02, 0, &[0]);
        rig.write(0x1A02, 1, &0x7130_0110_u32.to_le_bytes());
        rig.write(0x1A02, 0, &[1]);
        rig.write(0x1802, 2, &[3]);
        rig.write(0x1802, 1, &0x4000_038A_u32.to_le_bytes());
        let _ = rig.send(0, &[1, 10]);
        assert_eq!(rig.module.next_event(), Time::NEVER);
        rig.bench.samples = 0;
        let frames: Vec<usize> = (0..9).map(|_| rig.send(0x80, &[]).len()).collect();
        assert_eq!(frames, [0, 0, 1, 0, 0, 1, 0, 0, 1]);
        assert_eq!(rig.bench.samples, 3);
    }
}
