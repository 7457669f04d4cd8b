//! A position display HEIDENHAIN ND 287 over the encoder of a comparator.
//!
//! Source: HEIDENHAIN, ND 287 user's manual, parts II-5 and II-6 (see `wire::nd287` for the format); the times of
//! the ND 281 B manual, p. 42: a value is stored at most 1 ms after it was asked and put out within 50 ms.
//!
//! A head that does not see its scale, or moves too fast over it, when a value is asked for, is a fault: the
//! display shows it until it is switched off, and `?` stands in place of the unit.
//!
//! Absent: keys, functions, status, lists of parameters, the second input.

use core::time::Duration;

use serde::Deserialize;
use units::Time;
use wire::Payload;
use wire::nd287::{Command, Identification, MeasuredValue, NAK, STX, Unit};

use super::replies::Replies;
use super::{Node, Section};
use crate::config::error::{ConfigError, positive};
use crate::plant::Plant;
use crate::plant::config::PlantConfig;
use crate::random::Stream;

/// How a display is set, and what stands before it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Nd287DisplayConfig {
    /// Digits behind the point, in millimetres.
    pub decimals: usize,
    /// Standard deviation of a value.
    pub noise_nm: f64,
    /// How much longer the scale is than it says.
    pub scale_error_ppm: f64,
    /// Period of the encoder's signal: a count that slips is wrong by multiples of it.
    pub signal_period_um: f64,
    /// Faster than this the encoder's signals cannot be counted.
    pub speed_max_m_per_s: f64,
    /// From a request to its answer's start.
    pub reply_ms: f64,
    /// The answer varies by up to this much more.
    pub reply_jitter_ms: f64,
    /// From power-on until it listens.
    pub boot_ms: f64,
    /// What it calls itself.
    pub name: String,
    /// The number of its software, and its version.
    pub software: [String; 2],
}

impl Default for Nd287DisplayConfig {
    fn default() -> Self {
        Self {
            decimals: 5,
            noise_nm: 10.0,
            scale_error_ppm: 0.0,
            signal_period_um: 4.0,
            speed_max_m_per_s: 0.5,
            reply_ms: 20.0,
            reply_jitter_ms: 25.0,
            boot_ms: 1500.0,
            name: "ND-287".to_owned(),
            software: ["646118-01".to_owned(), "V1-01".to_owned()],
        }
    }
}

/// More do not leave room for metres.
const DECIMALS_MAX: usize = 6;
const ESC: u8 = 0x1b;
/// Longer commands are none.
const COMMAND_MAX: usize = 16;

/// The emulated display.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::nd287_display::{Nd287DisplayConfig, Nd287DisplayNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::Payload;
///
/// let (config, mut plant) = (Nd287DisplayConfig::default(), Plant::default());
/// let mut display = Nd287DisplayNode::new(&config, 1, "nd");
/// display.power_on(Time::ZERO, &mut plant);
/// let asked = Payload::Bytes(b"\x1bA0000\r".to_vec());
/// display.handle(Time::from_seconds(2.0), &asked, &mut plant);
/// display.advance(display.next_event(), &mut plant);
/// let answer = b"\x02ND-287    \r\n646118-01 \r\nV1-01     \r\n".to_vec();
/// assert_eq!(display.poll_transmit(), Some(Payload::Bytes(answer)));
/// ```
#[derive(Clone, Debug)]
pub struct Nd287DisplayNode {
    config: Nd287DisplayConfig,
    /// What has come of a command, behind its ESC.
    command: Option<Vec<u8>>,
    /// Where the head stood when the display was switched on.
    datum_m: Option<f64>,
    is_faulty: bool,
    replies: Replies,
    noise: Stream,
    jitter: Stream,
}

impl Nd287DisplayNode {
    /// A display without power; `seed` and `name` choose noise and jitter.
    pub fn new(config: &Nd287DisplayConfig, seed: u64, name: &str) -> Self {
        Self {
            config: config.clone(),
            command: None,
            datum_m: None,
            is_faulty: false,
            replies: Replies::new(),
            noise: Stream::new(seed, &format!("{name} noise")),
            jitter: Stream::new(seed, &format!("{name} reply")),
        }
    }

    fn take_byte(&mut self, now: Time, byte: u8, plant: &Plant) {
        match (&mut self.command, byte) {
            (_, ESC) => self.command = Some(Vec::new()),
            (None, STX) => {
                let value = self.value(plant);
                self.reply(now, value.emit());
            }
            (None, _) => {}
            (Some(_), b'\r') => {
                let command = self.command.take().unwrap_or_default();
                let answer = self.answer(&command);
                self.reply(now, answer);
            }
            (Some(command), _) if command.len() < COMMAND_MAX => command.push(byte),
            (Some(_), _) => self.command = None,
        }
    }

    fn answer(&self, command: &[u8]) -> Vec<u8> {
        let word = core::str::from_utf8(command).ok();
        match word.and_then(Command::parse) {
            Some(Command::Identification) => self.identification().emit(),
            Some(Command::ErrorText) if self.is_faulty => b"\x02SIGNAL X1    \r\n".to_vec(),
            Some(Command::ErrorText) | None => vec![NAK],
        }
    }

    fn identification(&self) -> Identification {
        let [software, version] = self.config.software.clone();
        Identification {
            name: self.config.name.clone(),
            software,
            version,
        }
    }

    fn reply(&mut self, now: Time, answer: Vec<u8>) {
        let wait_ms = self.config.reply_ms + self.config.reply_jitter_ms * self.jitter.uniform();
        let at = now + Duration::from_secs_f64(wait_ms * 1e-3);
        self.replies.push_in_order(at, answer);
    }

    fn value(&mut self, plant: &Plant) -> MeasuredValue {
        let shown_m = self.watch(plant) - self.datum_m.unwrap_or_default();
        let noise_m = self.config.noise_nm * 1e-9 * self.noise.gaussian();
        MeasuredValue {
            value: (shown_m + noise_m) * 1e3,
            decimals: self.config.decimals,
            unit: if self.is_faulty {
                Unit::Fault
            } else {
                Unit::Millimetre
            },
            sorted: b' ',
            shown: b' ',
        }
    }

    /// What the scale says; a fault stays.
    fn watch(&mut self, plant: &Plant) -> f64 {
        let Some(seen) = plant.scanned() else {
            self.is_faulty = true;
            return 0.0;
        };
        let is_too_fast = seen.speed_m_per_s.abs() > self.config.speed_max_m_per_s;
        self.is_faulty |= is_too_fast || !seen.is_clean;
        let slipped_m = seen.slipped as f64 * self.config.signal_period_um * 1e-6;
        seen.position.value() * (1.0 - self.config.scale_error_ppm * 1e-6) + slipped_m
    }

    fn reset(&mut self) {
        self.command = None;
        self.is_faulty = false;
    }
}

impl Section for Nd287DisplayConfig {
    fn check(&self, _: &PlantConfig) -> Result<(), ConfigError> {
        if self.decimals > DECIMALS_MAX {
            return Err(ConfigError::Value {
                key: "decimals",
                seen: self.decimals as f64,
                expected: "at most 6",
            });
        }
        positive("signal_period_um", self.signal_period_um)?;
        positive("speed_max_m_per_s", self.speed_max_m_per_s)
    }

    fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        Box::new(Nd287DisplayNode::new(self, seed, name))
    }
}

impl Node for Nd287DisplayNode {
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

    fn power_on(&mut self, now: Time, plant: &mut Plant) {
        self.reset();
        self.datum_m = plant.scanned().map(|seen| seen.position.value());
        self.replies.power_on(now, self.config.boot_ms);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Beam, Servo};
    use units::Metres;

    struct Rig {
        node: Nd287DisplayNode,
        plant: Plant,
        now: Time,
    }

    impl Rig {
        fn new() -> Self {
            let config = Nd287DisplayConfig {
                boot_ms: 0.0,
                ..Nd287DisplayConfig::default()
            };
            let mut rig = Self {
                node: Nd287DisplayNode::new(&config, 1, "display"),
                plant: Plant::default(),
                now: Time::ZERO,
            };
            rig.node.power_on(Time::ZERO, &mut rig.plant);
            rig
        }

        fn ask(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
            let payload = Payload::Bytes(bytes.to_vec());
            self.node.handle(self.now, &payload, &mut self.plant);
            let at = self.node.next_event();
            if at == Time::NEVER {
                return None;
            }
            assert!(at.since(self.now) <= Duration::from_millis(50));
            self.now = at;
            self.plant.advance(at);
            self.node.advance(at, &mut self.plant);
            match self.node.poll_transmit() {
                Some(Payload::Bytes(answer)) => Some(answer),
                other => panic!("{other:?}"),
            }
        }

        fn value(&mut self) -> MeasuredValue {
            let answer = self.ask(&[STX]).expect("an answer");
            let line = answer.strip_suffix(b"\r\n").expect("a line");
            MeasuredValue::parse(line).expect("a measured value")
        }

        fn go(&mut self, demand: Metres) {
            let demand = demand.value();
            self.plant.set_servo(0, Servo::Follow { demand });
            self.now += Duration::from_millis(400);
            self.plant.advance(self.now);
        }
    }

    #[test]
    fn it_shows_how_far_the_stage_has_moved() {
        let mut rig = Rig::new();
        let (before, from) = (rig.value(), rig.plant.truth().position());
        rig.go(Metres(1e-3));
        let (after, to) = (rig.value(), rig.plant.truth().position());
        let shown_mm = after.value - before.value;
        let moved_mm = (to - from).mm();
        assert!((shown_mm - moved_mm).abs() < 1e-4, "{shown_mm} {moved_mm}");
        assert_eq!(after.unit, Unit::Millimetre);
    }

    #[test]
    fn a_dirty_scale_is_a_fault_that_stays() {
        let mut rig = Rig::new();
        rig.plant.set_beam(Beam::Blocked);
        assert_eq!(rig.value().unit, Unit::Fault);
        rig.plant.set_beam(Beam::Good);
        assert_eq!(rig.value().unit, Unit::Fault);
        assert_eq!(rig.ask(b"\x1bA0301\r").unwrap()[0], STX);
    }

    #[test]
    fn a_count_that_slips_is_wrong_by_signal_periods() {
        let mut rig = Rig::new();
        let before = rig.value().value;
        rig.plant.slip_fringes(3);
        let slipped_um = (rig.value().value - before) * 1e3;
        assert!((slipped_um - 12.0).abs() < 0.1, "{slipped_um}");
    }

    #[test]
    fn commands_are_answered_in_pieces_and_refused_when_they_are_not_known() {
        let mut rig = Rig::new();
        assert_eq!(rig.ask(b"\x1bA00"), None);
        let answer = rig.ask(b"00\r").unwrap();
        assert!(answer.starts_with(b"\x02ND-287    \r\n"), "{answer:?}");
        assert_eq!(rig.ask(b"\x1bA9999\r").unwrap(), [NAK]);
        assert_eq!(rig.ask(b"hello\r"), None);
    }
}
