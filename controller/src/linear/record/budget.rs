//! The uncertainty budget of a linear calibration, as it is stored.

use compensator::budget::{AxisBudget, BudgetError, COVERAGE_FACTOR, Combined};
use serde::{Deserialize, Serialize};
use units::{Approach, Metres};

use crate::store::budget::{ContributionRecord, told_freedom};

/// What makes the deviations uncertain, and what that comes to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BudgetRecord {
    /// k: each `expanded_u_m` is so many times its `u_m`.
    pub coverage_factor: f64,
    /// What contributes (GUM clause 8).
    pub contributions: Vec<ContributionRecord>,
    /// What they come to at each calibrated position and half-way between two.
    pub places: Vec<PlaceRecord>,
}

/// What a budget comes to at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceRecord {
    /// Where, metres.
    pub position_m: f64,
    /// Approached forward, where that was calibrated.
    pub forward: Option<CombinedRecord>,
    /// Likewise in reverse.
    pub reverse: Option<CombinedRecord>,
}

/// A combined uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CombinedRecord {
    /// Standard uncertainty, metres.
    pub u_m: f64,
    /// Expanded uncertainty, metres.
    pub expanded_u_m: f64,
    /// Effective degrees of freedom (Welch and Satterthwaite); `null` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
}

impl BudgetRecord {
    /// What `budget` says of an axis that was calibrated from `approaches`.
    pub fn new(budget: &AxisBudget, approaches: &[Approach]) -> Self {
        let at = |position, approach| {
            let known = approaches.contains(&approach);
            let combined = budget.at(position, approach).filter(|_| known);
            combined.map(|it| CombinedRecord::from(&it))
        };
        let place = |position: Metres| PlaceRecord {
            position_m: position.value(),
            forward: at(position, Approach::Forward),
            reverse: at(position, Approach::Reverse),
        };
        Self {
            coverage_factor: COVERAGE_FACTOR,
            contributions: budget.contributions().iter().map(Into::into).collect(),
            places: places(budget.positions()).map(place).collect(),
        }
    }

    /// The budget of an axis that was calibrated at `positions`.
    ///
    /// # Errors
    /// When its numbers can be no uncertainties.
    pub fn budget(&self, positions: Vec<Metres>) -> Result<AxisBudget, BudgetError> {
        let contributions = self.contributions.iter().map(Into::into).collect();
        AxisBudget::new(contributions, positions)
    }
}

/// Each position, and what lies half-way to the next.
fn places(positions: &[Metres]) -> impl Iterator<Item = Metres> + '_ {
    let between = |pair: &[Metres]| [pair[0], (pair[0] + pair[1]) / 2.0];
    let last = positions.last().copied();
    positions.windows(2).flat_map(between).chain(last)
}

impl From<&Combined> for CombinedRecord {
    fn from(it: &Combined) -> Self {
        Self {
            u_m: it.standard_uncertainty.value(),
            expanded_u_m: it.expanded().value(),
            degrees_of_freedom: told_freedom(it.degrees_of_freedom),
        }
    }
}
