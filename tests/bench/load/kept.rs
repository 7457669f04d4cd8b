//! A service that keeps an emulated machine in real time, in this process, and how long a command takes to the bus.

use core::cell::Cell;
use core::time::Duration;
use std::io::{Read, Write};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Instant;

use drivers::transport::{SendError, SyncStatistics, Transport};
use machine::Patience;
use serde_json::{Value, json};
use service::{Access, Caller, Edge, Listen, Opened, Service};
use tests::{LINEAR, shipped_config};
use truestage::emulated::EmulatedOnPtys;
use truestage::{Machine, ports};
use units::Time;
use wire::{Arrival, Payload, Port, Ports};

use crate::SYNC;

/// From one motion to the next at least, and a part of a SYNC period that is another one each time: a command must
/// not always come at the same moment of the period.
const MOTION_EVERY: Duration = Duration::from_millis(100);
/// The golden section: whatever their number, its multiples are spread evenly over a period.
const PHASE_STEP: f64 = 0.618_033_988_749_895;
/// So often the zero is sought.
const TRIES: u32 = 3;
/// Far more than anything takes here.
const LATE: Duration = Duration::from_secs(60);

/// Frames for the drive, when they were handed to the bus.
type Sent = (Instant, Vec<u8>);

/// Notes what the drive is told.
struct Noting {
    inner: Box<dyn Transport>,
    sent: Sender<Sent>,
}

impl Transport for Noting {
    fn now(&self) -> Time {
        self.inner.now()
    }

    fn send(&mut self, port: Port, payload: &Payload) -> Result<(), SendError> {
        if let Payload::Frame(frame) = payload
            && frame.standard_id().is_some_and(|it| it & 0x780 == 0x200)
        {
            let _ = self.sent.send((Instant::now(), frame.data().to_vec()));
        }
        self.inner.send(port, payload)
    }

    fn receive(&mut self, until: Time) -> Option<Arrival> {
        self.inner.receive(until)
    }

    fn receive_unhurried(&mut self, until: Time, unhurried: Ports) -> Option<Arrival> {
        self.inner.receive_unhurried(until, unhurried)
    }

    fn sleep_until(&mut self, until: Time) {
        self.inner.sleep_until(until);
    }

    fn set_sync(&mut self, port: Port, period: Option<Duration>) -> Result<(), SendError> {
        self.inner.set_sync(port, period)
    }

    fn sync_statistics(&self, port: Port) -> Option<SyncStatistics> {
        self.inner.sync_statistics(port)
    }
}

/// A service that keeps a machine in real time.
pub(crate) struct Kept {
    pub(crate) service: Service,
    sent: Receiver<Sent>,
    /// How many motions were commanded.
    moved: Cell<u32>,
    pub(crate) unix: std::path::PathBuf,
    pub(crate) tcp: SocketAddr,
    _edge: Edge,
    _emulated: EmulatedOnPtys,
    _folder: tempfile::TempDir,
}

impl Kept {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut loaded = shipped_config(&LINEAR, folder.path(), |text| text);
        // The emulated drives share the processors with everything else: they are waited for a second longer.
        loaded.patience = Patience::with_clock(1.001);
        let emulated = EmulatedOnPtys::start(LINEAR.emulated, 1, 1.0).unwrap();
        let overrides = emulated.overrides(&loaded.config).unwrap();
        let pace = emulated.pace("load").unwrap();
        let store = loaded.config.machine.store();
        let (note, sent) = channel();
        let service = Service::start(move || {
            let live = ports::open(&loaded.config, &overrides, ports::Use::Measurement, pace)?;
            let noting = Noting {
                inner: Box::new(live),
                sent: note,
            };
            Ok(Opened {
                machine: Machine::new(&loaded, Box::new(noting)),
                store,
                held: Box::new(()),
                teller: None,
            })
        });
        let service = service.unwrap_or_else(|error| panic!("{error}"));
        let unix = folder.path().join("socket");
        let places = [
            Listen::Unix(unix.clone()),
            "tcp:127.0.0.1:0".parse().unwrap(),
        ];
        let edge = Edge::open(service.desk(), &places, &Access::default()).unwrap();
        let Listen::Tcp(tcp) = edge.places()[1] else {
            panic!("it is TCP")
        };
        Self {
            service,
            sent,
            moved: Cell::new(0),
            unix,
            tcp,
            _edge: edge,
            _emulated: emulated,
            _folder: folder,
        }
    }

    fn ask(&self, line: &str, body: &Value) -> Value {
        let mut stream = UnixStream::connect(&self.unix).unwrap();
        stream.set_read_timeout(Some(LATE)).unwrap();
        let body = body.to_string();
        let length = body.len();
        let head =
            format!("{line} HTTP/1.1\r\nhost: x\r\nconnection: close\r\ncontent-length: {length}");
        stream
            .write_all(format!("{head}\r\n\r\n{body}").as_bytes())
            .unwrap();
        let mut said = String::new();
        stream.read_to_string(&mut said).unwrap();
        serde_json::from_str(said.split_once("\r\n\r\n").unwrap().1).unwrap()
    }

    /// Finds the zero, and moves to where the commands begin.
    pub(crate) fn zero(&self) {
        assert!((0..TRIES).any(|_| self.finds_zero()), "it has no zero");
        let body = json!({"targets": {"x": "10mm"}, "uncompensated": true});
        let motion = self.ask("POST /v1/motions", &body);
        let id = motion["id"].as_str().unwrap_or_else(|| panic!("{motion}"));
        self.ask(&format!("GET /v1/motions/{id}?wait_s=60"), &json!({}));
    }

    /// On a busy computer an emulated drive may be silent for too long, which is said.
    fn finds_zero(&self) -> bool {
        let run = self.ask("POST /v1/runs", &json!({"kind": "zero", "start": true}));
        let id = run["id"].as_str().unwrap_or_else(|| panic!("{run}"));
        let run = self.ask(&format!("GET /v1/runs/{id}?wait_s=300"), &json!({}));
        let is_found = run["state"] == "done";
        if !is_found {
            eprintln!("no zero: {}", run["cause"]);
            self.ask("POST /v1/reset", &json!({}));
        }
        is_found
    }

    /// Ends it.
    pub(crate) fn end(self) {
        self.service.desk().end(&Caller::named("load")).unwrap();
        self.service.wait().unwrap();
    }

    /// Moves to and fro for so long; how long each command took to the bus.
    pub(crate) fn commands(&self, span: Duration) -> Vec<Duration> {
        let (begun, mut taken) = (Instant::now(), Vec::new());
        let mut last = self.sent.try_iter().last();
        while begun.elapsed() < span {
            let moved = self.moved.get();
            let mm = if moved.is_multiple_of(2) { 10.02 } else { 10.0 };
            self.moved.set(moved + 1);
            let body =
                json!({"targets": {"x": {"value": mm, "unit": "mm"}}, "uncompensated": true});
            last = self.sent.try_iter().last().or(last);
            let asked = Instant::now();
            let motion = self.ask("POST /v1/motions", &body);
            let id = motion["id"].as_str().unwrap_or_else(|| panic!("{motion}"));
            let ended = self.ask(&format!("GET /v1/motions/{id}?wait_s=30"), &json!({}));
            assert_eq!(ended["state"], "done", "{ended}");
            let before = last.as_ref().map(|it| it.1.clone());
            let frames: Vec<Sent> = self.sent.try_iter().collect();
            let first = frames
                .iter()
                .find(|it| it.0 > asked && Some(&it.1) != before.as_ref());
            taken.push(first.expect("the drive is told").0 - asked);
            last = frames.last().cloned().or(last);
            let next = asked + MOTION_EVERY + SYNC.mul_f64((f64::from(moved) * PHASE_STEP).fract());
            thread::park_timeout(next.saturating_duration_since(Instant::now()));
        }
        taken
    }
}
