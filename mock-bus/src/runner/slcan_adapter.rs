//! A CAN adapter on a serial line, as Lawicel's CAN232 behaves; sans-io.
//!
//! Source: Lawicel AB, CAN232 manual version 3. The bit rate must be set before the channel is
//! opened and cannot change while it is open; a wrong or impossible command is answered by
//! BEL. An adapter that is set to another bit rate than the bus's hears nothing and its frames
//! reach nobody.
//!
//! Absent: acceptance filters (`M`, `m`), polling (`A`, `P`, `X`), `s` bit timing.

use units::Time;
use wire::can::{BusError, BusErrorClass, CanFrame, CanId, ControllerProblem};
use wire::slcan::{
    BitrateCode, BusState, CR, Command, LineBuffer, Reply, StatusFlags, TIMESTAMP_PERIOD_MS,
};

const VERSION: [u8; 4] = *b"1013";
const SERIAL: [u8; 4] = *b"TS01";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channel {
    Closed,
    Open,
    ListenOnly,
}

/// What a byte from the host leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// These bytes go back to the host.
    Reply(Vec<u8>),
    /// This frame goes to the bus; the host is then told by [`SlcanAdapter::transmitted`].
    Transmit(CanFrame),
}

#[derive(Clone, Debug)]
pub(super) struct SlcanAdapter {
    bus_bit_per_s: u32,
    channel: Channel,
    bitrate: Option<BitrateCode>,
    timestamps: bool,
    flags: StatusFlags,
    lines: LineBuffer,
}

impl SlcanAdapter {
    /// A closed adapter on a bus of this bit rate.
    pub(super) fn new(bus_bit_per_s: u32) -> Self {
        Self {
            bus_bit_per_s,
            channel: Channel::Closed,
            bitrate: None,
            timestamps: false,
            flags: StatusFlags::empty(),
            lines: LineBuffer::default(),
        }
    }

    /// Takes one byte of the host.
    pub(super) fn take(&mut self, byte: u8) -> Option<Action> {
        let line = self.lines.push(byte)?;
        let command = Command::parse(&line)?;
        Some(match self.obey(command) {
            Ok(Done::Replied(reply)) => Action::Reply(reply.emit()),
            Ok(Done::Transmit(frame)) => Action::Transmit(frame),
            Err(Refused) => Action::Reply(Reply::Refused.emit()),
        })
    }

    fn obey(&mut self, command: Command) -> Result<Done, Refused> {
        let closed = self.channel == Channel::Closed;
        let reply = match command {
            Command::Bitrate(code) if closed => {
                self.bitrate = Some(code);
                Reply::Done
            }
            Command::Timestamps(on) if closed => {
                self.timestamps = on;
                Reply::Done
            }
            Command::Open if closed => self.open(Channel::Open)?,
            Command::OpenListenOnly if closed => self.open(Channel::ListenOnly)?,
            Command::Close if !closed => {
                self.channel = Channel::Closed;
                Reply::Done
            }
            Command::Transmit(frame) if self.channel == Channel::Open => {
                return Ok(Done::Transmit(frame));
            }
            Command::ReadStatus if !closed => {
                Reply::Status(core::mem::replace(&mut self.flags, StatusFlags::empty()))
            }
            Command::ReadVersion => Reply::Version(VERSION),
            Command::ReadSerial => Reply::Serial(SERIAL),
            _ => return Err(Refused),
        };
        Ok(Done::Replied(reply))
    }

    fn open(&mut self, channel: Channel) -> Result<Reply, Refused> {
        self.bitrate.ok_or(Refused)?;
        self.channel = channel;
        Ok(Reply::Done)
    }

    /// Whether adapter and bus understand each other.
    pub(super) fn in_tune(&self) -> bool {
        self.bitrate
            .is_some_and(|code| code.bitrate() == self.bus_bit_per_s)
    }

    /// What the host is told about the frame that it sent.
    pub(super) fn transmitted(&mut self, frame: &CanFrame, taken: bool) -> Vec<u8> {
        if !taken {
            self.flags |= StatusFlags::TX_FULL;
            return Reply::Refused.emit();
        }
        if !self.in_tune() {
            self.flags |= StatusFlags::BUS_ERROR;
        }
        match frame.id() {
            CanId::Standard(_) => vec![b'z', CR],
            CanId::Extended(_) => vec![b'Z', CR],
        }
    }

    /// What the host is told about a frame on the bus; nothing while closed or out of tune.
    pub(super) fn received(&mut self, at: Time, frame: CanFrame) -> Vec<u8> {
        if self.channel == Channel::Closed {
            return Vec::new();
        }
        if !self.in_tune() {
            self.flags |= StatusFlags::BUS_ERROR;
            return Vec::new();
        }
        let ms = at.nanos() / 1_000_000 % u64::from(TIMESTAMP_PERIOD_MS);
        let timestamp_ms = self.timestamps.then_some(ms as u16);
        Reply::Received {
            frame,
            timestamp_ms,
        }
        .emit()
    }

    /// What the host is told about an error: the state report that the Linux driver reads.
    pub(super) fn bus_error(&mut self, error: BusError) -> Vec<u8> {
        let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
        let state = if error.class.contains(BusErrorClass::BUS_OFF) {
            BusState::Off
        } else if error.controller.intersects(passive) {
            self.flags |= StatusFlags::PASSIVE;
            BusState::Passive
        } else {
            BusState::Active
        };
        match self.channel {
            Channel::Closed => Vec::new(),
            Channel::Open | Channel::ListenOnly => Reply::BusState(state).emit(),
        }
    }
}

enum Done {
    Replied(Reply),
    Transmit(CanFrame),
}

struct Refused;

#[cfg(test)]
mod tests {
    use super::*;

    const REFUSED: &[u8] = &[0x07];

    fn say(adapter: &mut SlcanAdapter, line: &str) -> Vec<Action> {
        line.bytes().filter_map(|byte| adapter.take(byte)).collect()
    }

    fn check(adapter: &mut SlcanAdapter, line: &str, expected: &[u8]) {
        assert_eq!(
            say(adapter, line),
            [Action::Reply(expected.to_vec())],
            "{line:?}"
        );
    }

    fn open() -> SlcanAdapter {
        let mut adapter = SlcanAdapter::new(1_000_000);
        check(&mut adapter, "S8\r", b"\r");
        check(&mut adapter, "O\r", b"\r");
        adapter
    }

    #[test]
    fn it_opens_only_with_a_bit_rate_and_only_once() {
        let mut adapter = SlcanAdapter::new(1_000_000);
        check(&mut adapter, "O\r", REFUSED);
        check(&mut adapter, "C\r", REFUSED);
        let mut adapter = open();
        check(&mut adapter, "O\r", REFUSED);
        check(&mut adapter, "S6\r", REFUSED);
        check(&mut adapter, "C\r", b"\r");
        check(&mut adapter, "S6\r", b"\r");
    }

    #[test]
    fn frames_go_both_ways_while_it_is_open() {
        let mut adapter = open();
        let frame = CanFrame::standard(0x181, &[0x27, 0x02]);
        assert_eq!(say(&mut adapter, "t18122702\r"), [Action::Transmit(frame)]);
        assert_eq!(adapter.transmitted(&frame, true), b"z\r");
        assert_eq!(adapter.received(Time::ZERO, frame), b"t18122702\r");
        check(&mut adapter, "C\r", b"\r");
        assert_eq!(adapter.received(Time::ZERO, frame), b"");
        check(&mut adapter, "t18122702\r", REFUSED);
    }

    #[test]
    fn time_stamps_wrap_at_a_minute() {
        let mut adapter = SlcanAdapter::new(1_000_000);
        for line in ["Z1\r", "S8\r", "O\r"] {
            check(&mut adapter, line, b"\r");
        }
        let frame = CanFrame::standard(0x80, &[]);
        let at = Time(60_010 * 1_000_000);
        assert_eq!(adapter.received(at, frame), b"t0800000A\r");
    }

    #[test]
    fn a_full_queue_is_refused_and_flagged_once() {
        let mut adapter = open();
        let frame = CanFrame::standard(0x80, &[]);
        assert_eq!(adapter.transmitted(&frame, false), REFUSED);
        check(&mut adapter, "F\r", b"F02\r");
        check(&mut adapter, "F\r", b"F00\r");
    }

    #[test]
    fn out_of_tune_it_hears_nothing() {
        let mut adapter = SlcanAdapter::new(500_000);
        for line in ["S8\r", "O\r"] {
            check(&mut adapter, line, b"\r");
        }
        assert_eq!(
            adapter.received(Time::ZERO, CanFrame::standard(0x80, &[])),
            b""
        );
        check(&mut adapter, "F\r", b"F80\r");
    }

    #[test]
    fn nonsense_is_refused_and_an_empty_line_ignored() {
        let mut adapter = open();
        check(&mut adapter, "hello\r", REFUSED);
        check(&mut adapter, "t1812\r", REFUSED);
        assert!(say(&mut adapter, "\r\r").is_empty());
        check(&mut adapter, "V\r", b"V1013\r");
        check(&mut adapter, "N\r", b"NTS01\r");
    }
}
