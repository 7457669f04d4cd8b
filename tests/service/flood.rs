//! A flood, in real time: the machine's thread goes on, and a stop is heard.
//!
//! How late a busy computer is, no test decides (`bench/load/main.rs` measures it): where threads that wait for nothing are late,
//! too, nothing is learnt from it.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use machine::Patience;
use service::{Access, Caller, Desk, Edge, Listen, MachineState, Opened, Service};
use tests::flood::flood;
use tests::{LINEAR, Rig, Shipped, not_run, rigs, shipped_config};
use truestage::emulated::EmulatedOnPtys;
use truestage::{Machine, ports};

const SPAN: Duration = Duration::from_secs(4);
/// So far behind the machine's thread may be meanwhile.
const BEHIND_MAX: Duration = Duration::from_secs(2);
/// A computer that keeps a thread which waits for nothing from running for so long says nothing of one that may wait.
const HELD_UP_MAX: Duration = Duration::from_millis(500);
/// How often that thread looks at the clock.
const BEAT: Duration = Duration::from_millis(5);
/// A stop that is not answered by then never is.
const LATE: Duration = Duration::from_secs(60);

/// A service that keeps the emulated machine `shipped` in real time.
pub(crate) fn kept(
    shipped: &Shipped,
    folder: &std::path::Path,
    emulated: &EmulatedOnPtys,
) -> Service {
    let mut loaded = shipped_config(shipped, folder, |text| text);
    let overrides = emulated.overrides(&loaded.config).unwrap();
    let pace = emulated.pace("a service").unwrap();
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

/// What a thread sees that waits for nothing.
struct Seen {
    /// How far the machine's clock, which is published after each tick, was behind that on the wall at most.
    behind_s: f64,
    /// The longest time for which this thread was not let run.
    held_up: Duration,
}

fn watch(desk: &Desk, until: Instant) -> Seen {
    let (begun, clock) = (Instant::now(), desk.machine().clock_s);
    let (mut looked, mut seen) = (
        begun,
        Seen {
            behind_s: 0.0,
            held_up: Duration::ZERO,
        },
    );
    while looked < until {
        thread::park_timeout(BEAT);
        let now = Instant::now();
        seen.held_up = seen.held_up.max(now - looked);
        let lived = desk.machine().clock_s - clock;
        seen.behind_s = seen.behind_s.max((now - begun).as_secs_f64() - lived);
        looked = now;
    }
    seen
}

#[test]
fn a_machine_goes_on_in_a_flood_and_a_stop_is_heard() {
    // No bus makes a difference to it.
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let emulated = EmulatedOnPtys::start(LINEAR.emulated, 51, 1.0).unwrap();
    let service = kept(&LINEAR, folder.path(), &emulated);
    let desk = service.desk();
    let any = "tcp:127.0.0.1:0".parse().unwrap();
    let edge = Edge::open(desk.clone(), &[any], &Access::default()).unwrap();
    let Listen::Tcp(address) = edge.places()[0] else {
        panic!("it is TCP")
    };
    let until = Instant::now() + SPAN;
    let mut stops = 0;
    let Seen { behind_s, held_up } = thread::scope(|scope| {
        let flooding = scope.spawn(|| flood(address, until));
        let watching = scope.spawn(|| watch(&desk, until));
        while !flooding.is_finished() {
            assert_eq!(stop(address), "200", "stop {stops}");
            stops += 1;
        }
        watching.join().unwrap()
    });
    let machine = desk.machine();
    let _ = desk.end(&Caller::named("the test"));
    let _ = service.wait();
    // Each stop is an event, and that the machine runs is one.
    let heard = desk.machine().newest_event;
    // Its clock goes on when its drives are gone, too: a thread that waited for the edge is behind.
    let is_behind = behind_s >= BEHIND_MAX.as_secs_f64();
    if is_behind && held_up > HELD_UP_MAX {
        let why =
            format!("the computer was too busy: it kept a thread from running for {held_up:?}");
        return not_run("a machine in a flood", &why);
    }
    assert!(
        !is_behind,
        "{behind_s} s behind; other threads were held up for {held_up:?} at most"
    );
    if machine.state != MachineState::Running {
        let why = format!("the emulated drives were held up: {:?}", machine.cause);
        return not_run("a machine in a flood", &why);
    }
    assert!(stops > 0 && heard > stops, "{stops} stops, {heard} events");
}
