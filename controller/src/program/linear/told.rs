//! The results of linear axes as they are printed: text for people, one object for programs.

use serde_json::{Value, json};
use units::{Metres, Short};

use crate::linear::{
    Calibrated, HallSweepEntry, HeldEntry, LinearTeller, Moved, Verified, ZeroEntry, Zeroed,
};
use crate::program::linear::{job, moved as of_move, uncertainty};
use crate::program::{json as to_json, text};
use crate::runs::Told;

/// For whoever keeps a machine.
pub(crate) static TELLER: LinearTeller = LinearTeller {
    zeroed,
    calibrated,
    verified,
    moved,
    reached: |job, calibration, point| Told {
        text: job::reached_text(point),
        value: job::reached_value(job, calibration, point),
    },
    job_done: |job, done| Told {
        text: job::done_text(job, done),
        value: job::done_value(job, done),
    },
};

pub(crate) fn zeroed(axis: &str, zeroed: &Zeroed) -> Told {
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
    let drift = zeroed.previous.as_ref().map(|before| {
        let now = &zeroed.entry;
        (
            (now.peak_max_v - before.peak_max_v) * 1e3,
            (now.mid_v - before.mid_v) * 1e3,
        )
    });
    let since = drift.map_or(String::new(), |(peak, mid)| {
        format!("\nsince the zero before: peak sensor {peak:+.1} mV, slope sensor {mid:+.1} mV")
    });
    let flat = zeroed.flat.map_or(String::new(), |it| {
        format!(
            "\nwarning: level_below_peak_v lies where the curves are flat: the peak sensor climbs at {:.0} % of its \
             steepest, the slope sensor at {:.0} % of its slope at the zero. The zero is right, and could be more \
             certain: `truestage plan zero` proposes another level",
            it.steepness * 100.0,
            it.linearity * 100.0
        )
    });
    let value = json!({
        "axis": axis,
        "zero": to_json::zero(estimate),
        "uncertainty": uncertainty::value_of_zero(&zeroed.entry),
        "flat_level": zeroed.flat.map(|it| json!({"steepness": it.steepness, "linearity": it.linearity})),
        "search": search(&HallSweepEntry::of(&zeroed.outcome)),
        "drift_since_last": drift.map(|(peak, mid)| json!({"peak_mv": peak, "slope_mv": mid})),
        "journal": zeroed.journal,
    });
    Told {
        text: text + &since + &budget_of_zero(&zeroed.entry) + &flat,
        value,
    }
}

fn budget_of_zero(entry: &ZeroEntry) -> String {
    let worst = uncertainty::of_zero(entry);
    worst.map_or_else(String::new, |it| format!("\n{}", it.sentence()))
}

/// Where the steps of a search ended, in the drive's coordinates before the origin became zero.
fn search(it: &HallSweepEntry) -> Value {
    let held = |it: HeldEntry| {
        json!({
            "position_um": to_json::um(Metres(it.position_m)),
            "peak_v": it.peak_v,
            "slope_v": it.slope_v,
        })
    };
    json!({
        "g7": {"position_um": to_json::um(Metres(it.peak_m)), "peak_v": it.peak_max_v},
        "g1_p1": held(it.g1),
        "g2_p2": held(it.g2),
        "g8_p0": held(it.p0),
    })
}

pub(crate) fn calibrated(calibrated: &Calibrated) -> Told {
    Told {
        text: calibrated_text(calibrated),
        value: calibrated_value(calibrated),
    }
}

pub(crate) fn calibrated_text(calibrated: &Calibrated) -> String {
    let fitted = &calibrated.fitted;
    let state = match calibrated.is_in_use {
        true => "stored and activated".to_owned(),
        false => format!(
            "stored, NOT IN USE: compare it with `truestage cal diff`, use it with `truestage cal activate {}`",
            &calibrated.id[..12]
        ),
    };
    let mut text = format!(
        "calibration {} {state}\n  {} positions, largest deviation {:.3} µm, {}\n  {}\n  \
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
        "active": calibrated.is_in_use,
        "path": calibrated.path,
        "journal": calibrated.journal,
        "closure_um": calibrated.measured.closure.map(to_json::um),
        "fit": fit,
        "wrong_position_noticed_um": calibrated.noticed.map(to_json::um),
        "uncertainty": budget.map(uncertainty::value),
    })
}

pub(crate) fn verified(axis: &str, verified: &Verified, compensated: bool) -> Told {
    let name = if compensated { "as_left" } else { "as_found" };
    let mut value = verified_value(name, verified);
    value["axis"] = json!(axis);
    Told {
        text: verified_text(name, verified),
        value,
    }
}

fn moved(axis: &str, moved: &Moved, calibration: Option<&str>) -> Told {
    Told {
        text: of_move::text(axis, moved, calibration),
        value: of_move::value(axis, moved, calibration),
    }
}

/// `name` is `as_found` or `as_left`.
pub(crate) fn verified_text(name: &str, verified: &Verified) -> String {
    let title = name.replace('_', " ");
    let mut text = text::figures_table(&[(&title, &verified.figures)]);
    text += "\n";
    text += &verdict(verified).0;
    let uncertain = uncertainty::of_targets(&verified.uncertainty);
    text += &uncertain.map_or(String::new(), |it| format!("\n{it}"));
    text += &format!(
        "\ndatum after the runs: {}",
        text::closure(verified.measured.closure)
    );
    text + &format!("\npoints in {}", verified.journal.display())
}

fn verdict(verified: &Verified) -> (String, bool) {
    let accuracy = verified.figures.accuracy.bidirectional;
    uncertainty::verdict(accuracy, verified.tolerance, &verified.uncertainty)
}

pub(crate) fn verified_value(name: &str, verified: &Verified) -> Value {
    let (verdict, is_good) = verdict(verified);
    let is_doubtful = verified.is_within_tolerance() && !is_good;
    json!({
        name: to_json::figures(&verified.figures),
        "closure_um": verified.measured.closure.map(to_json::um),
        "tolerance_um": to_json::um(verified.tolerance),
        "within_tolerance": verified.is_within_tolerance(),
        "warning": is_doubtful.then_some(verdict),
        "uncertainty": uncertainty::targets(&verified.uncertainty),
        "journal": verified.journal,
    })
}
