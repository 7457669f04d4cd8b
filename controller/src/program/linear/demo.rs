//! The linear stage: zero by Hall sensors, error table by interferometer, power cycles.

use std::path::{Path, PathBuf};
use std::time::Duration;

use compensator::iso230::Figures;
use machine::records::read_journal;
use serde_json::{Value, json};
use units::{Metres, Time, Volts};

use crate::emulated::{DriftLimits, HallDrift};
use crate::linear::{Calibrated, LinearLog, Verified, VerifyOptions, Zeroed};
use crate::program::demo::emulation::Emulation;
use crate::program::demo::stand::{
    Demo, DemoArgs, Show, Shown, Stand, power_cycle, shipped, took, write_page,
};
use crate::program::linear::page::section;
use crate::program::linear::report::{self, Page, Section};
use crate::program::output::Output;
use crate::program::{json as to_json, text};
use crate::run::CalibrateOptions;
use crate::{Failure, Machine};
use machine::records::Store;

const AXIS: &str = "x";
/// What aged, warmed and disturbed Hall sensors may do between two power-ups.
const DRIFT: DriftLimits = DriftLimits {
    offset: Volts(0.1),
    gain: 0.03,
    gain_per_m: 0.0,
};

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

/// What can be shown.
pub(crate) const DEMOS: &[Demo] = &[Demo {
    name: "linear",
    help: "A linear-motor stage with Hall sensors and a laser interferometer",
    files: shipped!("linear"),
    show: Show::OnStand(show),
}];

fn show(stand: &mut Stand, args: &DemoArgs, output: Output) -> Result<Shown, Failure> {
    let Stand {
        machine,
        store,
        emulated,
        started,
    } = stand;
    let story = machine.guarded(|machine| tell(machine, store, emulated, args, output))?;
    let report = write_report(store, &story)?;
    let wall = started.elapsed();
    Ok(Shown {
        text: summary(&story, &report, wall, machine.now()),
        value: to_value(&story, &report, wall),
        bad: out_of_tolerance(&story),
    })
}

fn tell(
    machine: &mut Machine,
    store: &Store,
    emulated: &Emulation,
    args: &DemoArgs,
    output: Output,
) -> Result<Story, Failure> {
    output.note("1 start: identities, set-up, supervision");
    machine.start()?;
    output.note("2 zero: drift-free origin from two Hall sensors");
    let first_zero = machine.linear(AXIS)?.zero(store)?;
    output.note("3 as found: ISO 230-2 without compensation");
    let found = machine.linear(AXIS)?.verify(store, &options(false, None))?;
    output.note("4 calibrate: error table by interferometer");
    let calibrated = machine
        .linear(AXIS)?
        .calibrate(store, &CalibrateOptions::default())?;
    output.note("5 as left: ISO 230-2, compensated, between the calibrated positions");
    let compensated = options(true, Some(calibrated.id.clone()));
    let left = machine.linear(AXIS)?.verify(store, &compensated)?;
    output.note("6 power off and on, Hall sensors drifted by up to ±100 mV and ±3 %; zero again");
    let mut rezeros = Vec::new();
    for number in 1..=args.power_cycles {
        let drift = HallDrift::random(args.seed, number, DRIFT);
        rezeros.push(rezero(machine, store, emulated, drift, &first_zero)?);
    }
    output.note("7 as left, after the power cycles");
    let after = machine.linear(AXIS)?.verify(store, &compensated)?;
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
    emulated: &Emulation,
    drift: HallDrift,
    first: &Zeroed,
) -> Result<Rezero, Failure> {
    power_cycle(machine, emulated, drift)?;
    let zeroed = machine.linear(AXIS)?.zero(store)?;
    let shift = machine.linear(AXIS)?.displacement_at_zero()?;
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

fn summary(story: &Story, report: &std::path::Path, wall: Duration, lived: Time) -> String {
    let largest = |figures: &Figures| figures.largest_deviation().um();
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
        took(wall, lived),
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
        "as_found_largest_deviation_um": to_json::um(story.found.figures.largest_deviation()),
        "zero": to_json::zero(&story.first_zero.estimate),
        "power_cycles": rezeros,
        "calibration": {"id": story.calibrated.id, "path": story.calibrated.path},
        "report": report,
        "wall_s": wall.as_secs_f64(),
    })
}

fn write_report(store: &Store, story: &Story) -> Result<PathBuf, Failure> {
    let read = |path: &Path| read_journal::<LinearLog>(path);
    let verified = [&story.found, &story.left, &story.after];
    let titles = ["as found", "as left", "after power cycles"];
    let journals = verified.map(|it| read(&it.journal));
    let [found, left, after] = journals;
    let journals = [found?, left?, after?];
    let sections = titles.into_iter().zip(verified).zip(&journals);
    let sections = sections.map(|((title, verified), journal)| Section {
        title: title.to_owned(),
        ..section(journal, &verified.figures)
    });
    let rezeros = story.rezeros.iter().map(|it| read(&it.zeroed.journal));
    let rezeros: Vec<_> = rezeros.collect::<Result<_, _>>()?;
    let [_, left, _] = &journals;
    let page = Page {
        title: format!("truestage: axis {AXIS} of {}", left.header.machine),
        facts: report::head(left, Some(&story.left.figures), &[]),
        sections: sections.collect(),
        calibration: Some(&story.calibrated.record.content),
        logs: rezeros.iter().chain([left]).map(|it| &it.log).collect(),
    };
    write_page(store, &left.header, &report::render(&page))
}
