//! What is said of the uncertainty budget of a platform's screw.

use serde_json::{Value, json};
use units::{Metres, Short};

use crate::platform::ScrewContent;
use crate::program::budget::{AtWorst, LENGTHS, value_of};
use crate::program::json::um;
use crate::store::budget::PlaceBudgetRecord;

/// The budget where the screw is least certain.
pub(crate) fn worst(content: &ScrewContent) -> Option<AtWorst> {
    let named = |it: &PlaceBudgetRecord| format!("{} mm", Short(stroke(it).mm()));
    AtWorst::of(content.budget.as_ref()?, LENGTHS, named)
}

/// For programs: the contributions, and the largest uncertainty.
pub(crate) fn value(content: &ScrewContent) -> Value {
    value_of(content.budget.as_ref(), |it| {
        json!({
            "stroke_mm": stroke(it).mm(),
            "approach": it.approach.map(String::from),
            "expanded_um": um(Metres(it.expanded_u_si)),
        })
    })
}

fn stroke(it: &PlaceBudgetRecord) -> Metres {
    Metres(it.at_si.first().copied().unwrap_or_default())
}
