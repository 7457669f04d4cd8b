//! Runs of the machine's thread: procedures between two ticks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use machine::ask_disk;
use machine::records::{AnyLog, read_journal};
use truestage::Failure;
use truestage::runs::Found;

use super::{Kept, called};
use crate::keeper::{RunTask, cause_of};
use crate::request::RunKind;

impl Kept {
    /// The newest journal that a run like `task` has left unfinished.
    fn newest_journal(&mut self, task: &RunTask) -> Result<Option<PathBuf>, Failure> {
        let (kind, group) = (task.request.kind, Arc::clone(&task.group));
        let found = ask_disk(&mut self.machine, &self.store, move |store| {
            store.interrupted_run(kind.stage().text(), group.journals())
        });
        Ok(found?.ok().flatten().map(|found| found.journal))
    }

    /// One run, from its begin to its end.
    pub(super) fn run(&mut self, id: &str) {
        let Some(task) = self.keeper.borrow_mut().begin_run(id) else {
            return;
        };
        let (before, result) = match self.newest_journal(&task) {
            Ok(before) => (before, self.perform(&task)),
            Err(failure) => (None, Err(failure)),
        };
        self.machine.leave_instrument();
        self.keeper.borrow_mut().end_procedure(id);
        let result = result.map_err(|failure| match self.leave(&task, before) {
            // What a machine says while the disk is waited for counts.
            Err(since) if since.stops_the_machine() => since,
            _ => failure,
        });
        match result {
            // The next tick ends the service.
            Err(_) if self.machine.stop_request().is_requested() => {}
            Ok(found) => {
                self.load_courses();
                self.settle(id, found);
            }
            Err(failure) if failure.is_stop() => {
                // What it found may be stored, and in use.
                self.load_courses();
                let mut keeper = self.keeper.borrow_mut();
                keeper.run_interrupted(&mut self.machine, id);
            }
            Err(failure) if failure.stops_the_machine() => self.failed(failure),
            Err(failure) => {
                // A verification that finds a calibration harmful takes it out of use.
                self.load_courses();
                let cause = cause_of(&failure);
                self.keeper.borrow_mut().run_failed(id, &cause);
            }
        }
    }

    /// What the run `id` found is shown, and the run ends as it was to end.
    fn settle(&mut self, id: &str, mut found: Found) {
        let mut keeper = self.keeper.borrow_mut();
        let is_ending = self.machine.stop_request().is_requested();
        match found.bad.take_if(|failure| failure.stops_the_machine()) {
            Some(failure) => {
                keeper.run_found(id, found);
                drop(keeper);
                if !is_ending {
                    self.failed(failure);
                }
            }
            None if !is_ending && found.bad.as_ref().is_some_and(Failure::is_stop) => {
                keeper.run_cut_short(&mut self.machine, id, found);
            }
            None => keeper.run_done(id, found),
        }
    }

    /// Where a run that ended early goes on, if it is one that can. `before` is the journal that was the newest when it
    /// began: that of an earlier run.
    fn leave(&mut self, task: &RunTask, before: Option<PathBuf>) -> Result<(), Failure> {
        let begun = match &task.resume {
            Some(journal) => {
                let own = journal.clone();
                let incomplete =
                    ask_disk(&mut self.machine, &self.store, move |_| is_incomplete(&own));
                incomplete?.then(|| journal.clone())
            }
            None if task.is_resumed => {
                let newest = self.newest_journal(task)?;
                newest.filter(|journal| before.as_ref() != Some(journal))
            }
            None => None,
        };
        self.keeper.borrow_mut().run_left(&task.id, begun);
        Ok(())
    }

    /// Runs that were interrupted before this service began can go on.
    pub(super) fn offer_runs(&mut self) -> Result<(), Failure> {
        let groups = self.keeper.borrow().groups();
        for group in groups {
            for kind in RunKind::ALL {
                let stage = kind.stage();
                let is_resumed = group.is_resumed(self.machine.config(), stage);
                if kind.has_rows() || !is_resumed {
                    continue;
                }
                let of_group = group.clone();
                let found = ask_disk(&mut self.machine, &self.store, move |store| {
                    store.interrupted_run(stage.text(), of_group.journals())
                })?;
                let mut keeper = self.keeper.borrow_mut();
                match found {
                    Ok(Some(found)) => keeper.offer_run(kind, &found),
                    Ok(None) => {}
                    Err(error) => keeper.warn(&format!("{}: {error}", called(&group))),
                }
            }
        }
        Ok(())
    }

    fn perform(&mut self, task: &RunTask) -> Result<Found, Failure> {
        let mut person = self.keeper.borrow_mut().asker();
        let (machine, store, teller) = (&mut self.machine, &self.store, self.teller.as_ref());
        let procedure = task.of_procedure();
        task.group
            .perform(machine, store, &procedure, &mut person, teller)
    }
}

/// Whether a run can go on with `journal`.
fn is_incomplete(journal: &Path) -> bool {
    read_journal::<AnyLog>(journal).is_ok_and(|read| !read.complete)
}
