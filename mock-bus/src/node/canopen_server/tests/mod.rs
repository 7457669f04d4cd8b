//! The node's dialogs, byte by byte.

mod blocks;
mod habits;
mod impolite;
mod management;
mod process;
mod transfers;

use std::time::Duration;

use units::Time;
use wire::can::{CanFrame, CanId};
use wire::canopen::pdo::MappedObject;

use super::dictionary::{Access, Bounds, Entry, Kind, Mapping};
use super::{
    CanopenServer, Description, Dictionary, Identity, Manners, NamedObject, PdoDefault, ServerEvent,
};
use wire::canopen::NodeId;

pub(super) const LOG: usize = 300;

fn application() -> Dictionary {
    let mut dictionary = Dictionary::default();
    let word = Entry::read_write(Kind::U16, 0x1234).mapped(Mapping::Both);
    dictionary.insert(0x6040, 0, word.bounded(Bounds::Between(0, 0x7FFF)));
    dictionary.insert(
        0x6041,
        0,
        Entry::read_only(Kind::U16, 0x0250).mapped(Mapping::Transmit),
    );
    dictionary.insert(
        0x6064,
        0,
        Entry::read_only(Kind::I32, -2).mapped(Mapping::Transmit),
    );
    dictionary.insert(
        0x607A,
        0,
        Entry::read_write(Kind::I32, 0).mapped(Mapping::Receive),
    );
    let mode = Entry::read_write(Kind::I8, 1).bounded(Bounds::OneOf(&[1, 6]));
    dictionary.insert(0x6060, 0, mode.mapped(Mapping::Receive));
    dictionary.insert(0x6085, 0, Entry::number(Kind::U32, Access::WriteOnly, 7));
    let log = (0..LOG).map(|place| place as u8).collect();
    dictionary.insert(0x2000, 0, Entry::octets(Access::ReadOnly, LOG, log));
    dictionary.insert(
        0x2001,
        0,
        Entry::octets(Access::ReadWrite, 1000, Vec::new()),
    );
    dictionary
}

fn description() -> Description {
    let rpdo = |cob_id, mapping: &[MappedObject]| PdoDefault {
        cob_id,
        transmission: 255,
        mapping: mapping.to_vec(),
        ..PdoDefault::default()
    };
    let controlword = MappedObject::new(0x6040, 0, 16);
    let statusword = MappedObject::new(0x6041, 0, 16);
    let position = MappedObject::new(0x6064, 0, 32);
    Description {
        device_type: 0x0002_0192,
        device_name: "a drive with a long name".into(),
        hardware_version: "1".into(),
        software_version: "abcdefg".into(),
        identity: Identity::default(),
        heartbeat_ms: 0,
        rpdos: vec![
            rpdo(0x201, &[controlword]),
            rpdo(0x8000_0301, &[controlword]),
        ],
        tpdos: vec![
            rpdo(0x4000_0181, &[statusword]),
            rpdo(0xC000_0281, &[statusword, position]),
        ],
    }
}

/// Node 1 with a clock that the test moves.
pub(super) struct Bench {
    pub(super) server: CanopenServer,
    pub(super) now: Time,
}

impl Bench {
    /// Booted, in pre-operational.
    pub(super) fn new() -> Self {
        let mut bench = Self::with(Manners::default());
        assert_eq!(bench.wait_ms(10), ["701#00"]);
        bench.events();
        bench
    }

    /// Powered, not yet booted.
    pub(super) fn with(manners: Manners) -> Self {
        let node = NodeId::new(1).unwrap();
        let boot = Duration::from_millis(10);
        Self {
            server: CanopenServer::new(node, boot, &description(), application(), manners),
            now: Time::ZERO,
        }
    }

    pub(super) fn sent(&mut self) -> Vec<String> {
        let frames = std::iter::from_fn(|| self.server.poll_transmit());
        frames.map(|frame| frame.to_string()).collect()
    }

    pub(super) fn events(&mut self) -> Vec<ServerEvent> {
        std::iter::from_fn(|| self.server.poll_event()).collect()
    }

    /// Passes every event of the node on the way.
    pub(super) fn wait_ms(&mut self, ms: u64) -> Vec<String> {
        let end = self.now + Duration::from_millis(ms);
        while self.server.next_event() <= end {
            self.now = self.now.max(self.server.next_event());
            self.server.advance(self.now);
        }
        self.now = end;
        self.server.advance(end);
        self.sent()
    }

    /// Sends a frame as candump writes it; the answers.
    #[track_caller]
    pub(super) fn ask(&mut self, frame: &str) -> Vec<String> {
        self.server.handle(self.now, &parse(frame));
        self.sent()
    }

    /// A whole dialog: each frame and its only answer.
    #[track_caller]
    pub(super) fn dialog(&mut self, exchanges: &[(&str, &str)]) {
        for (request, answer) in exchanges {
            let seen = self.ask(request);
            let expected: Vec<&str> = answer.split(' ').filter(|s| !s.is_empty()).collect();
            assert_eq!(seen, expected, "after {request}");
        }
    }

    pub(super) fn start(&mut self) {
        self.server.handle(self.now, &parse("000#0101"));
        self.events();
    }
}

fn parse(text: &str) -> CanFrame {
    let (id, data) = text.split_once('#').unwrap();
    let id = u16::from_str_radix(id, 16).unwrap();
    if let Some(length) = data.strip_prefix('R') {
        let id = CanId::standard(id).unwrap();
        return CanFrame::remote(id, length.parse().unwrap()).unwrap();
    }
    let byte = |place| u8::from_str_radix(&data[place..place + 2], 16).unwrap();
    let bytes: Vec<u8> = (0..data.len()).step_by(2).map(byte).collect();
    CanFrame::standard(id, &bytes)
}
