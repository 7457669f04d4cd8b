//! `truestage serve` under a service manager: what it tells over the socket that `NOTIFY_SOCKET` names.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::programs::{Bench, Process, live_rigs};

const SOCKET: &str = "manager.sock";
/// Of its watchdog: it is told twice as often.
const PERIOD: Duration = Duration::from_millis(80);
/// A service that tells nothing for so long has nothing to tell.
const SILENCE: Duration = Duration::from_millis(400);
/// The longest wait for anything that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// A service manager as far as a service knows it.
struct Heard(UnixDatagram);

impl Heard {
    fn at(bench: &Bench) -> Self {
        let socket = UnixDatagram::bind(bench.folder().join(SOCKET));
        Self(socket.expect("a socket can be made"))
    }

    /// The next message, a line each; nothing when none comes within `span`.
    fn within(&self, span: Duration) -> Option<String> {
        let mut bytes = [0; 4096];
        self.0.set_read_timeout(Some(span)).expect("it is a span");
        match self.0.recv(&mut bytes) {
            Ok(length) => Some(String::from_utf8_lossy(&bytes[..length]).into_owned()),
            Err(error) if error.kind() == ErrorKind::WouldBlock => None,
            Err(error) => panic!("{error}"),
        }
    }

    /// The message with a line that begins with `wanted`, and how many came before.
    #[track_caller]
    fn until(&self, wanted: &str) -> (String, usize) {
        for before in 0..10_000 {
            let Some(message) = self.within(PATIENCE) else {
                break;
            };
            if message.lines().any(|line| line.starts_with(wanted)) {
                return (message, before);
            }
        }
        panic!("it never said {wanted}");
    }

    /// Hears what was said before the service fell silent.
    #[track_caller]
    fn silence(&self) {
        let said = (0..100).find(|_| self.within(SILENCE).is_none());
        assert!(said.is_some(), "it goes on as if nothing was the matter");
    }
}

fn keep(bench: &Bench, heard: &Heard) -> Process {
    let words = ["serve", "machine.toml", "--listen", "unix:truestage.sock"];
    let period = PERIOD.as_micros().to_string();
    let variables = [("NOTIFY_SOCKET", SOCKET), ("WATCHDOG_USEC", &period)];
    let service = bench.start_within(&words, &variables);
    let (starting, before) = heard.until("STATUS=starting the machine");
    assert_eq!((starting.lines().count(), before), (1, 0));
    let (ready, before) = heard.until("READY=1");
    assert_eq!(before, 0, "nothing is ready before the machine is");
    assert_eq!(ready, "READY=1\nSTATUS=running; x Disabled\n");
    assert!(bench.folder().join("truestage.sock").exists());
    service
}

/// It is alive for its manager, and ends in order when it is told to.
#[track_caller]
fn check_lives_and_ends(service: Process, heard: &Heard) {
    for _ in 0..3 {
        heard.until("WATCHDOG=1");
    }
    service.signal(Signal::SIGTERM);
    heard.until("STOPPING=1");
    let ended = service.end();
    assert_eq!(ended.code, Some(0), "{ended:?}");
}

#[test]
fn a_service_manager_hears_that_it_is_ready_that_it_lives_and_that_it_ends() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let heard = Heard::at(&bench);
        let service = keep(&bench, &heard);
        check_lives_and_ends(service, &heard);
    }
}

/// Its machine's thread waits for a machine that is stopped; its other threads are as lively as ever.
#[test]
fn a_machine_thread_that_hangs_is_not_kept_alive_by_the_others() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let heard = Heard::at(&bench);
        let _service = keep(&bench, &heard);
        heard.until("WATCHDOG=1");
        bench.signal_emulator(Signal::SIGSTOP);
        heard.silence();
        bench.signal_emulator(Signal::SIGCONT);
        heard.until("WATCHDOG=1");
    }
}

/// It waits for a reset. At its end nobody reads what it tells any more, which is no reason to stay.
#[test]
fn a_service_whose_machine_is_gone_says_why_and_lives_until_it_is_ended() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let heard = Heard::at(&bench);
        // A service opens its lines again by their names, and a terminal that is gone gives its name to the next one:
        // that of another test. As long as somebody has it open it does not.
        let _names = bench.hold_terminals();
        let service = keep(&bench, &heard);
        bench.signal_emulator(Signal::SIGKILL);
        heard.until("STATUS=stopped by a failure, reset it: ");
        check_lives_and_ends(service, &heard);
    }
}

/// What it tells nobody may not keep it from its work.
#[test]
fn a_manager_that_is_not_there_is_said_once_and_the_machine_is_kept() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let words = ["serve", "machine.toml", "--listen", "unix:truestage.sock"];
        let mut service = bench.start_within(&words, &[("NOTIFY_SOCKET", "nobody.sock")]);
        let socket = bench.folder().join("truestage.sock");
        service.wait_until(|| socket.exists());
        bench.run(&["status"]).with_code(0);
        service.signal(Signal::SIGTERM);
        let ended = service.end();
        assert_eq!(ended.code, Some(0), "{ended:?}");
        assert_eq!(ended.said.matches("NOTIFY_SOCKET").count(), 1, "{ended:?}");
    }
}
