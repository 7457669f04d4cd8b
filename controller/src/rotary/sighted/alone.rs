//! A plate whose readings need no machine: typed where nothing is driven, or imported from files.

use std::path::PathBuf;

#[cfg(feature = "program")]
use super::dialog::Dialog;
use super::import::{import, readings};
#[cfg(feature = "program")]
use super::person::Person;
#[cfg(feature = "program")]
use super::stand::{ByHand, IDLE};
use crate::failure::Failure;
use crate::rotary::calibrate::{Calibration, RotaryCalibrated};
use crate::rotary::operator::PlateTask;
use crate::rotary::placed::Placed;
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::subject::Subject;
use crate::rotary::verify::{RotaryVerified, Verification};
use crate::run::CalibrateOptions;
use crate::runs::DataFile;
use crate::store::Store;
use units::Radians;

/// Where the readings of placements come from.
pub(crate) enum Source<'a> {
    /// One placement a file.
    Files(&'a [DataFile]),
    /// Somebody types them.
    #[cfg(feature = "program")]
    Person(&'a mut dyn Person),
}

/// How far a calibration has come.
pub(crate) enum Progress {
    /// To its end.
    Done(Box<RotaryCalibrated>),
    /// Files of further placements are wanted.
    Due(Box<NextPlacement>),
}

/// The placement that is to be read next.
pub(crate) struct NextPlacement {
    /// The run that it belongs to.
    pub(crate) journal: PathBuf,
    /// What a person has to do for it.
    pub(crate) task: PlateTask,
    /// The columns of its file.
    pub(crate) columns: &'static str,
    /// The placements that were read: offset, how far the plate moved meanwhile, and the scatter of one
    /// line in one pass.
    pub(crate) read: Vec<(f64, Radians, Option<Radians>)>,
}

/// Calibrates `subject` by what was read of its plate elsewhere.
pub(crate) fn calibrate(
    subject: Subject<'_>,
    store: &Store,
    options: &CalibrateOptions,
    mut source: Source<'_>,
) -> Result<Progress, Failure> {
    before_anything_is_written(&subject, options, &source)?;
    let mut it = Calibration::begin(subject, store, options)?;
    let due = read_placements(&mut it, &mut source).inspect_err(|failure| it.note(failure))?;
    if let Some(due) = due {
        return Ok(Progress::Due(Box::new(NextPlacement {
            journal: it.journal.path().to_owned(),
            task: it.run.task(it.subject.axis, &due, due.known),
            columns: it.run.sighting(it.subject.axis)?.value.header(),
            read: it
                .placed()
                .iter()
                .map(|it| (it.offset, it.closure, it.scatter))
                .collect(),
        })));
    }
    let solution = it.evaluate().inspect_err(|failure| it.note(failure))?;
    let (calibrated, _) = it.store(store, solution)?;
    Ok(Progress::Done(Box::new(calibrated)))
}

/// A file that cannot be that of the first placement begins no run.
fn before_anything_is_written(
    subject: &Subject<'_>,
    options: &CalibrateOptions,
    source: &Source<'_>,
) -> Result<(), Failure> {
    let (run, config) = subject.plate_run()?;
    let sighting = run.sighting(subject.axis)?;
    if let (Source::Files([first, ..]), None) = (source, &options.resume)
        && let Some(offset) = config.design()?.offsets().first()
    {
        readings(first, (&run, sighting), *offset as f64)?;
    }
    Ok(())
}

/// Reads what `source` has; the placement that is due then.
fn read_placements(
    it: &mut Calibration<'_>,
    source: &mut Source<'_>,
) -> Result<Option<DuePlacement>, Failure> {
    let axis = it.subject.axis;
    match source {
        #[cfg(feature = "program")]
        Source::Person(person) => {
            while let Some(due) = it.due()? {
                let placed = typed(axis, &it.run, &due, &mut **person, &mut it.journal)?;
                it.take(placed);
            }
        }
        Source::Files(files) => {
            for file in *files {
                let due = it.due()?.ok_or_else(|| Failure::Usage {
                    what: format!("{}: all placements are read already", file.name),
                    help: "leave this file out".into(),
                })?;
                let placed = imported(axis, &it.run, &due, file, &mut it.journal)?;
                it.take(placed);
            }
        }
    }
    it.due()
}

/// Verifies `subject` by what was read of its plate elsewhere.
pub(crate) fn verify(
    subject: Subject<'_>,
    store: &Store,
    (compensated, resume): (bool, Option<&PathBuf>),
    source: Source<'_>,
) -> Result<RotaryVerified, Failure> {
    let known = subject.in_use(store)?;
    if let Source::Files([_, second, ..]) = source {
        return Err(Failure::Usage {
            what: format!("{}: a verification is one placement", second.name),
            help: "give one file".into(),
        });
    }
    let mut it = Verification::begin(subject, store, (compensated, known), resume)?;
    let (axis, due) = (it.subject.axis, it.due());
    let placed = match source {
        Source::Files([file, ..]) => imported(axis, &it.run, &due, file, &mut it.journal),
        Source::Files([]) => Err(Failure::Usage {
            what: "no file of readings".into(),
            help: "give one with --readings".into(),
        }),
        #[cfg(feature = "program")]
        Source::Person(person) => typed(axis, &it.run, &due, person, &mut it.journal),
    };
    let placed = placed.inspect_err(|failure| it.journal.note(failure))?;
    it.judge(store, &placed)
}

fn imported(
    axis: &str,
    run: &PlateRun,
    due: &DuePlacement,
    file: &DataFile,
    journal: &mut PlateJournal,
) -> Result<Placed, Failure> {
    let sighting = run.sighting(axis)?;
    import(axis, (run, sighting), due.offset, file, journal)
}

#[cfg(feature = "program")]
fn typed(
    axis: &str,
    run: &PlateRun,
    due: &DuePlacement,
    person: &mut dyn Person,
    journal: &mut PlateJournal,
) -> Result<Placed, Failure> {
    let sighting = run.sighting(axis)?;
    if journal.so_far().sweeps_at(due.offset).next().is_some() {
        let read = format!(
            "axis {axis}, plate {}, placement {} of {}: lines of it were read already, leave it where it is",
            run.plate, due.step.0, due.step.1
        );
        person.tell(&read);
    } else {
        person.ask(&run.task(axis, due, due.known))?;
        while !person.is_done()? {
            person.wait(IDLE);
        }
    }
    let dialog = Dialog::new(axis, run, sighting, due.offset);
    dialog.read(&mut ByHand(None), person, journal)
}
