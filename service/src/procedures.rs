//! What runs do with a linear axis, and what they found.

use machine::records::Store;
use serde_json::{Value, json};
use truestage::linear::{Teller, Told, VerifyOptions};
use truestage::{CalibrateOptions, Failure, Machine};

use crate::keeper::RunTask;
use crate::request::RunKind;
use crate::view::ToldView;

/// Figures, and what the command line says of them.
pub(crate) type Found = (Value, Option<ToldView>);

pub(crate) fn perform(
    machine: &mut Machine,
    store: &Store,
    axis: &str,
    task: &RunTask,
    teller: Option<Teller>,
) -> Result<Found, Failure> {
    let (found, told) = match task.request.kind {
        RunKind::Zero => zero(machine, store, axis, teller),
        RunKind::Calibrate => calibrate(machine, store, axis, task, teller),
        RunKind::Verify => verify(machine, store, axis, task, teller),
    }?;
    let told = told.zip(teller).map(|(mut told, teller)| {
        told.value["counters"] = (teller.counters)(machine);
        ToldView::from(told)
    });
    Ok((found, told))
}

type Outcome = Result<(Value, Option<Told>), Failure>;

fn zero(machine: &mut Machine, store: &Store, axis: &str, teller: Option<Teller>) -> Outcome {
    let zeroed = machine.linear(axis)?.zero(store)?;
    let estimate = &zeroed.estimate;
    let found = json!({
        "origin_um": estimate.origin.um(),
        "standard_uncertainty_um": estimate.standard_uncertainty.um(),
        "points": estimate.points,
        "journal": zeroed.journal,
    });
    Ok((found, teller.map(|it| (it.zeroed)(axis, &zeroed))))
}

fn calibrate(
    machine: &mut Machine,
    store: &Store,
    axis: &str,
    task: &RunTask,
    teller: Option<Teller>,
) -> Outcome {
    let options = CalibrateOptions {
        resume: task.resume.clone(),
        accept_drift: task.request.accept_drift,
        ..CalibrateOptions::default()
    };
    let made = machine.linear(axis)?.calibrate(store, &options)?;
    let found = json!({
        "calibration": made.id,
        "largest_deviation_um": made.fitted.table.largest().um(),
        "positions": made.fitted.table.nodes().len(),
        "closure_um": made.measured.closure.map(|it| it.um()),
        "journal": made.journal,
    });
    Ok((found, teller.map(|it| (it.calibrated)(&made))))
}

fn verify(
    machine: &mut Machine,
    store: &Store,
    axis: &str,
    task: &RunTask,
    teller: Option<Teller>,
) -> Outcome {
    let compensated = !task.request.uncompensated;
    let calibration = match compensated {
        true => machine.linear(axis)?.load_active(store)?,
        false => None,
    };
    let options = VerifyOptions {
        compensated,
        calibration,
        resume: task.resume.clone(),
    };
    let verified = machine.linear(axis)?.verify(store, &options)?;
    let found = json!({
        "accuracy_um": verified.figures.accuracy.bidirectional.um(),
        "tolerance_um": verified.tolerance.um(),
        "within_tolerance": verified.is_within_tolerance(),
        "journal": verified.journal,
    });
    let told = teller.map(|it| (it.verified)(axis, &verified, compensated));
    Ok((found, told))
}
