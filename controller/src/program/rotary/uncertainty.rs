//! What is said of the uncertainty budget of a rotary table.

use serde_json::{Value, json};
use units::Radians;

use crate::program::budget::{ANGLES, AtWorst, value_of};
use crate::program::rotary::json::arcsec;
use crate::rotary::RotaryContent;
use crate::store::budget::PlaceBudgetRecord;

/// The budget where the table is least certain.
pub(crate) fn worst(content: &RotaryContent) -> Option<AtWorst> {
    let named = |it: &PlaceBudgetRecord| format!("{:.3}°", angle(it).degrees());
    AtWorst::of(content.budget.as_ref()?, ANGLES, named)
}

/// For programs: the contributions, and the largest uncertainty.
pub(crate) fn value(content: &RotaryContent) -> Value {
    value_of(content.budget.as_ref(), |it| {
        json!({
            "position_deg": angle(it).degrees(),
            "expanded_arcsec": arcsec(Radians(it.expanded_u_si)),
        })
    })
}

fn angle(it: &PlaceBudgetRecord) -> Radians {
    Radians(it.at_si.first().copied().unwrap_or_default())
}
