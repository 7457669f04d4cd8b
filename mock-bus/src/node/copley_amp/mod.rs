//! Emulated Copley Controls servo amplifiers behind one serial line.
//!
//! Source: ASCII Programmer's Guide, 16-01196 rev. 01 (pages below are its). One amplifier is at
//! the cable; it obeys commands without a node number and forwards the others over CAN (p. 63). The
//! rate of the line is that amplifier's alone: 9600 bit/s after power-on, reset and BREAK (p. 7),
//! and its reply to a new rate comes at the new rate (p. 42).
//!
//! It does what the guide warns of: at another rate than the host's it receives and sends garbage,
//! a low level of more than a byte's length is a BREAK, also when it is only the bits of a much
//! slower host; for 100 ms after a change of rate it is deaf; a node that does not answer is error
//! 32; `ok` to `t 1` says nothing about motion.
//!
//! Absent: several axes in one amplifier, S-curves, velocity moves, writing the position,
//! copying to and from flash, program registers, homing other than 512, 513, 529, 545
//! and 561.

mod amp;
mod config;
mod health;
#[cfg(test)]
mod tests;

use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};

use units::Time;
use wire::copley::{
    Address, BAUD_AT_RESET, CR, Command, ErrorCode, Faults, LINE_MAX, Reply, Request,
};
use wire::{LineControl, Payload};

pub use config::{AmpQuirks, CopleyAmpConfig, CopleyAmpsConfig, LineQuirks};

use super::{Node, Section};
use crate::config::error::ConfigError;
use crate::plant::Plant;
use crate::plant::config::PlantConfig;
use crate::random::Stream;
use amp::Amp;

/// What comes sooner after a change of rate is not heard (p. 42).
const DEAF: Duration = Duration::from_millis(100);
/// Rates that differ by less understand each other.
const RATE_TOLERANCE: f64 = 0.03;

/// Amplifiers, the first of which is at the cable.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::copley_amp::{CopleyAmpsConfig, CopleyAmpsNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::Payload;
///
/// let (config, mut plant) = (CopleyAmpsConfig::default(), Plant::default());
/// let mut amps = CopleyAmpsNode::new(&config, 1, "amps");
/// amps.power_on(Time::ZERO, &mut plant);
/// amps.advance(Time::from_seconds(2.0), &mut plant);
/// let asked = Payload::Bytes(b"g r0x90\r".to_vec());
/// amps.handle(Time::from_seconds(2.0), &asked, &mut plant);
/// amps.advance(Time::from_seconds(2.1), &mut plant);
/// // 9600 bit/s, which its clock cannot make exactly.
/// assert_eq!(amps.poll_transmit(), Some(Payload::Bytes(b"v 9603\r".to_vec())));
/// ```
pub struct CopleyAmpsNode {
    config: CopleyAmpsConfig,
    amps: Vec<Amp>,
    port: SerialPort,
    replies: VecDeque<PendingReply>,
    outbox: VecDeque<Payload>,
    /// Power to be switched, by address.
    switches: Vec<(u8, bool)>,
    jitter: Stream,
    delivered: BTreeMap<&'static str, u64>,
}

struct PendingReply {
    at: Time,
    bytes: Vec<u8>,
    /// The rate at which it leaves.
    rate: u32,
}

/// The serial port of the amplifier at the cable.
struct SerialPort {
    rate: u32,
    /// The host's, once it has said so.
    host_rate: Option<u32>,
    line: Vec<u8>,
    deaf_until: Time,
}

impl SerialPort {
    fn reset(&mut self) {
        self.rate = BAUD_AT_RESET;
        self.line.clear();
    }

    fn understands(&self) -> bool {
        self.host_rate.is_none_or(|host| {
            let ratio = f64::from(host) / f64::from(self.rate);
            (ratio - 1.0).abs() < RATE_TOLERANCE
        })
    }

    /// Whether the low bits of a byte at the host's rate last longer here than a byte does.
    fn takes_for_break(&self, byte: u8) -> bool {
        // The start bit and the bits that follow it low, least significant first.
        let low_bits = 1 + byte.trailing_zeros().min(8);
        let longer = self.host_rate.map_or(0.0, |host| {
            f64::from(low_bits) * f64::from(self.rate) / f64::from(host)
        });
        longer >= 10.0
    }
}

/// What a byte becomes between two rates.
const fn garbled(byte: u8) -> u8 {
    byte.rotate_left(3) ^ 0xD5 | 0x80
}

impl CopleyAmpsNode {
    /// Amplifiers without power; `seed` and `name` choose their jitter.
    pub fn new(config: &CopleyAmpsConfig, seed: u64, name: &str) -> Self {
        Self {
            amps: config.amps.iter().cloned().map(Amp::new).collect(),
            port: SerialPort {
                rate: BAUD_AT_RESET,
                host_rate: None,
                line: Vec::new(),
                deaf_until: Time::ZERO,
            },
            replies: VecDeque::new(),
            outbox: VecDeque::new(),
            switches: Vec::new(),
            jitter: Stream::new(seed, &format!("{name} reply")),
            delivered: BTreeMap::new(),
            config: config.clone(),
        }
    }

    /// How the line misbehaves; writing it spoils what comes next.
    pub const fn quirks_mut(&mut self) -> &mut LineQuirks {
        &mut self.config.quirks
    }

    /// How the amplifier at `address` misbehaves; `None` where there is none.
    pub fn amp_quirks_mut(&mut self, address: u8) -> Option<&mut AmpQuirks> {
        Some(&mut self.amp_mut(address)?.config.quirks)
    }

    /// How often each quirk of the line was delivered, by its key.
    pub fn deliveries(&self, key: &str) -> u64 {
        self.delivered.get(key).copied().unwrap_or(0)
    }

    /// The amplifier at `address` finds `faults`, which latch; with none their causes are gone.
    pub fn set_faults(&mut self, address: u8, faults: Faults) {
        if let Some(amp) = self.amp_mut(address) {
            amp.set_causes(faults);
        }
    }

    /// The amplifier at `address` loses its power, or gets it back, when the node is advanced
    /// next.
    pub fn set_power(&mut self, address: u8, on: bool) {
        self.switches.push((address, on));
    }

    fn switch_power(&mut self, now: Time, plant: &mut Plant) {
        for (address, on) in core::mem::take(&mut self.switches) {
            if address == 0 && !on {
                self.reset_port();
                self.replies.clear();
            }
            match self.amp_mut(address) {
                Some(amp) if on => amp.power_on(now, plant),
                Some(amp) => amp.power_off(plant),
                None => {}
            }
        }
    }

    fn reset_port(&mut self) {
        self.port.reset();
        if let Some(amp) = self.amp_mut(0) {
            amp.reset_rate();
        }
    }

    /// When the last move of the amplifier at `address` truly began: for judges only.
    pub fn moved_at(&self, address: u8) -> Option<Time> {
        let amp = self.amps.iter().find(|amp| amp.config.address == address)?;
        amp.moved_at()
    }

    /// The rate of the line, as the amplifier at the cable has it: for judges only.
    pub const fn rate(&self) -> u32 {
        self.port.rate
    }

    fn amp_mut(&mut self, address: u8) -> Option<&mut Amp> {
        self.amps
            .iter_mut()
            .find(|amp| amp.config.address == address)
    }

    /// Uses up one delivery of a quota.
    fn take(&mut self, key: &'static str, quota: fn(&mut LineQuirks) -> &mut u32) -> bool {
        let left = quota(&mut self.config.quirks);
        if *left == 0 {
            return false;
        }
        *left -= 1;
        *self.delivered.entry(key).or_default() += 1;
        true
    }

    fn control(&mut self, control: LineControl) {
        match control {
            LineControl::Baud(rate) => self.port.host_rate = Some(rate),
            LineControl::Break(true) => self.reset_port(),
            LineControl::Break(false) => {}
        }
    }

    fn take_byte(&mut self, now: Time, byte: u8, plant: &mut Plant) {
        let listens = self.amp_mut(0).is_some_and(|amp| amp.listens(now));
        if !listens || now < self.port.deaf_until {
            return;
        }
        if self.port.takes_for_break(byte) {
            self.reset_port();
        } else if !self.port.understands() {
            self.push(garbled(byte));
        } else if byte == CR {
            let line = core::mem::take(&mut self.port.line);
            self.obey(now, &line, plant);
        } else {
            self.push(byte);
        }
    }

    fn push(&mut self, byte: u8) {
        // A longer line is no command any more, whatever follows.
        if self.port.line.len() <= LINE_MAX {
            self.port.line.push(byte);
        }
    }

    fn obey(&mut self, now: Time, line: &[u8], plant: &mut Plant) {
        if line.is_empty() {
            return;
        }
        let request = match Request::parse(line) {
            Ok(request) => request,
            Err(refused) => return self.reply(now, 0, Reply::Error(refused.code)),
        };
        if matches!(request.address.letter(), Some('b'..='d')) {
            return self.reply(now, 0, Reply::Error(ErrorCode::AxisLetter));
        }
        let trajectory = matches!(request.command, Command::Trajectory(_));
        if trajectory
            && self.take("lose_trajectory_commands", |q| {
                &mut q.lose_trajectory_commands
            })
        {
            return;
        }
        let node = request.address.node_number();
        let reply = self.execute(now, &request, plant);
        if trajectory
            && self.take("lose_trajectory_replies", |q| {
                &mut q.lose_trajectory_replies
            })
        {
            return;
        }
        if let Some(reply) = reply {
            let reply = self.spoil(now, &request, reply, plant);
            self.reply(now, node, reply);
        }
    }

    /// `None`: a restart is not answered.
    fn execute(&mut self, now: Time, request: &Request, plant: &mut Plant) -> Option<Reply> {
        let node = request.address.node_number();
        let Some(amp) = self.amp_mut(node).filter(|amp| amp.listens(now)) else {
            return Some(Reply::Error(ErrorCode::CanFailed));
        };
        if request.command == Command::Reset {
            amp.restart(now, plant);
            return match node {
                0 => {
                    self.reset_port();
                    None
                }
                // The one at the cable waits for it in vain (p. 13).
                _ => Some(Reply::Error(ErrorCode::CanFailed)),
            };
        }
        let reply = amp.execute(now, request.command, plant);
        if node == 0
            && let Some(rate) = amp.take_new_rate()
        {
            self.port.rate = rate;
            self.port.deaf_until = now + DEAF;
        }
        Some(reply)
    }

    fn spoil(&mut self, now: Time, request: &Request, reply: Reply, plant: &mut Plant) -> Reply {
        let Reply::Value(value) = reply else {
            return reply;
        };
        if self.take("wrong_digits", |q| &mut q.wrong_digits) {
            return Reply::Value(with_a_wrong_digit(&value));
        }
        if self.take("foreign_replies", |q| &mut q.foreign_replies) {
            let own = request.address.node_number();
            let other = self.amps.iter_mut().find(|amp| amp.config.address != own);
            if let Some(other) = other {
                return other.execute(now, request.command, plant);
            }
        }
        Reply::Value(value)
    }

    fn reply(&mut self, now: Time, node: u8, reply: Reply) {
        if self.take("lose_replies", |q| &mut q.lose_replies) {
            return;
        }
        let config = &self.config;
        let mut wait_ms = config.reply_ms + config.reply_jitter_ms * self.jitter.uniform();
        if node != 0 {
            wait_ms += config.forward_ms;
        }
        if reply == Reply::Error(ErrorCode::CanFailed) {
            wait_ms += config.forward_timeout_ms;
        }
        let mut at = now + Duration::from_secs_f64(wait_ms * 1e-3);
        if self.take("delay_replies", |q| &mut q.delay_replies) {
            at += Duration::from_millis(self.config.quirks.delay_ms.into());
        }
        // One after the other, in the order of the commands.
        let before = self.replies.back().map_or(Time::ZERO, |last| last.at);
        self.replies.push_back(PendingReply {
            at: at.max(before),
            bytes: reply.emit(),
            rate: self.port.rate,
        });
    }

    fn send(&mut self, reply: PendingReply) {
        let understood = self.port.host_rate.is_none_or(|host| {
            let ratio = f64::from(host) / f64::from(reply.rate);
            (ratio - 1.0).abs() < RATE_TOLERANCE
        });
        let bytes = if understood {
            reply.bytes
        } else {
            reply.bytes.into_iter().map(garbled).collect()
        };
        self.outbox.push_back(Payload::Bytes(bytes));
    }
}

/// One digit more or less, at the place of the most significant.
fn with_a_wrong_digit(value: &str) -> String {
    let at = value.find(|c: char| c.is_ascii_digit());
    let changed = |at: usize, c: char| match c.to_digit(10) {
        Some(digit) if at > 0 || digit > 0 => char::from_digit((digit + 4) % 10, 10).unwrap_or(c),
        _ => c,
    };
    value
        .char_indices()
        .map(
            |(place, c)| {
                if Some(place) == at { changed(1, c) } else { c }
            },
        )
        .collect()
}

impl Section for CopleyAmpsConfig {
    fn check(&self, plant: &PlantConfig) -> Result<(), ConfigError> {
        if !addresses_fit(self) {
            return Err(ConfigError::Value {
                key: "amps",
                seen: self.amps.len() as f64,
                expected: "amplifiers with different addresses up to 127, one of them 0",
            });
        }
        let resolution_nm = plant.resolution_nm();
        let odd = self
            .amps
            .iter()
            .find(|amp| amp.encoder_resolution_nm != resolution_nm);
        odd.map_or(Ok(()), |amp| {
            Err(ConfigError::Value {
                key: "encoder_resolution_nm",
                seen: amp.encoder_resolution_nm,
                expected: "the plant's resolution_nm",
            })
        })
    }

    fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        Box::new(CopleyAmpsNode::new(self, seed, name))
    }
}

impl Node for CopleyAmpsNode {
    fn handle(&mut self, now: Time, payload: &Payload, plant: &mut Plant) {
        match payload {
            Payload::Bytes(bytes) => {
                for byte in bytes {
                    self.take_byte(now, *byte, plant);
                }
            }
            Payload::Control(control) => self.control(*control),
            Payload::Frame(_) => {}
        }
    }

    fn advance(&mut self, now: Time, plant: &mut Plant) {
        self.switch_power(now, plant);
        for amp in &mut self.amps {
            amp.advance(now, plant);
        }
        while self.replies.front().is_some_and(|reply| reply.at <= now) {
            let reply = self.replies.pop_front();
            if let Some(reply) = reply {
                self.send(reply);
            }
        }
    }

    fn next_event(&self) -> Time {
        let reply = self.replies.front().map_or(Time::NEVER, |reply| reply.at);
        self.amps.iter().map(Amp::next_event).fold(reply, Time::min)
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn power_off(&mut self, _now: Time, plant: &mut Plant) {
        for amp in &mut self.amps {
            amp.power_off(plant);
        }
        self.reset_port();
        self.replies.clear();
        self.outbox.clear();
    }

    fn power_on(&mut self, now: Time, plant: &mut Plant) {
        for amp in &mut self.amps {
            amp.power_on(now, plant);
        }
    }
}

/// Whether the addresses of `config` can be: each once, one of them at the cable, none beyond
/// 127.
pub(crate) fn addresses_fit(config: &CopleyAmpsConfig) -> bool {
    let mut addresses: Vec<u8> = config.amps.iter().map(|amp| amp.address).collect();
    addresses.sort_unstable();
    let apart = addresses.windows(2).all(|pair| pair[0] != pair[1]);
    let known = addresses.iter().all(|node| Address::node(*node).is_some());
    apart && known && addresses.first() == Some(&0)
}
