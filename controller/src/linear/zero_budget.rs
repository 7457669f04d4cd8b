//! Contributions to the uncertainty of a zero: its passes, whole counts of its drive, and voltages that are older than
//! their position.

use compensator::budget::{BudgetError, Contribution, Correlation, Evaluation, PlacesBudget};
use compensator::hall_zero::ZeroEstimate;
use compensator::uncertainty::of_rounding;
use units::Metres;

use crate::store::budget::PlacesBudgetRecord;

/// Returns the budget of a drive's zero of counts of `count` metres where `estimate` says that the origin is. Meanwhile
/// the axis moved by `lag` at most from where the voltages were sampled to where the position was.
///
/// The few degrees of freedom of the passes have widened their standard uncertainty already: that is in the
/// sensitivity.
pub fn budget(
    estimate: &ZeroEstimate,
    count: f64,
    lag: Metres,
) -> Result<PlacesBudget<Metres>, BudgetError> {
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
    let mut lines = vec![
        line(name, Evaluation::A, scatter, freedom),
        line("whole counts of the drive", Evaluation::B, count, None),
    ];
    let mut sensitivities = vec![by, of_rounding(1.0)];
    if lag > Metres::ZERO {
        let name = "age of the voltages";
        lines.push(line(name, Evaluation::B, lag.value(), None));
        sensitivities.push(of_lag(Metres(1.0)));
    }
    PlacesBudget::new(lines, vec![sensitivities])
}

/// The standard uncertainty of a place that is off by `lag` at most, in metres (GUM, 4.3.7).
pub(super) fn of_lag(lag: Metres) -> f64 {
    lag.value() / 3.0_f64.sqrt()
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
