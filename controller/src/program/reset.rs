//! `truestage reset`: faults of drives are acknowledged.

use serde_json::{Value, json};
use wire::cia402::PowerState;

use crate::Failure;
use crate::connected::Machine;
use crate::ports::Use;
use crate::program::AxisArgs;
use crate::program::json as to_json;
use crate::program::output::{Ended, Output};
use crate::program::session::{Session, choose_axis};

/// An axis before and after its reset.
pub(crate) struct AxisReset {
    pub(crate) axis: String,
    pub(crate) before: String,
    pub(crate) after: String,
}

/// The axes that are meant: the one that is named, or the only one; `None` where each that needs it is.
pub(crate) fn meant(names: Vec<String>, args: &AxisArgs) -> Result<Option<String>, Failure> {
    match (&args.axis, names.as_slice()) {
        (None, [_, _, ..]) => Ok(None),
        _ => choose_axis(names, args).map(Some),
    }
}

/// What is told of resets; of one axis that is `meant`, of it alone.
pub(crate) fn told(meant: Option<&str>, resets: &[AxisReset], zero: &str) -> (String, Value) {
    let lines = resets.iter().map(
        |AxisReset {
             axis,
             before,
             after,
         }| { format!("axis {axis}: was in {before}, is now in {after}; {zero}") },
    );
    let text = match resets {
        [] => "no axis has a fault; nothing was acknowledged".to_owned(),
        _ => lines.collect::<Vec<_>>().join("\n"),
    };
    let values = resets.iter().map(
        |AxisReset {
             axis,
             before,
             after,
         }| { json!({"axis": axis, "before": before, "after": after}) },
    );
    let mut values: Vec<Value> = values.collect();
    let value = match meant {
        Some(_) => values.pop().unwrap_or_default(),
        None => json!({"resets": values}),
    };
    (text, value)
}

/// Acknowledges the fault of the axis that is named, or of each axis that has one; nothing moves.
pub(crate) fn run(args: &AxisArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.machine, "reset", Use::Motion, output)?;
    let mut names = session.machine.devices().axis_names();
    names.extend(session.machine.devices().rotary_names());
    let meant = meant(names.clone(), args)?;
    let (resets, counters) = session.machine.guarded(|machine| {
        // Whatever is marked in its file: nothing moves, and it has nothing to forget.
        machine.core.start()?;
        let mut resets = Vec::new();
        for axis in names {
            resets.extend(reset(machine, axis, meant.as_deref())?);
        }
        machine.shut_down()?;
        Ok((resets, to_json::counters(&machine.devices().counters())))
    })?;
    let (text, mut value) = told(meant.as_deref(), &resets, "zero it before it moves");
    value["counters"] = counters;
    output.result(&text, &value)
}

/// Resets `axis` where it is the one that is meant or, where none is, has a fault.
fn reset(
    machine: &mut Machine,
    axis: String,
    meant: Option<&str>,
) -> Result<Option<AxisReset>, Failure> {
    let word =
        |state: Option<PowerState>| state.map_or("unknown".into(), |state| state.to_string());
    let before = machine.power_state(&axis)?;
    let is_wanted = meant.map_or(before == Some(PowerState::Fault), |meant| meant == axis);
    if !is_wanted {
        return Ok(None);
    }
    machine.reset_fault(&axis)?;
    let after = machine.power_state(&axis)?;
    Ok(Some(AxisReset {
        axis,
        before: word(before),
        after: word(after),
    }))
}
