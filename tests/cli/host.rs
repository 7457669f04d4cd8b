//! Troubles of a computer beside a program that owns a machine: blocked output, limits, files that are full.

use core::time::Duration;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::fd::{AsFd, OwnedFd};
use std::process::{Command, Stdio};
use std::thread;

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::signal::Signal;
use nix::sys::termios::{FlowArg, tcflow};
use nix::unistd::pipe;
use serde_json::{Value, json};
use tests::{Edit, ROTARY, Rig};

use crate::killed::Watcher;
use crate::programs::{Bench, Process, live_rigs, text};
use crate::serve::{ask, keep};
use crate::signals::Table;

const JOG: [&str; 3] = ["jog", "machine.toml", "c=20deg/s"];
/// Noise of a table that stands, in a second.
const STANDS_DEG: f64 = 1e-3;

/// A pipe that takes nothing more, and the end that is not read.
fn full_pipe() -> (OwnedFd, Stdio) {
    let (unread, full) = pipe().expect("a pipe");
    let blocking = fcntl(full.as_fd(), FcntlArg::F_GETFL).expect("it has flags");
    fcntl(full.as_fd(), FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).expect("it does not wait");
    let mut filled = File::from(full.try_clone().expect("a descriptor"));
    let refused = loop {
        if let Err(error) = filled.write_all(&[b' '; 512]) {
            break error;
        }
    };
    assert_eq!(refused.kind(), ErrorKind::WouldBlock);
    let blocking = OFlag::from_bits_retain(blocking);
    fcntl(full.as_fd(), FcntlArg::F_SETFL(blocking)).expect("it waits");
    (unread, full.into())
}

/// Both streams of a verb, and what must be kept open meanwhile.
type Streams = (Stdio, Stdio, Vec<OwnedFd>);

fn full_stderr() -> Streams {
    let (unread, full) = full_pipe();
    (Stdio::piped(), full, vec![unread])
}

fn full_stdout() -> Streams {
    let (unread, full) = full_pipe();
    (full, Stdio::piped(), vec![unread])
}

/// Ctrl-S was pressed.
fn held_terminal() -> Streams {
    let terminal = openpty(None, None).expect("a terminal can be had");
    tcflow(terminal.slave.as_fd(), FlowArg::TCOOFF).expect("it is a terminal");
    let end = || Stdio::from(terminal.slave.try_clone().expect("a descriptor"));
    let (out, said) = (end(), end());
    (out, said, vec![terminal.slave, terminal.master])
}

fn check_stops(streams: impl Fn() -> Streams) {
    for (signal, code) in [(Signal::SIGINT, 130), (Signal::SIGTERM, 143)] {
        let mut table = Table::new();
        let (out, said, _open) = streams();
        let mut command = table.bench.verb(&JOG);
        let command = command.stdin(Stdio::null()).stdout(out).stderr(said);
        let mut process = Process::spawn(command);
        table.until_jogging(&mut process);
        process.signal(signal);
        let turned = table.turns_after(&mut process);
        assert!(turned < STANDS_DEG, "{signal}: {turned} degrees");
        assert_eq!(process.end().code, Some(code), "{signal}");
    }
}

#[test]
fn a_full_standard_error_keeps_no_signal_from_stopping() {
    check_stops(full_stderr);
}

#[test]
fn a_full_standard_output_keeps_no_signal_from_stopping() {
    check_stops(full_stdout);
}

#[test]
fn a_terminal_that_is_held_keeps_no_signal_from_stopping() {
    check_stops(held_terminal);
}

#[test]
fn a_verb_whose_output_is_blocked_ends_as_well_as_any() {
    for streams in [full_stderr, full_stdout, held_terminal] {
        let bench = Bench::new(Rig::Pty);
        let (out, said, _open) = streams();
        let mut command = bench.verb(&["calibrate", "machine.toml"]);
        let command = command.stdin(Stdio::null()).stdout(out).stderr(said);
        assert_eq!(Process::spawn(command).end().code, Some(0));
        let stored = bench.run(&["cal", "list"]).with_code(0);
        let count = stored["calibrations"].as_array().map(Vec::len);
        assert_eq!(count, Some(1), "{stored}");
    }
}

/// What was held is shown once it may be, and it is said why it came late.
#[test]
fn a_reader_that_comes_back_reads_what_was_blocked() {
    let bench = Bench::new(Rig::Pty);
    let (unread, full) = full_pipe();
    let mut command = bench.verb(&["calibrate", "machine.toml"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    let process = Process::spawn(command.stderr(full));
    // The pipe ends with the program that has its other end.
    drop(command);
    let mut said = String::new();
    let ended = thread::spawn(move || process.end().code);
    let read = File::from(unread).read_to_string(&mut said);
    assert!(read.is_ok(), "{said}");
    assert_eq!(ended.join().ok(), Some(Some(0)));
    assert!(said.contains("calibrate x"), "{said}");
}

/// A drive without torque says at once that it is off.
#[test]
fn a_verb_that_failed_ends_when_its_table_stands() {
    let mut table = Table::new();
    let mut process = Process::start(&mut table.bench.verb(&JOG));
    table.until_jogging(&mut process);
    let opened = table.angle_deg();
    table
        .watcher
        .lend_hand("fault fault = { kind = \"safe_torque_off\" }");
    let turned = table.turns_after(&mut process);
    let coasted = table.angle_deg() - opened;
    // In a tenth of that time its drive had said that it is off.
    assert!(coasted > 2.0, "it coasted by {coasted} degrees only");
    assert!(turned < 0.01, "it turned by {turned} of {coasted} degrees");
    let ended = process.end();
    assert_eq!(ended.code, Some(4), "{ended:?}");
    assert_eq!(ended.json["device"], "c", "{ended:?}");
}

/// The journal grows beyond what a file may: that is an error of a file, not the end of the program.
#[test]
fn a_limit_of_a_file_is_a_full_disk() {
    let bench = Bench::new(Rig::Pty);
    let verb = bench.verb(&["calibrate", "machine.toml"]);
    let mut command = Command::new("prlimit");
    command.current_dir(bench.folder()).arg("--fsize=12000");
    command.arg(verb.get_program()).args(verb.get_args());
    let ended = Process::start(&mut command).end();
    let failed = ended.with_code(2);
    let error = text(&failed["error"]);
    assert!(error.contains("File too large"), "{error}");
    assert!(error.contains("--resume"), "{error}");
    assert_eq!(failed["can_resume"], true, "{failed}");
    bench
        .run(&["calibrate", "machine.toml", "--resume"])
        .with_code(0);
}

#[test]
fn streams_that_are_closed_change_no_result() {
    let bench = Bench::new(Rig::Pty);
    let verb = bench.verb(&["zero", "machine.toml"]);
    let mut command = Command::new("sh");
    command.current_dir(bench.folder());
    command.args(["-c", "exec \"$0\" \"$@\" <&- >&- 2>&-"]);
    command.arg(verb.get_program()).args(verb.get_args());
    assert_eq!(Process::start(&mut command).end().code, Some(0));
}

/// `| head -1`: who has read enough closes the pipe.
#[test]
fn a_reader_that_leaves_ends_no_verb() {
    let bench = Bench::new(Rig::Pty);
    let (closed, out) = pipe().expect("a pipe");
    let (gone, said) = pipe().expect("a pipe");
    drop((closed, gone));
    let mut command = bench.verb(&["calibrate", "machine.toml"]);
    let command = command.stdin(Stdio::null()).stdout(out).stderr(said);
    assert_eq!(Process::spawn(command).end().code, Some(0));
}

/// Whatever the environment says, the same is done.
#[test]
fn an_odd_environment_changes_no_result() {
    let bench = Bench::new(Rig::Pty);
    let mut command = bench.verb(&["zero", "machine.toml"]);
    command
        .env_clear()
        .env("HOME", "/nowhere")
        .env("TMPDIR", "/nowhere");
    command
        .env("LC_ALL", "tr_TR.ISO-8859-9")
        .env("TERM", "none");
    Process::start(&mut command).end().with_code(0);
}

/// A run that a device ends says how it goes on, to people and to programs.
#[test]
fn a_run_that_a_device_ends_names_its_journal() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        let mut process = bench.start(&["calibrate", "machine.toml"]);
        let runs = bench.records().join("runs");
        let is_measuring = || {
            let entries = std::fs::read_dir(&runs).into_iter().flatten().flatten();
            let mut journals =
                entries.filter(|entry| entry.file_name().to_string_lossy().contains("-calibrate-"));
            journals.any(|entry| entry.metadata().is_ok_and(|data| data.len() > 8_000))
        };
        process.wait_until(is_measuring);
        Watcher::of(&bench).lend_hand("fault fault = { kind = \"safe_torque_off\" }");
        let ended = process.end();
        assert!(ended.said.contains("--resume"), "{ended:?}");
        let failed = ended.with_code(4);
        assert_eq!(failed["can_resume"], true, "{failed}");
        assert_eq!(failed["device"], "x", "{failed}");
        assert!(text(&failed["journal"]).contains("-calibrate-"), "{failed}");
        assert!(failed["code"].is_string(), "{failed}");
    }
}

/// A service whose table is on its way, and the path of that motion.
fn turning() -> (Process, String, Table) {
    let bench = Bench::of(Rig::Pty, ROTARY, |text| text);
    bench.configure("machine.toml", |text| {
        text.edit("move_timeout_s = 60.0", "move_timeout_s = 100000.0")
    });
    let service = keep(&bench);
    bench.run(&["zero", "machine.toml"]).with_code(0);
    let mut table = Table::held(bench);
    let body = json!({"targets": {"c": "170deg"}, "speed": "20deg/s", "uncompensated": true});
    let folder = table.bench.folder().to_owned();
    let asked = thread::spawn(move || ask(&folder, "POST /v1/motions", &body));
    while !asked.is_finished() {
        table.watcher.wait(Duration::from_millis(5));
    }
    let (status, motion) = asked.join().expect("it is answered");
    assert_eq!(status, 201, "{motion}");
    let path = format!("GET /v1/motions/{}", text(&motion["id"]));
    (service, path, table)
}

fn look(bench: &Bench, request: &str) -> Value {
    loop {
        let (status, seen) = ask(bench.folder(), request, &Value::Null);
        // On a busy computer time stands still for long, and it is asked too often.
        if status != 429 {
            assert_eq!(status, 200, "{seen}");
            return seen;
        }
    }
}

/// Its drive has no torque, and says so at once.
#[test]
fn a_motion_fails_when_its_table_stands() {
    let (_service, motion, mut table) = turning();
    table.watcher.wait(Duration::from_secs(3));
    table
        .watcher
        .lend_hand("fault fault = { kind = \"safe_torque_off\" }");
    let opened = table.angle_deg();
    let mut seen = Vec::new();
    let ended = loop {
        let state = look(&table.bench, &motion)["state"].clone();
        if state == "failed" {
            break table.angle_deg();
        }
        if seen.last() != Some(&state) {
            seen.push(state);
        }
        table.watcher.wait(Duration::from_millis(5));
    };
    table.watcher.wait(Duration::from_secs(1));
    let turned = (table.angle_deg() - ended).abs();
    assert!((ended - opened).abs() > 2.0, "{opened} to {ended} degrees");
    assert!(turned < 0.01, "it turned by {turned} degrees");
    assert_eq!(seen, ["moving", "stopping"]);
}

/// A computer that froze, or a drive that did: the place of the axis is not known.
#[test]
fn values_of_a_silent_drive_are_unknown() {
    let (_service, motion, mut table) = turning();
    table.watcher.wait(Duration::from_secs(3));
    let before = look(&table.bench, "GET /v1/axes/c");
    assert!(before["encoder"]["value"].is_f64(), "{before}");
    table
        .watcher
        .lend_hand("fault fault = { kind = \"mute\", node = \"drive\" }");
    // Its silence has been noticed, and it was asked to stop.
    table.watcher.wait(Duration::from_millis(1_500));
    let silent = look(&table.bench, "GET /v1/axes/c");
    assert_eq!(silent["state"], "ErrorStop", "{silent}");
    assert!(silent["encoder"].is_null(), "{silent}");
    assert!(silent["position"].is_null(), "{silent}");
    assert_eq!(look(&table.bench, &motion)["state"], "stopping");
}
