//! A rotary table's self-calibration and its plan, angles in arcseconds.

use compensator::rotary::{
    Criterion, Design, Reading, Solution, harmonic_max, rms_amplification_of_a_pair,
    rms_amplification_of_all,
};
use serde_json::{Value, json};
use units::Radians;

use crate::program::json::rounded;
use crate::rotary::RotaryContent;
use crate::rotary::bidirectional::Bidirectional;

/// Arcseconds, rounded to a thousandth of a microarcsecond.
pub(crate) fn arcsec(angle: Radians) -> f64 {
    rounded(angle.arcsec(), 1e9)
}

/// The word for a criterion.
pub(crate) const fn criterion(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Worst => "worst",
        Criterion::Rms => "rms",
    }
}

/// What offsets make of noise, compared with the patent's pair and with theory.
pub(crate) fn design(design: &Design, pair: &Design) -> Value {
    let lines = design.lines();
    let mut value = amplification(design);
    value["lines"] = json!(lines);
    value["placements"] = json!(design.offsets().len());
    value["patent_pair"] = amplification(pair);
    value["theory"] = json!({
        "pair_one_line_apart_rms": rms_amplification_of_a_pair(lines),
        "placement_at_every_line_rms": rms_amplification_of_all(lines),
    });
    value
}

fn amplification(design: &Design) -> Value {
    let (harmonic, worst) = design.worst();
    let each: Vec<f64> = (1..=design.harmonics())
        .map(|harmonic| design.amplification(harmonic))
        .collect();
    json!({
        "offsets": design.offsets(),
        "rms_amplification": design.rms_amplification(),
        "worst_amplification": worst,
        "worst_harmonic": harmonic,
        "amplification": each,
    })
}

/// What readings say about table and plate. A table error is reading − true angle.
pub(crate) fn solution(solution: &Solution) -> Value {
    let list = |values: Option<Vec<Radians>>| {
        values.map(|values| values.into_iter().map(arcsec).collect::<Vec<_>>())
    };
    let plate = solution.plate_error.iter();
    let outliers: Vec<_> = solution
        .outliers
        .iter()
        .map(|it| {
            let mut value = reading(&it.reading);
            value["residual_arcsec"] = json!(arcsec(it.residual));
            value
        })
        .collect();
    let (worst_harmonic, worst_amplification) = solution.design.worst();
    json!({
        "lines": solution.design.lines(),
        "offsets": solution.design.offsets(),
        "table_error_arcsec": list(Some(solution.table_error.clone())),
        "standard_uncertainty_arcsec": list(solution.standard_uncertainty())
            .map_or_else(|| json!(vec![Value::Null; solution.table_error.len()]), Value::from),
        "propagated_uncertainty_arcsec": list(solution.uncertainty_propagated()),
        "plate_error_arcsec": plate.map(|it| it.map(arcsec)).collect::<Vec<_>>(),
        "residual_rms_arcsec": arcsec(solution.residual_rms),
        "degrees_of_freedom": solution.degrees_of_freedom,
        "reading_noise_arcsec": solution.reading_noise_seen.map(arcsec),
        "noise_amplification": solution.noise_amplification(),
        "worst_amplification": worst_amplification,
        "worst_harmonic": worst_harmonic,
        "harmonic_max": harmonic_max(solution.design.lines()),
        "outliers": outliers,
        "missing": solution.missing.iter().map(reading).collect::<Vec<_>>(),
    })
}

fn reading(reading: &Reading) -> Value {
    json!({
        "placement": reading.placement,
        "offset": reading.offset,
        "line": reading.line,
    })
}

/// The harmonics of a table error, up to the highest that its lines tell between them, too.
pub(crate) fn harmonics(content: &RotaryContent) -> Value {
    let each = content.harmonics().into_iter().map(|it| {
        json!({
            "number": it.number,
            "amplitude_arcsec": arcsec(it.amplitude),
            "standard_uncertainty_arcsec": it.standard_uncertainty.map(arcsec),
            "phase_deg": it.phase.degrees(),
            "significant": it.is_significant,
        })
    });
    each.collect()
}

/// What the directions of a placement's passes differ by. A reversal value is forward − reverse.
pub(crate) fn bidirectional(it: &Bidirectional) -> Value {
    let [forward, reverse] = it.repeatability.map(|it| it.map(arcsec));
    json!({
        "reversal_arcsec": it.reversal.iter().map(|it| it.map(arcsec)).collect::<Vec<_>>(),
        "mean_reversal_arcsec": arcsec(it.mean_reversal),
        "reversal_variation_arcsec": arcsec(it.reversal_variation),
        "repeatability_arcsec": {"forward": forward, "reverse": reverse},
    })
}
