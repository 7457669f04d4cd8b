//! What a fit of a ball screw prints, lengths in micrometres.

use compensator::screw::patent::PatentEstimate;
use compensator::screw::{Fitted, ScrewModel, StrokeOutlier};
use serde_json::{Value, json};
use units::portable::atan2;
use units::{Metres, Radians};

use crate::program::json as to_json;

/// Rounded to a picometre: uncertainties are small and wanted with digits.
fn um(length: Metres) -> f64 {
    rounded(length.um())
}

/// A slope in micrometres per millimetre.
fn um_per_mm(slope: f64) -> f64 {
    rounded(slope * 1e3)
}

fn rounded(value: f64) -> f64 {
    to_json::rounded(value, 1e6)
}

/// The patent's means, of the deviations as they stand in the file. What was not repeated has no
/// uncertainty (null).
pub(crate) fn patent(estimate: &PatentEstimate) -> Value {
    let u = estimate.uncertainty;
    json!({
        "rows": estimate.rows,
        "at_m_um": um(estimate.at_m),
        "at_n_um": um(estimate.at_n),
        "mean_at_m_um": um(estimate.mean_at_m),
        "mean_at_m_um_u": u.map(|it| um(it.mean_at_m)),
        "mean_at_n_um": um(estimate.mean_at_n),
        "mean_at_n_um_u": u.map(|it| um(it.mean_at_n)),
        "slope_um_per_mm": um_per_mm(estimate.slope),
        "slope_um_per_mm_u": u.map(|it| um_per_mm(it.slope)),
        "mean_lost_motion_um": um(estimate.mean_all),
        "mean_lost_motion_um_u": u.map(|it| um(it.mean_all)),
        "harmonics": [],
        "residual_um": um(estimate.residual),
        "scatter_um": u.map(|it| um(it.scatter)),
        "degrees_of_freedom": u.map(|it| it.degrees_of_freedom),
    })
}

/// Rows that were left out of a fit; `lines` are those of all rows in their file, if any.
pub(crate) fn outliers(outliers: &[StrokeOutlier], lines: &[usize]) -> Value {
    let named = outliers.iter().map(|it| {
        json!({
            "line": lines.get(it.index),
            "approach": it.stroke.approach.symbol().to_string(),
            "stroke_um": um(it.stroke.stroke),
            "deviation_um": um(it.stroke.deviation),
            "residual_um": um(it.residual),
        })
    });
    named.collect()
}

/// A least-squares model of rows in `lines` of a file, of the deviations as they stand there.
pub(crate) fn fitted(fitted: &Fitted, rows: usize, lines: &[usize]) -> Value {
    let model = &fitted.model;
    let tests = fitted.tests.iter().map(|test| {
        json!({
            "harmonic": test.number,
            "p_value": test.p_value,
            "level": test.level,
            "kept": test.kept,
        })
    });
    let lack_of_fit = fitted.lack_of_fit.map(|it| {
        json!({
            "p_value": it.p_value,
            "significant": it.significant,
            "repeatability_um": um(it.repeatability),
        })
    });
    let leaks = fitted.leaks.iter().map(|it| {
        json!({
            "harmonic": it.number,
            "slope_um_per_mm_per_um": rounded(it.slope_per_amplitude * 1e-3),
        })
    });
    json!({
        "rows": rows,
        "first_stroke_um": um(model.first),
        "last_stroke_um": um(model.last),
        "lead_mm": model.lead.map(Metres::mm),
        "offset_um": um(model.offset),
        "offset_um_u": model.u_offset().map(um),
        "slope_um_per_mm": um_per_mm(model.slope),
        "slope_um_per_mm_u": model.u_slope().map(um_per_mm),
        "lost_motion_um": um(model.lost_motion),
        "lost_motion_um_u": model.u_lost_motion().map(um),
        "harmonics": harmonics(model),
        "harmonics_tested": tests.collect::<Vec<_>>(),
        "harmonics_not_observable": fitted.unobservable,
        "harmonics_left_out_shift_slope": leaks.collect::<Vec<_>>(),
        "residual_um": um(fitted.residual),
        "stroke_error_um": um(fitted.scatter.stroke),
        "side_error_um": um(fitted.scatter.side),
        "repeatability_um": um(fitted.scatter.repeatability),
        "degrees_of_freedom": fitted.degrees_of_freedom,
        "degrees_of_freedom_within": fitted.degrees_of_freedom_within,
        "lack_of_fit": lack_of_fit,
        "outliers": outliers(&fitted.outliers, lines),
    })
}

fn harmonics(model: &ScrewModel) -> Vec<Value> {
    let each = |(index, it): (usize, &compensator::screw::Harmonic)| {
        let u = model.u_harmonic(index);
        // As amplitude · sin(2π number s/lead + phase).
        let phase = Radians(atan2(it.cosine.value(), it.sine.value()));
        json!({
            "harmonic": it.number,
            "amplitude_um": um(it.amplitude()),
            "amplitude_um_u": u.map(|[.., u]| um(u)),
            "phase_deg": rounded(phase.value().to_degrees()),
            "sine_um": um(it.sine),
            "sine_um_u": u.map(|[u, ..]| um(u)),
            "cosine_um": um(it.cosine),
            "cosine_um_u": u.map(|[_, u, _]| um(u)),
        })
    };
    model.harmonics.iter().enumerate().map(each).collect()
}
