//! Signals, of which `timeout` and a terminal that closes send two at once: axes stand before the program ends.

use core::time::Duration;
use std::io::Read as _;
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};

use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use nix::pty::openpty;
use nix::sys::signal::Signal;
use tests::{ROTARY, Rig};

use crate::killed::Watcher;
use crate::programs::{Bench, Process, number};

/// The table's speed in the tests of this file.
const JOG: [&str; 3] = ["jog", "machine.toml", "c=20deg/s"];
/// Noise of a table that stands, in a second.
const STANDS_DEG: f64 = 1e-3;

/// A table whose time passes as a test lets it.
pub(crate) struct Table {
    pub(crate) bench: Bench,
    pub(crate) watcher: Watcher,
}

impl Table {
    pub(crate) fn new() -> Self {
        Self::held(Bench::of(Rig::Pty, ROTARY, |text| text))
    }

    /// From now on time passes as the test lets it.
    pub(crate) fn held(bench: Bench) -> Self {
        let watcher = Watcher::of(&bench);
        Self { bench, watcher }
    }

    pub(crate) fn angle_deg(&self) -> f64 {
        number(&self.watcher.truth()["angle_deg"])
    }

    /// How far it turns in a tenth of a second.
    fn turn_deg(&mut self) -> f64 {
        let before = self.angle_deg();
        self.watcher.wait(Duration::from_millis(100));
        (self.angle_deg() - before).abs()
    }

    /// Lets time pass until the jog of `process` has its speed.
    pub(crate) fn until_jogging(&mut self, process: &mut Process) {
        let mut fast = 0;
        // A zero turns it, too, but not for so long.
        while fast < 20 {
            process.goes_on();
            let is_fast = (1.9..2.1).contains(&self.turn_deg());
            fast = if is_fast { fast + 1 } else { 0 };
        }
    }

    /// Lets time pass until `process` has ended, and says how far the table turned in the second after that.
    pub(crate) fn turns_after(&mut self, process: &mut Process) -> f64 {
        while !process.has_ended() {
            self.watcher.wait(Duration::from_millis(5));
        }
        let ended = self.angle_deg();
        self.watcher.wait(Duration::from_secs(1));
        (self.angle_deg() - ended).abs()
    }
}

/// Lets the clock on the wall pass: signals are counted by that.
fn pass_on_the_wall(span: Duration) {
    let (mut silent, _sender) = UnixStream::pair().expect("a pair of sockets");
    if !span.is_zero() {
        silent.set_read_timeout(Some(span)).expect("a time");
        let heard = silent.read(&mut [0]);
        assert!(heard.is_err(), "nothing is ever sent");
    }
}

/// The machine's time stands still between the signals, so that the table turns whenever the second one comes.
#[test]
fn a_second_signal_leaves_no_table_turning() {
    for apart_ms in [0, 50, 300, 900, 1_200, 2_000] {
        let mut table = Table::new();
        let mut process = Process::start(&mut table.bench.verb(&JOG));
        table.until_jogging(&mut process);
        process.signal(Signal::SIGTERM);
        pass_on_the_wall(Duration::from_millis(apart_ms));
        process.signal(Signal::SIGTERM);
        let turned = table.turns_after(&mut process);
        assert!(turned < STANDS_DEG, "{apart_ms} ms: {turned} degrees");
        let code = process.end().code;
        assert_eq!(code, Some(143), "{apart_ms} ms");
    }
}

/// GNU `timeout` sends its signal to the program and then to its group.
#[test]
fn a_time_out_of_the_shell_leaves_no_table_turning() {
    let mut table = Table::new();
    let verb = table.bench.verb(&JOG);
    let mut command = Command::new("timeout");
    command.current_dir(table.bench.folder());
    command.arg("--preserve-status").arg("1000");
    command.arg(verb.get_program()).args(verb.get_args());
    let mut process = Process::start(&mut command);
    table.until_jogging(&mut process);
    process.signal(Signal::SIGTERM);
    let turned = table.turns_after(&mut process);
    assert!(turned < STANDS_DEG, "{turned} degrees");
    assert_eq!(process.end().code, Some(143));
}

#[test]
fn a_terminal_that_closes_leaves_no_table_turning() {
    let mut table = Table::new();
    let verb = table.bench.verb(&[&JOG[..], &["--yes"]].concat());
    let terminal = openpty(None, None).expect("a terminal can be had");
    let no_child_has = FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC);
    fcntl(&terminal.master, no_child_has).expect("it is open");
    let mut command = Command::new("setsid");
    command.current_dir(table.bench.folder()).arg("--ctty");
    command.arg(verb.get_program()).args(verb.get_args());
    let end = || Stdio::from(terminal.slave.try_clone().expect("a descriptor"));
    command.stdin(end()).stdout(end()).stderr(end());
    let mut process = Process::spawn(&mut command);
    // The terminal is gone with the program that has its other end.
    drop((command, terminal.slave));
    table.until_jogging(&mut process);
    drop(terminal.master);
    let turned = table.turns_after(&mut process);
    assert!(turned < STANDS_DEG, "{turned} degrees");
    assert_eq!(process.end().code, Some(129));
}
