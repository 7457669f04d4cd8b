//! An ADAM-4117 or I-7017 analog input module in the ASCII protocol.
//!
//! Source: Advantech ADAM-4000 series manual, chapter 4. It answers nothing to a syntax error,
//! another module's address or a wrong checksum.
//!
//! Absent: changing the configuration (`%AANNTTCCFF`), formats other than engineering units.

use core::time::Duration;
use serde::Deserialize;
use wire::Payload;
use wire::dcon::{CR, Command, format_volts, frame, unframe};

use units::Time;

use super::replies::Replies;
use super::{Node, Section};
use crate::config::error::{ConfigError, positive};
use crate::plant::Plant;
use crate::plant::config::PlantConfig;
use crate::random::Stream;

/// How a module is set.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DconModuleConfig {
    /// Its address on the line.
    pub address: u8,
    /// Whether lines end in a checksum.
    pub checksum: bool,
    /// How many channels answer to "all".
    pub channels: usize,
    /// Digits after the point: 4 for the ranges up to 5 V, 3 for 10 V.
    pub decimals: usize,
    /// From a command's end to its answer's start.
    pub reply_ms: f64,
    /// The answer varies by up to this much more.
    pub reply_jitter_ms: f64,
    /// From power-on until it listens.
    pub boot_ms: f64,
    /// What it calls itself.
    pub model: String,
    /// Its firmware's version.
    pub firmware: String,
}

impl Default for DconModuleConfig {
    fn default() -> Self {
        Self {
            address: 1,
            checksum: true,
            channels: 8,
            decimals: 4,
            reply_ms: 2.0,
            reply_jitter_ms: 1.0,
            boot_ms: 300.0,
            model: "4117".to_owned(),
            firmware: "A1.06".to_owned(),
        }
    }
}

/// Longer lines are no command: the module forgets them.
const LINE_MAX: usize = 32;

/// The emulated module.
#[derive(Clone, Debug)]
pub struct DconModuleNode {
    config: DconModuleConfig,
    line: Vec<u8>,
    sampled: Vec<f64>,
    fresh: bool,
    replies: Replies,
    jitter: Stream,
}

impl DconModuleNode {
    /// A module without power; `seed` and `name` choose its jitter.
    pub fn new(config: &DconModuleConfig, seed: u64, name: &str) -> Self {
        Self {
            config: config.clone(),
            line: Vec::new(),
            sampled: Vec::new(),
            fresh: false,
            replies: Replies::new(),
            jitter: Stream::new(seed, &format!("{name} reply")),
        }
    }

    fn take_byte(&mut self, now: Time, byte: u8, plant: &mut Plant) {
        if byte != CR {
            self.line.push(byte);
            return;
        }
        let line = core::mem::take(&mut self.line);
        if line.len() > LINE_MAX {
            return;
        }
        let Ok(text) = unframe(&line, self.config.checksum) else {
            return;
        };
        let Some(answer) = Command::parse(text).and_then(|command| self.answer(command, plant))
        else {
            return;
        };
        let wait_ms = self.config.reply_ms + self.config.reply_jitter_ms * self.jitter.uniform();
        let at = now + Duration::from_secs_f64(wait_ms * 1e-3);
        let reply = frame(&answer, self.config.checksum);
        self.replies.push(at, reply);
    }

    /// `None` where the module stays silent.
    fn answer(&mut self, command: Command, plant: &mut Plant) -> Option<String> {
        let own = self.config.address;
        let id = format!("!{own:02X}");
        match command {
            Command::ReadAll { address } if address == own => {
                let volts = self.sample(plant);
                Some(self.values(&volts))
            }
            Command::ReadChannel { address, channel } if address == own => {
                let channel = usize::from(channel);
                if channel >= self.config.channels {
                    return Some(format!("?{own:02X}"));
                }
                Some(self.values(&[plant.analog_volts(channel)]))
            }
            Command::ReadName { address } if address == own => Some(id + &self.config.model),
            Command::ReadFirmware { address } if address == own => Some(id + &self.config.firmware),
            Command::ReadConfiguration { address } if address == own => {
                // Input range 09 (±5 V), 9600 baud, engineering units, checksum in bit 6.
                let format = if self.config.checksum { 0x40 } else { 0x00 };
                Some(format!("{id}0906{format:02X}"))
            }
            Command::SampleAll => {
                self.sampled = self.sample(plant);
                self.fresh = true;
                None
            }
            Command::ReadSampled { address } if address == own => Some(self.sampled_answer()),
            _ => None,
        }
    }

    /// `>AAS(data)`: S is 1 the first time the sample is read. Without a sample: refused.
    fn sampled_answer(&mut self) -> String {
        let own = self.config.address;
        if self.sampled.is_empty() {
            return format!("?{own:02X}");
        }
        let status = u8::from(core::mem::take(&mut self.fresh));
        let values = self.values(&self.sampled);
        format!(">{own:02X}{status}{}", values.trim_start_matches('>'))
    }

    fn sample(&self, plant: &mut Plant) -> Vec<f64> {
        (0..self.config.channels)
            .map(|channel| plant.analog_volts(channel))
            .collect()
    }

    fn values(&self, volts: &[f64]) -> String {
        let shown = volts
            .iter()
            .map(|volts| format_volts(*volts, self.config.decimals));
        core::iter::once(">".to_owned()).chain(shown).collect()
    }

    fn reset(&mut self) {
        self.line.clear();
        self.sampled.clear();
    }
}

impl Section for DconModuleConfig {
    fn check(&self, _: &PlantConfig) -> Result<(), ConfigError> {
        positive("channels", self.channels as f64)
    }

    fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        Box::new(DconModuleNode::new(self, seed, name))
    }
}

impl Node for DconModuleNode {
    fn handle(&mut self, now: Time, payload: &Payload, plant: &mut Plant) {
        for byte in self.replies.heard(now, payload) {
            self.take_byte(now, *byte, plant);
        }
    }

    fn advance(&mut self, now: Time, _plant: &mut Plant) {
        self.replies.advance(now);
    }

    fn next_event(&self) -> Time {
        self.replies.next_event()
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.replies.poll_transmit()
    }

    fn power_off(&mut self, _now: Time, _plant: &mut Plant) {
        self.reset();
        self.replies.power_off();
    }

    fn power_on(&mut self, now: Time, _plant: &mut Plant) {
        self.reset();
        self.replies.power_on(now, self.config.boot_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::dcon::parse_volts;

    fn module(checksum: bool) -> (DconModuleNode, Plant) {
        let config = DconModuleConfig {
            checksum,
            boot_ms: 0.0,
            ..DconModuleConfig::default()
        };
        let mut plant = Plant::default();
        let mut node = DconModuleNode::new(&config, 1, "adc");
        node.power_on(Time::ZERO, &mut plant);
        (node, plant)
    }

    /// The answer to `bytes` as text without CR, and how late it was.
    fn ask(node: &mut DconModuleNode, plant: &mut Plant, bytes: &[u8]) -> Option<(String, Time)> {
        node.handle(Time::ZERO, &Payload::Bytes(bytes.to_vec()), plant);
        let at = node.next_event();
        if at == Time::NEVER {
            return None;
        }
        node.advance(at, plant);
        let Some(Payload::Bytes(reply)) = node.poll_transmit() else {
            panic!("no reply at its time");
        };
        Some((String::from_utf8(reply).unwrap().trim_end().to_owned(), at))
    }

    #[test]
    fn all_channels_answer_in_engineering_units_after_the_reply_time() {
        let (mut node, mut plant) = module(false);
        let (text, at) = ask(&mut node, &mut plant, b"#01\r").unwrap();
        let volts = parse_volts(&text).unwrap();
        assert_eq!(volts.len(), 8);
        assert!((volts[0] - plant.analog_volts(0)).abs() < 2e-3);
        assert!(at >= Time(2_000_000) && at <= Time(3_000_000), "{at}");
    }

    #[test]
    fn a_checksum_is_wanted_and_given() {
        let (mut node, mut plant) = module(true);
        assert_eq!(ask(&mut node, &mut plant, b"#01\r"), None);
        let (text, _) = ask(&mut node, &mut plant, &frame("$01M", true)).unwrap();
        assert_eq!(unframe(text.as_bytes(), true), Ok("!014117"));
    }

    #[test]
    fn nonsense_and_strangers_get_silence() {
        let (mut node, mut plant) = module(false);
        for line in [&b"#02\r"[..], b"hello\r", b"\r", b"#0\r", b"\xFF\xFE\r"] {
            assert_eq!(ask(&mut node, &mut plant, line), None, "{line:?}");
        }
        assert!(ask(&mut node, &mut plant, b"$01F\r").is_some());
    }

    #[test]
    fn a_command_may_come_in_pieces() {
        let (mut node, mut plant) = module(false);
        assert_eq!(ask(&mut node, &mut plant, b"$0"), None);
        let (text, _) = ask(&mut node, &mut plant, b"12\r").unwrap();
        assert_eq!(text, "!01090600");
    }

    #[test]
    fn a_synchronous_sample_is_silent_and_read_later() {
        let (mut node, mut plant) = module(false);
        assert_eq!(ask(&mut node, &mut plant, b"$014\r").unwrap().0, "?01");
        assert_eq!(ask(&mut node, &mut plant, b"#**\r"), None);
        let (first, _) = ask(&mut node, &mut plant, b"$014\r").unwrap();
        let (second, _) = ask(&mut node, &mut plant, b"$014\r").unwrap();
        assert!(first.starts_with(">011") && second.starts_with(">010"));
        assert_eq!(first[4..], second[4..]);
    }
}
