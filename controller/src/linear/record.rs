//! The deviations of a linear axis (`linear_error_table`).

mod budget;

use compensator::budget::AxisBudget;
use compensator::error_table::{ErrorTable, Node};
use serde::{Deserialize, Serialize};
use units::{Approach, Metres};

use crate::store::StoreError;
pub(crate) use budget::{BudgetRecord, CombinedRecord, PlaceRecord};

/// An error table as it is stored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinearContent {
    /// How many runs.
    pub runs: u32,
    /// Difference of the same place measured first and last, metres, where measured.
    pub closure_m: Option<f64>,
    /// Mean lost motion (reverse − forward), metres, where both approaches were measured.
    pub lost_motion_m: Option<f64>,
    /// Its standard uncertainty, metres.
    pub lost_motion_u_m: Option<f64>,
    /// Deviation (actual − target) at each calibrated position.
    pub nodes: Vec<NodeRecord>,
    /// What makes these uncertain; without it the nodes' uncertainties are those of their scatter and
    /// of the instrument alone, as programs stated them before there was a budget.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<BudgetRecord>,
    /// Over which distance each position and the datum were approached, metres; without it over distances
    /// that differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach_m: Option<f64>,
}

/// One calibrated position, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeRecord {
    pub position_m: f64,
    pub forward_m: Option<f64>,
    pub reverse_m: Option<f64>,
    pub forward_u_m: Option<f64>,
    pub reverse_u_m: Option<f64>,
}

impl LinearContent {
    /// The name of this kind.
    pub const KIND: &'static str = "linear_error_table";

    /// What `table` says, measured in `runs` runs with this closure error.
    pub fn new(table: &ErrorTable, runs: u32, closure: Option<Metres>) -> Self {
        let lost_motion = table.lost_motion();
        let metres = |value: Option<Metres>| value.map(Metres::value);
        let nodes = table.nodes().iter().map(|node| NodeRecord {
            position_m: node.position.value(),
            forward_m: metres(node.forward),
            reverse_m: metres(node.reverse),
            forward_u_m: metres(node.u_forward),
            reverse_u_m: metres(node.u_reverse),
        });
        Self {
            runs,
            closure_m: metres(closure),
            lost_motion_m: lost_motion.map(|it| it.mean.value()),
            lost_motion_u_m: metres(lost_motion.and_then(|it| it.standard_uncertainty)),
            nodes: nodes.collect(),
            budget: None,
            approach_m: None,
        }
    }

    /// The same with `budget`, whose combined uncertainties become those of the nodes.
    #[must_use]
    pub fn with_budget(mut self, budget: &AxisBudget) -> Self {
        let combined = |node: &NodeRecord, approach, value: Option<f64>| {
            let at = budget.at(Metres(node.position_m), approach);
            at.filter(|_| value.is_some())
                .map(|it| it.standard_uncertainty.value())
        };
        for node in &mut self.nodes {
            node.forward_u_m = combined(node, Approach::Forward, node.forward_m);
            node.reverse_u_m = combined(node, Approach::Reverse, node.reverse_m);
        }
        self.budget = Some(BudgetRecord::new(budget, &self.approaches()));
        self
    }

    /// The same, of positions that were each approached over this distance.
    #[must_use]
    pub fn with_approach(self, length: Option<Metres>) -> Self {
        Self {
            approach_m: length.map(Metres::value),
            ..self
        }
    }

    /// From which sides it was measured.
    pub fn approaches(&self) -> Vec<Approach> {
        let has = |of: fn(&NodeRecord) -> Option<f64>| self.nodes.iter().any(|it| of(it).is_some());
        let sides = [
            (Approach::Forward, has(|it| it.forward_m)),
            (Approach::Reverse, has(|it| it.reverse_m)),
        ];
        sides
            .into_iter()
            .filter_map(|(approach, is_known)| is_known.then_some(approach))
            .collect()
    }

    /// The uncertainty budget of calibration `id`, where it has one.
    ///
    /// # Errors
    /// When its numbers can be no uncertainties.
    pub fn axis_budget(&self, id: &str) -> Result<Option<AxisBudget>, StoreError> {
        let positions = self.nodes.iter().map(|it| Metres(it.position_m)).collect();
        let budget = self.budget.as_ref().map(|it| it.budget(positions));
        budget
            .transpose()
            .map_err(|source| StoreError::model(id, source))
    }

    /// The error table that calibration `id` holds.
    ///
    /// # Errors
    /// When its nodes make no table.
    pub fn table(&self, id: &str) -> Result<ErrorTable, StoreError> {
        let nodes = self
            .nodes
            .iter()
            .map(|node| Node {
                position: Metres(node.position_m),
                forward: node.forward_m.map(Metres),
                reverse: node.reverse_m.map(Metres),
                u_forward: node.forward_u_m.map(Metres),
                u_reverse: node.reverse_u_m.map(Metres),
            })
            .collect();
        ErrorTable::new(nodes).map_err(|source| StoreError::model(id, source))
    }
}

#[cfg(test)]
mod tests;
