//! The state of one port: a CAN bus or a serial line, as the host sees it.

use core::time::Duration;
use std::collections::VecDeque;

use units::Time;
use wire::can::CanFrame;
use wire::{LineControl, Payload, Port};

use super::{DeliverError, Link};
use crate::bus::{CanBus, Sender};
use crate::config::PortConfig;
use crate::span::seconds;

/// Start, eight data and stop bits.
const BITS_PER_BYTE: u64 = 10;

pub(super) struct PortState {
    pub(super) name: String,
    pub(super) link: Link,
    latency: Duration,
    /// Zero when it hands over at any time.
    every: Duration,
    pub(super) medium: Medium,
}

pub(super) enum Medium {
    Can(CanPort),
    Serial(SerialPort),
}

pub(super) struct CanPort {
    pub(super) bus: CanBus,
    queue_max: usize,
    held_back: Option<(Sender, CanFrame)>,
}

#[derive(Default)]
pub(super) struct SerialPort {
    byte_ns: u64,
    device_free: Time,
    host_free: Time,
    to_device: VecDeque<(Time, Payload)>,
    kept: Vec<u8>,
}

impl PortState {
    pub(super) fn new(config: &PortConfig) -> Self {
        let (latency_us, every_us, medium) = match config {
            PortConfig::Can(can) => (
                can.latency_us,
                can.hands_over_every_us,
                Medium::Can(CanPort {
                    bus: CanBus::new(can.bitrate_kbit_per_s),
                    queue_max: can.transmit_queue_frames,
                    held_back: None,
                }),
            ),
            PortConfig::Serial(line) => (
                line.latency_us,
                line.hands_over_every_us,
                Medium::Serial(SerialPort::new(line)),
            ),
        };
        Self {
            name: config.name().to_owned(),
            link: Link::Up,
            latency: seconds(latency_us * 1e-6),
            every: seconds(every_us * 1e-6),
            medium,
        }
    }

    /// When the host gets what is through at `through`.
    pub(super) fn handed_over(&self, through: Time) -> Time {
        let ready = through + self.latency;
        match self.every.as_nanos() as u64 {
            0 => ready,
            every => Time(ready.0.next_multiple_of(every)),
        }
    }

    /// Takes what the host sends.
    pub(super) fn take(
        &mut self,
        now: Time,
        port: Port,
        payload: &Payload,
    ) -> Result<(), DeliverError> {
        let link = self.link;
        let usable = link == Link::Up;
        match (&mut self.medium, payload) {
            (Medium::Can(_), Payload::Bytes(_) | Payload::Control(_))
            | (Medium::Serial(_), Payload::Frame(_)) => Err(DeliverError::WrongKind { port }),
            _ if !usable => Err(DeliverError::Unusable { port, link }),
            (Medium::Can(can), Payload::Frame(frame)) => {
                if can.bus.host_waiting() >= can.queue_max {
                    return Err(DeliverError::QueueFull { port });
                }
                can.bus.send(Sender::Host, *frame);
                Ok(())
            }
            (Medium::Serial(line), Payload::Bytes(bytes)) => {
                let start = now.max(line.host_free);
                line.host_free = start + line.span(bytes.len());
                line.to_device.push_back((line.host_free, payload.clone()));
                Ok(())
            }
            (Medium::Serial(line), Payload::Control(control)) => {
                let at = now.max(line.host_free);
                line.to_device.push_back((at, payload.clone()));
                line.control(*control);
                Ok(())
            }
        }
    }

    pub(super) fn next_event(&self, now: Time) -> Time {
        match &self.medium {
            Medium::Can(can) if can.bus.wants_start() => now,
            Medium::Can(can) => can.bus.done_at(),
            Medium::Serial(line) => line.to_device.front().map_or(Time::NEVER, |(at, _)| *at),
        }
    }

    /// What has reached the devices' side by `now`.
    pub(super) fn arrived(&mut self, now: Time) -> Option<(Sender, Payload)> {
        match &mut self.medium {
            Medium::Can(can) => {
                let (sender, frame) = can.bus.complete(now)?;
                Some((sender, Payload::Frame(frame)))
            }
            Medium::Serial(line) => {
                if line.to_device.front()?.0 > now {
                    return None;
                }
                let (_, payload) = line.to_device.pop_front()?;
                Some((Sender::Host, payload))
            }
        }
    }

    pub(super) fn arbitrate(&mut self, now: Time) {
        if let Medium::Can(can) = &mut self.medium {
            can.bus.start(now);
        }
    }

    pub(super) fn send_frame(&mut self, sender: Sender, frame: CanFrame) {
        if let Medium::Can(can) = &mut self.medium {
            can.bus.send(sender, frame);
        }
    }

    /// When `bytes` that the device starts to send at `start` are through.
    pub(super) fn line_time(&mut self, start: Time, bytes: usize) -> Time {
        let Medium::Serial(line) = &mut self.medium else {
            return start;
        };
        let through = start.max(line.device_free) + line.span(bytes);
        line.device_free = through;
        through
    }

    pub(super) fn hold_back(&mut self, sender: Sender, frame: CanFrame) {
        if let Medium::Can(can) = &mut self.medium {
            can.held_back = Some((sender, frame));
        }
    }

    pub(super) fn held_back(&mut self) -> Option<(Sender, CanFrame)> {
        match &mut self.medium {
            Medium::Can(can) => can.held_back.take(),
            Medium::Serial(_) => None,
        }
    }

    pub(super) fn keep(&mut self, bytes: Vec<u8>) {
        if let Medium::Serial(line) = &mut self.medium {
            line.kept = bytes;
        }
    }

    pub(super) fn take_kept(&mut self) -> Vec<u8> {
        match &mut self.medium {
            Medium::Serial(line) => core::mem::take(&mut line.kept),
            Medium::Can(_) => Vec::new(),
        }
    }

    pub(super) fn forget(&mut self, sender: Sender) {
        if let Medium::Can(can) = &mut self.medium {
            can.bus.forget(sender);
        }
    }

    pub(super) fn busy(&self) -> Option<Duration> {
        match &self.medium {
            Medium::Can(can) => Some(can.bus.busy()),
            Medium::Serial(_) => None,
        }
    }
}

impl SerialPort {
    fn new(config: &crate::config::SerialConfig) -> Self {
        Self {
            byte_ns: config.baud_bit_per_s.map_or(0, byte_ns),
            ..Self::default()
        }
    }

    /// The host's rate is the line's, except where the line is USB.
    fn control(&mut self, control: LineControl) {
        if let LineControl::Baud(baud) = control
            && self.byte_ns > 0
        {
            self.byte_ns = byte_ns(baud);
        }
    }

    const fn span(&self, bytes: usize) -> Duration {
        Duration::from_nanos(self.byte_ns * bytes as u64)
    }
}

fn byte_ns(baud: u32) -> u64 {
    BITS_PER_BYTE * 1_000_000_000 / u64::from(baud.max(1))
}
