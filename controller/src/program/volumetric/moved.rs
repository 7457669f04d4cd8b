//! What `move` says of three axes: where they were sent, what corrected that, and what makes it uncertain.

use compensator::budget::COVERAGE_FACTOR;
use machine::engine::Live;
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::program::budget::{AtWorst, LENGTHS};
use crate::runs::Told;
use crate::store::budget::{PlaceBudgetRecord, PlacesBudgetRecord};
use crate::volumetric::moved::VolumetricMoved;

const AXES: [&str; 3] = ["x", "y", "z"];

pub(crate) fn moved(moved: &VolumetricMoved) -> Told {
    let live = &moved.live;
    let worst = moved.budget.as_ref().and_then(worst);
    let sentence = worst.map_or_else(String::new, |it| format!("\n{}", it.sentence()));
    Told {
        text: live_text(live) + &sentence,
        value: json!({
            "corrected": live.corrected,
            "axes": live_value(live),
            "uncertainty": moved.budget.as_ref().map(budget_value),
        }),
    }
}

fn live_text(live: &Live) -> String {
    let rows = AXES.iter().enumerate().map(|(k, name)| {
        let offset = live.offset[k].um();
        let u = match live.uncertainty[k].um() {
            known if known.is_finite() => format!("{:.3} µm (k = 2)", 2.0 * known),
            _ => "unknown".into(),
        };
        let set_point = (live.nominal[k] + live.offset[k]).mm();
        format!(
            "{name}: target {:.6} mm, set-point {set_point:.6} mm, correction {offset:+.3} µm, U {u}",
            live.nominal[k].mm()
        )
    });
    rows.collect::<Vec<_>>().join("\n")
}

fn live_value(live: &Live) -> Value {
    let axes = AXES.iter().enumerate().map(|(k, name)| {
        json!({"axis": name, "target_mm": live.nominal[k].mm(), "correction_um": live.offset[k].um(),
               "u_um": live.uncertainty[k].um()})
    });
    axes.collect()
}

/// Along the axis of which the place is least certain.
fn worst(budget: &PlacesBudgetRecord) -> Option<AtWorst> {
    let u = |it: &PlaceBudgetRecord| it.u_si;
    let places = budget.places.iter().zip(AXES);
    let (place, axis) = places.reduce(|most, it| if u(it.0) > u(most.0) { it } else { most })?;
    let mm = place
        .at_si
        .iter()
        .map(|it| Short(Metres(*it).mm()).to_string());
    let shares = budget.contributions.iter().zip(&place.sensitivities);
    let worst = AtWorst {
        place: format!(
            "x, y, z = {} mm along {axis}",
            mm.collect::<Vec<_>>().join(", ")
        ),
        approach: None,
        shares: shares
            .map(|(it, by)| (it.clone(), (it.value * by).abs()))
            .collect(),
        u_si: place.u_si,
        degrees_of_freedom: place.degrees_of_freedom,
        told: LENGTHS,
    };
    Some(worst.sorted())
}

/// Each contribution with its sensitivities along x, y and z, and what they come to along each.
fn budget_value(budget: &PlacesBudgetRecord) -> Value {
    let along = budget.places.iter().zip(AXES).map(|(it, axis)| {
        json!({
            "axis": axis,
            "standard_um": Metres(it.u_si).um(),
            "expanded_um": Metres(it.expanded_u_si).um(),
            "degrees_of_freedom": it.degrees_of_freedom,
        })
    });
    let contributions = budget.contributions.iter().enumerate().map(|(at, it)| {
        let by: Vec<f64> = budget
            .places
            .iter()
            .map(|it| it.sensitivities[at])
            .collect();
        json!({
            "name": it.name,
            "evaluation": it.evaluation,
            "value": it.value,
            "unit": it.unit,
            "sensitivities": by,
            "degrees_of_freedom": it.degrees_of_freedom,
            "correlation": it.correlation,
        })
    });
    json!({
        "coverage_factor": COVERAGE_FACTOR,
        "along": along.collect::<Vec<_>>(),
        "contributions": contributions.collect::<Vec<_>>(),
    })
}
