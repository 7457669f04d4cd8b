//! `truestage demo`: the whole cycle on an emulated machine, over real protocols.
//!
//! The emulated devices run in a thread of their own behind pseudo-terminals: CAN as SLCAN,
//! everything else as serial lines. The controller side is the one of every other verb. Both
//! share a clock that waits for them, so that every computer shows the same; so does the
//! machine in this process (`--in-process`), sooner.

pub(crate) mod emulation;
pub(crate) mod stand;
pub(crate) mod which;

use std::time::Instant;

use clap::Args;
use drivers::transport::awake::KeptAwake;
use machine::records::Lease;

use self::emulation::Emulation;
use self::stand::{Demo, DemoArgs, Show, Shown, Stand};
use self::which::Which;
use crate::config::{self, Loaded};
use crate::emulated::{Emulated, EmulatedOnPtys};
use crate::program::output::{Ended, Output};
use crate::program::progress::Bars;
use crate::program::signals::stop_on_signals;
use crate::{Failure, Machine};

#[derive(Debug, Args)]
pub(crate) struct DemoCommand {
    /// Which machine.
    #[arg(long, value_enum, default_value_t = Which::first())]
    machine: Which,
    #[command(flatten)]
    args: DemoArgs,
}

pub(crate) fn run(command: &DemoCommand, output: Output) -> Ended {
    let (Which(demo), args) = (command.machine, &command.args);
    match demo.show {
        Show::Alone(_) if args.speed.is_some() => Err(never_in_real_time(demo)),
        Show::Alone(run) => run(demo, args, output),
        Show::OnStand(show) => on_stand(demo, args, output, show),
    }
}

/// Nobody shall wait for what is never shown in real time.
fn never_in_real_time(demo: &Demo) -> Failure {
    let name = demo.name;
    Failure::Usage {
        what: format!(
            "--speed is not for --machine {name}, which is shown as fast as the computer allows"
        ),
        help: "leave it out, or watch another machine".into(),
    }
}

fn on_stand(
    demo: &Demo,
    args: &DemoArgs,
    output: Output,
    show: impl FnOnce(&mut Stand, &DemoArgs, Output) -> Result<Shown, Failure>,
) -> Ended {
    let started = Instant::now();
    let mut loaded = load(demo, args)?;
    let store = loaded.config.machine.store();
    let _lease = Lease::take(&store, "demo")?;
    let [_, _, description] = demo.files;
    let emulated = emulation(args, description, &loaded)?;
    // Only with a shared clock do the two ends do nothing but wait for each other.
    let _awake = (args.speed.is_none() && !args.in_process).then(KeptAwake::new);
    let (transport, patience) = emulated.connect(&loaded.config)?;
    loaded.patience = patience;
    let mut machine = Machine::new(&loaded, transport);
    let bars = match args.speed {
        None => output.bars(Bars::of_demonstration),
        Some(_) => output.bars(Bars::new),
    };
    machine.observe(Box::new(bars));
    stop_on_signals(&machine.stop_request())?;
    announce(args, &loaded, &emulated, output);
    let mut stand = Stand {
        machine,
        store,
        emulated,
        started,
    };
    let shown = show(&mut stand, args, output)?;
    match shown.bad {
        None => output.result(&shown.text, &shown.value),
        Some(failure) => output.bad_result(&shown.text, shown.value, failure),
    }
}

fn emulation(args: &DemoArgs, description: &str, loaded: &Loaded) -> Result<Emulation, Failure> {
    if args.in_process {
        let emulated = Emulated::new(description, args.seed, &loaded.config)?;
        return Ok(Emulation::InProcess(emulated));
    }
    let emulated = match args.speed {
        None => EmulatedOnPtys::in_lockstep(description, args.seed)?,
        Some(speed) => EmulatedOnPtys::start(description, args.seed, speed)?,
    };
    Ok(Emulation::OnPtys(Box::new(emulated)))
}

fn load(demo: &Demo, args: &DemoArgs) -> Result<Loaded, Failure> {
    if let Some(speed) = args.speed
        && !(speed.is_finite() && speed > 0.0)
    {
        return Err(Failure::Usage {
            what: format!("a speed of {speed}"),
            help: "give a positive number; 1 is real time".into(),
        });
    }
    let [path, text, _] = demo.files;
    let mut loaded = config::parse(text, path)?;
    if let Some(folder) = &args.data_dir {
        loaded.config.machine.data_dir.clone_from(folder);
    }
    Ok(loaded)
}

fn announce(args: &DemoArgs, loaded: &Loaded, emulated: &Emulation, output: Output) {
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
