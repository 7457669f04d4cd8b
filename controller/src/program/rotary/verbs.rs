//! The verbs of the cycle on rotary axes (system S2).

use serde_json::{Value, json};

use crate::jogging::{Jogged, round};
use crate::ports::Use;
use crate::program::jogs::Jog;
use crate::program::json as to_json;
use crate::program::operator::Terminal;
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::rotary::readings::{self, ReadBy};
use crate::program::rotary::targets::{named_way, targets, turns_left_out};
use crate::program::rotary::told::{self, verified, zeroed};
use crate::program::session::{Session, choose_axis};
use crate::program::tried::{Made, tried};
use crate::program::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs};
use crate::{Agreed, Failure, Machine};
use machine::records::Store;

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let run = |_: &mut Machine, _: &str, _: &Store| Ok(());
    let (axis, (), counters) = with_zeroed_table(args, "zero", Use::Motion, output, run)?;
    output.told(zeroed(&axis), counters)
}

/// Starts the machine, zeroes the axis, runs `procedure`, switches off.
fn with_zeroed_table<R>(
    args: &AxisArgs,
    verb: &str,
    purpose: Use,
    output: Output,
    procedure: impl FnOnce(&mut Machine, &str, &Store) -> Result<R, Failure>,
) -> Result<(String, R, Value), Failure> {
    let mut session = Session::open(&args.machine, verb, purpose, output)?;
    let axis = choose_axis(session.machine.devices().rotary_names(), args)?;
    let store = session.store.clone();
    let (result, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        machine.rotary(&axis)?.zero()?;
        let result = procedure(machine, &axis, &store)?;
        machine.shut_down()?;
        Ok((result, to_json::counters(&machine.devices().counters())))
    })?;
    Ok((axis, result, counters))
}

/// Who brings the plate about, and who reads it.
enum Reader {
    /// A detector reads what this person places.
    Detector(Terminal),
    /// This person does both.
    Person(Terminal),
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let mut operator = match ReadBy::of(&args.axis, &args.readings)? {
        ReadBy::Detector => Reader::Detector(Terminal::new(
            args.ask.yes,
            args.axis.machine.hand(),
            output,
        )?),
        ReadBy::Driven => Reader::Person(readings::person(args.ask.yes, &args.axis, output, true)?),
        ReadBy::Alone => return readings::calibrate(args, output),
    };
    let mut made = None;
    let run = |machine: &mut Machine, axis: &str, store: &Store| {
        let resume = journal_to_resume(args.resume.as_ref(), store, "calibrate", axis)?;
        let options = args.options(resume.clone());
        let calibrated = resumable(store, "calibrate", axis, resume.as_deref(), || {
            let mut table = machine.rotary(axis)?;
            match &mut operator {
                Reader::Detector(operator) => table.calibrate(store, &options, operator),
                Reader::Person(person) => table.calibrate_sighted(store, &options, person),
            }
        })?;
        made = Some(Made {
            told: told::calibrated(axis, &calibrated),
            store: store.clone(),
            group: axis.to_owned(),
            stored: vec![(axis.to_owned(), calibrated.id.clone())],
        });
        if !args.verify {
            return Ok(None);
        }
        let mut table = machine.rotary(axis)?;
        let verified = match &mut operator {
            Reader::Detector(operator) => table.verify(store, true, operator),
            Reader::Person(person) => table.verify_sighted(store, (true, None), person),
        }?;
        let bad = verified.out_of_tolerance(axis);
        Ok(Some((told::told_verified(axis, &verified), bad)))
    };
    let ended = with_zeroed_table(&args.axis, "calibrate", Use::Measurement, output, run);
    let ended = ended.map(|(_, verified, counters)| (verified, counters));
    tried(made, ended, args, output)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let read_by = ReadBy::of(&args.axis, &args.readings)?;
    let mut operator = match read_by {
        ReadBy::Detector if args.resume.is_some() => {
            return Err(Failure::Usage {
                what: "a rotary axis's verification cannot be resumed where a detector reads the plate"
                    .into(),
                help: "it is one placement: start it again".into(),
            });
        }
        ReadBy::Detector => Reader::Detector(Terminal::new(
            args.ask.yes,
            args.axis.machine.hand(),
            output,
        )?),
        ReadBy::Driven => Reader::Person(readings::person(args.ask.yes, &args.axis, output, true)?),
        ReadBy::Alone => return readings::verify(args, output),
    };
    let compensated = !args.uncompensated;
    let run = |machine: &mut Machine, axis: &str, store: &Store| {
        // Uncompensated, too: it knows the plate's errors.
        machine.rotary(axis)?.load_active(store)?;
        let mut table = machine.rotary(axis)?;
        match &mut operator {
            Reader::Detector(operator) => table.verify(store, compensated, operator),
            Reader::Person(person) => {
                let resume = journal_to_resume(args.resume.as_ref(), store, "verify", axis)?;
                resumable(store, "verify", axis, resume.as_deref(), || {
                    table.verify_sighted(store, (compensated, resume.as_ref()), person)
                })
            }
        }
    };
    let (axis, it, counters) =
        with_zeroed_table(&args.axis, "verify", Use::Measurement, output, run)?;
    verified(&axis, &it, counters, output)
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    let (targets, way) = (targets(args)?, named_way(args));
    let mut session = Session::open(&args.machine, "move", Use::Motion, output)?;
    let store = session.store.clone();
    let agreed = args.agreed.agreed();
    let moved = session.machine.guarded(|machine| {
        machine.start()?;
        let mut calibrations = Vec::new();
        for (axis, _) in &targets {
            calibrations.push(calibration_of(machine, axis, agreed, &store)?);
        }
        let mut moved = Vec::new();
        for ((axis, angle), calibration) in targets.iter().zip(calibrations) {
            machine.rotary(axis)?.zero()?;
            let turned = machine.rotary(axis)?.move_to(*angle, way)?;
            moved.push((axis, turned, calibration, turns_left_out(*angle, way)));
        }
        machine.shut_down()?;
        Ok(moved)
    })?;
    let lines: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration, note)| {
            let note = note
                .as_ref()
                .map_or(String::new(), |it| format!("\naxis {axis}: {it}"));
            told::moved(axis, moved, calibration.as_deref()).text + &note
        })
        .collect();
    let values: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration, _)| told::moved(axis, moved, calibration.as_deref()).value)
        .collect();
    output.result(&lines.join("\n"), &json!({"moves": values}))
}

/// Takes the calibration of `axis` into use, unless it shall go without. Without one it does not turn to a place
/// unless somebody has agreed to that.
fn calibration_of(
    machine: &mut Machine,
    axis: &str,
    agreed: Agreed,
    store: &Store,
) -> Result<Option<String>, Failure> {
    if agreed.uncompensated {
        return Ok(None);
    }
    let id = machine.rotary(axis)?.load_active(store)?;
    machine.rotary(axis)?.course().require(axis, agreed)?;
    Ok(id)
}

pub(crate) fn check_jog(machine: &mut Machine, jog: &Jog) -> Result<(), Failure> {
    let speed = round(&jog.axis, jog.speed)?;
    machine.rotary(&jog.axis)?.check_jog(speed)
}

pub(crate) fn jog(machine: &mut Machine, _: &Store, jog: &Jog) -> Result<Jogged, Failure> {
    let speed = round(&jog.axis, jog.speed)?;
    machine.start()?;
    machine.rotary(&jog.axis)?.zero()?;
    machine.rotary(&jog.axis)?.jog(speed, jog.duration)
}
