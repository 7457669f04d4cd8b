//! The thermal errors of three axes, as they were found together with their other errors.

use compensator::volumetric::Axis;
use compensator::volumetric::identify::{
    BendPlan, ExpansionPlan, IdentifiedBend, IdentifiedExpansion,
};
use compensator::volumetric::model::ErrorName;
use serde::{Deserialize, Serialize};
use units::Metres;

use crate::store::StoreError;

/// Letters of the axes in files.
pub(crate) const AXES: [char; 3] = ['x', 'y', 'z'];

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
    /// Whether it was found from sideways readings too, not from tilts alone.
    #[serde(default)]
    pub sideways: bool,
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

/// What a calibration did not find of what there is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnknownRecord {
    /// Guides that bend by the configuration: axis and direction of the bow. They are not corrected,
    /// and no uncertainty counts them.
    pub bends: Vec<[char; 2]>,
    /// Error functions that are taken as zero, because they move nothing with the tools given.
    pub without_effect: Vec<String>,
}

impl UnknownRecord {
    /// These guides and errors.
    pub fn of(bends: &[BendPlan], without_effect: &[ErrorName]) -> Self {
        let bend = |it: &BendPlan| [letter(it.axis), letter(it.towards)];
        Self {
            bends: bends.iter().map(bend).collect(),
            without_effect: without_effect.iter().map(ToString::to_string).collect(),
        }
    }

    /// Behind a summary; nothing when all is known.
    pub(crate) fn summary(&self) -> String {
        let bends = self.bends.iter().map(|[axis, _]| axis.to_string());
        let bends: Vec<String> = bends.collect();
        let mut text = String::new();
        if !bends.is_empty() {
            text += &format!(", bending of {} unknown", bends.join(", "));
        }
        if !self.without_effect.is_empty() {
            text += &format!(", {} taken as zero", self.without_effect.join(", "));
        }
        text
    }
}

fn letter(axis: Axis) -> char {
    AXES[axis.index()]
}

fn axis_of(letter: char, id: &str) -> Result<Axis, StoreError> {
    Axis::of_letter(letter).ok_or_else(|| super::no_error(id, &letter.to_string()))
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
            sideways: plan.sideways,
        }
    }

    pub(crate) fn found(&self, id: &str) -> Result<IdentifiedBend, StoreError> {
        Ok(IdentifiedBend {
            plan: BendPlan {
                axis: axis_of(self.axis, id)?,
                towards: axis_of(self.towards, id)?,
                over: self.over,
                under: self.under,
                low: Metres(self.low_m),
                high: Metres(self.high_m),
                sideways: self.sideways,
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

    pub(crate) fn found(&self, id: &str) -> Result<IdentifiedExpansion, StoreError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn bend(sideways: bool) -> IdentifiedBend {
        IdentifiedBend {
            plan: BendPlan {
                axis: Axis::X,
                towards: Axis::Z,
                over: 0,
                under: Some(1),
                low: Metres(0.0),
                high: Metres(0.5),
                sideways,
                seen_from: None,
            },
            bow: Metres::from_um(4.0),
            u: Metres::from_um(0.1),
        }
    }

    #[test]
    fn a_bend_comes_back_as_it_was_planned_also_from_earlier_files() {
        for sideways in [false, true] {
            let record = BendRecord::of(&bend(sideways));
            let text = serde_json::to_string(&record).unwrap();
            let read: BendRecord = serde_json::from_str(&text).unwrap();
            assert_eq!(read.found("id").unwrap(), bend(sideways));
            let earlier = text.replace(&format!(",\"sideways\":{sideways}"), "");
            assert_ne!(earlier, text);
            let read: BendRecord = serde_json::from_str(&earlier).unwrap();
            assert_eq!(read.found("id").unwrap(), bend(false));
        }
    }

    #[test]
    fn what_nobody_knows_is_named() {
        let roll = ErrorName::About(Axis::Z, Axis::Z);
        let unknown = UnknownRecord::of(&[bend(false).plan], &[roll]);
        assert_eq!(unknown.bends, [['x', 'z']]);
        let text = unknown.summary();
        assert!(text.contains("bending of x unknown"), "{text}");
        assert!(text.contains("e_cz taken as zero"), "{text}");
        assert_eq!(UnknownRecord::default().summary(), "");
    }
}
