//! What is said of the uncertainty budget of three axes: that of the tool in use, as a length.

use serde_json::{Value, json};
use units::{Metres, Short};

use crate::program::budget::{AtWorst, LENGTHS, value_of};
use crate::store::budget::{PlaceBudgetRecord, PlacesBudgetRecord};

/// The budget where the tool is least certain.
pub(crate) fn worst(budget: Option<&PlacesBudgetRecord>) -> Option<AtWorst> {
    let named = |it: &PlaceBudgetRecord| {
        let mm = millimetres(it).map(|it| Short(it).to_string());
        format!("x, y, z = {} mm", mm.collect::<Vec<_>>().join(", "))
    };
    AtWorst::of(budget?, LENGTHS, named)
}

/// For programs: the contributions, and the largest uncertainty.
pub(crate) fn value(budget: Option<&PlacesBudgetRecord>) -> Value {
    value_of(budget, |it| {
        json!({
            "position_mm": millimetres(it).collect::<Vec<_>>(),
            "expanded_um": Metres(it.expanded_u_si).um(),
        })
    })
}

fn millimetres(it: &PlaceBudgetRecord) -> impl Iterator<Item = f64> {
    it.at_si.iter().map(|it| Metres(*it).mm())
}
