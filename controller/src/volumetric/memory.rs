//! State memories: displacements and rolls that are to be kept although they deviate (system S4).
//!
//! The first memory keeps what a machine was built with, the second what the first part is made
//! with beyond that, so that all later parts are made alike. Both can be recorded at stops along
//! each axis, before any part: what the detectors see then beyond their references is kept from
//! the next part on. The second is otherwise recorded while a first part is made (`first_part`).

use compensator::volumetric::Axis;
use compensator::volumetric::function::{Function, FunctionError, Shape};
use compensator::volumetric::online::{Coverage, Displacement, StateMap};
use units::{Metres, Radians};

use crate::failure::Failure;
use crate::run::{settle, utc_now};
use crate::store::{CalibrationRecord, RecordHead, Store};
use crate::volumetric::correction::{bends, lever};
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::inputs::slide_of;
use crate::volumetric::reference::References;
use crate::volumetric::{AXES, MemoryName, StateMemoryContent};
use crate::volumetric::{BeamConfig, VolumetricConfig};
use crate::volumetric::{
    REFERENCES, VolumetricFailure, VolumetricRecords, VolumetricState, memory_pointer,
};

/// A state that was recorded, stored and activated.
#[derive(Clone, Debug)]
pub struct Remembered {
    /// The name of the record.
    pub id: String,
    /// What is kept from now on.
    pub map: StateMap,
    /// Which part of each axis was met; beyond, its ends hold.
    pub covers: Coverage,
    /// A second memory in use that counts beyond another first one: nothing is corrected until it
    /// is recorded again or cleared.
    pub foreign: Option<String>,
}

impl WorkVolume<'_> {
    /// Records the present state along each watched axis as `memory`, stores and activates it: what
    /// is made from now on is made with it.
    ///
    /// The second memory keeps what is there beyond the first. Nothing is corrected meanwhile, so
    /// this is not the state of a part that was made corrected before.
    ///
    /// # Errors
    /// When there are no references, a detector is in trouble, or anything stops the machine.
    pub fn record_memory(
        &mut self,
        store: &Store,
        memory: MemoryName,
    ) -> Result<Remembered, Failure> {
        let (state, records) = self.state_beneath(store, memory)?;
        let now = self.take_references()?;
        let config = self.config.clone();
        let (mut map, mut covers) = (StateMap::default(), Coverage::default());
        for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
            let Some(beam) = beam else {
                continue;
            };
            let Some((nodes, states)) = present(&config, &state, &now, axis, beam)? else {
                continue;
            };
            let beyond = nodes.iter().zip(states);
            let beyond: Vec<_> = beyond
                .map(|(at, it)| state.memories.beyond_first(axis, *at, it))
                .collect();
            let functions = functions(&nodes, &beyond).map_err(VolumetricFailure::from)?;
            map.of[axis.index()] = Some(functions);
            covers[axis.index()] = nodes.first().copied().zip(nodes.last().copied());
        }
        map.roll = present_rolls(&config, &state, &now)?;
        self.keep_memory(store, memory, &records, (map, covers), "memory record")
    }

    /// Whether [`Self::record_memory`] has what it needs, before anything moves.
    ///
    /// # Errors
    /// When there are no references.
    pub fn check_memory(&self, store: &Store, memory: MemoryName) -> Result<(), Failure> {
        self.state_beneath(store, memory).map(|_| ())
    }

    /// What is in use beneath `memory`, for whoever records it: what is recorded again need not
    /// belong to what is in use now.
    ///
    /// # Errors
    /// When there are no references to count from.
    pub(super) fn state_beneath(
        &self,
        store: &Store,
        memory: MemoryName,
    ) -> Result<(VolumetricState, VolumetricRecords), Failure> {
        let needed: &[MemoryName] = match memory {
            MemoryName::First => &[],
            MemoryName::Second => &[MemoryName::First],
        };
        let stored = self.state_with(store, needed)?;
        let (state, records) = stored.ok_or(VolumetricFailure::NoGeometry)?;
        let config = self.config;
        let section = "beam";
        let mut watched = Axis::ALL
            .into_iter()
            .zip(config.beam.each())
            .filter(|it| it.1.is_some())
            .map(|it| it.0)
            .peekable();
        if watched.peek().is_none() {
            return Err(VolumetricFailure::NotConfigured { section }.into());
        }
        match watched.find(|it| state.beams[it.index()].is_none()) {
            Some(axis) => Err(VolumetricFailure::NoReference { axis }.into()),
            None => Ok((state, records)),
        }
    }

    /// Stores and activates what was recorded with `records` in use.
    pub(super) fn keep_memory(
        &mut self,
        store: &Store,
        memory: MemoryName,
        records: &VolumetricRecords,
        (map, covers): (StateMap, Coverage),
        source: &str,
    ) -> Result<Remembered, Failure> {
        let references = records.references.as_deref().unwrap_or_default();
        let content = StateMemoryContent {
            first: match memory {
                MemoryName::First => None,
                MemoryName::Second => records.first_memory.clone(),
            },
            ..StateMemoryContent::new(memory, references, &map)
        };
        let head = RecordHead {
            created: utc_now(),
            source: source.to_owned(),
            ..self.this_volume(memory_pointer(memory))?
        };
        let id = store.save(&CalibrationRecord { head, content })?;
        // What is used was stored before.
        settle(&mut self.core, store)?;
        store.activate(memory_pointer(memory), &id)?;
        settle(&mut self.core, store)?;
        let foreign = foreign_second(store)?;
        Ok(Remembered {
            id,
            map,
            covers,
            foreign,
        })
    }

    /// Keeps nothing by `memory` any more; the record stays. Returns its name, and a second memory
    /// in use that counts beyond it.
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn clear_memory(
        &self,
        store: &Store,
        memory: MemoryName,
    ) -> Result<(Option<String>, Option<String>), Failure> {
        let before = store.put_out_of_use(memory_pointer(memory))?;
        Ok((before, foreign_second(store)?))
    }

    /// Whether references are in use.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub fn has_references(&self, store: &Store) -> Result<bool, Failure> {
        Ok(store.active(REFERENCES)?.current.is_some())
    }
}

/// The second memory in use, when it counts beyond another first memory than is in use.
pub(super) fn foreign_second(store: &Store) -> Result<Option<String>, Failure> {
    let current = |memory| store.active(memory_pointer(memory)).map(|it| it.current);
    let Some(second) = current(MemoryName::Second)? else {
        return Ok(None);
    };
    let record = store.load::<StateMemoryContent>(&second)?;
    let is_own = record.content.first == current(MemoryName::First)?;
    Ok((!is_own).then_some(second))
}

/// Places along an axis, and what was displaced there.
type Stops = (Vec<Metres>, Vec<Displacement>);

/// The stops along `axis` and the displacements there, of what was read `now`; `None` where there
/// are none to count from.
fn present(
    config: &VolumetricConfig,
    state: &VolumetricState,
    now: &References,
    axis: Axis,
    beam: &BeamConfig,
) -> Result<Option<Stops>, Failure> {
    let section = "beam";
    let drift = crate::volumetric::settings::beam_drift(beam);
    let drift = drift.ok_or(VolumetricFailure::NotConfigured { section })?;
    let seen = now.content.beam("the present state", axis, drift)?;
    let letter = AXES[axis.index()];
    let record = now.content.beams.iter().find(|it| it.axis == letter);
    let reference = state.beams[axis.index()].as_ref();
    let (Some(seen), Some(record), Some(reference)) = (seen, record, reference) else {
        return Ok(None);
    };
    let [x, y, z] = now.content.rolls("the present state", config)?;
    let roll_now = match axis {
        Axis::X => x,
        Axis::Y => y,
        Axis::Z => z,
    };
    let rolls = roll_now.zip(state.rolls[axis.index()].as_ref());
    let roll = |at: Metres| {
        let beyond = rolls.as_ref().map(|(now, then)| now.at(at) - then.at(at));
        beyond.unwrap_or(Radians(0.0))
    };
    let lever = lever(
        axis,
        slide_of(beam)?,
        &bends(config, state)?,
        &state.temperatures,
    );
    let shift = reference.beam_shift(seen.end());
    let displacement = |at: &Metres| {
        let whole = reference.displacement(*at, seen.slider(*at), shift);
        let tilts = lever.seen(*at, roll(*at), &now.temperatures);
        [whole[0] - tilts[0], whole[1] - tilts[1]]
    };
    let nodes = record.slider[0].positions_m.iter().copied().map(Metres);
    let nodes: Vec<Metres> = nodes.collect();
    let displacements = nodes.iter().map(displacement).collect();
    Ok(Some((nodes, displacements)))
}

/// The rolls beyond their references and beyond what the first memory keeps, of each slide whose roll is read.
fn present_rolls(
    config: &VolumetricConfig,
    state: &VolumetricState,
    now: &References,
) -> Result<[Option<Function<Radians>>; 3], Failure> {
    let mut rolls = now.content.rolls("the present state", config)?;
    for (axis, roll) in Axis::ALL.into_iter().zip(&mut rolls) {
        let Some(seen) = roll else {
            continue;
        };
        let reference = state.rolls[axis.index()].as_ref();
        let reference = reference.ok_or(VolumetricFailure::NoRollReference)?;
        let nodes: Vec<Metres> = seen.nodes().collect();
        let beyond = nodes.iter().map(|at| {
            let left = seen.at(*at) - reference.at(*at);
            state.memories.roll_beyond_first(axis, *at, left)
        });
        let beyond: Vec<Radians> = beyond.collect();
        let beyond = Function::new(&nodes, &beyond, Shape::Spline);
        *roll = Some(beyond.map_err(VolumetricFailure::from)?);
    }
    Ok(rolls)
}

fn functions(
    nodes: &[Metres],
    states: &[Displacement],
) -> Result<[Function<Metres>; 2], FunctionError> {
    let function = |k: usize| {
        let values: Vec<Metres> = states.iter().map(|it| it[k]).collect();
        Function::new(nodes, &values, Shape::Spline)
    };
    Ok([function(0)?, function(1)?])
}
