//! The verbs of the cycle on a real (or separately emulated) machine.

use std::path::PathBuf;

use machine::records::Store;
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::linear::{Calibrated, Verified, VerifyOptions};
use crate::ports::Use;
use crate::program::linear::{moved, uncertainty};
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::session::{Session, choose_axis};
use crate::program::targets::axis_target;
use crate::program::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs};
use crate::program::{json as to_json, text};
use crate::run::CalibrateOptions;
use crate::{Failure, Machine};

/// What is settled before anything moves.
struct Prepared {
    calibration: Option<String>,
    resume: Option<PathBuf>,
}

/// Starts the machine, zeroes `axis`, loads its calibration, runs `procedure`, switches off.
/// What the devices counted on the way comes with the result.
fn with_zeroed_axis<R>(
    args: &AxisArgs,
    verb: &str,
    output: Output,
    load_calibration: bool,
    resume: Option<&PathBuf>,
    procedure: impl FnOnce(&mut Machine, &str, &Store, Prepared) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    let mut session = Session::open(&args.machine, verb, Use::Measurement, output)?;
    let axis = choose_axis(session.machine.devices().axis_names(), args)?;
    let store = session.store.clone();
    let resume = journal_to_resume(resume, &store, verb, &axis)?;
    if load_calibration && store.active(&axis)?.current.is_none() {
        return Err(Failure::Usage {
            what: format!("axis {axis} has no active calibration"),
            help: "run `truestage calibrate`, or verify with --uncompensated".into(),
        });
    }
    session.machine.guarded(|machine| {
        machine.start()?;
        let calibration = if load_calibration {
            machine.linear(&axis)?.load_active(&store)?
        } else {
            None
        };
        machine.linear(&axis)?.zero(&store)?;
        let prepared = Prepared {
            calibration,
            resume,
        };
        let resumed = prepared.resume.clone();
        let result = resumable(&store, verb, &axis, resumed.as_deref(), || {
            procedure(machine, &axis, &store, prepared)
        })?;
        machine.shut_down()?;
        Ok((result, to_json::counters(&machine.devices().counters())))
    })
}

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.machine, "zero", Use::Motion, output)?;
    let axis = choose_axis(session.machine.devices().axis_names(), args)?;
    let store = session.store.clone();
    let (zeroed, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let zeroed = machine.linear(&axis)?.zero(&store)?;
        machine.shut_down()?;
        Ok((zeroed, to_json::counters(&machine.devices().counters())))
    })?;
    let estimate = &zeroed.estimate;
    let lost_motion = estimate.passes.map_or(String::new(), |it| {
        format!(
            "\nlost motion {:.3} µm between forward and reverse",
            it.lost_motion.um()
        )
    });
    let text = format!(
        "axis {axis}: zero found, standard uncertainty {:.1} nm ({} samples); the coarse \
         reference was off by {:.3} µm{lost_motion}\nrecorded in {}",
        estimate.standard_uncertainty.nm(),
        estimate.points,
        estimate.origin.um(),
        zeroed.journal.display()
    );
    let drift = zeroed.previous.map(|before| {
        let now = zeroed.entry;
        (
            (now.peak_max_v - before.peak_max_v) * 1e3,
            (now.mid_v - before.mid_v) * 1e3,
        )
    });
    let since = drift.map_or(String::new(), |(peak, mid)| {
        format!("\nsince the zero before: peak sensor {peak:+.1} mV, slope sensor {mid:+.1} mV")
    });
    let value = json!({
        "axis": axis,
        "zero": to_json::zero(estimate),
        "drift_since_last": drift.map(|(peak, mid)| json!({"peak_mv": peak, "slope_mv": mid})),
        "journal": zeroed.journal,
        "counters": counters,
    });
    output.result(&(text + &since), &value)
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let (calibrated, counters) = with_zeroed_axis(
        &args.axis,
        "calibrate",
        output,
        false,
        args.resume.as_ref(),
        |machine, axis, store, prepared| {
            let options = CalibrateOptions {
                resume: prepared.resume,
                accept_drift: args.accept_drift,
            };
            machine.linear(axis)?.calibrate(store, &options)
        },
    )?;
    let mut value = calibrated_value(&calibrated);
    value["counters"] = counters;
    output.result(&calibrated_text(&calibrated), &value)
}

pub(crate) fn calibrated_text(calibrated: &Calibrated) -> String {
    let fitted = &calibrated.fitted;
    let mut text = format!(
        "calibration {} stored and activated\n  {} positions, largest deviation {:.3} µm, {}\n  {}\n  \
         points in {}",
        &calibrated.id[..12],
        fitted.table.nodes().len(),
        fitted.table.largest().um(),
        text::closure(calibrated.measured.closure),
        calibrated.path.display(),
        calibrated.journal.display()
    );
    text += &format!("\n  {}", text::noticed(calibrated.noticed));
    let content = &calibrated.record.content;
    text += &format!("\n  {}", uncertainty::sentence(content));
    for point in &fitted.robust.outliers {
        text += &format!(
            "\n  left out: run {}, approach {}, {} mm, off by {:.2} µm",
            point.run,
            point.approach.symbol(),
            Short(point.target.mm()),
            point.residual.um()
        );
    }
    text
}

pub(crate) fn calibrated_value(calibrated: &Calibrated) -> Value {
    let mut fit = to_json::fitted(&calibrated.fitted);
    // Closure means what the datum's place shows; from run to run the whole table moves.
    fit["drift_um"] = json!(calibrated.fitted.drift.closure.map(to_json::um));
    fit["drift_um_u"] = json!(calibrated.fitted.drift.u_closure.map(to_json::um));
    let budget = calibrated.record.content.budget.as_ref();
    json!({
        "calibration": calibrated.id,
        "path": calibrated.path,
        "journal": calibrated.journal,
        "closure_um": calibrated.measured.closure.map(to_json::um),
        "fit": fit,
        "wrong_position_noticed_um": calibrated.noticed.map(to_json::um),
        "uncertainty": budget.map(uncertainty::value),
    })
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let compensated = !args.uncompensated;
    let name = if compensated { "as_left" } else { "as_found" };
    let run = |machine: &mut Machine, axis: &str, store: &Store, prepared: Prepared| {
        let verified = machine.linear(axis)?.verify(
            store,
            &VerifyOptions {
                compensated,
                calibration: prepared.calibration,
                resume: prepared.resume,
            },
        )?;
        Ok((axis.to_owned(), verified))
    };
    let ((axis, verified), counters) = with_zeroed_axis(
        &args.axis,
        "verify",
        output,
        compensated,
        args.resume.as_ref(),
        run,
    )?;
    let text = verified_text(name, &verified);
    let within = verified.is_within_tolerance();
    let mut value = verified_value(name, &verified);
    value["axis"] = json!(axis);
    value["counters"] = counters;
    if compensated && !within {
        let seen = verified.figures.accuracy.bidirectional;
        let limit = verified.tolerance;
        return output.bad_result(&text, value, Failure::OutOfTolerance { axis, seen, limit });
    }
    output.result(&text, &value)
}

/// `name` is `as_found` or `as_left`.
pub(crate) fn verified_text(name: &str, verified: &Verified) -> String {
    let title = name.replace('_', " ");
    let mut text = text::figures_table(&[(&title, &verified.figures)]);
    let uncertain = uncertainty::of_targets(&verified.uncertainty);
    text += &uncertain.map_or(String::new(), |it| format!("\n{it}"));
    text += &format!(
        "\ndatum after the runs: {}",
        text::closure(verified.measured.closure)
    );
    text + &format!("\npoints in {}", verified.journal.display())
}

pub(crate) fn verified_value(name: &str, verified: &Verified) -> Value {
    json!({
        name: to_json::figures(&verified.figures),
        "closure_um": verified.measured.closure.map(to_json::um),
        "tolerance_um": to_json::um(verified.tolerance),
        "within_tolerance": verified.is_within_tolerance(),
        "uncertainty": uncertainty::targets(&verified.uncertainty),
        "journal": verified.journal,
    })
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    args.without_way()?;
    if args.align {
        return Err(Failure::Usage {
            what: "--align is for platforms, which a camera sees".into(),
            help: "leave it out".into(),
        });
    }
    if args.targets.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write AXIS=LENGTH with a unit: x=12.5mm".into(),
        });
    }
    let targets = args
        .targets
        .iter()
        .map(|text| axis_target(text))
        .collect::<Result<Vec<_>, _>>()?;
    let mut session = Session::open(&args.machine, "move", Use::Motion, output)?;
    for (axis, target) in &targets {
        let (min, max) = {
            let config = session.machine.linear(axis)?.config();
            (
                Metres::from_mm(config.motion.soft_min_mm),
                Metres::from_mm(config.motion.soft_max_mm),
            )
        };
        if !(*target >= min && *target <= max) {
            return Err(Failure::Machine(machine::Failure::SoftLimit {
                axis: axis.clone(),
                target: *target,
                min,
                max,
            }));
        }
    }
    let store = session.store.clone();
    let moved = session.machine.guarded(|machine| {
        machine.start()?;
        let mut moved = Vec::new();
        for (axis, target) in &targets {
            let calibration = machine.linear(axis)?.load_active(&store)?;
            machine.linear(axis)?.zero(&store)?;
            let one = machine.linear(axis)?.move_and_read(*target)?;
            moved.push((axis, one, calibration));
        }
        machine.shut_down()?;
        Ok(moved)
    })?;
    let lines: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration)| moved::text(axis, moved, calibration.as_deref()))
        .collect();
    let value: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration)| moved::value(axis, moved, calibration.as_deref()))
        .collect();
    output.result(&lines.join("\n"), &json!({"moves": value}))
}
