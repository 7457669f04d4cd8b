//! Measuring modules by CiA 404 on CANopen: up to eight voltages and temperatures, sampled
//! together at every n-th SYNC.
//!
//! Process values (0x7130, 16 bits) travel in TPDO 3 (the first four inputs used) and TPDO 4 (the
//! others): their identifiers come behind those of set-points and drives' answers, so that many
//! detectors that speak at one SYNC never hold up a set-point by more than one frame. A reading is
//! complete when all its PDOs have come after one SYNC.
//!
//! At the start every input used is given its sensor type (0x6110), its unit (0x6131) and decimal
//! digits (0x6132), a neutral scaling (0x6126, 0x6127), and is switched on (0x6112), all read
//! back. Inputs that are not used stay as they are. Absent: 0x6130 and 0x9130 (REAL32 and
//! INTEGER32), 0x6150 (a value at an end of the range says as much), two-point scaling 0x7120 to
//! 0x7123, filters, tare.

#[cfg(test)]
mod tests;

use core::time::Duration;

use units::{Celsius, Time, Volts};
use wire::Input;
use wire::Payload;
use wire::canopen::Object;
use wire::canopen::pdo::{MappedObject, Transmission, extract};
use wire::cia404::{self, PhysicalUnit, SensorType};

use super::analog_node::{AnalogNode, Heard};
use super::canopen_node::{CanopenNode, NodeSettings};
use super::{
    Alarm, AnalogInput, AnalogReading, Device, DeviceError, Identity, TemperatureInput,
    TemperatureReading,
};
use crate::protocol::pdo_setup::{Pdo, PdoDirection};
use crate::protocol::script::Step;

/// The most inputs of one module.
pub const INPUTS_MAX: usize = 8;
/// What one TPDO holds.
const PER_PDO: usize = 4;
/// The TPDO of the first four inputs.
const FIRST_PDO: u8 = 3;

/// What is wired to an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A voltage.
    Voltage,
    /// A resistance thermometer Pt100.
    Pt100,
}

/// One input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputSettings {
    /// Its number, sub-index of 0x7130, from 1.
    pub input: u8,
    /// What is wired to it.
    pub quantity: Quantity,
    /// How many digits stand behind the point of its process value, in millivolts or degrees:
    /// more resolve better and reach less far.
    pub decimal_digits: u8,
}

impl InputSettings {
    /// A voltage in tenths of millivolts, up to 3.2767 V either way.
    pub const fn voltage(input: u8) -> Self {
        Self {
            input,
            quantity: Quantity::Voltage,
            decimal_digits: 1,
        }
    }

    /// A temperature in hundredths of degrees.
    pub const fn pt100(input: u8) -> Self {
        Self {
            input,
            quantity: Quantity::Pt100,
            decimal_digits: 2,
        }
    }

    const fn unit(self) -> PhysicalUnit {
        match self.quantity {
            Quantity::Voltage => PhysicalUnit::MILLIVOLT,
            Quantity::Pt100 => PhysicalUnit::CELSIUS,
        }
    }

    const fn sensor(self) -> SensorType {
        match self.quantity {
            Quantity::Voltage => SensorType::Voltage,
            Quantity::Pt100 => SensorType::Pt100,
        }
    }

    /// Volts or degrees of one count.
    fn per_count(self) -> f64 {
        self.unit().per_count(self.decimal_digits)
    }
}

/// Everything the driver must know about one module.
///
/// # Example
///
/// ```
/// use drivers::device::canopen_node::NodeSettings;
/// use drivers::device::cia404::{Cia404Settings, InputSettings};
/// use std::time::Duration;
/// use wire::canopen::NodeId;
///
/// let (node, master) = (NodeId::new(5).expect("1 to 127"), NodeId::new(127).expect("likewise"));
/// let common = NodeSettings::new(node, master, Duration::from_millis(2));
/// let inputs: Vec<_> = (1..=5).map(InputSettings::pt100).collect();
/// let settings = Cia404Settings::new(common, &inputs, 50).expect("up to eight inputs");
/// assert_eq!(settings.pdo_bytes(), [8, 2], "four inputs in a PDO");
/// let twice = [InputSettings::pt100(1), InputSettings::voltage(1)];
/// assert!(Cia404Settings::new(common, &twice, 50).is_none());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Cia404Settings {
    /// Node, master, identity, heartbeats, SYNC period, start time-outs.
    pub common: NodeSettings,
    /// The inputs used, 1 to 8, in the order of the readings.
    pub inputs: Vec<InputSettings>,
    /// The module samples and sends at every so many SYNCs, 1 to 240.
    pub every_syncs: u8,
}

impl Cia404Settings {
    /// A module with these inputs; `None` when there are none or more than eight, when one is
    /// used twice, or when `every_syncs` is not 1 to 240.
    pub fn new(common: NodeSettings, inputs: &[InputSettings], every_syncs: u8) -> Option<Self> {
        let twice = |at: usize| inputs[..at].iter().any(|it| it.input == inputs[at].input);
        let good = (1..=INPUTS_MAX).contains(&inputs.len())
            && (1..=240).contains(&every_syncs)
            && !(0..inputs.len()).any(twice);
        good.then(|| Self {
            common,
            inputs: inputs.to_vec(),
            every_syncs,
        })
    }

    fn configuration(&self) -> Vec<Step> {
        let node = self.common.node;
        let transmit = |number| Pdo::new(PdoDirection::Transmit, number).expect("1 to 4");
        let mut steps: Vec<Step> = (1..=4)
            .flat_map(|number| transmit(number).disable(node))
            .collect();
        for input in &self.inputs {
            steps.extend(input_steps(*input));
        }
        let transmission = Transmission::Synchronous(self.every_syncs);
        for (number, inputs) in (FIRST_PDO..).zip(self.inputs.chunks(PER_PDO)) {
            let mapped: Vec<MappedObject> = inputs
                .iter()
                .map(|it| MappedObject::new(cia404::PROCESS_VALUE, it.input, 16))
                .collect();
            let pdo = transmit(number).configure(node, &mapped, transmission);
            steps.extend(pdo.expect("four inputs of 16 bits fit"));
        }
        steps
    }

    /// Bytes of each PDO that the module sends, and at every how many SYNCs: for the bus load.
    pub fn pdo_bytes(&self) -> Vec<u8> {
        let pdos = self.inputs.chunks(PER_PDO);
        pdos.map(|inputs| inputs.len() as u8 * 2).collect()
    }
}

/// One CiA 404 module.
#[derive(Debug)]
pub struct Cia404Analog {
    settings: Cia404Settings,
    module: AnalogNode,
    /// The PDOs of the sample under way, as far as they have come.
    parts: Vec<Option<[u8; 8]>>,
    began: Time,
    volts: Option<AnalogReading>,
    temperatures: Option<TemperatureReading>,
    incomplete_samples: u64,
}

impl Cia404Analog {
    /// A module that is not started.
    pub fn new(settings: Cia404Settings) -> Self {
        let mut common = settings.common;
        // Its process data comes so much more seldom than SYNC.
        common.sync_period *= u32::from(settings.every_syncs);
        let node = CanopenNode::new(common, cia404::PROFILE).living_by(FIRST_PDO);
        Self {
            module: AnalogNode::new(node),
            parts: vec![None; settings.inputs.len().div_ceil(PER_PDO)],
            settings,
            began: Time::ZERO,
            volts: None,
            temperatures: None,
            incomplete_samples: 0,
        }
    }

    /// The settings it was made with.
    pub const fn settings(&self) -> &Cia404Settings {
        &self.settings
    }

    fn forget(&mut self) {
        self.parts.fill(None);
        self.volts = None;
        self.temperatures = None;
    }

    fn pump(&mut self, now: Time) {
        while let Some(heard) = self.module.hear(now, || self.settings.configuration()) {
            match heard {
                Heard::Pdo { number, frame } => {
                    let part = number.checked_sub(FIRST_PDO).map(usize::from);
                    if let Some(part) = part.filter(|part| *part < self.parts.len()) {
                        self.take_part(now, part, frame.data());
                    }
                }
                Heard::Reset => self.forget(),
            }
        }
    }

    fn take_part(&mut self, now: Time, part: usize, payload: &[u8]) {
        let (begins, is_up) = (self.module.awaits_its_first(), self.module.node.is_up());
        if !(begins || is_up) {
            return;
        }
        let left = self.settings.inputs.len() - part * PER_PDO;
        let expected = left.min(PER_PDO) * 2;
        // Before the start is over nobody is told of a short one.
        let is_silent = !is_up && payload.len() < expected;
        if is_silent || !self.module.is_whole(expected, payload.len()) {
            return;
        }
        // The parts of one sample follow each other; an older one that stayed alone is lost.
        let old = now.since(self.began) >= self.patience();
        if self.parts.iter().any(Option::is_some) && (old || self.parts[part].is_some()) {
            self.parts.fill(None);
            self.incomplete_samples += 1;
        }
        if self.parts.iter().all(Option::is_none) {
            self.began = now;
        }
        let mut bytes = [0; 8];
        bytes[..expected].copy_from_slice(&payload[..expected]);
        self.parts[part] = Some(bytes);
        if self.parts.iter().all(Option::is_some) {
            self.take_sample(now);
        }
    }

    /// Parts of one sample come within half the time to the next one.
    fn patience(&self) -> Duration {
        self.settings.common.sync_period * u32::from(self.settings.every_syncs) / 2
    }

    /// Into the memory of the sample before: in a cyclic loop nothing is asked for.
    fn take_sample(&mut self, now: Time) {
        let raw = |place: usize| {
            let part = self.parts.get(place / PER_PDO).copied().flatten();
            let raw = part.and_then(|part| extract(&part, place % PER_PDO * 16, 16));
            raw.map_or(i16::MIN, |raw| (raw as u16).cast_signed())
        };
        let mut volts = self.volts.take().unwrap_or(AnalogReading {
            at: now,
            volts: Vec::new(),
            saturated: Vec::new(),
        });
        let mut temperatures = self.temperatures.take().unwrap_or(TemperatureReading {
            at: now,
            celsius: Vec::new(),
        });
        (volts.at, temperatures.at) = (now, now);
        volts.volts.clear();
        volts.saturated.clear();
        temperatures.celsius.clear();
        for (place, input) in self.settings.inputs.iter().enumerate() {
            let raw = raw(place);
            let at_an_end = raw == i16::MAX || raw == i16::MIN;
            let value = f64::from(raw) * input.per_count();
            match input.quantity {
                Quantity::Voltage => {
                    volts.volts.push(Volts(value));
                    volts.saturated.push(at_an_end);
                }
                Quantity::Pt100 => {
                    let celsius = (!at_an_end).then_some(Celsius(value));
                    temperatures.celsius.push(celsius);
                }
            }
        }
        self.parts.fill(None);
        self.volts = (!volts.volts.is_empty()).then_some(volts);
        self.temperatures = (!temperatures.celsius.is_empty()).then_some(temperatures);
        if !self.module.node.is_up() {
            self.module.up(now);
        }
    }

    fn count(&self, quantity: Quantity) -> usize {
        let inputs = self.settings.inputs.iter();
        inputs.filter(|input| input.quantity == quantity).count()
    }
}

/// What makes one input tell what it shall.
fn input_steps(settings: InputSettings) -> Vec<Step> {
    const SCALING: &str = "making the module's own scaling neutral";
    const REAL32_ONE: u32 = 0x3F80_0000;
    let object = |index| Object::new(index, settings.input);
    let sensor = "telling the module what is wired to an input";
    let unit = "choosing the unit of an input";
    vec![
        Step::check(object(cia404::SENSOR_TYPE), settings.sensor().raw(), sensor),
        Step::check(object(cia404::PHYSICAL_UNIT), settings.unit().raw(), unit),
        Step::check(
            object(cia404::DECIMAL_DIGITS),
            settings.decimal_digits,
            unit,
        ),
        Step::check(object(cia404::SCALING_FACTOR), REAL32_ONE, SCALING).optional(),
        Step::check(object(cia404::SCALING_OFFSET), 0_u32, SCALING).optional(),
        Step::check(
            object(cia404::OPERATION_MODE),
            cia404::MODE_NORMAL,
            "switching an input on",
        )
        .optional(),
    ]
}

impl Device for Cia404Analog {
    fn handle(&mut self, now: Time, input: &Input) {
        self.module.node.handle(now, input);
        self.pump(now);
    }

    fn handle_timeout(&mut self, now: Time) {
        self.module.node.handle_timeout(now);
        self.pump(now);
    }

    fn poll_timeout(&self) -> Time {
        self.module.node.poll_timeout()
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.module.node.poll_transmit().map(Payload::Frame)
    }

    fn poll_alarm(&mut self) -> Option<Alarm> {
        self.module.alarms.pop_front()
    }

    fn start(&mut self, now: Time) {
        self.forget();
        self.module.start(now);
    }

    fn release_watch(&mut self, now: Time) -> bool {
        self.module.node.release_watch(now)
    }

    fn poll_outcome(&mut self) -> Option<Result<(), DeviceError>> {
        self.module.outcome.take()
    }

    fn identity(&self) -> Option<Identity> {
        self.module.node.identity().cloned()
    }

    fn counters(&self) -> Vec<(&'static str, u64)> {
        let mut counters = self.module.counters();
        counters.push(("samples incomplete", self.incomplete_samples));
        counters
    }
}

impl AnalogInput for Cia404Analog {
    fn channels(&self) -> usize {
        self.count(Quantity::Voltage)
    }

    fn reading(&self) -> Option<&AnalogReading> {
        self.volts.as_ref()
    }

    fn thermometers(&self) -> Option<&dyn TemperatureInput> {
        (self.sensors() > 0).then_some(self as &dyn TemperatureInput)
    }
}

impl TemperatureInput for Cia404Analog {
    fn sensors(&self) -> usize {
        self.count(Quantity::Pt100)
    }

    fn temperatures(&self) -> Option<&TemperatureReading> {
        self.temperatures.as_ref()
    }
}
