//! What makes a zero uncertain: how its passes repeat, and that a drive takes its zero in whole counts.

use compensator::budget::{BudgetError, Contribution, Correlation, Evaluation, PlacesBudget};
use compensator::hall_zero::ZeroEstimate;
use compensator::uncertainty::of_rounding;
use units::Metres;

use crate::store::budget::PlacesBudgetRecord;

/// The budget of a drive's zero of counts of `count` metres where `estimate` says that the origin is.
///
/// The few degrees of freedom of the passes have widened their standard uncertainty already: that is in the
/// sensitivity.
pub fn budget(estimate: &ZeroEstimate, count: f64) -> Result<PlacesBudget<Metres>, BudgetError> {
    let of_passes = estimate.standard_uncertainty.value();
    let known = estimate.passes.filter(|it| it.scatter > Metres::ZERO);
    let (name, scatter, freedom) = match known {
        Some(it) => {
            let freedom = it.degrees_of_freedom as f64;
            ("passes over the flanks", it.scatter.value(), Some(freedom))
        }
        None => ("noise of the samples", of_passes, None),
    };
    let by = if scatter > 0.0 {
        of_passes / scatter
    } else {
        0.0
    };
    let lines = vec![
        line(name, Evaluation::A, scatter, freedom),
        line("whole counts of the drive", Evaluation::B, count, None),
    ];
    PlacesBudget::new(lines, vec![vec![by, of_rounding(1.0)]])
}

/// As it is kept, of the zero at `origin`.
pub fn record(budget: &PlacesBudget<Metres>, origin: Metres) -> PlacesBudgetRecord {
    PlacesBudgetRecord::new(budget, vec![(vec![origin.value()], None)])
}

fn line(
    name: &str,
    evaluation: Evaluation,
    value: f64,
    degrees_of_freedom: Option<f64>,
) -> Contribution {
    Contribution {
        name: name.to_owned(),
        evaluation,
        value,
        unit: "m".to_owned(),
        sensitivity: 1.0,
        degrees_of_freedom,
        correlation: Correlation::CommonOffset,
        approach: None,
    }
}
