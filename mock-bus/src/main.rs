//! The command `mock-bus`: an emulated machine for other programs to talk to.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::SignalFd;
use wire::lockstep::{Reply, Request, path_of};

use mock_bus::config::MachineConfig;
use mock_bus::fault::FaultConfig;
use mock_bus::runner::{self, Options, Pace, Pauses, Running, hand};

/// Runs an emulated machine until it is interrupted, and prints where its ports are.
#[derive(Parser)]
#[command(
    version,
    about,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// The machine's configuration.
    #[arg(required = true)]
    config: Option<PathBuf>,
    /// Put the first CAN bus on this SocketCAN interface.
    #[arg(long, value_name = "INTERFACE", conflicts_with = "slcan")]
    can: Option<String>,
    /// Make this symbolic link to the first CAN bus's SLCAN terminal.
    #[arg(long, value_name = "PATH")]
    slcan: Option<PathBuf>,
    /// Make a symbolic link to a port's terminal.
    #[arg(long, value_name = "PORT=PATH", value_parser = port_and_path)]
    link: Vec<(String, PathBuf)>,
    /// Seed of the machine's noise and errors.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Simulated seconds per real second.
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// `lockstep:PATH`: time passes only when neither the machine nor the programs that talk to
    /// it have anything left to do, so that a busy computer changes nothing. They agree over a
    /// socket at PATH: `truestage … --clock lockstep:PATH`.
    #[arg(long, value_name = "CLOCK", value_parser = path_of, conflicts_with = "speed")]
    clock: Option<PathBuf>,
    /// With --clock: a program that is killed does not end the machine; the next one continues.
    #[arg(long, requires = "clock")]
    outlive: bool,
    /// A socket for `mock-bus ctl` in real time; with --clock, the clock's own socket serves
    /// instead.
    #[arg(long, value_name = "PATH", conflicts_with = "clock")]
    control: Option<PathBuf>,
    /// Add a fault, as TOML: `from_s = 2.0, fault = { kind = "beam_blocked" }`.
    #[arg(long, value_name = "TOML", value_parser = hand::fault)]
    fault: Vec<FaultConfig>,
}

#[derive(Subcommand)]
enum Command {
    /// Acts on a running machine, as its operator would: `mock-bus ctl SOCKET turn-plate 73`.
    Ctl {
        /// Where the machine listens: the PATH of its `--clock lockstep:PATH` or `--control PATH`.
        socket: PathBuf,
        /// `turn-plate LINES`, `fix-plate OFFSET`, `place-plate OFFSET`, `read-line NUMBER`, `set-up-line TOML`, `take-line-away`, `fault TOML`, `end-fault
        /// NUMBER`, `power off`, `power on`, or `truth`.
        #[arg(required = true, num_args = 1.., allow_hyphen_values = true)]
        words: Vec<String>,
    },
}

fn port_and_path(text: &str) -> Result<(String, PathBuf), String> {
    let (port, path) = text.split_once('=').ok_or("expected PORT=PATH")?;
    Ok((port.to_owned(), PathBuf::from(path)))
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("mock-bus: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: Arguments) -> Result<(), Box<dyn std::error::Error>> {
    match (&arguments.command, arguments.config.clone()) {
        (Some(Command::Ctl { socket, words }), _) => lend_a_hand(socket, &words.join(" ")),
        (None, Some(config)) => emulate(&config, arguments),
        // The command line's parser asks for one of them.
        (None, None) => Ok(()),
    }
}

/// Says what shall be done and prints what came of it.
#[expect(clippy::print_stdout, reason = "the answer is the command's result")]
fn lend_a_hand(socket: &Path, words: &str) -> Result<(), Box<dyn std::error::Error>> {
    // A machine need not run for its user to learn the words.
    hand::Deed::parse(words)?;
    let failed = |error| format!("{}: {error}; is a machine running there?", socket.display());
    let mut stream = UnixStream::connect(socket).map_err(failed)?;
    let words = words.to_owned();
    writeln!(stream, "{}", Request::Do { words }).map_err(failed)?;
    let mut line = String::new();
    BufReader::new(stream)
        .read_line(&mut line)
        .map_err(failed)?;
    match Reply::parse(line.trim_end_matches('\n'))? {
        Reply::Done(text) => println!("{text}"),
        Reply::Refused(why) => return Err(why.into()),
        other => return Err(format!("unexpected answer `{other}`").into()),
    }
    Ok(())
}

fn emulate(config: &Path, arguments: Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let mut config = MachineConfig::load(config)?;
    config.faults.extend(arguments.fault.iter().cloned());
    let options = options(&config, arguments);
    // Before the machine's thread starts, so that it inherits the mask.
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGINT);
    signals.add(Signal::SIGTERM);
    signals.thread_block()?;
    let machine = runner::spawn(&config, &options)?;
    print_ports(&config, &options, machine.ports());
    std::io::stdout().flush()?;
    wait_for_the_end(&signals, &machine)?;
    Ok(machine.stop()?)
}

/// Until a signal comes or the machine has ended by itself.
fn wait_for_the_end(signals: &SigSet, machine: &Running) -> Result<(), Errno> {
    const LOOK_EVERY_MS: u16 = 500;
    let signals = SignalFd::new(signals)?;
    let mut told = 0;
    while !machine.has_ended() {
        told = tell_pauses(machine.pauses(), told);
        let mut fds = [PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
        match poll(&mut fds, PollTimeout::from(LOOK_EVERY_MS)) {
            Ok(0) | Err(Errno::EINTR) => {}
            Ok(_) => break,
            Err(errno) => return Err(errno),
        }
    }
    Ok(())
}

/// Names the computer, where that is to blame; says how many pauses have been told.
fn tell_pauses(pauses: Pauses, told: u64) -> u64 {
    if let Some((at, pause)) = pauses.last.filter(|_| pauses.count > told) {
        eprintln!(
            "mock-bus: this computer paused the emulated machine for {:.3} s, until {:.3} s of its \
             time ({} pauses so far): what the controller misses meanwhile is not a fault of the \
             machine; with --clock lockstep:PATH such pauses do no harm",
            pause.as_secs_f64(),
            at.seconds(),
            pauses.count
        );
    }
    pauses.count
}

fn options(config: &MachineConfig, arguments: Arguments) -> Options {
    let can = config.ports.iter().find(|port| port.is_can());
    let can = can.map(|port| port.name().to_owned());
    let mut links: BTreeMap<String, PathBuf> = arguments.link.into_iter().collect();
    links.extend(can.clone().zip(arguments.slcan));
    Options {
        seed: arguments.seed,
        pace: match arguments.clock {
            None => Pace::Wall(arguments.speed),
            Some(path) => Pace::Lockstep(path),
        },
        control: arguments.control,
        outlive: arguments.outlive,
        interfaces: can.zip(arguments.can).into_iter().collect(),
        links,
        ..Options::default()
    }
}

#[expect(
    clippy::print_stdout,
    reason = "the command's result is where the ports are"
)]
fn print_ports(config: &MachineConfig, options: &Options, paths: &[PathBuf]) {
    for (port, path) in config.ports.iter().zip(paths) {
        let name = port.name();
        let kind = match (port.is_can(), options.interfaces.contains_key(name)) {
            (true, true) => "socketcan ",
            (true, false) => "slcan ",
            (false, _) => "",
        };
        println!("{name}: {kind}{}", path.display());
    }
}
