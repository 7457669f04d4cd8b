//! The command `mock-bus`: an emulated machine for other programs to talk to.

use std::collections::BTreeMap;
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::SignalFd;

use mock_bus::config::MachineConfig;
use mock_bus::fault::FaultConfig;
use mock_bus::runner::{self, Options, Running};

/// Runs an emulated machine until it is interrupted, and prints where its ports are.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    /// The machine's configuration.
    config: PathBuf,
    /// Put the first CAN bus on this SocketCAN interface.
    #[arg(long, value_name = "INTERFACE", conflicts_with = "slcan")]
    can: Option<String>,
    /// Make this symbolic link to the first CAN bus's SLCAN terminal.
    #[arg(long, value_name = "PATH")]
    slcan: Option<PathBuf>,
    /// Make a symbolic link to a port's terminal.
    #[arg(long, value_name = "PORT=PATH", value_parser = port_and_path)]
    link: Vec<(String, PathBuf)>,
    /// Chooses noise and errors.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Simulated seconds for each second.
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Add a fault, as TOML: `from_s = 2.0, fault = { kind = "beam_blocked" }`.
    #[arg(long, value_name = "TOML", value_parser = fault)]
    fault: Vec<FaultConfig>,
}

fn port_and_path(text: &str) -> Result<(String, PathBuf), String> {
    let (port, path) = text.split_once('=').ok_or("expected PORT=PATH")?;
    Ok((port.to_owned(), PathBuf::from(path)))
}

fn fault(text: &str) -> Result<FaultConfig, String> {
    let mut faults: BTreeMap<String, FaultConfig> =
        toml::from_str(&format!("fault = {{ {text} }}")).map_err(|error| error.to_string())?;
    faults.remove("fault").ok_or_else(|| "no fault".to_owned())
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
    let mut config = MachineConfig::load(&arguments.config)?;
    config.faults.extend(arguments.fault.iter().cloned());
    let options = options(&config, arguments);
    // Before the machine's thread starts, so that it inherits the mask.
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGINT);
    signals.add(Signal::SIGTERM);
    signals.thread_block()?;
    let machine = runner::spawn(&config, &options)?;
    print_ports(&config, &options, machine.ports());
    wait_for_the_end(&signals, &machine)?;
    Ok(machine.stop()?)
}

/// Until a signal comes or the machine has ended by itself.
fn wait_for_the_end(signals: &SigSet, machine: &Running) -> Result<(), Errno> {
    const LOOK_EVERY_MS: u16 = 500;
    let signals = SignalFd::new(signals)?;
    while !machine.has_ended() {
        let mut fds = [PollFd::new(signals.as_fd(), PollFlags::POLLIN)];
        match poll(&mut fds, PollTimeout::from(LOOK_EVERY_MS)) {
            Ok(0) | Err(Errno::EINTR) => {}
            Ok(_) => break,
            Err(errno) => return Err(errno),
        }
    }
    Ok(())
}

fn options(config: &MachineConfig, arguments: Arguments) -> Options {
    let can = config.ports.iter().find(|port| port.is_can());
    let can = can.map(|port| port.name().to_owned());
    let mut links: BTreeMap<String, PathBuf> = arguments.link.into_iter().collect();
    links.extend(can.clone().zip(arguments.slcan));
    Options {
        seed: arguments.seed,
        speed: arguments.speed,
        interfaces: can.zip(arguments.can).into_iter().collect(),
        links,
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
