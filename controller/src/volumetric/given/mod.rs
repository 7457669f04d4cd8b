//! References of the detectors that are given beforehand, from a file: nothing is read, and nothing moves.
//!
//! They are what each detector reads along its axis where the machine is as its tables say, by design or by a
//! measurement made elsewhere. They are stored as `reference` stores what it has read, and count from the errors
//! in use like those. How sure they are nobody says: it is in no uncertainty that is stated.
//!
//! Source: CN1214003A, the references y_br and z_br, set and stored beforehand as a table or a function of x_c.
//!
//! | file | what |
//! |---|---|
//! | `load` | a table (`.csv`) or functions (`.toml`), as references |
//! | `config` | the keys of a file of functions |
//! | `judge` | whether this machine can have them |

mod config;
mod judge;
mod load;
#[cfg(test)]
mod tests;

use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::{Axis, GivenReference, ReferenceOf};
use units::{Metres, Quantity, Radians};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::store::{CalibrationRecord, RecordHead, Store};
use crate::volumetric::reference::measured_geometry;
use crate::volumetric::settings::drift_record;
use crate::volumetric::{
    AXES, BeamConfig, BeamRecord, BeamReferencesContent, FunctionRecord, MemoryName, REFERENCES,
    StateMemoryContent, VolumetricFailure, memory_pointer,
};

#[cfg(test)]
pub(crate) use config::ReferenceFunctionsConfig;

/// References that were given, stored and activated.
#[derive(Clone, Debug)]
pub(crate) struct GivenReferences {
    /// The name of the record.
    pub(crate) id: String,
    /// What is in it.
    pub(crate) content: BeamReferencesContent,
    /// Those that were in use before, for the same errors.
    pub(crate) before: Option<BeamReferencesContent>,
    /// Memories in use that count from other references: nothing is corrected until they are recorded again or
    /// cleared.
    pub(crate) foreign: Vec<(MemoryName, String)>,
}

/// Stores what `text`, the file called `name`, gives and activates it.
///
/// # Errors
/// When the errors of the machine were never measured, or the file does not give references that this machine can
/// have: with file and line. What was in use stays in use then.
pub(crate) fn import(
    machine: &MachineConfig,
    store: &Store,
    head: RecordHead,
    file: (&str, &str),
) -> Result<GivenReferences, Failure> {
    let config = machine.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
    let geometry = measured_geometry(store)?;
    let (given, how) = load::load(machine, config, file)?;
    let mut content = BeamReferencesContent {
        geometry,
        given: Some(how),
        ..BeamReferencesContent::default()
    };
    for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
        if let Some(beam) = beam {
            content.beams.push(record(axis, beam, &given)?);
        }
    }
    let mut rolls = Vec::new();
    for it in given.iter().filter(|it| it.of == ReferenceOf::Roll) {
        rolls.push((it.axis, function::<Radians>("roll", it)?));
    }
    content.set_rolls(rolls);
    let before = in_use(store, &content.geometry)?;
    let id = store.save(&CalibrationRecord {
        head,
        content: content.clone(),
    })?;
    store.activate(REFERENCES, &id)?;
    Ok(GivenReferences {
        foreign: foreign_memories(store, &id)?,
        id,
        content,
        before,
    })
}

/// The references of a beam, all of which are there.
fn record(
    axis: Axis,
    beam: &BeamConfig,
    given: &[GivenReference],
) -> Result<BeamRecord, VolumetricFailure> {
    let none = VolumetricFailure::NoReference { axis };
    let of = |of: ReferenceOf| given.iter().find(|it| (it.axis, it.of) == (axis, of));
    let [first, second] = axis.others();
    let slider = (
        of(ReferenceOf::Slide(first)),
        of(ReferenceOf::Slide(second)),
    );
    let (Some(along_first), Some(along_second)) = slider else {
        return Err(none);
    };
    let end = |along: Axis| {
        let it = of(ReferenceOf::End(along));
        it.and_then(|it| it.values.first().copied())
    };
    Ok(BeamRecord {
        axis: AXES[axis.index()],
        slider: [
            function::<Metres>("first", along_first)?,
            function::<Metres>("second", along_second)?,
        ],
        end_m: match (beam.at_the_end(), end(first), end(second)) {
            (None, ..) => None,
            (Some(_), Some(first), Some(second)) => Some([first, second]),
            (Some(_), ..) => return Err(none),
        },
        drift: drift_record(beam),
        wandered_m: None,
    })
}

fn function<Q: Quantity>(
    name: &str,
    it: &GivenReference,
) -> Result<FunctionRecord, VolumetricFailure> {
    let values: Vec<Q> = it.values.iter().copied().map(Q::from_value).collect();
    let function = Function::new(&it.positions, &values, Shape::Spline)?;
    Ok(FunctionRecord::of(name, &function))
}

/// The references in use, where they count from the same errors.
fn in_use(store: &Store, geometry: &str) -> Result<Option<BeamReferencesContent>, Failure> {
    let Some(id) = store.active(REFERENCES)?.current else {
        return Ok(None);
    };
    let content = store.load::<BeamReferencesContent>(&id)?.content;
    Ok((content.geometry == geometry).then_some(content))
}

/// Memories in use that count from others than the references called `id`.
fn foreign_memories(store: &Store, id: &str) -> Result<Vec<(MemoryName, String)>, Failure> {
    let mut foreign = Vec::new();
    for which in [MemoryName::First, MemoryName::Second] {
        let Some(memory) = store.active(memory_pointer(which))?.current else {
            continue;
        };
        let content = store.load::<StateMemoryContent>(&memory)?.content;
        if content.references != id {
            foreign.push((which, memory));
        }
    }
    Ok(foreign)
}
