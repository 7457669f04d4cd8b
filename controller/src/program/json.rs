//! What `--json` prints: one object, lengths in the unit its key or `unit` names
//! (docs/decisions/0033-what-json-prints-is-composed.md).

use compensator::error_table::{ErrorTable, Fitted};
use compensator::hall_zero::ZeroEstimate;
use compensator::iso230::{Conformity, Directional, Figures, Means, OneWayFigures};
use serde_json::{Value, json};
use units::{Approach, Metres};

/// To multiples of `1 / per_unit`: beyond that is noise of the arithmetic.
pub(crate) fn rounded(value: f64, per_unit: f64) -> f64 {
    // Adding zero turns -0.0, which would print as "-0.0", into 0.0.
    (value * per_unit).round() / per_unit + 0.0
}

/// Micrometres, rounded to a tenth of a nanometre.
pub(crate) fn um(length: Metres) -> f64 {
    rounded(length.um(), 1e4)
}

fn directional(figure: &Directional) -> Value {
    json!({
        "bidirectional": um(figure.bidirectional),
        "forward": um(figure.forward),
        "reverse": um(figure.reverse),
    })
}

/// ISO 230-2 figures in micrometres.
pub(crate) fn figures(figures: &Figures) -> Value {
    let targets: Vec<_> = figures
        .targets
        .iter()
        .map(|it| {
            json!({
                "target_mm": it.target.mm(),
                "mean_deviation": {"forward": um(it.mean_forward), "reverse": um(it.mean_reverse)},
                "standard_deviation": {"forward": um(it.s_forward), "reverse": um(it.s_reverse)},
                "reversal_value": um(it.reversal_value),
                "repeatability": {
                    "bidirectional": um(it.repeatability),
                    "forward": um(it.repeatability_forward),
                    "reverse": um(it.repeatability_reverse),
                },
            })
        })
        .collect();
    json!({
        "unit": "um",
        "reversal_value": um(figures.reversal_value),
        "mean_reversal_value": um(figures.mean_reversal_value),
        "mean_bidirectional_deviation_range": um(figures.mean_bidirectional_deviation_range),
        "systematic_deviation": directional(&figures.systematic_deviation),
        "repeatability": directional(&figures.repeatability),
        "accuracy": directional(&figures.accuracy),
        "runs": figures.runs,
        "conforms_to_iso_230_2": figures.conforms(),
        "iso_230_2_asks_for": asked_for(&figures.conformity),
        "targets": targets,
    })
}

fn asked_for(conformity: &Conformity) -> Value {
    json!({"runs": conformity.runs_wanted, "targets": conformity.targets_wanted})
}

/// Unidirectional ISO 230-2 figures in micrometres, with the names that they have among those of both
/// directions; what needs both is not there.
pub(crate) fn one_way(figures: &OneWayFigures) -> Value {
    let side = match figures.approach {
        Approach::Forward => "forward",
        Approach::Reverse => "reverse",
    };
    let of = |figure| json!({ side: um(figure) });
    let targets = figures.targets.iter().map(|it| {
        json!({
            "target_mm": it.target.mm(),
            "mean_deviation": of(it.mean),
            "standard_deviation": of(it.s),
            "repeatability": of(it.repeatability),
        })
    });
    json!({
        "unit": "um",
        "approach": side,
        "systematic_deviation": of(figures.systematic_deviation),
        "repeatability": of(figures.repeatability),
        "accuracy": of(figures.accuracy),
        "runs": figures.conformity.runs,
        "conforms_to_iso_230_2": figures.conformity.conforms(),
        "iso_230_2_asks_for": asked_for(&figures.conformity),
        "targets": targets.collect::<Vec<_>>(),
    })
}

/// What ISO 230-2 can be told of single measurements, in micrometres, with the names of all figures; `null`
/// where a side was not measured.
pub(crate) fn means(means: &Means) -> Value {
    let of = |figure: Option<Metres>| figure.map(um);
    let targets = means.targets.iter().map(|it| {
        json!({
            "target_mm": it.target.mm(),
            "mean_deviation": { "forward": of(it.forward), "reverse": of(it.reverse) },
        })
    });
    json!({
        "unit": "um",
        "systematic_deviation": {
            "bidirectional": of(means.systematic_deviation),
            "forward": of(means.forward),
            "reverse": of(means.reverse),
        },
        "mean_bidirectional_deviation_range": of(means.mean_bidirectional_deviation_range),
        "reversal_value": of(means.reversal_value),
        "mean_reversal_value": of(means.mean_reversal_value),
        "not_stated": "repeatability and accuracy: a target was measured only once from a side",
        "runs": means.conformity.runs,
        "conforms_to_iso_230_2": means.conformity.conforms(),
        "iso_230_2_asks_for": asked_for(&means.conformity),
        "targets": targets.collect::<Vec<_>>(),
    })
}

/// What devices counted, as `{device: {what: count}}`; what never happened is left out.
pub(crate) fn counters(counters: &[(String, &'static str, u64)]) -> Value {
    let mut devices = serde_json::Map::new();
    for (device, what, count) in counters.iter().filter(|(_, _, count)| *count > 0) {
        let device = devices.entry(device.clone()).or_insert_with(|| json!({}));
        device[*what] = json!(count);
    }
    Value::Object(devices)
}

/// An error table: deviations (actual − target) in micrometres.
pub(crate) fn table(table: &ErrorTable) -> Value {
    let length = |value: Option<Metres>| value.map(um);
    let nodes: Vec<_> = table
        .nodes()
        .iter()
        .map(|node| {
            json!({
                "position_mm": node.position.mm(),
                "deviation_um": {"forward": length(node.forward), "reverse": length(node.reverse)},
                "standard_uncertainty_um": {
                    "forward": length(node.u_forward),
                    "reverse": length(node.u_reverse),
                },
            })
        })
        .collect();
    let lost_motion = table.lost_motion();
    json!({
        "lost_motion_um": lost_motion.map(|it| um(it.mean)),
        "lost_motion_um_u": lost_motion.and_then(|it| it.standard_uncertainty).map(um),
        "largest_deviation_um": um(table.largest()),
        "nodes": nodes,
    })
}

/// How a table was fitted, without its drift.
pub(crate) fn fitted(fitted: &Fitted) -> Value {
    let outliers: Vec<_> = fitted
        .robust
        .outliers
        .iter()
        .map(|point| {
            json!({
                "run": point.run,
                "approach": point.approach.symbol().to_string(),
                "target_mm": point.target.mm(),
                "residual_um": um(point.residual),
            })
        })
        .collect();
    let mut value = table(&fitted.table);
    value["outliers"] = json!(outliers);
    value["outlier_share"] = json!(fitted.robust.share);
    value
}

/// A zero from the Hall sensors.
pub(crate) fn zero(estimate: &ZeroEstimate) -> Value {
    json!({
        "origin_um": um(estimate.origin),
        "origin_um_u": um(estimate.standard_uncertainty),
        "patent_p0_um": estimate.p0_patent.map(um),
        "left_flank_um": um(estimate.left.position),
        "right_flank_um": um(estimate.right.position),
        "peak_max_v": estimate.peak_max.value(),
        "mid_voltage_v": estimate.mid_voltage.value(),
        "residual_rms_peak_mv": estimate.residual_rms_peak.value() * 1e3,
        "residual_rms_slope_mv": estimate.residual_rms_slope.value() * 1e3,
        "points": estimate.points,
        "lost_motion_um": estimate.passes.map(|it| um(it.lost_motion)),
        "pass_scatter_um": estimate.passes.map(|it| um(it.scatter)),
        "degrees_of_freedom": estimate.passes.map(|it| it.degrees_of_freedom),
    })
}
