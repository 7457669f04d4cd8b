//! Analog inputs by CiA 401 on CANopen: up to four channels, sampled together at each SYNC.
//!
//! TPDO 1 is mapped to 0x6401:k, 16 bits each, left-justified whatever the converter's width.
//! The global enable 0x6423 is off after power-on by the standard: without it most modules send
//! nothing. The module's own scaling, where it has one (offset 0x6431, factor 0x6432), is set to
//! neutral, so that only the settings give volts. Absent: 0x6402 (32 bits), 0x6403 (floats) with
//! their scaling 0x642F and 0x6430, output modules, digital channels.

#[cfg(test)]
mod tests;

use units::{Time, Volts};
use wire::Input;
use wire::Payload;
use wire::canopen::Object;
use wire::canopen::pdo::{MappedObject, Transmission, extract};

use super::analog_node::{AnalogNode, Heard};
use super::canopen_node::{CanopenNode, NodeSettings};
use super::{Alarm, AnalogInput, AnalogReading, Device, DeviceError, Identity};
use crate::protocol::pdo_setup::{Pdo, PdoDirection};
use crate::protocol::script::Step;

/// The profile number in 0x1000.
const PROFILE: u16 = 401;
/// What one TPDO holds.
const CHANNELS_MAX: usize = 4;
const FULL_SCALE: f64 = 0x7FFF as f64;
/// "The value changed by more than delta" among the triggers of 0x6421 (CiA 401, 6.3.3).
const TRIGGER_DELTA: u8 = 0x04;

/// One channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelSettings {
    /// The input, sub-index of 0x6401, from 1.
    pub input: u8,
    /// The voltage of 0x7FFF; negative when the sensor is wired the other way round.
    pub full_scale: Volts,
}

/// Everything the driver must know about one module.
#[derive(Clone, Debug, PartialEq)]
pub struct Cia401Settings {
    /// Node, master, identity, heartbeats, SYNC period, start time-outs.
    pub common: NodeSettings,
    /// The channels used, 1 to 4, in the order of the readings.
    pub channels: Vec<ChannelSettings>,
    /// Bits of the converter: the lower bits of a sample are always 0, so the upper rail is at
    /// 0x7FF0 for 12 bits.
    pub converter_bits: u8,
}

impl Cia401Settings {
    /// A 16-bit converter with these channels; `None` when there are none or more than four.
    pub fn new(common: NodeSettings, channels: &[ChannelSettings]) -> Option<Self> {
        (1..=CHANNELS_MAX).contains(&channels.len()).then(|| Self {
            common,
            channels: channels.to_vec(),
            converter_bits: 16,
        })
    }

    fn configuration(&self) -> Vec<Step> {
        const SCALING: &str = "making the module's own scaling neutral";
        let node = self.common.node;
        let pdo = |direction, number| Pdo::new(direction, number).expect("1 to 4");
        let transmit = |number| pdo(PdoDirection::Transmit, number);
        let mapped: Vec<MappedObject> = self
            .channels
            .iter()
            .map(|channel| MappedObject::new(0x6401, channel.input, 16))
            .collect();
        let mut steps = transmit(1)
            .configure(node, &mapped, Transmission::Synchronous(1))
            .expect("four channels of 16 bits fit");
        for unused in 2..=4 {
            steps.extend(transmit(unused).disable(node));
        }
        for channel in &self.channels {
            let input = channel.input;
            let object = |index| Object::new(index, input);
            steps.push(Step::check(object(0x6431), 0_i32, SCALING).optional());
            steps.push(Step::check(object(0x6432), 1_i32, SCALING).optional());
            let trigger = "choosing what makes the module send";
            steps.push(Step::check(object(0x6421), TRIGGER_DELTA, trigger).optional());
            steps.push(Step::check(object(0x6426), 0_u32, trigger).optional());
        }
        steps.push(Step::check(
            Object::new(0x6423, 0),
            1_u8,
            "enabling the analog inputs",
        ));
        steps
    }

    const fn upper_rail(&self) -> i16 {
        let spare = 16_u8.saturating_sub(self.converter_bits);
        // Two bits of sign and value are the least a converter can have.
        let spare = if spare > 14 { 14 } else { spare };
        0x7FFF & !((1_i16 << spare) - 1)
    }
}

/// One CiA 401 module with analog inputs.
///
/// # Example
///
/// A node that answers every question with the number of a drive is no analog module.
///
/// ```
/// use drivers::device::canopen_node::NodeSettings;
/// use drivers::device::cia401::{ChannelSettings, Cia401Analog, Cia401Settings};
/// use drivers::device::{Device, DeviceError};
/// use std::time::Duration;
/// use units::{Time, Volts};
/// use wire::can::CanFrame;
/// use wire::canopen::NodeId;
/// use wire::{Input, Payload};
///
/// let (node, master) = (NodeId::new(5).expect("1 to 127"), NodeId::new(127).expect("likewise"));
/// let common = NodeSettings::new(node, master, Duration::from_millis(2));
/// let channel = ChannelSettings { input: 1, full_scale: Volts(10.0) };
/// let settings = Cia401Settings::new(common, &[channel]).expect("1 to 4 channels");
/// let mut module = Cia401Analog::new(settings);
/// module.start(Time::ZERO);
/// while let Some(Payload::Frame(asked)) = module.poll_transmit() {
///     if let (Some(0x605), &[0x40, low, high, sub, ..]) = (asked.standard_id(), asked.data()) {
///         let answer = [0x43, low, high, sub, 0x92, 0x01, 0x02, 0x00];
///         let input = Input::Payload(Payload::Frame(CanFrame::standard(0x585, &answer)));
///         module.handle(Time::from_seconds(0.001), &input);
///     }
/// }
/// let outcome = module.poll_outcome();
/// let wrong = Some(Err(DeviceError::WrongIdentity {
///     node,
///     what: "device profile",
///     expected: 401,
///     seen: 402,
/// }));
/// assert_eq!(outcome, wrong);
/// ```
#[derive(Debug)]
pub struct Cia401Analog {
    settings: Cia401Settings,
    module: AnalogNode,
    reading: Option<AnalogReading>,
}

impl Cia401Analog {
    /// A module that is not started.
    pub fn new(settings: Cia401Settings) -> Self {
        Self {
            module: AnalogNode::new(CanopenNode::new(settings.common, PROFILE)),
            settings,
            reading: None,
        }
    }

    fn pump(&mut self, now: Time) {
        while let Some(heard) = self.module.hear(now, || self.settings.configuration()) {
            match heard {
                Heard::Pdo { number: 1, frame } => self.take_sample(now, frame.data()),
                Heard::Pdo { .. } => {}
                Heard::Reset => self.reading = None,
            }
        }
    }

    fn take_sample(&mut self, now: Time, payload: &[u8]) {
        let expected = self.settings.channels.len() * 2;
        if !self.module.node.is_up() {
            if !self.module.awaits_its_first() || payload.len() < expected {
                return;
            }
            self.module.up(now);
        }
        if !self.module.is_whole(expected, payload.len()) {
            return;
        }
        let rail = self.settings.upper_rail();
        let channels = &self.settings.channels;
        // The last sample's memory serves again: a cyclic loop asks for none.
        let mut reading = self.reading.take().unwrap_or_else(|| AnalogReading {
            at: now,
            volts: Vec::with_capacity(channels.len()),
            saturated: Vec::with_capacity(channels.len()),
        });
        reading.at = now;
        reading.volts.clear();
        reading.saturated.clear();
        for (at, channel) in channels.iter().enumerate() {
            let Some(raw) = extract(payload, at * 16, 16) else {
                break;
            };
            let raw = (raw as u16).cast_signed();
            let volts = channel.full_scale * (f64::from(raw) / FULL_SCALE);
            reading.volts.push(volts);
            reading.saturated.push(raw >= rail || raw == i16::MIN);
        }
        self.reading = Some(reading);
    }
}

impl Device for Cia401Analog {
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
        self.reading = None;
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
        self.module.counters()
    }
}

impl AnalogInput for Cia401Analog {
    fn channels(&self) -> usize {
        self.settings.channels.len()
    }

    fn reading(&self) -> Option<&AnalogReading> {
        self.reading.as_ref()
    }
}
