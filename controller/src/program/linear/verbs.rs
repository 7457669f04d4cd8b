//! The verbs of the cycle on a real (or separately emulated) machine.

use std::path::PathBuf;

use machine::records::Store;
use serde_json::{Value, json};
use units::{Approach, Metres};

use crate::linear::settings::require_within;
use crate::linear::{Verified, VerifyOptions};
use crate::ports::Use;
use crate::program::json as to_json;
use crate::program::linear::{gantry, moved, told};
use crate::program::output::{Ended, Output, with_counters};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::session::{Session, choose_axis};
use crate::program::targets::axis_targets;
use crate::program::tried::{Made, tried};
use crate::program::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs};
use crate::runs::Told;
use crate::{Agreed, Failure, Machine};

/// An axis of a machine that is connected, before anything moves.
struct Opened {
    session: Session,
    axis: String,
    store: Store,
    /// The journal that is continued.
    resume: Option<PathBuf>,
}

impl Opened {
    fn new(
        args: &AxisArgs,
        verb: &str,
        resume: Option<&PathBuf>,
        output: Output,
    ) -> Result<Self, Failure> {
        let session = Session::open(&args.machine, verb, Use::Measurement, output)?;
        let axis = choose_axis(session.machine.devices().axis_names(), args)?;
        let store = session.store.clone();
        let resume = journal_to_resume(resume, &store, verb, &axis)?;
        Ok(Self {
            session,
            axis,
            store,
            resume,
        })
    }
}

/// A verification as left wants a calibration.
pub(super) fn require_active(store: &Store, axis: &str) -> Result<(), Failure> {
    match store.active(axis)?.current {
        Some(_) => Ok(()),
        None => Err(Failure::Usage {
            what: format!("axis {axis} has no active calibration"),
            help: "run `truestage calibrate`, or verify with --uncompensated".into(),
        }),
    }
}

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.machine, "zero", Use::Motion, output)?;
    if let Some(gantry) = gantry::asked_for(session.machine.config(), args.axis.as_deref()) {
        return gantry::zero(session, &gantry, output);
    }
    let axis = choose_axis(session.machine.devices().axis_names(), args)?;
    let store = session.store.clone();
    let (zeroed, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let zeroed = machine.linear(&axis)?.zero(&store)?;
        machine.shut_down()?;
        Ok((zeroed, to_json::counters(&machine.devices().counters())))
    })?;
    output.told(told::zeroed(&axis, &zeroed), counters)
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let mut made = None;
    let Opened {
        mut session,
        axis,
        store,
        resume,
    } = Opened::new(&args.axis, "calibrate", args.resume.as_ref(), output)?;
    let ended = session.machine.guarded(|machine| {
        machine.start()?;
        machine.linear(&axis)?.zero(&store)?;
        let options = args.options(resume.clone());
        let calibrated = resumable(&store, "calibrate", &axis, resume.as_deref(), || {
            machine.linear(&axis)?.calibrate(&store, &options)
        })?;
        made = Some(Made {
            told: told::calibrated(&calibrated),
            store: store.clone(),
            group: axis.clone(),
            stored: vec![(axis.clone(), calibrated.id.clone())],
        });
        let verified = match args.verify {
            true => {
                let options = VerifyOptions {
                    compensated: true,
                    calibration: Some(calibrated.id),
                    resume: None,
                };
                let verified = verified_by(machine, &axis, &store, &options)?;
                let told = told::verified(&axis, &verified, true);
                Some((told, verified.out_of_tolerance(&axis)))
            }
            false => None,
        };
        machine.shut_down()?;
        Ok((verified, to_json::counters(&machine.devices().counters())))
    });
    tried(made, ended, args, output)
}

fn verified_by(
    machine: &mut Machine,
    axis: &str,
    store: &Store,
    options: &VerifyOptions,
) -> Result<Verified, Failure> {
    resumable(store, "verify", axis, options.resume.as_deref(), || {
        machine.linear(axis)?.verify(store, options)
    })
}

/// What was verified as left, and whether it is within the tolerance.
fn judged(axis: &str, verified: &Verified, told: Told, counters: Value, output: Output) -> Ended {
    let Some(failure) = verified.out_of_tolerance(axis) else {
        return output.told(told, counters);
    };
    output.bad_result(&told.text, with_counters(told.value, counters), failure)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let compensated = !args.uncompensated;
    let Opened {
        mut session,
        axis,
        store,
        resume,
    } = Opened::new(&args.axis, "verify", args.resume.as_ref(), output)?;
    if compensated {
        require_active(&store, &axis)?;
    }
    let (verified, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let calibration = match compensated {
            true => machine.linear(&axis)?.load_active(&store)?,
            false => None,
        };
        machine.linear(&axis)?.zero(&store)?;
        let options = VerifyOptions {
            compensated,
            calibration,
            resume,
        };
        let verified = verified_by(machine, &axis, &store, &options)?;
        machine.shut_down()?;
        Ok((verified, to_json::counters(&machine.devices().counters())))
    })?;
    let told = told::verified(&axis, &verified, compensated);
    match compensated {
        true => judged(&axis, &verified, told, counters, output),
        false => output.told(told, counters),
    }
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    let targets = axis_targets(args)?;
    let mut session = Session::open(&args.machine, "move", Use::Motion, output)?;
    let agreed = args.agreed.agreed();
    let approach = args.approach.map(Approach::from);
    for (axis, target) in &targets {
        require_within(session.machine.config(), axis, *target)?;
    }
    let store = session.store.clone();
    let moved = session.machine.guarded(|machine| {
        machine.start()?;
        let mut calibrations = Vec::new();
        for (axis, target) in &targets {
            calibrations.push(corrected(machine, axis, (*target, agreed), &store)?);
        }
        let mut moved = Vec::new();
        for ((axis, target), calibration) in targets.iter().zip(calibrations) {
            machine.linear(axis)?.zero(&store)?;
            let mut stage = machine.linear(axis)?;
            let one = stage.move_and_read_from(*target, approach)?;
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

/// Takes the calibration that corrects `axis` on its way into use, unless it shall go without; what nobody has
/// agreed to is refused while nothing has moved.
fn corrected(
    machine: &mut Machine,
    axis: &str,
    (target, agreed): (Metres, Agreed),
    store: &Store,
) -> Result<Option<String>, Failure> {
    let calibration = match agreed.uncompensated {
        true => None,
        false => machine.linear(axis)?.load_active(store)?,
    };
    machine.linear(axis)?.require_corrected(target, agreed)?;
    Ok(calibration)
}
