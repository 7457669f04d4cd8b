//! A plate read by a person on a table that the machine drives to each line.

use std::path::PathBuf;

use super::dialog::Dialog;
use super::person::Person;
use crate::failure::Failure;
use crate::rotary::calibrate::RotaryCalibrated;
use crate::rotary::placed::Placed;
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::table::RotaryTable;
use crate::rotary::verify::RotaryVerified;
use crate::run::CalibrateOptions;
use crate::store::Store;

impl RotaryTable<'_> {
    /// As [`RotaryTable::calibrate`], with the lines read by a person.
    ///
    /// # Errors
    /// Those of that; without a section `sighting`; when he stops.
    pub fn calibrate_sighted(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
        person: &mut dyn Person,
    ) -> Result<RotaryCalibrated, Failure> {
        self.calibrate_by(store, options, &mut |table, run, due, journal| {
            table.read_by(run, due, person, journal)
        })
    }

    /// As [`RotaryTable::verify`], with the lines read by a person.
    ///
    /// # Errors
    /// Those of that; without a section `sighting`; when he stops.
    pub fn verify_sighted(
        &mut self,
        store: &Store,
        (compensated, resume): (bool, Option<&PathBuf>),
        person: &mut dyn Person,
    ) -> Result<RotaryVerified, Failure> {
        self.verify_by(
            store,
            (compensated, resume),
            &mut |table, run, due, journal| table.read_by(run, due, person, journal),
        )
    }

    fn read_by(
        &mut self,
        run: &PlateRun,
        due: &DuePlacement,
        person: &mut dyn Person,
        journal: &mut PlateJournal,
    ) -> Result<Placed, Failure> {
        let sighting = run.sighting(self.axis)?;
        let mut due = due.clone();
        if journal.so_far().sweeps_at(due.offset).next().is_some() {
            // Lines of it were read before somebody stopped: it lies there already.
            due.known = Some(due.offset);
            self.memory.plate_at = Some(due.offset);
        }
        self.place_plate(run, &due, person)?;
        let dialog = Dialog::new(self.axis, run, sighting, due.offset);
        let placed = dialog.read(self, person, journal)?;
        self.memory.plate_at = Some(due.offset);
        Ok(placed)
    }
}
