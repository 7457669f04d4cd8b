//! The command line. Its words are the cycle's own.

mod align;
mod answering;
mod ask;
mod before;
mod behind;
mod belongs;
mod budget;
mod cal;
mod cal_page;
mod check;
mod chosen;
mod controls;
mod data;
mod data_file;
mod data_text;
mod demo;
mod doctor;
mod examples;
mod exchange;
mod explain;
mod found;
mod intended;
mod jog;
mod jogs;
mod journal;
mod json;
mod kept;
mod kind;
mod linear;
mod made_from;
mod monitor;
mod move_args;
mod new;
mod operator;
mod output;
mod page;
mod paint;
mod plain;
mod platform;
mod plausible;
mod progress;
mod refused;
mod report;
mod reset;
mod resume;
mod rotary;
mod run;
#[cfg(test)]
mod same_figures_tests;
mod scan;
mod schema;
mod secure;
mod serve;
mod session;
mod shell;
mod show;
mod signals;
mod span;
#[cfg(test)]
mod stored_tests;
mod streams;
mod targets;
mod text;
mod token;
mod tried;
mod verbs;
mod volumetric;
mod written;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use wire::lockstep::path_of;

use crate::ports::Pace;
use crate::{Failure, made_by};
use examples::{EXIT_CODES, with_examples};
use intended::Intent;
use move_args::{AgreedArgs, ApproachName, MoveArgs, WayName, only_for};
use output::{Ended, Output, SaidArgs};
use refused::not_understood;
use rotary::readings::ReadingsArgs;
use schema::verb_of;
use volumetric::memory_args::MemoryCommand;
/// Makes precision motion stages go where they are told.
#[derive(Debug, Parser)]
#[command(name = "truestage", version, arg_required_else_help = true, after_help = EXIT_CODES)]
struct Cli {
    /// Print one JSON object on stdout instead of text.
    #[arg(long, global = true)]
    json: bool,
    #[command(flatten)]
    said: SaidArgs,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The whole cycle on an emulated machine: start here.
    Demo(demo::DemoCommand),
    /// Check a configuration; no bus is touched.
    Check {
        /// The machine's configuration.
        #[arg(default_value = "machine.toml")]
        config: PathBuf,
    },
    /// Write a configuration to begin with: a machine that ships, each key explained, with what is told here, asked at a
    /// terminal, or was found by `scan`. What must still be filled in is marked.
    New(new::NewArgs),
    /// Check what stands between this computer and the machine: ports, rights, queues, records, other masters on a
    /// bus; a line for each, with what to do. Nothing is sent to any device.
    Doctor(MachineArgs),
    /// List the devices on the buses and what does not match the configuration; nothing changes.
    Scan(MachineArgs),
    /// Acknowledge the fault of the axis that is named, or of each that has one, once; nothing moves.
    Reset(AxisArgs),
    /// Find the origin: with Hall sensors, on index pulses, or on an index mark.
    Zero(ZeroArgs),
    /// Zero, measure the deviations, store and activate the calibration.
    Calibrate(CalibrateArgs),
    /// Zero, measure between the calibrated positions, judge.
    Verify(VerifyArgs),
    /// Zero, then a compensated move: `truestage move machine.toml x=12.5mm`.
    Move(MoveArgs),
    /// Zero, then run an axis at a speed, to its soft limit, for a time, or until Ctrl-C: `truestage jog x=2mm/s`,
    /// `truestage jog c=5deg/s`; or a platform along x or y, or by theta.
    Jog(jog::JogArgs),
    /// Zero, then record the references of the detectors of three axes, for the calibration in use; or take them
    /// from a file (`reference import`).
    Reference(volumetric::reference::ReferenceArgs),
    /// Show where each detector sees its beam, while you turn the adjusters. No drive is enabled and nothing moves.
    Align(align::AlignArgs),
    /// Zero, then do a job of one axis (`JOB.toml`), or follow a path of three axes (`PATH.csv`), corrected.
    ///
    /// A job goes to its points one after the other and waits at each for a time, for the operator or for an input,
    /// as its file says; each point is in the journal with its uncertainty. It is judged whole before anything
    /// moves; --dry-run does only that. One that was interrupted goes on with --resume.
    ///
    /// A path has the columns time_s,x_mm,y_mm,z_mm. Its rows are joined by the cubic spline through them, at rest at both
    /// ends, which swings out at a corner or where the rows suddenly end, or by straight lines with rounded
    /// corners (--join linear --blend 50um). How far at most, and where, is printed before anything moves. Everything that will be driven is judged first (soft
    /// limits, speed, acceleration, jerk, calibrated volume), not only the rows.
    Run(run::RunArgs),
    /// Record or drop a state of three axes that is kept on purpose, so that all parts are alike.
    #[command(subcommand)]
    Memory(MemoryCommand),
    /// Stored calibrations.
    #[command(subcommand)]
    Cal(cal::CalCommand),
    /// Fit the same models to data measured elsewhere.
    #[command(subcommand)]
    Fit(data::FitCommand),
    /// Plan a measurement: what to measure, and what it will be able to tell.
    #[command(subcommand)]
    Plan(data::PlanCommand),
    /// ISO 230-2 figures of measured data (columns run,approach,target_mm,measured_mm).
    Iso230 {
        /// The data file.
        data: PathBuf,
        #[command(flatten)]
        by: data::MeasuredBy,
    },
    /// Say what a code means, what it mostly comes from and what to do: `truestage explain 0x8611`.
    Explain(explain::ExplainArgs),
    /// Keep the machine zeroed, enabled and supervised, and let others ask for motions and runs over HTTP.
    Serve(serve::ServeArgs),
    /// One more who may ask a service over the network: prints a token once, and keeps its hash in a file.
    Token(token::TokenArgs),
    /// What a machine that is kept by a service does, and its axes.
    Status(ServiceArgs),
    /// What it does as it happens: a picture on a terminal, elsewhere a line for each event.
    Monitor(monitor::MonitorArgs),
    /// Switch on an axis of a machine that is kept by a service, or all of them.
    Enable(PowerArgs),
    /// Switch off an axis of a machine that is kept by a service, or all of them; they keep their zero.
    Disable(PowerArgs),
    /// Stop everything that a service moves; taken from anybody.
    Stop {
        #[command(flatten)]
        service: ServiceArgs,
        /// Quick stop, and every drive off; without it axes slow down and stay enabled.
        #[arg(long)]
        quick: bool,
    },
    /// The journals of runs.
    #[command(subcommand)]
    Journal(journal::JournalCommand),
    /// A self-contained HTML page of a run.
    Report(report::ReportArgs),
    /// The JSON Schemas of what this program prints and reads.
    #[command(subcommand)]
    Schema(schema::SchemaCommand),
    /// A script by which a shell completes the words of this program: for bash,
    /// `truestage completions bash > ~/.local/share/bash-completion/completions/truestage`.
    Completions(shell::CompletionsArgs),
    /// Manual pages of this program and its verbs.
    Man(shell::ManArgs),
}

/// How a machine is reached.
#[derive(Clone, Debug, Args)]
struct MachineArgs {
    /// The machine's configuration.
    #[arg(default_value = "machine.toml")]
    config: PathBuf,
    /// Use another endpoint for a bus or line of the configuration: `can0=slcan:/dev/pts/3`,
    /// `can0=socketcan:vcan0`, `laser=/dev/pts/4`. May be given several times.
    #[arg(long = "port", value_name = "NAME=ENDPOINT")]
    ports: Vec<String>,
    /// The clock of an emulated machine that runs faster than real time (`mock-bus --speed`).
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    clock_speed: f64,
    /// `lockstep:PATH`: the clock of an emulated machine that waits for its controller (`mock-bus
    /// --clock lockstep:PATH`). That machine then turns plates and sets up lines itself.
    #[arg(long, value_name = "CLOCK", value_parser = path_of, conflicts_with = "clock_speed")]
    clock: Option<PathBuf>,
    /// Who does what a person is asked to do: the emulated machine at this socket (`mock-bus
    /// --control PATH`; that of --clock if not given), or, with `ask`, the person at this terminal.
    #[arg(long, value_name = "PATH")]
    hand: Option<PathBuf>,
    /// Write all traffic on the buses to this file, in candump's log format; it must not exist yet.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

impl MachineArgs {
    /// Whose time the machine lives by.
    fn pace(&self, verb: &str) -> Result<Pace, Failure> {
        match &self.clock {
            None => Ok(Pace::Wall(self.clock_speed)),
            Some(path) => Pace::lockstep(path, &format!("truestage {verb}")),
        }
    }

    /// Where an emulated machine's hand does what people are asked for.
    fn hand(&self) -> Option<&Path> {
        let hand = self.hand.as_deref().or(self.clock.as_deref());
        hand.filter(|hand| *hand != Path::new("ask"))
    }
}

#[derive(Clone, Debug, Args)]
struct AxisArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// Which axis; may be left out when there is only one.
    #[arg(long)]
    axis: Option<String>,
}

#[derive(Clone, Debug, Args)]
struct ZeroArgs {
    #[command(flatten)]
    axis: AxisArgs,
    #[command(flatten)]
    ask: AskArgs,
}

/// Whether somebody is asked.
#[derive(Clone, Copy, Debug, Args)]
struct AskArgs {
    /// Say what would be done, and what that depends upon; no port is opened, nothing moves.
    #[arg(long)]
    dry_run: bool,
    /// Ask nothing: neither on a terminal, before anything moves, whether to go on; nor, where a person turns
    /// the plate of a rotary table or sets up the lines of an interferometer, whether that is done.
    #[arg(long)]
    yes: bool,
}

/// What a bare `--resume` stands for; no file is called that by accident.
const NEWEST_RUN: &str = "<newest>";

#[derive(Clone, Debug, Args)]
struct CalibrateArgs {
    #[command(flatten)]
    axis: AxisArgs,
    /// Continue the newest interrupted run of this axis, or the journal given.
    #[arg(long, value_name = "JOURNAL", num_args = 0..=1, default_missing_value = NEWEST_RUN)]
    resume: Option<PathBuf>,
    /// Save even if the first and the last measurement of one place differ by more than the limit.
    #[arg(long)]
    accept_drift: bool,
    #[command(flatten)]
    ask: AskArgs,
    #[command(flatten)]
    readings: ReadingsArgs,
    /// Store what is found, and use what was used before.
    #[arg(long, conflicts_with = "verify")]
    no_activate: bool,
    /// Verify with it at once, and go back to what was used before where it makes things worse.
    #[arg(long)]
    verify: bool,
    /// Three axes: let them move to and fro for this long, then measure again what heat changed. With --resume for as long as
    /// the run was to, when not given; and not again where four fifths of the warmth are left.
    #[arg(long, value_name = "MINUTES")]
    warm_up_min: Option<f64>,
}

#[derive(Clone, Debug, Args)]
struct VerifyArgs {
    #[command(flatten)]
    axis: AxisArgs,
    /// Without the calibration: the stage as found.
    #[arg(long)]
    uncompensated: bool,
    /// Continue the newest interrupted run of this axis, or the journal given.
    #[arg(long, value_name = "JOURNAL", num_args = 0..=1, default_missing_value = NEWEST_RUN)]
    resume: Option<PathBuf>,
    #[command(flatten)]
    ask: AskArgs,
    #[command(flatten)]
    readings: ReadingsArgs,
}

pub use serve::Serving;
use token::NewToken;

/// Which axes of a machine that is kept by a service.
#[derive(Clone, Debug, Args)]
struct PowerArgs {
    #[command(flatten)]
    service: ServiceArgs,
    /// Which axis; all of them when not given.
    #[arg(long)]
    axis: Option<String>,
}

/// A service that keeps a machine.
#[derive(Clone, Debug, Args)]
struct ServiceArgs {
    /// The machine that it keeps, whose records say where it is found; `machine.toml` when it is there.
    #[arg(value_name = "MACHINE.toml", conflicts_with = "at")]
    config: Option<PathBuf>,
    /// Where it is found: what `truestage serve --listen` said. `unix:truestage.sock` when nothing else is known.
    #[arg(long, value_name = "PLACE")]
    at: Option<String>,
}

/// Runs the command line of this process; `keep` keeps a machine for `truestage serve`, `enrol` makes a token for
/// `truestage token` and returns it, `code_of` names failures for programs, and `version` is what `--version` says of
/// this program.
pub fn main(
    keep: fn(Serving) -> Result<(), crate::Failure>,
    enrol: fn(NewToken) -> Result<String, crate::Failure>,
    code_of: fn(&crate::Failure) -> String,
    version: &'static str,
) -> ExitCode {
    made_by::this_is(version);
    output::name_failures_by(code_of);
    signals::outlive_full_files();
    let code = run(keep, enrol, version);
    // What could not be printed was said where it was given.
    let _ = streams::finish();
    code
}

fn run(
    keep: fn(Serving) -> Result<(), Failure>,
    enrol: fn(NewToken) -> Result<String, Failure>,
    version: &'static str,
) -> ExitCode {
    let words = with_examples(Cli::command())
        .version(version)
        .try_get_matches();
    let read = words.and_then(|words| Ok((verb_of(&words), Cli::from_arg_matches(&words)?)));
    let (verb, cli) = match read {
        Ok(read) => read,
        Err(refused) => return not_understood(&refused),
    };
    // As long as the program: there is one.
    let output = Output::new(cli.json, verb.leak()).saying(cli.said.said());
    match done(cli.command, output, keep, enrol) {
        Ok(None) => ExitCode::SUCCESS,
        Ok(Some(failure)) => {
            output.must_say(&format!("error: {failure}"));
            ExitCode::from(failure.exit_code())
        }
        Err(failure) => {
            output.failure(&failure);
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Does what `command` says.
fn done(
    command: Command,
    output: Output,
    keep: fn(Serving) -> Result<(), Failure>,
    enrol: fn(NewToken) -> Result<String, Failure>,
) -> Ended {
    match command {
        Command::Demo(args) => demo::run(&args, output),
        Command::Check { config } => check::run(&config, output),
        Command::New(args) => new::run(&args, output),
        Command::Doctor(args) => doctor::run(&args, output),
        Command::Scan(args) => scan::run(&args, output),
        Command::Reset(args) => kept::or_by_its_service(reset::run(&args, output), |service| {
            service.reset(&args, output)
        }),
        Command::Zero(args) => before::run(Intent::Zero(&args), output),
        Command::Calibrate(args) => before::run(Intent::Calibrate(&args), output),
        Command::Verify(args) => before::run(Intent::Verify(&args), output),
        Command::Move(args) => before::run(Intent::Move(&args.settle()), output),
        Command::Jog(args) => jog::run(&args.settle(), output),
        Command::Reference(args) => volumetric::reference::run(&args, output),
        Command::Align(args) => align::run(&args, output),
        Command::Run(args) => run::run(args, output),
        Command::Memory(MemoryCommand::Record(args)) => volumetric::memory::record(&args, output),
        Command::Memory(MemoryCommand::Import(args)) => volumetric::memory::import(&args, output),
        Command::Memory(MemoryCommand::Clear(args)) => volumetric::memory::clear(&args, output),
        Command::Cal(command) => cal::run(&command, output),
        Command::Fit(command) => data::fit(&command, output),
        Command::Plan(command) => data::plan(&command, output),
        Command::Iso230 { data, by } => data::iso230(&data, &by, output),
        Command::Explain(args) => explain::run(&args, output),
        Command::Status(service) => ask::status(&service, output),
        Command::Monitor(args) => monitor::run(&args, output),
        Command::Enable(args) => ask::power(&args, true, output),
        Command::Disable(args) => ask::power(&args, false, output),
        Command::Stop { service, quick } => ask::stop(&service, quick, output),
        Command::Serve(args) => serve::run(args, output, keep),
        Command::Token(args) => token::run(args, output, enrol),
        Command::Journal(command) => journal::run(&command, output),
        Command::Report(args) => report::run(&args, output),
        Command::Schema(command) => schema::run(command, &Cli::command(), output),
        Command::Completions(args) => shell::completions(args, Cli::command()),
        Command::Man(args) => shell::man(&args, with_examples(Cli::command()), output),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Command {
        let words = ["truestage"].iter().chain(words);
        Cli::try_parse_from(words)
            .unwrap_or_else(|error| panic!("{error}"))
            .command
    }

    #[test]
    fn every_verb_can_be_parsed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_path_without_a_configuration_is_run_on_the_machine_here() {
        let settled = |words: &[&str]| match parsed(words) {
            Command::Run(args) => args.settle(),
            _ => panic!("another verb"),
        };
        let (machine, path) = settled(&["run", "p.csv"]);
        assert_eq!(
            (machine.config, path),
            ("machine.toml".into(), "p.csv".into())
        );
        let (machine, path) = settled(&["run", "m.toml", "p.csv"]);
        assert_eq!((machine.config, path), ("m.toml".into(), "p.csv".into()));
    }

    #[test]
    fn a_bare_resume_means_the_newest_run() {
        let Command::Calibrate(args) = parsed(&["calibrate", "m.toml", "--resume"]) else {
            panic!("another verb")
        };
        assert_eq!(args.resume, Some(NEWEST_RUN.into()));
        let Command::Verify(args) = parsed(&["verify", "m.toml", "--resume", "a.jsonl"]) else {
            panic!("another verb")
        };
        assert_eq!(args.resume, Some("a.jsonl".into()));
    }

    #[test]
    fn a_first_part_is_made_when_asked_for_only() {
        for (words, expected) in [
            (&["run", "m.toml", "part.csv"][..], false),
            (&["run", "m.toml", "part.csv", "--first-part"][..], true),
        ] {
            let Command::Run(args) = parsed(words) else {
                panic!("another verb")
            };
            assert_eq!(args.first_part, expected);
        }
    }

    #[test]
    fn a_move_without_a_configuration_uses_the_one_here() {
        let Command::Move(args) = parsed(&["move", "x=1mm", "y=2mm"]) else {
            panic!("another verb")
        };
        let args = args.settle();
        assert_eq!(args.machine.config, PathBuf::from("machine.toml"));
        assert_eq!(args.targets, ["x=1mm", "y=2mm"]);
        let Command::Move(args) = parsed(&["move", "m.toml", "x=1mm"]) else {
            panic!("another verb")
        };
        let args = args.settle();
        assert_eq!(args.machine.config, PathBuf::from("m.toml"));
        assert_eq!(args.targets, ["x=1mm"]);
    }
}
