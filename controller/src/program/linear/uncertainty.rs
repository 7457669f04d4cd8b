//! What is said of an uncertainty budget: the same figures in text, JSON and on the page.

use compensator::budget::{COVERAGE_FACTOR, Contribution};
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::linear::LinearContent;
use crate::linear::record::{BudgetRecord, CombinedRecord, ContributionRecord, PlaceRecord};

/// Of a calibration that has no budget.
pub(crate) const NOT_STATED: &str = "u: scatter and instrument alone; the calibration has no uncertainty budget \
                                     (made before there was one, or measured elsewhere)";
/// Contributions that are named in one line.
const NAMED: usize = 4;

/// The place of the largest uncertainty, and what it is there.
pub(crate) fn largest(budget: &BudgetRecord) -> Option<(Metres, CombinedRecord)> {
    let each = budget.places.iter().filter_map(|it| Some((it, worst(it)?)));
    let largest = each.max_by(|a, b| a.1.u_m.total_cmp(&b.1.u_m));
    largest.map(|(place, combined)| (Metres(place.position_m), combined))
}

/// Of both approaches the less certain.
fn worst(place: &PlaceRecord) -> Option<CombinedRecord> {
    let both = [place.forward, place.reverse].into_iter().flatten();
    both.max_by(|a, b| a.u_m.total_cmp(&b.u_m))
}

/// What each contribution comes to so far from the datum, the largest first.
fn shares(budget: &BudgetRecord, position: Metres) -> Vec<(&ContributionRecord, Metres)> {
    let lines = budget.contributions.iter();
    let mut shares: Vec<_> = lines
        .map(|it| (it, Contribution::from(it).share(position)))
        .collect();
    shares.sort_by(|a, b| b.1.value().total_cmp(&a.1.value()));
    shares
}

/// In one line: the largest uncertainty, and what makes it.
pub(crate) fn sentence(budget: &BudgetRecord) -> String {
    let Some((position, combined)) = largest(budget) else {
        return String::new();
    };
    let named = shares(budget, position)
        .into_iter()
        .take(NAMED)
        .map(|(it, share)| format!("{} {:.0} nm", it.name, share.nm()));
    format!(
        "uncertainty U (k = {}) up to {:.3} µm, at {} mm; largest contributions there: {}",
        Short(COVERAGE_FACTOR),
        Metres(combined.expanded_u_m).um(),
        Short(position.mm()),
        named.collect::<Vec<_>>().join(", ")
    )
}

/// The whole budget, after a table.
pub(crate) fn lines(content: &LinearContent, budget: &BudgetRecord) -> String {
    let Some((position, combined)) = largest(budget) else {
        return String::new();
    };
    let sides = content.approaches().len();
    let at_mm = Short(position.mm()).to_string();
    let head = format!(
        "\nuncertainty budget (GUM), shares at {at_mm} mm\n  {:<38} {:>4} {:>12} {:<9} {:>10} {:>9}  {}",
        "contribution", "type", "u of input", "", "share (nm)", "freedom", "at two places"
    );
    let each = shares(budget, position).into_iter().map(|(it, share)| {
        let freedom = it
            .degrees_of_freedom
            .map_or("∞".into(), |it| format!("{it:.1}"));
        let side = match it.approach {
            Some('-') if sides > 1 => ", reverse",
            Some(_) if sides > 1 => ", forward",
            _ => "",
        };
        format!(
            "\n  {:<38} {:>4} {:>12} {:<9} {:>10.1} {freedom:>9}  {}",
            format!("{}{side}", it.name),
            it.evaluation,
            Short(it.value).to_string(),
            it.unit,
            share.nm(),
            correlation(it)
        )
    });
    let foot = format!(
        "\n  combined u {:.1} nm, U (k = {}) {:.1} nm, effective degrees of freedom {}",
        Metres(combined.u_m).nm(),
        Short(COVERAGE_FACTOR),
        Metres(combined.expanded_u_m).nm(),
        combined
            .degrees_of_freedom
            .map_or("∞".into(), |it| format!("{it:.0}"))
    );
    head + &each.collect::<String>() + &foot
}

/// What a contribution does at two places, in words.
pub(crate) fn correlation(it: &ContributionRecord) -> &'static str {
    use crate::linear::record::CorrelationRecord as C;
    match it.correlation {
        C::CommonScale => "common scale",
        C::CommonOffset => "common offset",
        C::Independent => "independent",
        C::BetweenPositions => "between positions",
    }
}

/// For programs: the budget as it is stored, with its largest uncertainty.
pub(crate) fn value(budget: &BudgetRecord) -> Value {
    let largest = largest(budget).map(|(position, combined)| {
        json!({
            "position_mm": position.mm(),
            "expanded_um": Metres(combined.expanded_u_m).um(),
        })
    });
    json!({"coverage_factor": budget.coverage_factor, "largest": largest, "contributions": budget.contributions})
}
