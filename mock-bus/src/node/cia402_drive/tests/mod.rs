//! The drive as a master meets it, over a mechanism that follows its demand ideally.

mod cyclic;
mod faults;
mod homing;
mod modes;
mod positioning;
mod quirks;
mod rotary;
mod states;

use std::collections::VecDeque;
use std::time::Duration;

use units::Time;
use wire::can::CanFrame;
use wire::canopen::sdo::{AbortCode, Expedited, SdoRequest, SdoResponse};
use wire::canopen::{NodeId, Object};

use super::mechanism::Mechanism;
use super::{Cia402DriveConfig, Drive};
use crate::plant::{IndexPulse, ProbeEdge, Servo};

const RESOLUTION_M: f64 = 10e-9;

/// An axis that is where its demand says, unless it is blocked or without torque.
#[derive(Debug)]
pub(super) struct IdealAxis {
    pub(super) counts: i64,
    /// Counts at and below which the negative switch is pressed, and the positive above.
    pub(super) switches: (i64, i64),
    pub(super) index: Option<IndexPulse>,
    pub(super) blocked: bool,
    pub(super) servo: Servo,
    pub(super) commands: u64,
    pub(super) edges: VecDeque<ProbeEdge>,
}

impl Mechanism for IdealAxis {
    fn counts(&self) -> i64 {
        self.counts
    }

    fn speed(&self) -> f64 {
        0.0
    }

    fn resolution(&self) -> f64 {
        RESOLUTION_M
    }

    fn index_pulse(&self) -> Option<IndexPulse> {
        self.index
    }

    fn limit_switches(&self) -> (bool, bool) {
        (
            self.counts <= self.switches.0,
            self.counts >= self.switches.1,
        )
    }

    fn probe_edge(&mut self) -> Option<ProbeEdge> {
        self.edges.pop_front()
    }

    fn set_servo(&mut self, servo: Servo) {
        self.servo = servo;
        self.commands += 1;
        if let Servo::Follow { demand } | Servo::Brake { demand } = servo
            && !self.blocked
        {
            let before = self.counts;
            self.counts = (demand / RESOLUTION_M).round() as i64;
            self.pass_marks(before);
        }
    }

    fn encoder_power(&mut self, on: bool) {
        if on {
            self.counts = 0;
        }
    }
}

impl IdealAxis {
    /// One index mark every millimetre, at odd multiples of half of one.
    fn pass_marks(&mut self, before: i64) {
        const MARKS: i64 = 100_000;
        let turn = |counts: i64| (counts + MARKS / 2).div_euclid(MARKS);
        if turn(before) != turn(self.counts) {
            self.index = Some(IndexPulse {
                count: turn(before).max(turn(self.counts)) * MARKS - MARKS / 2,
                number: self.index.map_or(1, |pulse| pulse.number + 1),
            });
        }
    }
}

/// Node 1 on its axis, with a clock that the test moves.
pub(super) struct Bench {
    pub(super) drive: Drive,
    pub(super) axis: IdealAxis,
    pub(super) now: Time,
}

impl Bench {
    /// Booted and operational.
    pub(super) fn new() -> Self {
        Self::with(Cia402DriveConfig::default())
    }

    pub(super) fn with(config: Cia402DriveConfig) -> Self {
        let axis = IdealAxis {
            counts: 0,
            switches: (i64::MIN, i64::MAX),
            index: None,
            blocked: false,
            servo: Servo::Off,
            commands: 0,
            edges: VecDeque::new(),
        };
        let drive = Drive::new(config);
        let mut bench = Self {
            drive,
            axis,
            now: Time::ZERO,
        };
        let sent = bench.wait_ms(200);
        assert_eq!(sent.first().map(String::as_str), Some("701#00"));
        let _ = bench.send(0, &[1, 1]);
        bench
    }

    /// Whether the fault of this key made a difference.
    pub(super) fn delivered(&self, key: &str) -> bool {
        self.drive.server.deliveries().contains_key(key)
    }

    pub(super) fn sent(&mut self) -> Vec<String> {
        let frames = std::iter::from_fn(|| self.drive.server.poll_transmit());
        frames.map(|frame| frame.to_string()).collect()
    }

    pub(super) fn wait_ms(&mut self, ms: u64) -> Vec<String> {
        let end = self.now + Duration::from_millis(ms);
        while self.drive.next_event() <= end {
            self.now = self.now.max(self.drive.next_event());
            self.drive.advance(self.now, &mut self.axis);
        }
        self.now = end;
        self.drive.advance(end, &mut self.axis);
        self.sent()
    }

    /// Waits until `done`, at most ten seconds; how long it took.
    #[track_caller]
    pub(super) fn wait_until(&mut self, what: &str, done: impl Fn(&mut Self) -> bool) -> Duration {
        let start = self.now;
        while !done(self) {
            assert!(
                self.now - start < Duration::from_secs(10),
                "waited for {what}"
            );
            let _ = self.wait_ms(1);
        }
        self.now - start
    }

    pub(super) fn send(&mut self, id: u16, data: &[u8]) -> Vec<String> {
        let frame = CanFrame::standard(id, data);
        self.drive.handle(self.now, &frame, &mut self.axis);
        self.sent()
    }

    fn request(&mut self, request: SdoRequest) -> SdoResponse {
        let frame = CanFrame::standard(0x601, &request.emit());
        self.drive.handle(self.now, &frame, &mut self.axis);
        let frames = std::iter::from_fn(|| self.drive.server.poll_transmit());
        let mut answers = frames.filter(|frame| frame.standard_id() == Some(0x581));
        SdoResponse::parse(answers.next().unwrap().data()).unwrap()
    }

    pub(super) fn try_write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        let object = Object::new(index, sub);
        let data = Expedited::new(data).unwrap();
        match self.request(SdoRequest::DownloadExpedited { object, data }) {
            SdoResponse::DownloadInitiate { .. } => Ok(()),
            SdoResponse::Abort { code, .. } => Err(code),
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    pub(super) fn write(&mut self, index: u16, data: &[u8]) {
        self.try_write(index, 0, data).unwrap();
    }

    #[track_caller]
    pub(super) fn write_i32(&mut self, index: u16, value: i32) {
        self.write(index, &value.to_le_bytes());
    }

    #[track_caller]
    pub(super) fn read(&mut self, index: u16) -> i64 {
        let object = Object::new(index, 0);
        match self.request(SdoRequest::UploadInitiate { object }) {
            SdoResponse::UploadExpedited { data, .. } => {
                let mut raw = [0; 8];
                raw[..data.data().len()].copy_from_slice(data.data());
                i64::from_le_bytes(raw)
            }
            other => panic!("{other:?}"),
        }
    }

    pub(super) fn position(&mut self) -> i32 {
        self.read(0x6064) as i32
    }

    #[track_caller]
    pub(super) fn control(&mut self, controlword: u16) {
        self.write(0x6040, &controlword.to_le_bytes());
    }

    pub(super) fn status(&mut self) -> u16 {
        self.read(0x6041) as u16
    }

    #[track_caller]
    pub(super) fn check_status(&mut self, expected: u16) {
        let seen = self.status();
        assert_eq!(
            seen, expected,
            "statusword {seen:#06X}, expected {expected:#06X}"
        );
    }

    /// Operation enabled, in profile position, standing.
    pub(super) fn enable(&mut self) {
        for controlword in [0x06, 0x07, 0x0F] {
            self.control(controlword);
            let _ = self.wait_ms(5);
        }
        let _ = self.wait_ms(50);
        self.check_status(0x0637);
    }

    /// One set-point with the handshake; waits for nothing.
    pub(super) fn set_point(&mut self, target: i32, flags: u16) {
        self.write_i32(0x607A, target);
        self.control(0x0F);
        self.control(0x1F | flags);
    }

    pub(super) fn watch_master(&mut self) {
        let master = NodeId::new(127).unwrap();
        let entry = wire::canopen::nmt::consumer_heartbeat_entry(master, 150);
        self.try_write(0x1016, 1, &entry.to_le_bytes()).unwrap();
        let _ = self.send(0x77F, &[5]);
    }
}
