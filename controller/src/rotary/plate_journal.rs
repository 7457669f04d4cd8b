//! The journal of a plate, and what stands in it.

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::rotary::placed::Placed;
use crate::rotary::subject::Subject;
use crate::rotary::{PlacementEntry, PlateEntry, PlateLog, PlatePlanEntry};
use crate::run::note_failure;
use crate::store::{
    Journal, JournalHeader, Log, Store, StoreError, first_difference, not_resumable,
};

/// A journal that is being written, with what it says so far: what a person reads goes on from there.
pub(crate) struct PlateJournal {
    journal: Journal<PlateLog>,
    plan: PlatePlanEntry,
    log: PlateLog,
}

impl PlateJournal {
    /// A new journal, or one that is continued.
    pub(super) fn open(
        store: &Store,
        header: &JournalHeader,
        plan: &PlatePlanEntry,
        resume: Option<&PathBuf>,
        subject: &Subject<'_>,
    ) -> Result<Self, Failure> {
        let (journal, log) = match resume {
            None => (store.create_journal(header)?, PlateLog::default()),
            Some(path) => continued(store, path, header, plan, subject)?,
        };
        let is_planned = log.plan.is_some();
        let mut it = Self {
            journal,
            plan: plan.clone(),
            log,
        };
        // Killed before its second line: nothing was read yet.
        if !is_planned {
            it.write(PlateEntry::PlatePlan(plan.clone()))?;
            it.flush_to_disk()?;
        }
        Ok(it)
    }

    /// What stands in it.
    pub(super) const fn so_far(&self) -> &PlateLog {
        &self.log
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        self.journal.path()
    }

    /// The placements that were read whole.
    pub(super) fn placed(&self) -> Vec<Placed> {
        let placements = self.log.placements.iter();
        placements
            .map(|it| Placed::in_plan(it, &self.log.sweeps, &self.plan))
            .collect()
    }

    /// A placement that a person has read whole.
    pub(super) fn close(&mut self, placement: PlacementEntry) -> Result<Placed, Failure> {
        self.write(PlateEntry::Placed(placement))?;
        self.flush_to_disk()?;
        Ok(Placed::in_plan(&placement, &self.log.sweeps, &self.plan))
    }

    pub(super) fn write(&mut self, entry: PlateEntry) -> Result<(), StoreError> {
        self.journal.write(&entry)?;
        self.log.take(entry);
        Ok(())
    }

    pub(super) fn flush_to_disk(&mut self) -> Result<(), StoreError> {
        self.journal.flush_to_disk()
    }

    /// Says why the run failed.
    pub(super) fn note(&mut self, failure: &Failure) {
        note_failure(&mut self.journal, failure);
    }

    pub(super) fn complete(&mut self) -> Result<(), StoreError> {
        self.journal.complete()
    }
}

fn continued(
    store: &Store,
    path: &Path,
    header: &JournalHeader,
    plan: &PlatePlanEntry,
    subject: &Subject<'_>,
) -> Result<(Journal<PlateLog>, PlateLog), Failure> {
    let mut header = header.clone();
    if plan.sighted.is_some() {
        // Some of it may be read with the machine, and some without.
        let before = store.read_journal::<PlateLog>(path)?.header.drive;
        header.drive = subject.drive_beside(&before);
    }
    let (journal, read) = store.resume_journal::<PlateLog>(path, &header, subject.hash)?;
    if let Some(before) = &read.log.plan
        && let Some(it) = first_difference(before, plan)
    {
        return Err(not_resumable(path, "how the plate is read", it).into());
    }
    Ok((journal, read.log))
}
