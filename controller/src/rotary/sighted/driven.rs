//! A plate read by a person on a table of a machine: it drives it to each line, or lets him turn it by hand.

use std::path::PathBuf;

use super::alone::{self, Progress, Source};
use super::dialog::Dialog;
use super::person::Person;
use super::stand::ByHand;
use crate::failure::Failure;
use crate::rotary::calibrate::RotaryCalibrated;
use crate::rotary::placed::Placed;
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::table::RotaryTable;
use crate::rotary::verify::RotaryVerified;
use crate::run::CalibrateOptions;
use crate::runs::DataFile;
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

    /// As [`RotaryTable::calibrate`], by what was read of the plate elsewhere: nothing moves.
    ///
    /// # Errors
    /// The first thing in `files` that is not as it should be, with file, line and column.
    pub(crate) fn calibrate_from(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
        files: &[DataFile],
    ) -> Result<Progress, Failure> {
        let source = Source::Files(files);
        let progress = alone::calibrate(self.subject(), store, options, source)?;
        self.load_active(store)?;
        Ok(progress)
    }

    /// As [`RotaryTable::verify`], by what was read of the plate elsewhere: nothing moves.
    ///
    /// # Errors
    /// The first thing in `files` that is not as it should be, with file, line and column; where a calibration makes
    /// the table worse it is no longer used.
    pub(crate) fn verify_from(
        &mut self,
        store: &Store,
        how: (bool, Option<&PathBuf>),
        files: &[DataFile],
    ) -> Result<RotaryVerified, Failure> {
        let verified = alone::verify(self.subject(), store, how, Source::Files(files));
        if verified.is_err() {
            self.forget_calibration();
            // Why it was not verified counts for more than why none is used now.
            drop(self.load_active(store));
        }
        verified
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
        let dialog = Dialog::new(self.axis, run, sighting, due.offset);
        let placed = if self.config.is_driven() {
            self.place_plate(run, &due, person)?;
            dialog.read(self, person, journal)
        } else {
            self.hand_over(run, &due, person)?;
            dialog.read(&mut ByHand(Some(self)), person, journal)
        }?;
        self.memory.plate_at = Some(due.offset);
        Ok(placed)
    }
}
