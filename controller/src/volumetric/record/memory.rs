//! States that are to be kept: displacements and rolls of the slides.

use compensator::volumetric::online::StateMap;
use serde::{Deserialize, Serialize};

use super::{AXES, FunctionRecord, RollRecord, no_error};
use crate::store::{StoreError, short};

/// Which memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MemoryName {
    /// What the machine was built with.
    #[default]
    First,
    /// What the first part was made with.
    Second,
}

impl MemoryName {
    /// As it is called on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
        }
    }
}

/// Displacements of one axis that are to be kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemoryRecord {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// First and second direction.
    pub functions: [FunctionRecord; 2],
}

/// Displacements that are to be kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateMemoryContent {
    /// Which memory.
    pub memory: MemoryName,
    /// The name of the references from which the displacements count.
    pub references: String,
    /// Of a second memory: the name of the first beyond which it counts; `None` where there was
    /// none in use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<String>,
    /// By axis.
    pub axes: Vec<MemoryRecord>,
    /// Likewise the rolls; none in files of earlier programs, which corrected every roll.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rolls: Vec<RollRecord>,
}

impl StateMemoryContent {
    /// The name of this kind.
    pub const KIND: &'static str = "state_memory";

    /// What `map` keeps, counted from the references of the name `references`, and from no first
    /// memory.
    pub fn new(memory: MemoryName, references: &str, map: &StateMap) -> Self {
        let axes = AXES.iter().zip(&map.of).filter_map(|(axis, functions)| {
            let [first, second] = functions.as_ref()?;
            Some(MemoryRecord {
                axis: *axis,
                functions: [
                    FunctionRecord::of("first", first),
                    FunctionRecord::of("second", second),
                ],
            })
        });
        let rolls = AXES.iter().zip(&map.roll).filter_map(|(axis, roll)| {
            Some(RollRecord {
                axis: *axis,
                roll: FunctionRecord::of("roll", roll.as_ref()?),
            })
        });
        Self {
            memory,
            references: references.to_owned(),
            first: None,
            axes: axes.collect(),
            rolls: rolls.collect(),
        }
    }

    /// The displacements and rolls, in the record `id`.
    ///
    /// # Errors
    /// When an axis is none or is there twice, or nodes form no function.
    pub fn map(&self, id: &str) -> Result<StateMap, StoreError> {
        let mut map = StateMap::default();
        for record in &self.axes {
            let [first, second] = &record.functions;
            let functions = [first.function(id)?, second.function(id)?];
            let place = AXES.iter().position(|it| *it == record.axis);
            let place = place.filter(|at| map.of[*at].is_none());
            let place = place.ok_or_else(|| no_error(id, &record.axis.to_string()))?;
            map.of[place] = Some(functions);
        }
        for record in &self.rolls {
            let place = AXES.iter().position(|it| *it == record.axis);
            let place = place.filter(|at| map.roll[*at].is_none());
            let place = place.ok_or_else(|| no_error(id, &format!("roll of {}", record.axis)))?;
            map.roll[place] = Some(record.roll.function(id)?);
        }
        Ok(map)
    }

    /// One line about it, for lists.
    pub(crate) fn summary(&self) -> String {
        let axes: String = self.axes.iter().map(|it| it.axis).collect();
        let rolls: String = self.rolls.iter().map(|it| it.axis).collect();
        let rolls = match rolls.is_empty() {
            true => rolls,
            false => format!(" and the roll of {rolls}"),
        };
        let beyond = self.first.as_deref().map(short);
        let beyond = beyond.map_or_else(String::new, |it| format!(", beyond the first {it}"));
        format!("{} memory of {axes}{rolls}{beyond}", self.memory.name())
    }
}
