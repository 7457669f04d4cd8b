//! State memories: displacements that are to be kept although they deviate (system S4).
//!
//! What is recorded is what the detectors see now beyond their references, at stops along each
//! axis: the first memory keeps what a machine was built with, the second what the first part is
//! made with beyond that, so that all later parts are made alike.

use compensator::volumetric::Axis;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::online::{BeamReference, StateMap};
use units::Metres;

use super::{REFERENCES, VolumetricFailure, memory_pointer};
use crate::cycle::utc_now;
use crate::failure::Failure;
use crate::machine::Machine;
use crate::store::{CalibrationRecord, Content, MemoryName, RecordHead, StateMemoryContent, Store};

/// A state that was recorded, stored and activated.
#[derive(Clone, Debug)]
pub struct Remembered {
    /// The name of the record.
    pub id: String,
    /// What is kept from now on.
    pub map: StateMap,
}

impl Machine {
    /// Records the present state along each watched axis as `memory`, stores and activates it.
    ///
    /// The second memory keeps what is there beyond the first. It is taken while nothing is
    /// corrected by the detectors.
    ///
    /// # Errors
    /// When there are no references, a detector is in trouble, or anything stops the machine.
    pub fn record_memory(
        &mut self,
        store: &Store,
        memory: MemoryName,
    ) -> Result<Remembered, Failure> {
        let stored = self.volumetric_state(store)?;
        let (state, records) = stored.ok_or(VolumetricFailure::NoGeometry)?;
        let axis = Axis::ALL
            .into_iter()
            .find(|it| state.beams[it.index()].is_some());
        let (Some(references), Some(_)) = (records.references, axis) else {
            let axis = Axis::X;
            return Err(VolumetricFailure::NoReference { axis }.into());
        };
        let now = self.take_references()?.content;
        let config = self.volumetric_config()?.clone();
        let mut map = StateMap::default();
        for axis in Axis::ALL {
            let beam = config.beam.each()[axis.index()];
            let reference = state.beams[axis.index()].as_ref();
            let (Some(beam), Some(reference)) = (beam, reference) else {
                continue;
            };
            let section = "beam";
            let drift = crate::assemble::beam_drift(beam);
            let drift = drift.ok_or(VolumetricFailure::NotConfigured { section })?;
            let Some(seen) = now.beam("the present state", axis, drift)? else {
                continue;
            };
            let first = state.memories.first.as_ref();
            let kept = |position| match (memory, first) {
                (MemoryName::Second, Some(first)) => first.at(axis, position),
                (MemoryName::Second, None) | (MemoryName::First, _) => [Metres(0.0); 2],
            };
            let nodes = now.beams.iter().find(|it| it.axis == letter(axis));
            let nodes = nodes.map_or(&[][..], |it| &it.slider[0].positions_m);
            map.of[axis.index()] = Some(beyond(nodes, &seen, reference, kept)?);
        }
        let content = StateMemoryContent::new(memory, &references, &map);
        let head = RecordHead {
            created: utc_now(),
            source: "memory record".into(),
            ..self.this_volume(memory_pointer(memory))?
        };
        let content = Content::StateMemory(content);
        let id = store.save(&CalibrationRecord { head, content })?;
        store.activate(memory_pointer(memory), &id)?;
        Ok(Remembered { id, map })
    }

    /// Keeps nothing by `memory` any more; the record stays. Returns its name.
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn clear_memory(
        &self,
        store: &Store,
        memory: MemoryName,
    ) -> Result<Option<String>, Failure> {
        Ok(store.put_out_of_use(memory_pointer(memory))?)
    }

    /// Whether references are in use.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub fn has_references(&self, store: &Store) -> Result<bool, Failure> {
        Ok(store.active(REFERENCES)?.current.is_some())
    }
}

const fn letter(axis: Axis) -> char {
    match axis {
        Axis::X => 'x',
        Axis::Y => 'y',
        Axis::Z => 'z',
    }
}

/// What `seen` is beyond `reference` and what is kept already.
fn beyond(
    nodes: &[f64],
    seen: &BeamReference,
    reference: &BeamReference,
    kept: impl Fn(Metres) -> [Metres; 2],
) -> Result<[Function<Metres>; 2], VolumetricFailure> {
    let shift = reference.beam_shift(seen.end());
    let nodes: Vec<Metres> = nodes.iter().copied().map(Metres).collect();
    let state = |node: &Metres| {
        let now = reference.displacement(*node, seen.slider(*node), shift);
        let kept = kept(*node);
        [now[0] - kept[0], now[1] - kept[1]]
    };
    let states: Vec<[Metres; 2]> = nodes.iter().map(state).collect();
    let function = |k: usize| {
        let values: Vec<Metres> = states.iter().map(|it| it[k]).collect();
        Function::new(&nodes, &values, Shape::Spline)
    };
    Ok([function(0)?, function(1)?])
}
