//! A flood, in real time: the machine's thread goes on, and a stop is heard.
//!
//! How late a busy computer is, no test decides (`bench/load.rs` measures it): where the machine is late without a flood,
//! too, nothing is learnt from one.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use machine::Patience;
use service::{Access, Caller, Desk, Edge, Listen, MachineState, Opened, Service};
use tests::flood::flood;
use tests::{LINEAR, Rig, not_run, rigs, shipped_config};
use truestage::emulated::EmulatedOnPtys;
use truestage::{Machine, ports};

const SPAN: Duration = Duration::from_secs(4);
/// How long nobody asks, before the flood and after it.
const QUIET: Duration = Duration::from_secs(1);
/// What the machine may be behind meanwhile, as a share of the time, for a flood to say anything.
const QUIET_SHARE_MAX: f64 = 0.1;
/// A stop that is not answered by then never is.
const LATE: Duration = Duration::from_secs(60);

/// A service that keeps an emulated machine in real time.
fn kept(folder: &std::path::Path, emulated: &EmulatedOnPtys) -> Service {
    let mut loaded = shipped_config(&LINEAR, folder, |text| text);
    let overrides = emulated.overrides(&loaded.config).unwrap();
    let pace = emulated.pace("a flood").unwrap();
    // The emulated drives share the processors with the flood.
    loaded.patience = Patience::with_clock(1.001);
    let store = loaded.config.machine.store();
    let service = Service::start(move || {
        let live = ports::open(&loaded.config, &overrides, ports::Use::Measurement, pace)?;
        Ok(Opened {
            machine: Machine::new(&loaded, Box::new(live)),
            store,
            held: Box::new(()),
            teller: None,
        })
    });
    service.unwrap_or_else(|error| panic!("{error}"))
}

/// The status of a stop, asked where the flood is.
fn stop(address: SocketAddr) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LATE)).unwrap();
    stream
        .write_all(b"POST /v1/stop HTTP/1.1\r\nhost: 127.0.0.1\r\nconnection: close\r\ncontent-length: 0\r\n\r\n")
        .unwrap();
    let mut said = String::new();
    stream.read_to_string(&mut said).unwrap();
    said.split(' ').nth(1).unwrap_or_default().to_owned()
}

/// How many seconds the machine's clock falls behind that on the wall while `body` lasts, and how many pass: the clock is
/// published after each tick, so a thread that waits is behind.
fn behind(desk: &Desk, body: impl FnOnce()) -> (f64, f64) {
    let (begun, clock) = (Instant::now(), desk.machine().clock_s);
    body();
    let (lived, passed) = (desk.machine().clock_s - clock, begun.elapsed());
    (passed.as_secs_f64() - lived, passed.as_secs_f64())
}

/// The same as a share of the time while nobody asks.
fn quiet_share(desk: &Desk) -> f64 {
    let until = Instant::now() + QUIET;
    let (behind, passed) = behind(desk, || {
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            thread::park_timeout(left);
        }
    });
    behind / passed
}

#[test]
fn a_machine_goes_on_in_a_flood_and_a_stop_is_heard() {
    // No bus makes a difference to it.
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let emulated = EmulatedOnPtys::start(LINEAR.emulated, 51, 1.0).unwrap();
    let service = kept(folder.path(), &emulated);
    let desk = service.desk();
    let any = "tcp:127.0.0.1:0".parse().unwrap();
    let edge = Edge::open(desk.clone(), &[any], &Access::default()).unwrap();
    let Listen::Tcp(address) = edge.places()[0] else {
        panic!("it is TCP")
    };
    let before = quiet_share(&desk);
    let mut stops = 0;
    let (behind, _) = behind(&desk, || {
        let until = Instant::now() + SPAN;
        thread::scope(|scope| {
            let flooding = scope.spawn(|| flood(address, until));
            while !flooding.is_finished() {
                assert_eq!(stop(address), "200", "stop {stops}");
                stops += 1;
            }
        });
    });
    let after = quiet_share(&desk);
    let machine = desk.machine();
    let _ = desk.end(&Caller::named("the test"));
    let _ = service.wait();
    // Each stop is an event, and that the machine runs is one.
    let heard = desk.machine().newest_event;
    if machine.state != MachineState::Running {
        let why = format!("the emulated drives were held up: {:?}", machine.cause);
        return not_run("a machine in a flood", &why);
    }
    assert!(stops > 0 && heard > stops, "{stops} stops, {heard} events");
    // A thread that waited for the edge would be behind by the flood.
    if behind < 0.5 * SPAN.as_secs_f64() {
        return;
    }
    let quiet = before.max(after);
    if quiet > QUIET_SHARE_MAX {
        let why =
            format!("the computer was too busy: {quiet:.2} of the time behind without a flood");
        return not_run("a machine in a flood", &why);
    }
    panic!("{behind} s behind in the flood, {before:.2} and {after:.2} of the time without one");
}
