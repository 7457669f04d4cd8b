//! `truestage demo`: the whole cycle on an emulated machine, over real protocols.
//!
//! The emulated devices run in a thread of their own behind pseudo-terminals: CAN as SLCAN,
//! the interferometer as a serial line. The controller side is the one of every other verb.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use compensator::iso230::Figures;
use serde_json::{Value, json};
use truestage::config::{self, Loaded};
use truestage::cycle::{CalibrateOptions, Calibrated, Verified, VerifyOptions, Zeroed};
use truestage::emulated::{DriftLimits, EmulatedOnPtys, HallDrift};
use truestage::report::{self, Page, Section};
use truestage::store::{Lease, ZeroEntry, read_journal};
use truestage::{Failure, Machine, Store, json as to_json, ports, text};
use units::{Metres, Volts};

use super::output::{Ended, Output};
use super::progress::Bars;
use super::session::stop_on_signals;

const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
const LINEAR_EMULATED: &str = include_str!("../../../configs/emulated/linear.toml");
const AXIS: &str = "x";
/// What aged, warmed and disturbed Hall sensors may do between two power-ups.
const DRIFT: DriftLimits = DriftLimits {
    offset: Volts(0.1),
    gain: 0.03,
    gain_per_m: 0.0,
};
/// How long the mains stays off, and what the drives take to boot, in machine time.
const POWER_OFF: Duration = Duration::from_millis(800);

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Which machine.
    #[arg(long, default_value = "linear")]
    machine: String,
    /// The emulated stage's errors, noise and drift; the same seed is the same stage.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How much faster than real time the emulated machine lives.
    #[arg(long, default_value_t = 10.0)]
    speed: f64,
    /// How often the power is cycled.
    #[arg(long, default_value_t = 3)]
    power_cycles: u64,
    /// Where calibrations, runs and the report go; the configuration's folder if not given.
    #[arg(long)]
    data_dir: Option<PathBuf>,
}

/// One zero after a power cycle, and where two methods put it.
struct Rezero {
    zeroed: Zeroed,
    /// By the interferometer, against the first zero.
    shift: Metres,
    /// Where a single fixed threshold would have put it, against the same.
    single_threshold_shift: Option<Metres>,
}

/// Everything the demonstration found.
struct Story {
    first_zero: Zeroed,
    found: Verified,
    calibrated: Calibrated,
    left: Verified,
    rezeros: Vec<Rezero>,
    after: Verified,
}

pub(super) fn run(args: &DemoArgs, output: Output) -> Ended {
    let started = Instant::now();
    let loaded = load(args)?;
    let section = &loaded.config.machine;
    let store = Store::new(&section.data_dir, &section.name);
    let _lease = Lease::take(&store, "demo")?;
    let emulated = EmulatedOnPtys::start(LINEAR_EMULATED, args.seed, args.speed)?;
    let transport = ports::open(
        &loaded.config,
        &emulated.overrides(&loaded.config)?,
        ports::Use::Measurement,
        args.speed,
    )?;
    let mut machine = Machine::new(&loaded, Box::new(transport));
    machine.observe(Box::new(Bars::new(
        output.is_json() || !std::io::stderr().is_terminal(),
    )));
    stop_on_signals(&machine.stop_request())?;
    announce(args, &loaded, &emulated, output);
    let story = machine.guarded(|machine| tell(machine, &store, &emulated, args, output))?;
    let report = write_report(&store, &story)?;
    let text = summary(&story, &report, started.elapsed(), args.speed);
    let value = to_value(&story, &report, started.elapsed());
    match out_of_tolerance(&story) {
        None => output.result(&text, &value),
        Some(failure) => output.bad_result(&text, value, failure),
    }
}

fn load(args: &DemoArgs) -> Result<Loaded, Failure> {
    if args.machine != "linear" {
        return Err(Failure::Usage {
            what: format!("there is no emulated machine `{}`", args.machine),
            help: "known: linear".into(),
        });
    }
    if !(args.speed.is_finite() && args.speed > 0.0) {
        return Err(Failure::Usage {
            what: format!("a speed of {}", args.speed),
            help: "give a positive number; 1 is real time".into(),
        });
    }
    let mut loaded = config::parse(LINEAR, "configs/machines/linear.toml")?;
    loaded.patience = ports::patience(args.speed);
    if let Some(folder) = &args.data_dir {
        loaded.config.machine.data_dir.clone_from(folder);
    }
    Ok(loaded)
}

fn announce(args: &DemoArgs, loaded: &Loaded, emulated: &EmulatedOnPtys, output: Output) {
    let machine = &loaded.config.machine;
    output.note(&format!(
        "truestage demo: emulated machine `{}` (stage {}), seed {}, {}× real time",
        machine.name, machine.stage_serial, args.seed, args.speed
    ));
    for line in emulated.description() {
        output.note(&format!("  {line}"));
    }
}

fn tell(
    machine: &mut Machine,
    store: &Store,
    emulated: &EmulatedOnPtys,
    args: &DemoArgs,
    output: Output,
) -> Result<Story, Failure> {
    output.note("1 start: identities, set-up, supervision");
    machine.start()?;
    output.note("2 zero: drift-free origin from two Hall sensors");
    let first_zero = machine.zero(AXIS, store)?;
    output.note("3 as found: ISO 230-2 without compensation");
    let found = machine.verify(AXIS, store, &options(false, None))?;
    output.note("4 calibrate: error table by interferometer");
    let calibrated = machine.calibrate(AXIS, store, &CalibrateOptions::default())?;
    output.note("5 as left: ISO 230-2, compensated, between the calibrated positions");
    let compensated = options(true, Some(calibrated.id.clone()));
    let left = machine.verify(AXIS, store, &compensated)?;
    output.note("6 power off and on, Hall sensors drifted by up to ±100 mV and ±3 %; zero again");
    let mut rezeros = Vec::new();
    for number in 1..=args.power_cycles {
        let drift = HallDrift::random(args.seed, number, DRIFT);
        rezeros.push(rezero(machine, store, emulated, drift, &first_zero)?);
    }
    output.note("7 as left, after the power cycles");
    let after = machine.verify(AXIS, store, &compensated)?;
    machine.shut_down()?;
    Ok(Story {
        first_zero,
        found,
        calibrated,
        left,
        rezeros,
        after,
    })
}

const fn options(compensated: bool, calibration: Option<String>) -> VerifyOptions {
    VerifyOptions {
        compensated,
        calibration,
        resume: None,
    }
}

fn rezero(
    machine: &mut Machine,
    store: &Store,
    emulated: &EmulatedOnPtys,
    drift: HallDrift,
    first: &Zeroed,
) -> Result<Rezero, Failure> {
    machine.shut_down()?;
    emulated.power_cycle(drift)?;
    let back = machine.now() + POWER_OFF;
    machine.run_until(back)?;
    machine.start()?;
    let zeroed = machine.zero(AXIS, store)?;
    let shift = machine.displacement_at_zero(AXIS)?;
    let threshold = zeroed.single_threshold(first.estimate.mid_voltage);
    let single_threshold_shift = threshold.map(|at| at - zeroed.estimate.origin + shift);
    Ok(Rezero {
        zeroed,
        shift,
        single_threshold_shift,
    })
}

fn out_of_tolerance(story: &Story) -> Option<Failure> {
    let verified = [&story.left, &story.after];
    let bad = verified.into_iter().find(|it| !it.is_within_tolerance())?;
    Some(Failure::OutOfTolerance {
        axis: AXIS.into(),
        seen: bad.figures.accuracy.bidirectional,
        limit: bad.tolerance,
    })
}

fn columns(story: &Story) -> [(&'static str, &Figures); 3] {
    [
        ("as found", &story.found.figures),
        ("as left", &story.left.figures),
        ("after power cycles", &story.after.figures),
    ]
}

fn summary(story: &Story, report: &std::path::Path, wall: Duration, speed: f64) -> String {
    let largest = |figures| text::largest_deviation(figures).um();
    let mut lines = vec![
        String::new(),
        text::figures_table(&columns(story)),
        format!(
            "{:<34} {:>22.3} {:>22.3} {:>22.3}",
            "  largest mean deviation",
            largest(&story.found.figures),
            largest(&story.left.figures),
            largest(&story.after.figures)
        ),
        String::new(),
        format!(
            "zero: standard uncertainty {:.0} nm at first",
            story.first_zero.estimate.standard_uncertainty.nm()
        ),
    ];
    for (at, rezero) in story.rezeros.iter().enumerate() {
        let single = rezero
            .single_threshold_shift
            .map_or("beyond the search".to_owned(), |shift| {
                format!("{:+.1} µm", shift.um())
            });
        lines.push(format!(
            "  power cycle {}: moved by {:+.0} nm (u = {:.0} nm); a single threshold: {single}",
            at + 1,
            rezero.shift.nm(),
            rezero.zeroed.estimate.standard_uncertainty.nm(),
        ));
    }
    lines.extend([
        String::new(),
        format!("calibration  {} (active)", story.calibrated.path.display()),
        format!("report       {}", report.display()),
        format!(
            "took {:.1} s; the emulated machine lived {speed}× faster",
            wall.as_secs_f64()
        ),
    ]);
    lines.join("\n")
}

fn to_value(story: &Story, report: &std::path::Path, wall: Duration) -> Value {
    let rezeros: Vec<_> = story
        .rezeros
        .iter()
        .map(|it| {
            json!({
                "shift_nm": it.shift.nm(),
                "standard_uncertainty_nm": it.zeroed.estimate.standard_uncertainty.nm(),
                "single_threshold_shift_um": it.single_threshold_shift.map(to_json::um),
            })
        })
        .collect();
    json!({
        "as_found": to_json::figures(&story.found.figures),
        "as_left": to_json::figures(&story.left.figures),
        "as_left_after_power_cycles": to_json::figures(&story.after.figures),
        "as_found_largest_deviation_um": to_json::um(text::largest_deviation(&story.found.figures)),
        "zero": to_json::zero(&story.first_zero.estimate),
        "power_cycles": rezeros,
        "calibration": {"id": story.calibrated.id, "path": story.calibrated.path},
        "report": report,
        "wall_s": wall.as_secs_f64(),
    })
}

fn write_report(store: &Store, story: &Story) -> Result<PathBuf, Failure> {
    let journal = read_journal(&story.left.journal)?;
    let verified = [
        ("as found", &story.found),
        ("as left", &story.left),
        ("after power cycles", &story.after),
    ];
    let sections = verified
        .into_iter()
        .map(|(title, verified)| Section {
            title: title.to_owned(),
            figures: &verified.figures,
            points: &verified.measured.points,
        })
        .collect();
    let zeros = story
        .rezeros
        .iter()
        .filter_map(|it| read_journal(&it.zeroed.journal).ok())
        .flat_map(|journal| journal.zeros)
        .collect::<Vec<ZeroEntry>>();
    let page = Page {
        title: format!("truestage: axis {AXIS} of {}", journal.header.machine),
        facts: report::facts_of(&journal),
        sections,
        calibration: Some(&story.calibrated.record),
        zeros,
    };
    let stamp = journal.header.started.replace([':', '-'], "");
    let path = store.reports().join(format!("{stamp}-demo.html"));
    store.write_report(&path, &report::render(&page))?;
    Ok(path)
}
