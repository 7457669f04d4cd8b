//! Live ports on real ptys. The other end is played by the test itself or by a thread;
//! nothing sleeps, every wait has a deadline that only a failure reaches.

use nix::pty::{OpenptyResult, openpty};
use nix::sys::termios::{BaudRate, SetArg, cfgetospeed, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use std::fs::{File, Permissions};
use std::io::{Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{self, Stdio};
use std::thread::JoinHandle;
use wire::LineControl;
use wire::LinkState;
use wire::can::{BusError, BusErrorClass, CanFrame, ControllerProblem};
use wire::slcan::{BusState, Command, LineBuffer, Reply, StatusFlags};

use super::*;

const PORT: Port = Port(1);
/// Only a failure waits this long.
const LONG: Duration = Duration::from_secs(20);

/// A pty's master and its slave's path; the slave stays open so that the master never
/// reads EIO before the port is opened.
struct Pty {
    master: File,
    slave: Option<File>,
    path: PathBuf,
}

impl Pty {
    fn new() -> Self {
        let OpenptyResult { master, slave } = openpty(None, None).unwrap();
        let mut raw = tcgetattr(&slave).unwrap();
        cfmakeraw(&mut raw);
        tcsetattr(&slave, SetArg::TCSANOW, &raw).unwrap();
        let path = ttyname(&slave).unwrap();
        Self {
            master: File::from(master),
            slave: Some(File::from(slave)),
            path,
        }
    }
}

fn control(control: LineControl) -> Payload {
    Payload::Control(control)
}

fn receive(live: &mut Live) -> Input {
    let until = live.now() + live.clock().span_of_wall(LONG);
    live.receive(until).expect("an arrival").input
}

fn bytes(input: Input) -> Vec<u8> {
    match input {
        Input::Payload(Payload::Bytes(bytes)) => bytes,
        other => panic!("{other:?}"),
    }
}

fn frame(id: u16, data: &[u8]) -> Payload {
    Payload::Frame(CanFrame::standard(id, data))
}

fn serial(pty: &Pty) -> Live {
    Live::builder(Clock::real())
        .serial(PORT, &pty.path, SerialSettings::new(9_600))
        .build()
        .unwrap()
}

#[test]
fn bytes_pass_a_serial_line_both_ways() {
    let mut pty = Pty::new();
    let mut live = serial(&pty);
    pty.master.write_all(b">+1.2345\r").unwrap();
    let mut heard = Vec::new();
    while heard.len() < 9 {
        heard.extend(bytes(receive(&mut live)));
    }
    assert_eq!(heard, b">+1.2345\r");
    let command = Payload::Bytes(b"#01\r".to_vec());
    live.send(PORT, &command).unwrap();
    let mut buffer = [0; 4];
    pty.master.read_exact(&mut buffer).unwrap();
    assert_eq!(&buffer, b"#01\r");
}

#[test]
fn a_line_that_takes_nothing_keeps_what_fits_and_then_refuses_whole_messages() {
    let mut pty = Pty::new();
    let mut live = serial(&pty);
    let message = Payload::Bytes(vec![b'x'; 1_000]);
    let mut accepted = 0;
    let refused = loop {
        match live.send(PORT, &message) {
            Ok(()) => accepted += 1,
            Err(error) => break error,
        }
        assert!(accepted < 1_000, "never full");
    };
    assert_eq!(refused, SendError::QueueFull { port: PORT });
    // The reader drains it; waiting writes what was kept.
    let reader = std::thread::spawn(move || {
        let mut buffer = vec![0; accepted * 1_000];
        pty.master.read_exact(&mut buffer).unwrap();
        pty.master.write_all(b"!").unwrap();
        pty
    });
    assert_eq!(bytes(receive(&mut live)), b"!");
    drop(reader.join().unwrap());
}

#[test]
fn an_open_line_changes_its_rate_and_a_break_is_harmless_on_a_pty() {
    let pty = Pty::new();
    let mut live = serial(&pty);
    let rate = || cfgetospeed(&tcgetattr(pty.slave.as_ref().unwrap()).unwrap());
    for done in [
        LineControl::Break(true),
        LineControl::Break(false),
        LineControl::Baud(115_200),
    ] {
        live.send(PORT, &control(done)).unwrap();
    }
    assert_eq!(rate(), BaudRate::B115200);
    live.send(PORT, &control(LineControl::Baud(9_600))).unwrap();
    assert_eq!(rate(), BaudRate::B9600);
    live.send(PORT, &Payload::Bytes(b"g r0x90\r".to_vec()))
        .unwrap();
    let mut heard = [0; 8];
    (&pty.master).read_exact(&mut heard).unwrap();
    assert_eq!(&heard, b"g r0x90\r");
    let odd = live.send(PORT, &control(LineControl::Baud(12_345)));
    assert!(matches!(odd, Err(SendError::System { .. })), "{odd:?}");
    assert_eq!(rate(), BaudRate::B9600);
}

#[test]
fn a_serial_line_that_vanishes_is_gone() {
    let mut pty = Pty::new();
    let mut live = serial(&pty);
    drop(pty.slave.take());
    drop(pty.master);
    assert_eq!(receive(&mut live), Input::Link(LinkState::Gone));
    let error = live.send(PORT, &Payload::Bytes(vec![1])).unwrap_err();
    let state = LinkState::Gone;
    assert_eq!(error, SendError::Unusable { port: PORT, state });
}

#[test]
fn a_serial_line_that_comes_back_is_up() {
    let directory = tempfile::tempdir().unwrap();
    let link = directory.path().join("laser");
    let mut pty = Pty::new();
    std::os::unix::fs::symlink(&pty.path, &link).unwrap();
    let mut live = Live::builder(Clock::real())
        .serial(PORT, &link, SerialSettings::new(9_600))
        .build()
        .unwrap();
    std::fs::remove_file(&link).unwrap();
    drop(pty.slave.take());
    drop(pty.master);
    assert_eq!(receive(&mut live), Input::Link(LinkState::Gone));
    let mut other = Pty::new();
    std::os::unix::fs::symlink(&other.path, &link).unwrap();
    assert_eq!(receive(&mut live), Input::Link(LinkState::Up));
    other.master.write_all(b"back").unwrap();
    assert_eq!(bytes(receive(&mut live)), b"back");
}

#[test]
fn what_cannot_be_opened_says_why() {
    let missing = Live::builder(Clock::real())
        .serial(PORT, "/dev/no-such-line", SerialSettings::new(9_600))
        .build();
    let Err(error) = missing else {
        panic!("opened")
    };
    let text = error.to_string();
    assert!(
        text.contains("/dev/no-such-line: No such file or directory; `ls"),
        "{text}"
    );
    let settings = SlcanSettings::new(123_456);
    let bitrate = Live::builder(Clock::real())
        .slcan(PORT, "/dev/null", settings)
        .build();
    assert!(matches!(bitrate, Err(OpenError::Bitrate { .. })));
}

#[test]
fn two_ports_of_one_number_are_refused() {
    let pty = Pty::new();
    let settings = SerialSettings::new(9_600);
    let twice = Live::builder(Clock::real())
        .serial(PORT, &pty.path, settings)
        .serial(PORT, &pty.path, settings)
        .build();
    assert!(matches!(
        twice,
        Err(OpenError::DuplicatePort { port: PORT })
    ));
}

/// Root opens it in any case, so that somebody else tries.
fn another_can_open(pty: &Pty) -> bool {
    const NOBODY: u32 = 65_534;
    let mut other = process::Command::new("sh");
    other.args(["-c", "exec 3<>\"$0\""]).arg(&pty.path);
    other.stderr(Stdio::null());
    if std::fs::metadata(&pty.path).unwrap().uid() == 0 {
        let everybody = Permissions::from_mode(0o666);
        std::fs::set_permissions(&pty.path, everybody).unwrap();
        other.uid(NOBODY);
    }
    other.status().unwrap().success()
}

#[test]
fn a_line_is_for_one_program_and_for_the_next_once_it_was_given_back() {
    let pty = Pty::new();
    let live = serial(&pty);
    assert!(!another_can_open(&pty), "it is open");
    drop(live);
    assert!(another_can_open(&pty), "it was given back");
}

/// Root is let in by the system in any case, and refused by the lock.
#[test]
fn a_program_that_is_refused_leaves_a_line_to_the_one_that_has_it() {
    let pty = Pty::new();
    let live = serial(&pty);
    let refused = Live::builder(Clock::real())
        .serial(PORT, &pty.path, SerialSettings::new(9_600))
        .build();
    let refused = refused.map(drop).unwrap_err().to_string();
    assert!(refused.contains("another program has it open"), "{refused}");
    assert!(!another_can_open(&pty), "it is still open");
    drop(live);
    assert!(another_can_open(&pty), "it was given back");
}

#[test]
fn no_arrival_by_the_deadline_is_none() {
    let pty = Pty::new();
    let mut live = serial(&pty);
    let until = live.now() + Duration::from_millis(3);
    assert_eq!(live.receive(until), None);
    assert!(live.now() >= until);
}

#[test]
fn the_ports_take_turns() {
    let (mut first, mut second) = (Pty::new(), Pty::new());
    let settings = SerialSettings::new(9_600);
    let mut live = Live::builder(Clock::real())
        .serial(Port(1), &first.path, settings)
        .serial(Port(2), &second.path, settings)
        .build()
        .unwrap();
    first.master.write_all(b"a").unwrap();
    second.master.write_all(b"b").unwrap();
    let until = live.now() + LONG;
    let mut ports = [0, 0].map(|_: u8| live.receive(until).unwrap().port);
    ports.sort();
    assert_eq!(ports, [Port(1), Port(2)]);
    assert_eq!(
        live.send(Port(3), &frame(1, &[])),
        Err(SendError::WrongKind { port: Port(3) })
    );
    assert_eq!(
        live.send(Port(1), &frame(1, &[])),
        Err(SendError::WrongKind { port: Port(1) })
    );
    let sync = live.set_sync(Port(2), Some(Duration::from_millis(1)));
    assert_eq!(sync, Err(SendError::WrongKind { port: Port(2) }));
}

/// An adapter on a pty's master: answers each command by `answer`, until the port closes.
fn adapter(
    mut pty: Pty,
    mut answer: impl FnMut(Command) -> Vec<Reply> + Send + 'static,
) -> JoinHandle<Vec<Command>> {
    std::thread::spawn(move || {
        let mut commands = Vec::new();
        let mut lines = LineBuffer::default();
        let mut buffer = [0; 256];
        while let Ok(count) = pty.master.read(&mut buffer) {
            for line in buffer[..count].iter().filter_map(|byte| lines.push(*byte)) {
                let Some(command) = Command::parse(&line) else {
                    continue;
                };
                commands.push(command);
                // The port is open now: its end is to be noticed.
                drop(pty.slave.take());
                for reply in answer(command) {
                    if pty.master.write_all(&reply.emit()).is_err() {
                        return commands;
                    }
                }
            }
        }
        commands
    })
}

/// What a sound adapter answers.
fn polite(command: Command) -> Vec<Reply> {
    vec![match command {
        Command::Transmit(_) => Reply::Queued,
        Command::ReadStatus => Reply::Status(StatusFlags::empty()),
        Command::ReadVersion => Reply::Version(*b"1013"),
        Command::ReadSerial => Reply::Serial(*b"A123"),
        Command::Unknown(_) => Reply::Refused,
        _ => Reply::Done,
    }]
}

fn settings() -> SlcanSettings {
    SlcanSettings {
        status_interval: None,
        answer_timeout: LONG,
        ..SlcanSettings::new(1_000_000)
    }
}

fn slcan(
    settings: SlcanSettings,
    answer: impl FnMut(Command) -> Vec<Reply> + Send + 'static,
) -> (Result<Live, OpenError>, JoinHandle<Vec<Command>>) {
    let pty = Pty::new();
    let path = pty.path.clone();
    let adapter = adapter(pty, answer);
    let live = Live::builder(Clock::real())
        .slcan(PORT, path, settings)
        .build();
    (live, adapter)
}

#[test]
fn an_adapter_is_closed_set_up_and_opened_in_this_order() {
    let (live, adapter) = slcan(settings(), polite);
    drop(live.unwrap());
    let commands = adapter.join().unwrap();
    let lines: Vec<_> = commands.iter().map(Command::emit).collect();
    let expected: [&[u8]; 5] = [b"C\r", b"V\r", b"S8\r", b"Z1\r", b"O\r"];
    assert_eq!(lines, expected);
}

#[test]
fn old_answers_in_the_line_do_not_confuse_the_start() {
    let mut first = true;
    let (live, _) = slcan(settings(), move |command| {
        let mut replies = Vec::new();
        if core::mem::take(&mut first) {
            let frame = CanFrame::standard(0x181, &[1]);
            let timestamp_ms = None;
            replies.push(Reply::Received {
                frame,
                timestamp_ms,
            });
            replies.extend([Reply::Done, Reply::Refused, Reply::Unknown(b'q')]);
        }
        replies.extend(polite(command));
        replies
    });
    let mut live = live.unwrap();
    let until = live.now() + Duration::from_millis(1);
    assert_eq!(live.receive(until), None);
}

#[test]
fn an_adapter_without_time_stamps_or_version_is_used_without() {
    let (live, _) = slcan(settings(), |command| match command {
        Command::Timestamps(_) | Command::ReadVersion => vec![Reply::Refused],
        other => polite(other),
    });
    assert!(live.is_ok());
}

#[track_caller]
fn check_refused(refused: Command, step: &'static str) {
    let (live, _) = slcan(settings(), move |command| {
        if command == refused {
            vec![Reply::Refused]
        } else {
            polite(command)
        }
    });
    let Err(OpenError::Slcan { failure, .. }) = live else {
        panic!("opened")
    };
    assert_eq!(failure, SlcanFailure::Refused { step });
}

#[test]
fn a_refused_step_of_the_start_is_named() {
    check_refused(Command::Open, "O");
    let bitrate = wire::slcan::BitrateCode::new(1_000_000).unwrap();
    check_refused(Command::Bitrate(bitrate), "S");
}

#[test]
fn an_adapter_that_answers_nothing_is_named() {
    let waited = Duration::from_millis(20);
    let settings = SlcanSettings {
        answer_timeout: waited,
        ..settings()
    };
    let (live, _) = slcan(settings, |_| Vec::new());
    let Err(error) = live else { panic!("opened") };
    let text = error.to_string();
    assert!(
        text.contains("did not answer") && text.contains("20ms"),
        "{text}"
    );
}

#[test]
fn frames_pass_an_adapter_both_ways() {
    let (live, adapter) = slcan(settings(), |command| {
        let mut replies = polite(command);
        if let Command::Transmit(frame) = command {
            let frame = CanFrame::standard(0x581, frame.data());
            let timestamp_ms = Some(12);
            replies.push(Reply::Received {
                frame,
                timestamp_ms,
            });
        }
        replies
    });
    let mut live = live.unwrap();
    for byte in 0..50 {
        live.send(PORT, &frame(0x601, &[byte])).unwrap();
        assert_eq!(receive(&mut live), Input::Payload(frame(0x581, &[byte])));
    }
    assert!(live.counters(PORT).contains(&("received", 50)));
    drop(live);
    assert_eq!(adapter.join().unwrap().len(), 55);
}

fn problem(controller: ControllerProblem) -> Input {
    let class = BusErrorClass::CONTROLLER;
    Input::BusError(BusError { class, controller })
}

#[test]
fn a_refused_transmission_is_a_transmit_overflow_and_the_flags_are_asked_why() {
    let (live, adapter) = slcan(settings(), |command| match command {
        Command::Transmit(_) => vec![Reply::Refused],
        Command::ReadStatus => vec![Reply::Status(StatusFlags::PASSIVE)],
        other => polite(other),
    });
    let mut live = live.unwrap();
    live.send(PORT, &frame(0x601, &[])).unwrap();
    assert_eq!(receive(&mut live), problem(ControllerProblem::TX_OVERFLOW));
    let passive = ControllerProblem::RX_PASSIVE | ControllerProblem::TX_PASSIVE;
    assert_eq!(receive(&mut live), problem(passive));
    assert!(live.counters(PORT).contains(&("refused_by_adapter", 1)));
    drop(live);
    assert_eq!(adapter.join().unwrap().last(), Some(&Command::ReadStatus));
}

#[test]
fn status_flags_and_state_reports_become_errors_and_losses() {
    let (live, _) = slcan(settings(), |command| match command {
        Command::Transmit(_) => vec![
            Reply::Queued,
            Reply::BusState(BusState::Warning),
            Reply::BusState(BusState::Off),
            Reply::Status(StatusFlags::OVERRUN | StatusFlags::BUS_ERROR),
            Reply::BusState(BusState::Active),
        ],
        other => polite(other),
    });
    let mut live = live.unwrap();
    live.send(PORT, &frame(0x601, &[])).unwrap();
    let warning = ControllerProblem::RX_WARNING | ControllerProblem::TX_WARNING;
    assert_eq!(receive(&mut live), problem(warning));
    let error = |class| {
        let controller = ControllerProblem::empty();
        Input::BusError(BusError { class, controller })
    };
    assert_eq!(receive(&mut live), error(BusErrorClass::BUS_OFF));
    assert_eq!(receive(&mut live), Input::Lost(1));
    assert_eq!(receive(&mut live), error(BusErrorClass::BUS_ERROR));
    assert_eq!(receive(&mut live), problem(ControllerProblem::ACTIVE));
}

#[test]
fn an_adapter_that_falls_silent_is_down_until_it_answers_again() {
    let settings = SlcanSettings {
        answer_timeout: Duration::from_millis(150),
        ..settings()
    };
    let mut ignored = 0;
    let (live, _) = slcan(settings, move |command| match command {
        Command::Transmit(_) | Command::ReadStatus if ignored < 2 => {
            ignored += 1;
            Vec::new()
        }
        other => polite(other),
    });
    let Ok(mut live) = live else {
        // A machine too slow to answer within 150 ms proves nothing here.
        return;
    };
    live.send(PORT, &frame(0x601, &[])).unwrap();
    assert_eq!(receive(&mut live), Input::Link(LinkState::Down));
    live.send(PORT, &frame(0x601, &[])).unwrap();
    assert_eq!(receive(&mut live), Input::Link(LinkState::Up));
}

#[test]
fn an_adapter_that_is_pulled_out_is_gone() {
    let mut pty = Pty::new();
    let path = pty.path.clone();
    let unplugged = std::thread::spawn(move || {
        let mut lines = LineBuffer::default();
        let mut byte = [0];
        loop {
            pty.master.read_exact(&mut byte).unwrap();
            let Some(command) = lines.push(byte[0]).and_then(|line| Command::parse(&line)) else {
                continue;
            };
            if matches!(command, Command::Transmit(_)) {
                return;
            }
            drop(pty.slave.take());
            for reply in polite(command) {
                pty.master.write_all(&reply.emit()).unwrap();
            }
        }
    });
    let mut live = Live::builder(Clock::real())
        .slcan(PORT, path, settings())
        .build()
        .unwrap();
    live.send(PORT, &frame(0x601, &[])).unwrap();
    unplugged.join().unwrap();
    assert_eq!(receive(&mut live), Input::Link(LinkState::Gone));
    let state = LinkState::Gone;
    let error = live.send(PORT, &frame(0x601, &[])).unwrap_err();
    assert_eq!(error, SendError::Unusable { port: PORT, state });
}

#[test]
fn syncs_and_frames_never_mix_within_a_line() {
    let (sender, heard) = std::sync::mpsc::channel();
    let (live, adapter) = slcan(settings(), move |command| {
        let _ = sender.send(command);
        polite(command)
    });
    let mut live = live.unwrap();
    live.set_sync(PORT, Some(Duration::from_micros(500)))
        .unwrap();
    let sync = Command::Transmit(wire::canopen::sync::emit_sync(None));
    let mut syncs = 0;
    let mut sent = 0;
    while syncs < 20 {
        let request = frame(0x601, &[1, 2, 3, 4, 5, 6, 7, 8]);
        if live.send(PORT, &request).is_ok() {
            sent += 1;
        }
        let until = live.now() + Duration::from_micros(100);
        assert_eq!(live.receive(until), None, "every line was understood");
        syncs += heard.try_iter().filter(|command| *command == sync).count();
    }
    assert!(live.sync_statistics(PORT).unwrap().sent >= 20);
    live.set_sync(PORT, None).unwrap();
    assert_eq!(live.sync_statistics(PORT), None);
    drop(live);
    let commands = adapter.join().unwrap();
    assert!(
        !commands
            .iter()
            .any(|command| matches!(command, Command::Unknown(_)))
    );
    let frames = commands
        .iter()
        .filter(|c| matches!(c, Command::Transmit(_)));
    let others = frames.filter(|command| **command != sync).count();
    assert!(others <= sent, "{others} of {sent}");
}

#[test]
fn a_scaled_clock_scales_the_sync_period() {
    let pty = Pty::new();
    let path = pty.path.clone();
    let adapter = adapter(pty, polite);
    let mut live = Live::builder(Clock::scaled(10.0))
        .slcan(PORT, path, settings())
        .build()
        .unwrap();
    let begun = live.now();
    live.set_sync(PORT, Some(Duration::from_millis(50)))
        .unwrap();
    while live.sync_statistics(PORT).unwrap().sent < 4 {
        let until = live.now() + Duration::from_millis(10);
        live.receive(until);
    }
    // Never early: four periods of the transport's clock at the least.
    assert!(live.now().since(begun) >= Duration::from_millis(199));
    drop(live);
    drop(adapter.join());
}
