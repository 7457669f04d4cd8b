//! The verbs of the cycle on three axes that are corrected throughout their volume (system S4).

use std::path::PathBuf;

use compensator::volumetric::identify::{Identified, scatter_limit};
use compensator::volumetric::{Axis, Point};
use machine::records::short;
use serde_json::{Value, json};
use units::Metres;

use crate::ports::Use;
use crate::program::json as to_json;
use crate::program::operator::Terminal;
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::session::Session;
use crate::program::targets::axis_target;
use crate::program::text::verdict;
use crate::program::tried::{Made, tried};
use crate::program::volumetric::moved::moved;
use crate::program::volumetric::uncertainty;
use crate::program::{AxisArgs, CalibrateArgs, MachineArgs, MoveArgs, VerifyArgs};
use crate::runs::Told;
use crate::store::budget::PlacesBudgetRecord;
use crate::volumetric::UnknownRecord;
use crate::volumetric::motion::{NamedPoint, Ready};
use crate::volumetric::verify::VolumetricVerified;
use crate::volumetric::{GEOMETRY, VerifyBy, VolumetricCalibrated, WarmUp};
use crate::{Failure, Machine};
use machine::records::Store;

/// Starts the machine, zeroes it, runs `procedure`, switches off. What `prepare` refuses is refused
/// when the devices have said who they are and before anything moves; what it made ready goes to
/// `procedure`.
pub(crate) fn with_zeroed_volume<P, R>(
    args: &MachineArgs,
    verb: &str,
    purpose: Use,
    output: Output,
    prepare: impl FnOnce(&mut Machine, &Store) -> Result<P, Failure>,
    procedure: impl FnOnce(&mut Machine, &Store, P) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    zeroed_volume(
        Session::open(args, verb, purpose, output)?,
        prepare,
        procedure,
    )
}

/// The same on a machine that is connected.
pub(crate) fn zeroed_volume<P, R>(
    mut session: Session,
    prepare: impl FnOnce(&mut Machine, &Store) -> Result<P, Failure>,
    procedure: impl FnOnce(&mut Machine, &Store, P) -> Result<R, Failure>,
) -> Result<(R, Value), Failure> {
    let store = session.store.clone();
    session.machine.guarded(|machine| {
        machine.start()?;
        let prepared = prepare(machine, &store)?;
        machine.volumetric()?.zero()?;
        let result = procedure(machine, &store, prepared)?;
        machine.shut_down()?;
        Ok((result, to_json::counters(&machine.devices().counters())))
    })
}

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let (machine, ready) = (&args.machine, |_: &mut Machine, _: &Store| Ok(()));
    let run = |_: &mut Machine, _: &Store, ()| Ok(());
    let ((), counters) = with_zeroed_volume(machine, "zero", Use::Motion, output, ready, run)?;
    output.told(zeroed(), counters)
}

pub(super) fn zeroed() -> Told {
    Told {
        text: "x, y and z: zero found on their index pulses".into(),
        value: json!({"axes": ["x", "y", "z"]}),
    }
}

/// How the machine becomes warm.
pub(super) fn warm_up_of(args: &CalibrateArgs) -> Result<WarmUp, Failure> {
    let Some(minutes) = args.warm_up_min else {
        return Ok(WarmUp::None);
    };
    WarmUp::of_minutes(minutes).ok_or_else(|| Failure::Usage {
        what: format!("--warm-up-min is {minutes}"),
        help: "give the minutes for which the axes move to and fro".into(),
    })
}

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let warm_up = warm_up_of(args)?;
    let mut operator = Terminal::new(args.ask.yes, args.axis.machine.hand(), output)?;
    let ready = |_: &mut Machine, store: &Store| {
        journal_to_resume(args.resume.as_ref(), store, "calibrate", GEOMETRY)
    };
    let mut made = None;
    let run = |machine: &mut Machine, store: &Store, resume: Option<PathBuf>| {
        let options = args.options(resume.clone());
        let calibrated = resumable(store, "calibrate", GEOMETRY, resume.as_deref(), || {
            machine
                .volumetric()?
                .calibrate_by(store, warm_up, &options, &mut operator)
        })?;
        made = Some(Made {
            told: Told {
                text: calibrated_text(&calibrated),
                value: calibrated_value(&calibrated),
            },
            store: store.clone(),
            group: GEOMETRY.into(),
            stored: calibrated.stored(),
        });
        if !args.verify {
            return Ok(None);
        }
        let by = VerifyBy::Everything;
        let verified = machine.volumetric()?.verify(store, by, &mut operator)?;
        let told = Told {
            text: verified_text(&verified),
            value: verified_value(&verified),
        };
        Ok(Some((told, verified.out_of_tolerance())))
    };
    let (machine, purpose) = (&args.axis.machine, Use::Measurement);
    let ended = with_zeroed_volume(machine, "calibrate", purpose, output, ready, run);
    tried(made, ended, args, output)
}

pub(crate) fn calibrated_text(made: &VolumetricCalibrated) -> String {
    format!(
        "errors {} and references {} are {}: {}\n  {}{}",
        short(&made.id),
        short(&made.references),
        match made.is_in_use {
            true => "in use",
            false => "stored; what was used before is used still",
        },
        made.agreement.readings_text(),
        made.agreement.tool_text(),
        budget_text(made.budget.as_ref())
            + &warmth_text(&made.found)
            + &unknown_text(&made.unknown),
    )
}

/// What makes the tool uncertain, in a line.
fn budget_text(budget: Option<&PlacesBudgetRecord>) -> String {
    let worst = uncertainty::worst(budget);
    worst.map_or_else(String::new, |it| format!("\n  {}", it.sentence()))
}

/// What warmth does, a line each.
pub(crate) fn warmth_text(found: &Identified) -> String {
    let mut text = String::new();
    for it in &found.expansions {
        let (value, u) = (it.per_kelvin * 1e6, it.u * 1e6);
        text += &format!(
            "\n  scale of {}: {value:.3} ppm/K, u {u:.3} ppm/K",
            it.plan.axis
        );
    }
    for it in &found.bends {
        let (value, u) = (it.bow.um(), it.u.um());
        let plan = it.plan;
        text += &format!(
            "\n  guide of {} bends towards {}: {value:.3} µm/K, u {u:.3} µm/K",
            plan.axis, plan.towards
        );
    }
    text
}

/// What nobody knows after this calibration, and what would tell it.
pub(crate) fn unknown_text(unknown: &UnknownRecord) -> String {
    let mut text = String::new();
    for [axis, towards] in &unknown.bends {
        text += &format!(
            "\n  guide of {axis} bends towards {towards}: not measured, because all lines were \
             read at the same temperature; it is not corrected and not included in any \
             uncertainty: calibrate with --warm-up-min"
        );
    }
    for name in &unknown.without_effect {
        text += &format!(
            "\n  {name}: taken as zero, because no given tool offset shows it: give \
             second_tool_offset_mm"
        );
    }
    text
}

pub(crate) fn calibrated_value(made: &VolumetricCalibrated) -> Value {
    let mut value = found_value(&made.found);
    value["geometry"] = json!(made.id);
    value["references"] = json!(made.references);
    value["lines"] = json!(made.lines);
    value["in_use"] = json!(made.is_in_use);
    value["journal"] = json!(made.journal);
    value["u_tool_max_um"] = json!(made.u_max.um());
    value["uncertainty"] = uncertainty::value(made.budget.as_ref());
    add_unknown(&mut value, &made.unknown);
    value
}

pub(crate) fn add_unknown(value: &mut Value, unknown: &UnknownRecord) {
    let bends = unknown.bends.iter();
    let bends = bends.map(|[axis, towards]| json!({"axis": axis, "towards": towards}));
    value["unknown_bends"] = bends.collect();
    value["taken_as_zero"] = json!(unknown.without_effect);
}

/// How well the readings agree, and what warmth does.
pub(crate) fn found_value(found: &Identified) -> Value {
    let expansions = found.expansions.iter().map(|it| {
        json!({"axis": it.plan.axis.to_string(), "ppm_per_k": it.per_kelvin * 1e6,
               "u_ppm_per_k": it.u * 1e6})
    });
    let bends = found.bends.iter().map(|it| {
        json!({"axis": it.plan.axis.to_string(), "towards": it.plan.towards.to_string(),
               "um_per_k": it.bow.um(), "u_um_per_k": it.u.um()})
    });
    json!({
        "degrees_of_freedom": found.degrees_of_freedom,
        "birge_ratio": found.birge_ratio,
        "birge_ratio_limit": scatter_limit(found.degrees_of_freedom),
        "expansions": expansions.collect::<Vec<_>>(),
        "bends": bends.collect::<Vec<_>>(),
    })
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    let mut operator = Terminal::new(args.ask.yes, args.axis.machine.hand(), output)?;
    let by = match args.uncompensated {
        true => VerifyBy::AsFound,
        false => VerifyBy::Everything,
    };
    let ready =
        |machine: &mut Machine, store: &Store| machine.volumetric()?.check_verify(store, by);
    let run = |machine: &mut Machine, store: &Store, ()| {
        machine.volumetric()?.verify(store, by, &mut operator)
    };
    let (machine, purpose) = (&args.axis.machine, Use::Measurement);
    let (verified, counters) = with_zeroed_volume(machine, "verify", purpose, output, ready, run)?;
    let mut value = verified_value(&verified);
    value["counters"] = counters;
    let text = verified_text(&verified);
    match verified.out_of_tolerance().filter(|_| !args.uncompensated) {
        None => output.result(&text, &value),
        Some(failure) => output.bad_result(&text, value, failure),
    }
}

pub(crate) fn verified_text(verified: &VolumetricVerified) -> String {
    let verdict = verdict(
        &format!(
            "deviations along the line: range {:.3} µm",
            verified.range.um()
        ),
        &format!("{:.3} µm", verified.limit.um()),
        verified.is_within_tolerance(),
    );
    let head = format!("{verdict}\n        x        y        z (mm)  deviation (µm)   u (µm)");
    verified.points.iter().fold(head, |text, it| {
        let [x, y, z] = mm(it.at);
        text + &format!(
            "\n {x:>8.3} {y:>8.3} {z:>8.3}  {:>19.3} {:>8.3}",
            it.deviation.um(),
            it.u.um()
        )
    })
}

pub(crate) fn verified_value(verified: &VolumetricVerified) -> Value {
    let points = verified.points.iter().map(
        |it| json!({"at_mm": mm(it.at), "deviation_um": it.deviation.um(), "u_um": it.u.um()}),
    );
    json!({
        "range_um": verified.range.um(),
        "limit_um": verified.limit.um(),
        "within_tolerance": verified.is_within_tolerance(),
        "journal": verified.journal,
        "points": points.collect::<Vec<_>>(),
    })
}

fn mm(point: Point) -> [f64; 3] {
    Axis::ALL.map(|axis| point.along(axis).mm())
}

/// The targets of a move of three axes.
pub(super) fn targets(args: &MoveArgs) -> Result<NamedPoint, Failure> {
    args.each_once()?;
    let mut target: [Option<Metres>; 3] = [None; 3];
    for text in &args.targets {
        let (axis, place) = axis_target(text)?;
        let known = "x, y, z".to_owned();
        let at = ["x", "y", "z"].iter().position(|it| *it == axis);
        let at = at.ok_or(Failure::Machine(machine::Failure::NoSuchAxis {
            axis,
            known,
        }))?;
        target[at] = Some(place);
    }
    if target.iter().all(Option::is_none) {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write AXIS=PLACE with a unit: x=12.5mm y=20mm z=5mm".into(),
        });
    }
    Ok(NamedPoint(target))
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    let named = targets(args)?;
    let ready = |machine: &mut Machine, store: &Store| {
        let mut volume = machine.volumetric()?;
        // Where the zero leaves what is not named.
        let target = named.from(volume.config().zero.index_mm.map(Metres::from_mm));
        let ready = match args.agreed.uncompensated {
            true => volume.check_target(target, false).map(|()| None),
            false => volume.ready(store, target).map(Some),
        };
        Ok((ready?, target))
    };
    let run = |machine: &mut Machine, _: &Store, (ready, target): (Option<Ready>, Point)| {
        let mut volume = machine.volumetric()?;
        match ready {
            Some(ready) => volume.go_corrected(ready, target).map(Some),
            None => volume.go_straight(target).map(|()| None),
        }
    };
    let machine = &args.machine;
    let (made, counters) = with_zeroed_volume(machine, "move", Use::Motion, output, ready, run)?;
    let told = made.as_ref().map_or_else(by_encoders, moved);
    output.told(told, counters)
}

fn by_encoders() -> Told {
    Told {
        text: "NOT CORRECTED: the axes went by their encoders alone".into(),
        value: json!({"corrected": false}),
    }
}
