//! What is said of an uncertainty budget: the same figures in text, JSON and on the page.

use core::cmp::Ordering;

use compensator::budget::{COVERAGE_FACTOR, Combined};
use serde_json::{Value, json};
use units::{Approach, Metres, Short};

use crate::linear::record::{BudgetRecord, CombinedRecord};
use crate::linear::{LinearContent, UncertaintyAtTarget, ZeroEntry};
use crate::program::budget::{AtWorst, LENGTHS, value_of};
use crate::program::json::um;
use crate::program::text;
use crate::store::budget::PlaceBudgetRecord;

/// Of a calibration that has no budget.
pub(crate) const NOT_STATED: &str = "u: scatter and instrument alone; the calibration has no uncertainty budget \
                                     (made before there was one, or measured elsewhere)";

/// The largest uncertainty of a calibration: where, from which side, and how large.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Largest {
    pub(crate) position: Metres,
    pub(crate) approach: Approach,
    pub(crate) combined: CombinedRecord,
}

/// The least certain of the places that a budget names.
pub(crate) fn largest(budget: &BudgetRecord) -> Option<Largest> {
    let sides = budget.places.iter().flat_map(|it| {
        let position = Metres(it.position_m);
        [
            (position, Approach::Forward, it.forward),
            (position, Approach::Reverse, it.reverse),
        ]
    });
    let known = sides.filter_map(|(position, approach, combined)| {
        Some(Largest {
            position,
            approach,
            combined: combined?,
        })
    });
    known.max_by(|a, b| a.combined.u_m.total_cmp(&b.combined.u_m))
}

/// The budget there.
pub(crate) fn worst(content: &LinearContent) -> Option<AtWorst> {
    let at = content.budget.as_ref().and_then(largest)?;
    let budget = content.axis_budget("").ok().flatten()?;
    let shares = budget.shares(at.position, at.approach)?.into_iter();
    let worst = AtWorst {
        place: format!("{} mm", to_the_um(at.position)),
        approach: Some(at.approach),
        shares: shares
            .map(|(it, share)| (it.into(), share.value()))
            .collect(),
        u_si: at.combined.u_m,
        degrees_of_freedom: at.combined.degrees_of_freedom,
        told: LENGTHS,
    };
    Some(worst.sorted())
}

/// The budget of a zero.
pub(crate) fn of_zero(entry: &ZeroEntry) -> Option<AtWorst> {
    AtWorst::of(entry.budget.as_ref()?, LENGTHS, |_| "the zero".to_owned())
}

/// The same for programs.
pub(crate) fn value_of_zero(entry: &ZeroEntry) -> Value {
    let largest = |it: &PlaceBudgetRecord| json!({"expanded_um": um(Metres(it.expanded_u_si))});
    value_of(entry.budget.as_ref(), largest)
}

/// In one line: the largest uncertainty, and what makes it.
pub(crate) fn sentence(content: &LinearContent) -> String {
    worst(content).map_or_else(|| NOT_STATED.to_owned(), |it| it.sentence())
}

/// The whole budget, after a table.
pub(crate) fn lines(content: &LinearContent) -> String {
    worst(content).map_or_else(|| format!("\n{NOT_STATED}"), |it| it.lines())
}

/// For programs: the budget as it is stored, with its largest uncertainty.
pub(crate) fn value(budget: &BudgetRecord) -> Value {
    let largest = largest(budget).map(|it| {
        json!({
            "position_mm": it.position.mm(),
            "approach": it.approach.symbol().to_string(),
            "expanded_um": Metres(it.combined.expanded_u_m).um(),
        })
    });
    json!({"coverage_factor": budget.coverage_factor, "largest": largest, "contributions": budget.contributions})
}

/// An uncertainty in words.
pub(crate) fn said(combined: &Combined) -> String {
    format!(
        "U = {:.3} µm (k = {})",
        combined.expanded().um(),
        Short(COVERAGE_FACTOR)
    )
}

/// The same for programs; `null` where none is stated.
pub(crate) fn combined(combined: Option<Combined>) -> Value {
    combined.map_or(Value::Null, |it| {
        json!({
            "standard_um": it.standard_uncertainty.um(),
            "expanded_um": it.expanded().um(),
            "coverage_factor": COVERAGE_FACTOR,
            "degrees_of_freedom": it.degrees_of_freedom,
        })
    })
}

fn by_size(a: &Combined, b: &Combined) -> Ordering {
    let (a, b) = (a.standard_uncertainty, b.standard_uncertainty);
    a.value().total_cmp(&b.value())
}

/// In millimetres: an uncertainty is alike a micrometre further on.
fn to_the_um(position: Metres) -> Short {
    Short(position.um().round() / 1e3)
}

/// How uncertain the corrected position is over the targets of a verification; `None` for one as found.
pub(crate) fn of_targets(targets: &[UncertaintyAtTarget]) -> Option<String> {
    let worst = |it: &UncertaintyAtTarget| {
        let both = [it.forward, it.reverse].into_iter().flatten();
        both.max_by(by_size)
    };
    let mut known: Vec<(Metres, Combined)> = targets
        .iter()
        .filter_map(|it| Some((it.target, worst(it)?)))
        .collect();
    known.sort_by(|a, b| by_size(&a.1, &b.1));
    let at = |(target, it): &(Metres, Combined)| {
        format!("{:.3} µm at {} mm", it.expanded().um(), to_the_um(*target))
    };
    if targets.is_empty() {
        return None;
    }
    let (Some(least), Some(most)) = (known.first(), known.last()) else {
        return Some(format!(
            "uncertainty of the corrected position: {NOT_KNOWN}"
        ));
    };
    let mut text = format!(
        "uncertainty U (k = {}) of the corrected position: {} to {}",
        Short(COVERAGE_FACTOR),
        at(least),
        at(most)
    );
    let beyond = targets.iter().filter(|it| worst(it).is_none());
    let beyond: Vec<String> = beyond.map(|it| to_the_um(it.target).to_string()).collect();
    if !beyond.is_empty() {
        text += &format!(
            "; NOT STATED at {} mm, beyond the calibrated range",
            beyond.join(", ")
        );
    }
    Some(text)
}

/// What a verification is judged by, and whether that is good. Where the corrected position is less certain at a target
/// than the tolerance is wide, nobody knows whether the axis is within it.
pub(crate) fn verdict(
    accuracy: Metres,
    tolerance: Metres,
    targets: &[UncertaintyAtTarget],
) -> (String, bool) {
    let known = targets.iter().flat_map(|it| [it.forward, it.reverse]);
    let most = known.flatten().max_by(by_size).map(|it| it.expanded());
    let in_um = |it: Metres| format!("{:.3} µm", it.um());
    let figure = format!("A = {}", in_um(accuracy));
    let told = [figure, in_um(tolerance), most.map_or(String::new(), in_um)];
    let [figure, limit, expanded] = &told;
    let is_beyond = most.is_some_and(|it| it > tolerance);
    text::sure_verdict([figure, limit, expanded], accuracy <= tolerance, is_beyond)
}

/// Of a place that a calibration without a budget corrects.
pub(crate) const NOT_KNOWN: &str =
    "NOT STATED: the calibration in use has no uncertainty budget; calibrate again";

/// For programs: at each target.
pub(crate) fn targets(targets: &[UncertaintyAtTarget]) -> Value {
    let each = targets.iter().map(|it| {
        json!({
            "target_mm": it.target.mm(),
            "forward": combined(it.forward),
            "reverse": combined(it.reverse),
        })
    });
    each.collect()
}
