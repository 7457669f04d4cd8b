//! What goes with a calibration of three axes that is chosen.
//!
//! References count from the errors that the machine had when they were taken, and memories from references. Errors
//! bring their own references; a memory that does not count from what is used then goes out of use, unless there is
//! another one that does. So what is chosen is one thing, and can be gone back to as one.

use machine::records::{Content, Store};

use crate::connected::Machine;
use crate::failure::Failure;
use crate::runs::{Change, write};
use crate::volumetric::state::{VolumetricRecords, check_memory, check_references, used};
use crate::volumetric::{
    BeamReferencesContent, GEOMETRY, MemoryName, REFERENCES, StateMemoryContent,
    VolumetricCorrection, VolumetricFailure, memory_pointer,
};

/// What the store calls what is kept of three axes together.
pub(super) fn pointers() -> Vec<String> {
    let memories = [MemoryName::First, MemoryName::Second].map(memory_pointer);
    let all = [GEOMETRY, REFERENCES].into_iter().chain(memories);
    all.map(str::to_owned).collect()
}

/// `chosen`, and what else is used otherwise because of it.
///
/// # Errors
/// What is chosen does not count from what is in use.
pub(super) fn with_companions(store: &Store, chosen: Vec<Change>) -> Result<Vec<Change>, Failure> {
    let mut after = After {
        store,
        changes: chosen.clone(),
    };
    let geometry = after.used(GEOMETRY)?.ok_or(VolumetricFailure::NoGeometry)?;
    if chosen.iter().any(|it| it.pointer == GEOMETRY) {
        let belongs = |it: &BeamReferencesContent| it.geometry == geometry;
        after.settle::<BeamReferencesContent>(REFERENCES, &belongs)?;
    }
    let mut records = VolumetricRecords {
        references: after.used(REFERENCES)?,
        geometry,
        ..VolumetricRecords::default()
    };
    for memory in [MemoryName::First, MemoryName::Second] {
        let pointer = memory_pointer(memory);
        // What nobody keeps is not kept again by itself, and what was chosen is checked.
        let is_chosen = chosen.iter().any(|it| it.pointer == pointer);
        if !is_chosen && after.used(pointer)?.is_some() {
            let belongs = |it: &StateMemoryContent| check_memory("", it, &records).is_ok();
            after.settle::<StateMemoryContent>(pointer, &belongs)?;
        }
        if memory == MemoryName::First {
            records.first_memory = after.used(pointer)?;
        }
    }
    check(store, &chosen, &records)?;
    Ok(after.changes)
}

/// Uses `geometry` from now on, and what counts from it.
///
/// # Errors
/// When something cannot be read or written.
pub(super) fn use_geometry(store: &Store, geometry: &str) -> Result<(), Failure> {
    let chosen = Change {
        pointer: GEOMETRY.to_owned(),
        id: Some(geometry.to_owned()),
        is_earlier: false,
    };
    let changes = with_companions(store, vec![chosen])?;
    Ok(write(store, &changes)?)
}

/// Uses nothing that counts from errors any more: there are none.
///
/// # Errors
/// When something cannot be read or written.
pub(super) fn use_nothing(store: &Store) -> Result<(), Failure> {
    let mut changes = Vec::new();
    for pointer in pointers() {
        if store.active(&pointer)?.current.is_some() {
            changes.push(Change::to_nothing(&pointer));
        }
    }
    Ok(write(store, &changes)?)
}

/// That what was chosen itself counts from what is used then.
fn check(store: &Store, chosen: &[Change], records: &VolumetricRecords) -> Result<(), Failure> {
    for Change { pointer, id, .. } in chosen {
        let Some(id) = id.as_deref().filter(|_| pointer != GEOMETRY) else {
            continue;
        };
        if pointer == REFERENCES {
            let own = store.load::<BeamReferencesContent>(id)?.content;
            check_references((id, &own), &records.geometry)?;
        } else {
            let own = store.load::<StateMemoryContent>(id)?.content;
            check_memory(id, &own, records)?;
        }
    }
    Ok(())
}

/// What is used after some changes.
struct After<'s> {
    store: &'s Store,
    changes: Vec<Change>,
}

impl After<'_> {
    fn used(&self, pointer: &str) -> Result<Option<String>, Failure> {
        Ok(used(self.store, &self.changes, pointer)?)
    }

    /// Uses what belongs under `pointer`: what is in use where that does, else what was in use last, else the newest;
    /// nothing where none does.
    fn settle<C: Content>(
        &mut self,
        pointer: &str,
        belongs: &dyn Fn(&C) -> bool,
    ) -> Result<(), Failure> {
        let store = self.store;
        let fits = |id: &String| {
            let record = store.load::<C>(id);
            record.is_ok_and(|it| it.head.axis == pointer && belongs(&it.content))
        };
        let in_use = store.active(pointer)?;
        if in_use.current.as_ref().is_some_and(fits) {
            return Ok(());
        }
        let before = in_use.history.iter().rev().find(|id| fits(id)).cloned();
        let found = match before {
            Some(id) => Some(id),
            None => self.newest(&fits)?,
        };
        match found {
            Some(id) => self.changes.push(Change::to(store, pointer, id)?),
            None if in_use.current.is_some() => self.changes.push(Change::to_nothing(pointer)),
            None => {}
        }
        Ok(())
    }

    /// The one that was made last of those that fit.
    fn newest(&self, fits: &dyn Fn(&String) -> bool) -> Result<Option<String>, Failure> {
        let all = self.store.list()?.into_iter().filter(|id| fits(id));
        let made = |id: &String| self.store.glance(id).map(|it| it.head.created).ok();
        Ok(all.max_by_key(made))
    }
}

/// Whether this machine can be corrected by what is used after `changes`.
///
/// # Errors
/// Why not.
pub(super) fn usable(
    machine: &mut Machine,
    store: &Store,
    changes: &[Change],
) -> Result<(), Failure> {
    let volume = machine.volumetric()?;
    if let Some((state, _)) = volume.state_after(store, changes)? {
        VolumetricCorrection::new(volume.core.config, state)?;
    }
    Ok(())
}
