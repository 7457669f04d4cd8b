//! The verbs of the cycle on rotary axes (system S2).

use machine::records::short;
use serde_json::{Value, json};
use units::Radians;

use crate::ports::Use;
use crate::program::json as to_json;
use crate::program::operator::Terminal;
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::rotary::json::{arcsec, solution};
use crate::program::session::{Session, choose_axis};
use crate::program::{AxisArgs, CalibrateArgs, MoveArgs, VerifyArgs, WayName};
use crate::rotary::Way;
use crate::rotary::moves::RotaryMoved;
use crate::rotary::verify::RotaryFigures;
use crate::rotary::{RotaryCalibrated, RotaryFailure, RotaryVerified};
use crate::run::CalibrateOptions;
use crate::{Failure, Machine};
use machine::records::Store;
use units::text::angle;

pub(crate) fn zero(args: &AxisArgs, output: Output) -> Ended {
    let run = |_: &mut Machine, _: &str, _: &Store| Ok(());
    let (axis, (), counters) = with_zeroed_table(args, "zero", Use::Motion, output, run)?;
    let text = format!("axis {axis}: zero found on the index mark");
    output.result(&text, &json!({"axis": axis, "counters": counters}))
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

pub(crate) fn calibrate(args: &CalibrateArgs, output: Output) -> Ended {
    let mut operator = Terminal::new(args.yes, args.axis.machine.hand(), output)?;
    let run = |machine: &mut Machine, axis: &str, store: &Store| {
        let options = CalibrateOptions {
            resume: journal_to_resume(args.resume.as_ref(), store, "calibrate", axis)?,
            accept_drift: args.accept_drift,
        };
        let resumed = options.resume.clone();
        resumable(store, "calibrate", axis, resumed.as_deref(), || {
            machine
                .rotary(axis)?
                .calibrate(store, &options, &mut operator)
        })
    };
    let (axis, calibrated, counters) =
        with_zeroed_table(&args.axis, "calibrate", Use::Measurement, output, run)?;
    let mut value = calibrated_value(&calibrated);
    value["axis"] = json!(axis);
    value["counters"] = counters;
    output.result(&calibrated_text(&calibrated), &value)
}

pub(crate) fn verify(args: &VerifyArgs, output: Output) -> Ended {
    if args.resume.is_some() {
        return Err(Failure::Usage {
            what: "a rotary axis's verification cannot be resumed".into(),
            help: "it is one placement: start it again".into(),
        });
    }
    let compensated = !args.uncompensated;
    let mut operator = Terminal::new(args.yes, args.axis.machine.hand(), output)?;
    let run = |machine: &mut Machine, axis: &str, store: &Store| {
        // Uncompensated, too: it knows the plate's errors.
        machine.rotary(axis)?.load_active(store)?;
        machine
            .rotary(axis)?
            .verify(store, compensated, &mut operator)
    };
    let (axis, verified, counters) =
        with_zeroed_table(&args.axis, "verify", Use::Measurement, output, run)?;
    let mut value = verified_value(&verified);
    value["axis"] = json!(axis);
    value["counters"] = counters;
    let text = verified_text(&verified);
    match out_of_tolerance(&axis, &verified) {
        Some(failure) => output.bad_result(&text, value, failure),
        None => output.result(&text, &value),
    }
}

/// What a verification that was to be within the tolerance failed by.
pub(crate) fn out_of_tolerance(axis: &str, verified: &RotaryVerified) -> Option<Failure> {
    let left = verified.left.as_ref()?;
    let failure = RotaryFailure::OutOfTolerance {
        axis: axis.to_owned(),
        seen: left.largest,
        limit: verified.tolerance,
    };
    (!verified.is_within_tolerance()).then(|| failure.into())
}

pub(crate) fn move_to(args: &MoveArgs, output: Output) -> Ended {
    if args.align {
        return Err(Failure::Usage {
            what: "--align is for platforms, which a camera sees".into(),
            help: "leave it out".into(),
        });
    }
    let targets: Vec<_> = args
        .targets
        .iter()
        .map(|text| target(text))
        .collect::<Result<_, _>>()?;
    if targets.is_empty() {
        return Err(Failure::Usage {
            what: "`move` needs a target".into(),
            help: "write AXIS=ANGLE with a unit: c=90deg".into(),
        });
    }
    let way = match args.way {
        None | Some(WayName::Shortest) => Way::Shortest,
        Some(WayName::Forward) => Way::Forward,
        Some(WayName::Reverse) => Way::Reverse,
        Some(WayName::Turns) => Way::Turns,
    };
    let mut session = Session::open(&args.machine, "move", Use::Motion, output)?;
    let store = session.store.clone();
    let moved = session.machine.guarded(|machine| {
        machine.start()?;
        let mut moved = Vec::new();
        for (axis, angle) in &targets {
            let calibration = machine.rotary(axis)?.load_active(&store)?;
            machine.rotary(axis)?.zero()?;
            moved.push((
                axis,
                machine.rotary(axis)?.move_to(*angle, way)?,
                calibration,
            ));
        }
        machine.shut_down()?;
        Ok(moved)
    })?;
    let lines: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration)| moved_text(axis, moved, calibration.as_deref()))
        .collect();
    let values: Vec<_> = moved
        .iter()
        .map(|(axis, moved, calibration)| moved_value(axis, moved, calibration.as_deref()))
        .collect();
    output.result(&lines.join("\n"), &json!({"moves": values}))
}

pub(crate) fn moved_text(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> String {
    let by = calibration.map_or("not corrected".to_owned(), short);
    let u = moved
        .standard_uncertainty
        .map_or(String::new(), |u| format!(", u = {:.4}″", u.arcsec()));
    format!(
        "axis {axis}: target {:.7}°, set-point {:.7}°, is at {:.7}° ({by}{u}){}",
        moved.target.degrees(),
        moved.set_point.degrees(),
        moved.expected.degrees(),
        uncorrected(axis, calibration)
    )
}

/// A table without a calibration goes by its encoder alone.
fn uncorrected(axis: &str, calibration: Option<&str>) -> String {
    if calibration.is_some() {
        return String::new();
    }
    format!(
        "\naxis {axis}: NOT CORRECTED: the axis has no calibration and is off by the deviation of \
         its encoder there; run `truestage calibrate`, or activate a calibration with `truestage \
         cal activate`"
    )
}

pub(crate) fn moved_value(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> Value {
    json!({
        "axis": axis,
        "target_deg": moved.target.degrees(),
        "set_point_deg": moved.set_point.degrees(),
        "expected_deg": moved.expected.degrees(),
        "standard_uncertainty_arcsec": moved.standard_uncertainty.map(arcsec),
        "calibration": calibration,
        "corrected": calibration.is_some(),
    })
}

pub(crate) fn calibrated_text(calibrated: &RotaryCalibrated) -> String {
    let solution = &calibrated.solution;
    let content = &calibrated.content;
    let u = content.uncertainty_max();
    let u = u.map_or("unknown".to_owned(), |u| {
        format!("{:.4}″ at most", u.arcsec())
    });
    let scatter = calibrated
        .scatter
        .map_or("unknown".to_owned(), |it| format!("{:.4}″", it.arcsec()));
    let mut text = format!(
        "calibration {} stored and activated\n  {} lines at offsets {:?}: table error up to {:.3}″ at \
         the lines, plate up to {:.3}″\n  standard uncertainty {u}; one line in one pass scatters by {scatter}\n  \
         {}\n  the plate moved by {:.3}″ at most while it was read\n  {}\n  passes in {}",
        short(&calibrated.id),
        solution.design.lines(),
        solution.design.offsets(),
        content.largest_error().arcsec(),
        content.largest_plate_error().arcsec(),
        content.harmonics_told(),
        calibrated.closure.arcsec(),
        calibrated.path.display(),
        calibrated.journal.display(),
    );
    for it in &solution.outliers {
        let (line, offset) = (it.reading.line, it.reading.offset);
        let residual = it.residual.arcsec();
        text += &format!(
            "\n  left out: line {line} at offset {offset}, {residual:+.3}″ from what the others \
             predict"
        );
    }
    if !solution.missing.is_empty() {
        text += &format!("\n  {} readings are missing", solution.missing.len());
    }
    text
}

pub(crate) fn calibrated_value(calibrated: &RotaryCalibrated) -> Value {
    let mut value = solution(&calibrated.solution);
    value["calibration"] = json!(calibrated.id);
    value["path"] = json!(calibrated.path);
    value["journal"] = json!(calibrated.journal);
    value["closure_arcsec"] = json!(arcsec(calibrated.closure));
    value["pass_scatter_arcsec"] = json!(calibrated.scatter.map(arcsec));
    value["largest_deviation_arcsec"] = json!(arcsec(calibrated.content.largest_error()));
    value
}

fn figures_text(title: &str, figures: &RotaryFigures) -> String {
    format!(
        "{title}: largest deviation {:.3}″, rms {:.3}″",
        figures.largest.arcsec(),
        figures.rms.arcsec()
    )
}

pub(crate) fn verified_text(verified: &RotaryVerified) -> String {
    let whose = if verified.plate_known {
        ""
    } else {
        " (errors of table and plate together: no calibration contains this plate)"
    };
    let mut text = figures_text("as found", &verified.found) + whose;
    if let Some(left) = &verified.left {
        text += &format!(
            "\n{} (tolerance {:.3}″)",
            figures_text("as left", left),
            verified.tolerance.arcsec()
        );
    }
    if let Some(noise) = verified.noise {
        text += &format!(
            "\n  this includes the scatter of these readings, {:.3}″ rms",
            noise.arcsec()
        );
    }
    let places = if verified.offset_lines.fract() == 0.0 {
        "at the lines"
    } else {
        "between the lines"
    };
    text + &format!(
        "\n  plate at offset {}: places {places} of the calibration; it moved by {:.3}″\n  passes in {}",
        verified.offset_lines,
        verified.closure.arcsec(),
        verified.journal.display()
    )
}

fn figures_value(figures: &RotaryFigures) -> Value {
    let deviations: Vec<_> = figures.deviations.iter().map(|it| it.map(arcsec)).collect();
    json!({
        "largest_arcsec": arcsec(figures.largest),
        "rms_arcsec": arcsec(figures.rms),
        "deviation_arcsec": deviations,
    })
}

pub(crate) fn verified_value(verified: &RotaryVerified) -> Value {
    json!({
        "offset_lines": verified.offset_lines,
        "plate_known": verified.plate_known,
        "as_found": figures_value(&verified.found),
        "as_left": verified.left.as_ref().map(figures_value),
        "reading_noise_arcsec": verified.noise.map(arcsec),
        "closure_arcsec": arcsec(verified.closure),
        "tolerance_arcsec": arcsec(verified.tolerance),
        "within_tolerance": verified.left.is_some().then(|| verified.is_within_tolerance()),
        "journal": verified.journal,
    })
}

/// `c=90deg`: the unit is never guessed.
fn target(text: &str) -> Result<(String, Radians), Failure> {
    let parsed = text.split_once('=').and_then(|(axis, value)| {
        let named = (!axis.is_empty()).then(|| axis.to_owned());
        Some((named?, angle(value)?))
    });
    parsed.ok_or_else(|| Failure::Usage {
        what: format!("`{text}` is not a target"),
        help: "write AXIS=ANGLE with a unit: c=90deg, c=-30arcmin, c=20arcsec, c=1.5rad".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_an_axis_and_an_angle_with_its_unit() {
        for (text, degrees) in [
            ("c=90deg", 90.0),
            ("c=-30arcmin", -0.5),
            ("c=36arcsec", 0.01),
            ("c=1e3mrad", 57.295_779_513_082_32),
            ("c=-725.5deg", -725.5),
        ] {
            let (axis, angle) = target(text).unwrap();
            assert_eq!(axis, "c");
            assert!((angle.degrees() - degrees).abs() < 1e-9, "{text}");
        }
        for text in [
            "c=90", "c", "=1deg", "c=1mm", "c=nandeg", "c=infrad", "c=1,5deg",
        ] {
            assert!(target(text).is_err(), "{text}");
        }
    }
}
