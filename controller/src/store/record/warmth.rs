//! What warmth does to three axes, as it was found with their errors.

use compensator::volumetric::Axis;
use compensator::volumetric::identify::{
    BendPlan, ExpansionPlan, IdentifiedBend, IdentifiedExpansion,
};
use serde::{Deserialize, Serialize};
use units::Metres;

use super::super::{StoreError, short};

pub(super) const AXES: [char; 3] = ['x', 'y', 'z'];

/// A guide that bends when it is warmer on one side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BendRecord {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// The direction of a positive bow.
    pub towards: char,
    /// The thermometer over the neutral plane, from 0.
    pub over: usize,
    /// The one under it.
    pub under: Option<usize>,
    /// Where the arc begins on its chord.
    pub low_m: f64,
    /// Where it ends.
    pub high_m: f64,
    /// Displacement in the middle of the arc per kelvin.
    pub bow_m_per_k: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty_m_per_k: f64,
}

/// How a scale expands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExpansionRecord {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// The thermometers whose mean is its temperature, from 0.
    pub thermometers: Vec<usize>,
    /// 1/K.
    pub per_k: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty_per_k: f64,
}

fn letter(axis: Axis) -> char {
    AXES[axis.index()]
}

fn axis_of(letter: char, id: &str) -> Result<Axis, StoreError> {
    let axis = Axis::ALL.into_iter().find(|it| AXES[it.index()] == letter);
    axis.ok_or_else(|| StoreError::ErrorName {
        id: short(id),
        name: letter.to_string(),
    })
}

impl BendRecord {
    /// What was found.
    pub fn of(found: &IdentifiedBend) -> Self {
        let plan = found.plan;
        Self {
            axis: letter(plan.axis),
            towards: letter(plan.towards),
            over: plan.over,
            under: plan.under,
            low_m: plan.low.value(),
            high_m: plan.high.value(),
            bow_m_per_k: found.bow.value(),
            standard_uncertainty_m_per_k: found.u.value(),
        }
    }

    pub(super) fn found(&self, id: &str) -> Result<IdentifiedBend, StoreError> {
        Ok(IdentifiedBend {
            plan: BendPlan {
                axis: axis_of(self.axis, id)?,
                towards: axis_of(self.towards, id)?,
                over: self.over,
                under: self.under,
                low: Metres(self.low_m),
                high: Metres(self.high_m),
                sideways: false,
                seen_from: None,
            },
            bow: Metres(self.bow_m_per_k),
            u: Metres(self.standard_uncertainty_m_per_k),
        })
    }
}

impl ExpansionRecord {
    /// What was found.
    pub fn of(found: &IdentifiedExpansion) -> Self {
        Self {
            axis: letter(found.plan.axis),
            thermometers: found.plan.thermometers.clone(),
            per_k: found.per_kelvin,
            standard_uncertainty_per_k: found.u,
        }
    }

    pub(super) fn found(&self, id: &str) -> Result<IdentifiedExpansion, StoreError> {
        Ok(IdentifiedExpansion {
            plan: ExpansionPlan {
                axis: axis_of(self.axis, id)?,
                thermometers: self.thermometers.clone(),
            },
            per_kelvin: self.per_k,
            u: self.standard_uncertainty_per_k,
        })
    }
}
