//! What is stored of three axes, put together for the correction.
//!
//! Three kinds of records, each with its own pointer in the store: the errors, what the detectors
//! read when the machine was as these errors say, and displacements that are to be kept. Each
//! names the one it counts from; what does not belong together is refused.

use compensator::volumetric::Axis;
use compensator::volumetric::online::{BeamReference, Memories};

use crate::config::ConfigHash;
use crate::failure::Failure;
use crate::runs::Change;
use crate::store::{Content, IdentityRecord, RecordHead, Store, StoreError, short};
use crate::volumetric::VolumetricConfig;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::settings::beam_drift;
use crate::volumetric::{BeamReferencesContent, GeometryContent, MemoryName, StateMemoryContent};
use crate::volumetric::{VolumetricFailure, VolumetricState};

/// What the errors of three axes are called where an axis is named.
pub(crate) const GEOMETRY: &str = "volume";
/// Likewise what their detectors read.
pub(crate) const REFERENCES: &str = "volume-references";

/// Likewise the displacements that are kept.
pub(crate) const fn memory_pointer(memory: MemoryName) -> &'static str {
    match memory {
        MemoryName::First => "volume-first-memory",
        MemoryName::Second => "volume-second-memory",
    }
}

/// The names of the records that a state was made of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VolumetricRecords {
    /// The errors.
    pub geometry: String,
    /// What the detectors read.
    pub references: Option<String>,
    /// What the machine was built with.
    pub first_memory: Option<String>,
    /// What the first part was made with.
    pub second_memory: Option<String>,
}

/// What is used under `pointer` after `changes`.
pub(super) fn used(
    store: &Store,
    changes: &[Change],
    pointer: &str,
) -> Result<Option<String>, StoreError> {
    match changes.iter().find(|it| it.pointer == pointer) {
        Some(change) => Ok(change.id.clone()),
        None => Ok(store.active(pointer)?.current),
    }
}

/// Reads records of one machine, and refuses those of others.
struct Reader<'a> {
    store: &'a Store,
    here: RecordHead,
    hash: &'a ConfigHash,
    /// What is read in place of what is in use.
    changes: &'a [Change],
}

impl Reader<'_> {
    /// The record that is in use under `pointer`, with its name.
    fn active<C: Content>(&self, pointer: &str) -> Result<Option<(String, C)>, StoreError> {
        let Some(id) = used(self.store, self.changes, pointer)? else {
            return Ok(None);
        };
        let record = self.store.load::<C>(&id)?;
        let here = RecordHead {
            axis: pointer.to_owned(),
            ..self.here.clone()
        };
        record.head.belongs_to(&id, &here, self.hash)?;
        Ok(Some((id, record.content)))
    }
}

impl WorkVolume<'_> {
    /// What `store` says is in use for these three axes, with the names of the records; `None`
    /// when their errors were never measured. What is not measured with the errors in use is no
    /// part of it and refused.
    ///
    /// # Errors
    /// When a record is damaged, belongs to another machine, configuration, drive or calibration,
    /// or holds no functions.
    pub fn state(
        &self,
        store: &Store,
    ) -> Result<Option<(VolumetricState, VolumetricRecords)>, Failure> {
        self.state_with(store, &[MemoryName::First, MemoryName::Second])
    }

    /// What it will be after these `changes`.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub(super) fn state_after(
        &self,
        store: &Store,
        changes: &[Change],
    ) -> Result<Option<(VolumetricState, VolumetricRecords)>, Failure> {
        self.state_of((store, changes), &[MemoryName::First, MemoryName::Second])
    }

    /// Likewise, with no other memories than `wanted`, the first before the second.
    pub(super) fn state_with(
        &self,
        store: &Store,
        wanted: &[MemoryName],
    ) -> Result<Option<(VolumetricState, VolumetricRecords)>, Failure> {
        self.state_of((store, &[]), wanted)
    }

    fn state_of(
        &self,
        (store, changes): (&Store, &[Change]),
        wanted: &[MemoryName],
    ) -> Result<Option<(VolumetricState, VolumetricRecords)>, Failure> {
        let config = self.config;
        let here = self.this_volume(GEOMETRY)?;
        let reader = Reader {
            store,
            here,
            hash: self.core.config_hash,
            changes,
        };
        let Some((id, geometry)) = reader.active::<GeometryContent>(GEOMETRY)? else {
            return Ok(None);
        };
        self.check_drives(&id, &geometry, config)?;
        check_thermometers(&geometry, config)?;
        let mut state = VolumetricState {
            axes: geometry.errors(&id)?,
            squareness: geometry.squareness(),
            covariance: geometry.covariance(&id)?,
            bends: geometry.bends(&id)?,
            expansions: geometry.expansions(&id)?,
            temperatures: geometry.temperatures(),
            ..VolumetricState::default()
        };
        let mut records = VolumetricRecords {
            geometry: id,
            ..VolumetricRecords::default()
        };
        if let Some((id, references)) = reader.active::<BeamReferencesContent>(REFERENCES)? {
            check_references((&id, &references), &records.geometry)?;
            state.beams = beams(&id, &references, config)?;
            state.rolls = references.rolls(&id, config)?;
            records.references = Some(id);
        }
        state.memories = memories(&reader, &mut records, wanted)?;
        Ok(Some((state, records)))
    }

    /// What a record of these three axes says of the machine it was made on.
    ///
    /// # Errors
    /// When there are no three axes.
    pub(super) fn this_volume(&self, pointer: &str) -> Result<RecordHead, VolumetricFailure> {
        let config = self.core.config.volumetric.as_ref();
        let [first, ..] = &config.ok_or(VolumetricFailure::None)?.axes;
        Ok(RecordHead {
            axis: pointer.to_owned(),
            ..self.core.this_machine(first)
        })
    }

    /// Who the drives of x, y and z are.
    pub(super) fn volume_drives(&self, config: &VolumetricConfig) -> Vec<IdentityRecord> {
        let each = config.axes.iter().map(|it| self.core.drive_record(it));
        each.collect()
    }

    fn check_drives(
        &self,
        id: &str,
        geometry: &GeometryContent,
        config: &VolumetricConfig,
    ) -> Result<(), StoreError> {
        let here = self.volume_drives(config);
        for (expected, seen) in geometry.drives.iter().zip(&here) {
            if expected.serial != seen.serial || expected.product != seen.product {
                let text = |it: &IdentityRecord| format!("{:#X} serial {}", it.product, it.serial);
                return Err(StoreError::Foreign {
                    id: short(id),
                    what: "a drive of the three axes",
                    expected: text(expected).into(),
                    seen: text(seen).into(),
                    instead: None,
                });
            }
        }
        Ok(())
    }
}

/// Before the detectors are: the correction would only say so much later.
fn check_thermometers(
    geometry: &GeometryContent,
    config: &VolumetricConfig,
) -> Result<(), VolumetricFailure> {
    let (seen, expected) = (geometry.temperatures_c.len(), config.temperature.len());
    if seen == expected {
        return Ok(());
    }
    Err(VolumetricFailure::Temperatures { seen, expected })
}

fn beams(
    id: &str,
    references: &BeamReferencesContent,
    config: &VolumetricConfig,
) -> Result<[Option<BeamReference>; 3], Failure> {
    let mut beams = [None, None, None];
    for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
        let Some(beam) = beam else {
            continue;
        };
        let section = "beam";
        let drift = beam_drift(beam).ok_or(VolumetricFailure::NotConfigured { section })?;
        beams[axis.index()] = references.beam(id, axis, drift)?;
    }
    Ok(beams)
}

fn memories(
    reader: &Reader<'_>,
    records: &mut VolumetricRecords,
    wanted: &[MemoryName],
) -> Result<Memories, Failure> {
    let mut memories = Memories::default();
    for memory in wanted {
        let pointer = memory_pointer(*memory);
        let Some((id, content)) = reader.active::<StateMemoryContent>(pointer)? else {
            continue;
        };
        check_memory(&id, &content, records)?;
        let map = Some(content.map(&id)?);
        match memory {
            MemoryName::First => (memories.first, records.first_memory) = (map, Some(id)),
            MemoryName::Second => (memories.second, records.second_memory) = (map, Some(id)),
        }
    }
    Ok(memories)
}

/// References count from the errors that the machine had when they were taken.
pub(super) fn check_references(
    (id, references): (&str, &BeamReferencesContent),
    geometry: &str,
) -> Result<(), VolumetricFailure> {
    if references.geometry == geometry {
        return Ok(());
    }
    Err(VolumetricFailure::OtherGeometry {
        references: short(id),
        measured_with: short(&references.geometry),
        geometry: short(geometry),
    })
}

/// What does not count from what is in use keeps something else than it should.
pub(super) fn check_memory(
    id: &str,
    content: &StateMemoryContent,
    records: &VolumetricRecords,
) -> Result<(), VolumetricFailure> {
    let name = |id: Option<&str>| id.map_or_else(|| "none".to_owned(), short);
    let references = records.references.as_deref();
    if Some(&*content.references) != references {
        return Err(VolumetricFailure::OtherReferences {
            which: content.memory.name(),
            memory: short(id),
            measured_with: short(&content.references),
            references: name(references),
        });
    }
    let first = records.first_memory.as_deref();
    if content.memory == MemoryName::Second && content.first.as_deref() != first {
        return Err(VolumetricFailure::OtherFirstMemory {
            memory: short(id),
            measured_with: name(content.first.as_deref()),
            first: name(first),
        });
    }
    Ok(())
}
