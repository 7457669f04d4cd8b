//! `truestage demo`: the whole cycle on an emulated machine, over real protocols.
//!
//! The emulated devices run in a thread of their own behind pseudo-terminals: CAN as SLCAN,
//! everything else as serial lines. The controller side is the one of every other verb. Both
//! share a clock that waits for them, so that every computer shows the same.

mod linear;
mod rotary;
mod uvw;
mod volumetric;

use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use serde_json::Value;
use truestage::config::{self, Loaded};
use truestage::emulated::{EmulatedOnPtys, HallDrift};
use truestage::store::{Lease, ReadJournal};
use truestage::{Failure, Machine, Store, ports};
use units::Time;

use super::output::{Ended, Output};
use super::progress::Bars;
use super::session::stop_on_signals;

/// How long the mains stays off, and what the drives take to boot, in machine time.
const POWER_OFF: Duration = Duration::from_millis(800);

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Which machine.
    #[arg(long, value_enum, default_value_t = Which::Linear)]
    machine: Which,
    /// The emulated stage's errors, noise and drift; the same seed is the same stage.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Let the emulated machine live by the wall's clock, so many times as fast (10, say), for
    /// whoever wants to watch; without it time passes as fast as the computer goes.
    #[arg(long, value_name = "FACTOR")]
    speed: Option<f64>,
    /// How often the power is cycled.
    #[arg(long, default_value_t = 3)]
    power_cycles: u64,
    /// Where calibrations, runs and the report go; the configuration's folder if not given.
    #[arg(long)]
    data_dir: Option<PathBuf>,
}

/// The machines there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Which {
    /// A linear-motor stage with Hall sensors and a laser interferometer.
    Linear,
    /// An alignment platform on three screws, seen by an image controller.
    Uvw,
    /// The same with amplifiers on a serial line in place of drives on CAN.
    UvwCopley,
    /// A rotary table and a plate of lines, turned from placement to placement.
    Rotary,
    /// Three axes corrected throughout their volume, for eight hours in virtual time.
    Volumetric,
}

impl Which {
    /// Where its configuration ships, that configuration, and what it is emulated from.
    const fn files(self) -> [&'static str; 3] {
        match self {
            Self::Linear => [
                "configs/machines/linear.toml",
                include_str!("../../../../configs/machines/linear.toml"),
                include_str!("../../../../configs/emulated/linear.toml"),
            ],
            Self::Uvw => [
                "configs/machines/uvw.toml",
                include_str!("../../../../configs/machines/uvw.toml"),
                include_str!("../../../../configs/emulated/uvw.toml"),
            ],
            Self::Rotary => [
                "configs/machines/rotary.toml",
                include_str!("../../../../configs/machines/rotary.toml"),
                include_str!("../../../../configs/emulated/rotary.toml"),
            ],
            Self::Volumetric => [
                "configs/machines/volumetric.toml",
                include_str!("../../../../configs/machines/volumetric.toml"),
                include_str!("../../../../configs/emulated/volumetric.toml"),
            ],
            Self::UvwCopley => [
                "configs/machines/uvw-copley.toml",
                include_str!("../../../../configs/machines/uvw-copley.toml"),
                include_str!("../../../../configs/emulated/uvw-copley.toml"),
            ],
        }
    }
}

/// A machine to show, and its emulation.
struct Stand {
    machine: Machine,
    store: Store,
    emulated: EmulatedOnPtys,
    started: Instant,
}

/// Switches the machine off and everything's power off and on, `drift` meanwhile, and starts again.
fn power_cycle(
    machine: &mut Machine,
    emulated: &EmulatedOnPtys,
    drift: HallDrift,
) -> Result<(), Failure> {
    machine.shut_down()?;
    emulated.power_cycle(drift)?;
    let back = machine.now() + POWER_OFF;
    machine.run_until(back)?;
    machine.start()
}

/// Writes the page of a demonstration whose run `journal` is, and says where.
fn write_page(store: &Store, journal: &ReadJournal, html: &str) -> Result<PathBuf, Failure> {
    let stamp = journal.header.started.replace([':', '-'], "");
    let path = store.reports().join(format!("{stamp}-demo.html"));
    store.write_report(&path, html)?;
    Ok(path)
}

/// What was shown.
struct Shown {
    text: String,
    value: Value,
    /// What is out of tolerance, if anything is.
    bad: Option<Failure>,
}

pub(super) fn run(args: &DemoArgs, output: Output) -> Ended {
    if args.machine == Which::Volumetric {
        return volumetric::run(args, output);
    }
    let started = Instant::now();
    let mut loaded = load(args)?;
    let store = Store::of(&loaded.config.machine);
    let _lease = Lease::take(&store, "demo")?;
    let [_, _, description] = args.machine.files();
    let emulated = match args.speed {
        None => EmulatedOnPtys::in_lockstep(description, args.seed)?,
        Some(speed) => EmulatedOnPtys::start(description, args.seed, speed)?,
    };
    let pace = emulated.pace("truestage demo")?;
    loaded.patience = pace.patience();
    let overrides = emulated.overrides(&loaded.config)?;
    let transport = ports::open(&loaded.config, &overrides, ports::Use::Measurement, pace)?;
    let mut machine = Machine::new(&loaded, Box::new(transport));
    machine.observe(Box::new(Bars::new(
        output.is_json() || !std::io::stderr().is_terminal(),
    )));
    stop_on_signals(&machine.stop_request())?;
    announce(args, &loaded, &emulated, output);
    let mut stand = Stand {
        machine,
        store,
        emulated,
        started,
    };
    let shown = match args.machine {
        Which::Linear => linear::show(&mut stand, args, output),
        Which::Uvw | Which::UvwCopley => uvw::show(&mut stand, args, output),
        Which::Rotary => rotary::show(&mut stand, output),
        Which::Volumetric => unreachable!("it was shown in virtual time"),
    }?;
    match shown.bad {
        None => output.result(&shown.text, &shown.value),
        Some(failure) => output.bad_result(&shown.text, shown.value, failure),
    }
}

fn load(args: &DemoArgs) -> Result<Loaded, Failure> {
    if let Some(speed) = args.speed
        && !(speed.is_finite() && speed > 0.0)
    {
        return Err(Failure::Usage {
            what: format!("a speed of {speed}"),
            help: "give a positive number; 1 is real time".into(),
        });
    }
    let [path, text, _] = args.machine.files();
    let mut loaded = config::parse(text, path)?;
    if let Some(folder) = &args.data_dir {
        loaded.config.machine.data_dir.clone_from(folder);
    }
    Ok(loaded)
}

fn announce(args: &DemoArgs, loaded: &Loaded, emulated: &EmulatedOnPtys, output: Output) {
    let machine = &loaded.config.machine;
    output.note(&format!(
        "truestage demo: emulated machine `{}` (stage {}), seed {}{}",
        machine.name,
        machine.stage_serial,
        args.seed,
        args.speed
            .map_or(String::new(), |speed| format!(", {speed}× real time")),
    ));
    for line in emulated.description() {
        output.note(&format!("  {line}"));
    }
}

/// The last line of every demonstration: how long it took, and how long the machine lived.
fn took(wall: Duration, lived: Time) -> String {
    format!(
        "took {:.1} s; the emulated machine lived {:.0} s meanwhile",
        wall.as_secs_f64(),
        lived.seconds()
    )
}
