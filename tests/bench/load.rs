//! What clients and floods do to a service's machine: how late its SYNCs are, and how long a command takes to the bus.
//!
//! `load show SECONDS ROUNDS` keeps the linear machine, emulated behind pseudo-terminals in real time, and takes these by
//! turns, ROUNDS times, SECONDS each:
//!
//! - nothing: nobody asks;
//! - clients: ten at 100 Hz each, and a stream of events with a sample at every SYNC;
//! - flood: a thousand connections that say nothing, half a request or a request of 10 MB, streams that nobody reads, and
//!   requests as fast as they are answered.
//!
//! In each it commands short motions and notes the time from before the request to the first frame that the drive is
//! sent for it. What asks is another process (`load clients`, `load flood`); the emulated machine is in this one.

use core::time::Duration;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Instant;

use drivers::transport::{Histogram, SendError, SyncStatistics, Transport};
use machine::Patience;
use serde_json::{Value, json};
use service::{Access, Desk, Edge, Listen, Opened, Service};
use tests::flood::flood;
use tests::{LINEAR, shipped_config};
use truestage::emulated::EmulatedOnPtys;
use truestage::{Machine, ports};
use units::Time;
use wire::{Arrival, Payload, Port, Ports};

/// From one motion to the next at least.
const MOTION_EVERY: Duration = Duration::from_millis(250);
/// From SYNC to SYNC.
const SYNC: Duration = Duration::from_millis(5);
/// Far more than anything takes here.
const LATE: Duration = Duration::from_secs(60);

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["clients", socket, seconds] => clients(Path::new(socket), seconds_of(seconds)),
        ["flood", address, seconds] => flood(
            address.parse().unwrap(),
            Instant::now() + seconds_of(seconds),
        ),
        ["show", seconds, rounds] => show(seconds_of(seconds), rounds.parse().unwrap()),
        _ => eprintln!("load: `load show 10 9`"),
    }
}

fn seconds_of(text: &str) -> Duration {
    Duration::from_secs_f64(text.parse().unwrap())
}

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
struct Kept {
    service: Service,
    sent: Receiver<Sent>,
    unix: std::path::PathBuf,
    tcp: SocketAddr,
    _edge: Edge,
    _emulated: EmulatedOnPtys,
    _folder: tempfile::TempDir,
}

impl Kept {
    fn new() -> Self {
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

    fn zero(&self) {
        let run = self.ask("POST /v1/runs", &json!({"kind": "zero", "start": true}));
        let id = run["id"].as_str().unwrap();
        let run = self.ask(&format!("GET /v1/runs/{id}?wait_s=300"), &json!({}));
        assert_eq!(run["state"], "done", "{run}");
    }

    /// Moves to and fro for so long; how long each command took to the bus.
    fn commands(&self, span: Duration) -> Vec<Duration> {
        let (begun, mut taken) = (Instant::now(), Vec::new());
        let mut last = self.sent.try_iter().last();
        while begun.elapsed() < span {
            let mm = if taken.len() % 2 == 0 { 10.02 } else { 10.0 };
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
            thread::park_timeout((asked + MOTION_EVERY).saturating_duration_since(Instant::now()));
        }
        taken
    }
}

fn lateness(desk: &Desk) -> (u64, Histogram) {
    let figures = desk.figures();
    let sync = figures.buses[0].sync.as_ref().expect("a SYNC thread");
    (sync.skipped, sync.lateness.clone())
}

/// What was seen in all turns of one kind.
#[derive(Default)]
struct Seen {
    name: &'static str,
    lateness: Histogram,
    p99: Vec<Duration>,
    skipped: u64,
    commands: Vec<Duration>,
}

fn turn(kept: &Kept, seen: &mut Seen, load: Option<&[&str]>, span: Duration) {
    let mut child = load.map(start);
    let desk = kept.service.desk();
    // Figures are taken once a second.
    thread::park_timeout(Duration::from_millis(1500));
    let (skipped, before) = lateness(&desk);
    seen.commands.extend(kept.commands(span));
    let (skipped_now, now) = lateness(&desk);
    let turn = now.since(&before);
    seen.p99.push(turn.percentile(0.99));
    seen.lateness.add(&turn);
    seen.skipped += skipped_now - skipped;
    if let Some(child) = &mut child {
        let _ = child.kill();
        let _ = child.wait();
    }
}

fn start(words: &[&str]) -> Child {
    // Other computers ask: what they need of this one's processors is not the service's.
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new("nice");
    command.args(["-n", "39"]).arg(program).args(words);
    command.spawn().unwrap()
}

fn show(span: Duration, rounds: usize) {
    let kept = Kept::new();
    kept.zero();
    let body = json!({"targets": {"x": "10mm"}, "uncompensated": true});
    let motion = kept.ask("POST /v1/motions", &body);
    let id = motion["id"].as_str().unwrap_or_else(|| panic!("{motion}"));
    kept.ask(&format!("GET /v1/motions/{id}?wait_s=60"), &json!({}));
    let (socket, address) = (kept.unix.display().to_string(), kept.tcp.to_string());
    // Longer than a turn: it is ended with it.
    let loads: [(&str, Option<&[&str]>); 3] = [
        ("nothing", None),
        ("clients", Some(&["clients", &socket, "3600"])),
        ("flood", Some(&["flood", &address, "3600"])),
    ];
    let mut all = loads.map(|(name, _)| Seen {
        name,
        ..Seen::default()
    });
    for _ in 0..rounds {
        for (seen, (_, load)) in all.iter_mut().zip(loads) {
            turn(&kept, seen, load, span);
        }
    }
    let quiet: Vec<_> = all[0].p99.clone();
    for seen in &mut all {
        report(seen, &quiet);
    }
    println!("limit of a command: {:?}", SYNC + Duration::from_millis(1));
    let desk = kept.service.desk();
    desk.end(&service::Caller::named("load")).unwrap();
    kept.service.wait().unwrap();
}

fn report(seen: &mut Seen, quiet: &[Duration]) {
    let mut ratios: Vec<f64> = seen
        .p99
        .iter()
        .zip(quiet)
        .map(|(it, quiet)| it.as_secs_f64() / quiet.as_secs_f64())
        .collect();
    ratios.sort_by(f64::total_cmp);
    seen.commands.sort();
    let of = |share: f64| {
        let last = seen.commands.len() - 1;
        seen.commands[(last as f64 * share).round() as usize].as_secs_f64() * 1e3
    };
    println!(
        "{:<8} SYNC {}; left out {}; p99 by turns {:?}, against nothing {:.2} (median; {:.2} to {:.2})",
        seen.name,
        seen.lateness,
        seen.skipped,
        seen.p99,
        ratios[ratios.len() / 2],
        ratios[0],
        ratios[ratios.len() - 1]
    );
    println!(
        "{:<8} command to frame p50 {:.2} ms, p90 {:.2} ms, p99 {:.2} ms, max {:.2} ms, of {}",
        seen.name,
        of(0.5),
        of(0.9),
        of(0.99),
        of(1.0),
        seen.commands.len()
    );
}

/// Ten at 100 Hz each, and a stream of events with a sample at every SYNC.
fn clients(socket: &Path, span: Duration) {
    let until = Instant::now() + span;
    thread::scope(|scope| {
        for _ in 0..10 {
            scope.spawn(|| {
                let mut stream = BufReader::new(UnixStream::connect(socket).unwrap());
                let mut due = Instant::now();
                while due < until {
                    stream
                        .get_mut()
                        .write_all(b"GET /v1/axes HTTP/1.1\r\nhost: x\r\n\r\n")
                        .unwrap();
                    hear(&mut stream);
                    due += Duration::from_millis(10);
                    thread::park_timeout(due.saturating_duration_since(Instant::now()));
                }
            });
        }
        scope.spawn(|| {
            let mut stream = UnixStream::connect(socket).unwrap();
            stream
                .write_all(b"GET /v1/events?sample_ms=5 HTTP/1.1\r\nhost: x\r\n\r\n")
                .unwrap();
            for line in BufReader::new(stream).lines() {
                let _ = line;
                if Instant::now() > until {
                    break;
                }
            }
        });
    });
}

/// One answer with its length in its head.
fn hear(stream: &mut impl BufRead) {
    let (mut line, mut length) = (String::new(), 0);
    while line != "\r\n" {
        line.clear();
        assert!(stream.read_line(&mut line).unwrap() > 0, "it hung up");
        if let Some(said) = line.to_lowercase().strip_prefix("content-length:") {
            length = said.trim().parse().unwrap();
        }
    }
    stream.read_exact(&mut vec![0; length]).unwrap();
}
