//! How runs of a rotary axis are told, in words and as JSON.

use machine::records::short;
use serde_json::{Value, json};

use crate::program::output::{Ended, Output};
use crate::program::rotary::json::{arcsec, bidirectional, harmonics, solution};
use crate::program::rotary::uncertainty;
use crate::program::text::verdict;
use crate::program::tried::used;
use crate::rotary::sighted::alone::{NextPlacement, Progress};
use crate::rotary::verify::RotaryFigures;
use crate::rotary::{RotaryCalibrated, RotaryMoved, RotaryTeller, RotaryVerified};
use crate::runs::Told;

/// For whoever keeps a machine.
pub(crate) static TELLER: RotaryTeller = RotaryTeller {
    zeroed,
    calibrated,
    progress,
    verified: told_verified,
    moved,
};

pub(crate) fn moved(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> Told {
    Told {
        text: moved_text(axis, moved, calibration),
        value: moved_value(axis, moved, calibration),
    }
}

pub(crate) fn zeroed(axis: &str) -> Told {
    Told {
        text: format!("axis {axis}: zero found on the index mark"),
        value: json!({"axis": axis}),
    }
}

pub(crate) fn calibrated(axis: &str, calibrated: &RotaryCalibrated) -> Told {
    let mut value = calibrated_value(calibrated);
    value["axis"] = json!(axis);
    Told {
        text: calibrated_text(calibrated),
        value,
    }
}

/// How far a calibration of a plate that a person reads has come.
pub(crate) fn progress(axis: &str, progress: &Progress) -> Told {
    let mut told = match progress {
        Progress::Done(it) => calibrated(axis, it),
        Progress::Due(it) => Told {
            text: next_text(axis, it),
            value: next_value(it),
        },
    };
    told.value["axis"] = json!(axis);
    told.value["complete"] = json!(matches!(progress, Progress::Done(_)));
    told
}

/// What was read, and what is to be done next.
fn next_text(axis: &str, next: &NextPlacement) -> String {
    let (_, of) = next.task.step;
    let mut text = format!(
        "axis {axis}: {} of {of} placements are read",
        next.read.len()
    );
    for (offset, closure, scatter) in &next.read {
        let scatter = scatter.map_or("unknown".to_owned(), |it| format!("{:.4}″", it.arcsec()));
        text += &format!(
            "\n  at offset {offset} the plate moved by {:+.3}″ while it was read; one line in one pass \
             scatters by {scatter}",
            closure.arcsec()
        );
    }
    text + &format!(
        "\n  next: {}\n  then continue with --resume --readings FILE (columns {})\n  readings in {}",
        next.task.text(),
        next.columns,
        next.journal.display()
    )
}

fn next_value(next: &NextPlacement) -> Value {
    let read = next.read.iter().map(|(offset, closure, scatter)| {
        json!({
            "offset": offset,
            "closure_arcsec": arcsec(*closure),
            "pass_scatter_arcsec": scatter.map(arcsec),
        })
    });
    let (number, of) = next.task.step;
    json!({
        "placements_read": read.collect::<Vec<_>>(),
        "due": {
            "placement": number,
            "of": of,
            "offset": next.task.offset,
            "task": next.task.text(),
        },
        "journal": next.journal,
    })
}

pub(crate) fn told_verified(axis: &str, verified: &RotaryVerified) -> Told {
    let mut value = verified_value(verified);
    value["axis"] = json!(axis);
    Told {
        text: verified_text(verified),
        value,
    }
}

/// How a verification ended; `counters` of a machine that was there.
pub(crate) fn verified(
    axis: &str,
    verified: &RotaryVerified,
    counters: Value,
    output: Output,
) -> Ended {
    let Told { text, mut value } = told_verified(axis, verified);
    if !counters.is_null() {
        value["counters"] = counters;
    }
    match verified.out_of_tolerance(axis) {
        Some(failure) => output.bad_result(&text, value, failure),
        None => output.result(&text, &value),
    }
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
        "{}\n  {} lines at offsets {:?}: table error up to {:.3}″ at \
         the lines, plate up to {:.3}″\n  standard uncertainty {u}; one line in one pass scatters by {scatter}\n  \
         {}\n  the plate moved by {:.3}″ at most while it was read\n  {}\n  passes in {}",
        used(
            &format!("calibration {}", short(&calibrated.id)),
            calibrated.is_in_use,
        ),
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
    if let Some(worst) = uncertainty::worst(content) {
        text += &format!("\n  {}", worst.sentence());
    }
    if !solution.missing.is_empty() {
        text += &format!("\n  {} readings are missing", solution.missing.len());
    }
    text
}

pub(crate) fn calibrated_value(calibrated: &RotaryCalibrated) -> Value {
    let mut value = solution(&calibrated.solution);
    value["calibration"] = json!(calibrated.id);
    value["in_use"] = json!(calibrated.is_in_use);
    value["path"] = json!(calibrated.path);
    value["journal"] = json!(calibrated.journal);
    value["closure_arcsec"] = json!(arcsec(calibrated.closure));
    value["pass_scatter_arcsec"] = json!(calibrated.scatter.map(arcsec));
    value["uncertainty"] = uncertainty::value(&calibrated.content);
    value["harmonics"] = harmonics(&calibrated.content);
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
        text += "\n";
        text += &verdict(
            &figures_text("as left", left),
            &format!("{:.3}″", verified.tolerance.arcsec()),
            verified.is_within_tolerance(),
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
        "bidirectional": verified.bidirectional.as_ref().map(bidirectional),
        "closure_arcsec": arcsec(verified.closure),
        "tolerance_arcsec": arcsec(verified.tolerance),
        "within_tolerance": verified.left.is_some().then(|| verified.is_within_tolerance()),
        "journal": verified.journal,
    })
}

fn moved_text(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> String {
    let by = calibration.map_or("not corrected".to_owned(), short);
    let u = moved.standard_uncertainty.map_or(String::new(), |u| {
        format!(", U = {:.4}″ (k = 2)", 2.0 * u.arcsec())
    });
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
        "\naxis {axis}: NOT CORRECTED: the axis went by its encoder alone, and is off by the deviation of that there"
    )
}

fn moved_value(axis: &str, moved: &RotaryMoved, calibration: Option<&str>) -> Value {
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
