//! `truestage demo`: the whole cycle on an emulated machine, over real protocols.
//!
//! The emulated devices run in a thread of their own behind pseudo-terminals: CAN as SLCAN,
//! everything else as serial lines. The controller side is the one of every other verb. Both
//! share a clock that waits for them, so that every computer shows the same; so does the
//! machine in this process (`--in-process`), sooner.

pub(crate) mod emulation;
pub(crate) mod stand;

use std::io::IsTerminal;
use std::time::Instant;

use machine::records::Lease;

use self::emulation::Emulation;
pub(crate) use self::stand::DemoArgs;
use self::stand::{Stand, Which};
use crate::config::{self, Loaded};
use crate::emulated::{Emulated, EmulatedOnPtys};
use crate::program::output::{Ended, Output};
use crate::program::progress::Bars;
use crate::program::session::stop_on_signals;
use crate::{Failure, Machine, store_of};

pub(crate) fn run(args: &DemoArgs, output: Output) -> Ended {
    if args.machine == Which::Volumetric {
        return super::volumetric::demo::run(args, output);
    }
    let started = Instant::now();
    let mut loaded = load(args)?;
    let store = store_of(&loaded.config.machine);
    let _lease = Lease::take(&store, "demo")?;
    let [_, _, description] = args.machine.files();
    let emulated = emulation(args, description, &loaded)?;
    let (transport, patience) = emulated.connect(&loaded.config)?;
    loaded.patience = patience;
    let mut machine = Machine::new(&loaded, transport);
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
        Which::Linear => super::linear::demo::show(&mut stand, args, output),
        Which::Uvw | Which::UvwCopley => super::platform::demo::show(&mut stand, args, output),
        Which::Rotary => super::rotary::demo::show(&mut stand, output),
        Which::Volumetric => unreachable!("the demonstration ran in virtual time"),
    }?;
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
