//! Everything that passed the machine's ports: always as a number, on demand as text.

use units::Time;
use wire::{Payload, Port};

use super::{Delivery, Event};
use crate::random::{FNV_START, fnv1a_bytes};

#[derive(Clone, Copy, Debug)]
pub(super) enum Direction {
    FromHost,
    ToHost,
}

#[derive(Debug)]
pub(super) struct Log {
    hash: u64,
    lines: Option<Vec<String>>,
}

impl Default for Log {
    fn default() -> Self {
        Self {
            hash: FNV_START,
            lines: None,
        }
    }
}

impl Log {
    pub(super) const fn hash(&self) -> u64 {
        self.hash
    }

    pub(super) fn keep_text(&mut self) {
        self.lines.get_or_insert_default();
    }

    pub(super) fn lines(&self) -> &[String] {
        self.lines.as_deref().unwrap_or_default()
    }

    pub(super) fn delivery(&mut self, delivery: &Delivery) {
        let (at, port) = (delivery.at, delivery.port);
        match &delivery.event {
            Event::Payload(payload) => self.payload(at, port, Direction::ToHost, payload),
            other => {
                let text = format!("{other:?}");
                self.add(at, port, Direction::ToHost, text.as_bytes());
                self.write(at, port, Direction::ToHost, || text.clone());
            }
        }
    }

    pub(super) fn payload(&mut self, at: Time, port: Port, way: Direction, payload: &Payload) {
        match payload {
            Payload::Frame(frame) => {
                let id = frame.id().raw().to_le_bytes();
                self.add(at, port, way, &id);
                self.hash = fnv1a_bytes(self.hash, frame.data());
            }
            Payload::Bytes(bytes) => self.add(at, port, way, bytes),
            Payload::Control(control) => self.add(at, port, way, format!("{control:?}").as_bytes()),
        }
        self.write(at, port, way, || match payload {
            Payload::Frame(frame) => frame.to_string(),
            Payload::Bytes(bytes) => String::from_utf8_lossy(bytes).escape_debug().to_string(),
            Payload::Control(control) => format!("{control:?}"),
        });
    }

    fn add(&mut self, at: Time, port: Port, way: Direction, bytes: &[u8]) {
        self.hash = fnv1a_bytes(self.hash, &at.0.to_le_bytes());
        self.hash = fnv1a_bytes(self.hash, &[port.0, way as u8]);
        self.hash = fnv1a_bytes(self.hash, bytes);
    }

    fn write(&mut self, at: Time, port: Port, way: Direction, text: impl FnOnce() -> String) {
        if let Some(lines) = &mut self.lines {
            let arrow = match way {
                Direction::FromHost => '<',
                Direction::ToHost => '>',
            };
            lines.push(format!("{:015} {} {arrow} {}", at.0, port.0, text()));
        }
    }
}
