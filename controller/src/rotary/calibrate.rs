//! Calibrate a rotary table: the plate in every placement, one table error, stored and activated.

use std::path::PathBuf;

use compensator::rotary::{self, Solution, SolveOptions};
use units::Radians;

use crate::failure::Failure;
use crate::rotary::estimate::{evaluate, series};
use crate::rotary::failure::RotaryFailure;
use crate::rotary::in_use::TableInUse;
use crate::rotary::operator::Operator;
use crate::rotary::placed::{Placed, largest_closure};
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::{DuePlacement, PlateRun};
use crate::rotary::settings::interpolation_of;
use crate::rotary::subject::{Subject, plate_record};
use crate::rotary::table::RotaryTable;
use crate::rotary::unturned::{Unturned, unturned};
use crate::rotary::{PlateEntry, RotaryContent};
use crate::run::{CalibrateOptions, is_used_by, settle, utc_now};
use crate::store::{CalibrationRecord, RecordHead, Store};
use machine::read_ahead;

/// So many placements are needed before one can be told to be misplaced by the others.
const JUDGED_MIN: usize = 3;

/// A rotary axis that was calibrated.
#[derive(Clone, Debug)]
pub struct RotaryCalibrated {
    /// Its calibration's name.
    pub id: String,
    /// Where that is.
    pub path: PathBuf,
    /// Where every pass is.
    pub journal: PathBuf,
    /// What the readings say.
    pub solution: Solution,
    /// By how much the plate moved in the worst placement, while it was read.
    pub closure: Radians,
    /// The scatter of one line in one pass, by what the directions differ, of the worst placement.
    pub scatter: Option<Radians>,
    /// What was stored.
    pub content: RotaryContent,
    /// Whether it is used from now on.
    pub is_in_use: bool,
}

impl RotaryTable<'_> {
    /// Reads the plate in every placement, which `operator` brings about, evaluates the table's
    /// error, stores and activates it, and uses it from now on, unless it is to be kept aside.
    ///
    /// # Errors
    /// Not zeroed, or no line detector; whatever stops the machine; a plate that slipped or lies
    /// elsewhere; readings that scatter too much or determine nothing; a table beyond the limits. The
    /// calibration in use before stays in use then.
    pub fn calibrate(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
        operator: &mut dyn Operator,
    ) -> Result<RotaryCalibrated, Failure> {
        // What is asked of a configuration comes before what is asked of the table.
        self.subject().plate_run()?;
        self.require_detector()?;
        self.calibrate_by(store, options, &mut |table, run, due, journal| {
            table.place_plate(run, due, operator)?;
            table.read_placement(run, (due.offset, due.phase), due.done, journal)
        })
    }

    /// The same with each placement brought about and read by `read`.
    pub(super) fn calibrate_by(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
        read: &mut Read<'_>,
    ) -> Result<RotaryCalibrated, Failure> {
        self.core.require_zeroed(self.axis)?;
        if let Some(journal) = &options.resume {
            read_ahead(&mut self.core, store, journal.clone())?;
        }
        let mut it = Calibration::begin(self.subject(), store, options)?;
        settle(&mut self.core, store)?;
        let evaluated = self
            .read_all(store, &mut it, read)
            .and_then(|()| it.evaluate());
        let solution = evaluated.inspect_err(|failure| {
            it.note(failure);
            // Offsets of a run without a calibration mean nothing to a verification.
            self.memory.plate_at = None;
        })?;
        settle(&mut self.core, store)?;
        let (calibrated, in_use) = it.store(store, solution)?;
        let stored = settle(&mut self.core, store);
        if calibrated.is_in_use && is_used_by(&stored) {
            self.memory.calibration = Some(in_use);
        }
        stored.map(|()| calibrated)
    }

    fn read_all(
        &mut self,
        store: &Store,
        it: &mut Calibration<'_>,
        read: &mut Read<'_>,
    ) -> Result<(), Failure> {
        while let Some(due) = it.due()? {
            let placed = self.read_due(read, &it.run, &due, &mut it.journal)?;
            // A placement that the disk has not kept would ask a person for the plate again.
            settle(&mut self.core, store)?;
            it.take(placed);
        }
        Ok(())
    }

    /// A placement that `read` brings about and reads, with what the machine's thermometers show before and behind it.
    pub(super) fn read_due(
        &mut self,
        read: &mut Read<'_>,
        run: &PlateRun,
        due: &DuePlacement,
        journal: &mut PlateJournal,
    ) -> Result<Placed, Failure> {
        self.note_thermometers(journal)?;
        let placed = read(self, run, due, journal)?;
        self.note_thermometers(journal)?;
        Ok(placed)
    }

    fn note_thermometers(&self, journal: &mut PlateJournal) -> Result<(), Failure> {
        if let Some(shown) = self.core.thermometers() {
            journal.write(PlateEntry::Thermometers(shown))?;
        }
        Ok(())
    }
}

/// Brings a placement about and reads it.
pub(super) type Read<'a> = dyn FnMut(
        &mut RotaryTable<'_>,
        &PlateRun,
        &DuePlacement,
        &mut PlateJournal,
    ) -> Result<Placed, Failure>
    + 'a;

/// A calibration that is under way: the placements that were read, by whomever.
pub(crate) struct Calibration<'a> {
    pub(super) subject: Subject<'a>,
    pub(super) run: PlateRun,
    amplification_limit: f64,
    /// Whether what is found is used.
    is_used: bool,
    offsets: Vec<f64>,
    pub(super) journal: PlateJournal,
    placed: Vec<Placed>,
}

impl<'a> Calibration<'a> {
    /// A new one, or one that is continued with its whole placements.
    pub(super) fn begin(
        subject: Subject<'a>,
        store: &Store,
        options: &CalibrateOptions,
    ) -> Result<Self, Failure> {
        let (mut run, config) = subject.plate_run()?;
        if options.accept_drift {
            run.closure_limit = None;
        }
        let design = config.design()?;
        let offsets: Vec<f64> = design.offsets().iter().map(|it| *it as f64).collect();
        let header = subject.header("calibrate", &run, None);
        let plan = run.plan(offsets.clone());
        let resume = options.resume.as_ref();
        let journal = PlateJournal::open(store, &header, &plan, resume, &subject)?;
        Ok(Self {
            placed: journal.placed(),
            amplification_limit: config.amplification_limit,
            is_used: !options.aside,
            subject,
            run,
            offsets,
            journal,
        })
    }

    /// The placement that is to be read next; `None` when all are.
    ///
    /// # Errors
    /// When one that was read turns out to be another one than was asked for.
    pub(super) fn due(&mut self) -> Result<Option<DuePlacement>, Failure> {
        // A run that was continued may have been killed between a placement and its judgement.
        doubt(
            self.subject.axis,
            &self.run,
            &self.placed,
            &mut self.journal,
        )?;
        let is_read = |offset: f64| self.placed.iter().any(|it| it.offset == offset);
        let due = (1..).zip(&self.offsets).find(|it| !is_read(*it.1));
        let sweeps = self.run.sweeps();
        Ok(due.map(|(number, offset)| DuePlacement {
            offset: *offset,
            step: (number, self.offsets.len()),
            known: self.placed.last().map(|it| it.offset),
            phase: self.placed.first().map(|it| it.phase),
            done: (
                sweeps * self.placed.len() as u32,
                sweeps * self.offsets.len() as u32,
            ),
        }))
    }

    pub(super) fn take(&mut self, placed: Placed) {
        self.placed.push(placed);
    }

    /// The placements that were read.
    pub(crate) fn placed(&self) -> &[Placed] {
        &self.placed
    }

    /// Says in the journal why it ended.
    pub(super) fn note(&mut self, failure: &Failure) {
        self.journal.note(failure);
    }

    pub(super) fn evaluate(&mut self) -> Result<Solution, Failure> {
        self.placed.sort_by(|a, b| a.offset.total_cmp(&b.offset));
        let (axis, limit) = (self.subject.axis, self.amplification_limit);
        Ok(evaluate(axis, &self.run, limit, &self.placed)?)
    }

    /// Stores what the readings say, and activates it unless it is to be kept aside.
    pub(super) fn store(
        mut self,
        store: &Store,
        solution: Solution,
    ) -> Result<(RotaryCalibrated, TableInUse), Failure> {
        let placed = &self.placed;
        let lay_at = |it: &Placed| it.stood.is_none().then(|| it.phase.value());
        let drawn = interpolation_of(self.subject.config.compensation.as_ref());
        let content = RotaryContent::new(&solution).with_budget(&solution, drawn);
        let axis = self.subject.axis.to_owned();
        let content = content.map_err(|source| Failure::Budget { axis, source });
        let lies_at = placed.first().and_then(lay_at);
        let content = content.map(|it| RotaryContent {
            plate_phase_rad: lies_at,
            ..it
        });
        let stored = content.and_then(|it| Ok((self.store_table(store, it.clone())?, it)));
        let ((id, in_use), content) = stored.inspect_err(|it| self.journal.note(it))?;
        self.journal.complete()?;
        let calibrated = RotaryCalibrated {
            path: store.calibration_path(&id),
            journal: self.journal.path().to_owned(),
            id,
            solution,
            closure: largest_closure(self.placed.iter().map(|it| it.closure)),
            scatter: self
                .placed
                .iter()
                .filter_map(|it| it.scatter)
                .reduce(Radians::max),
            content,
            is_in_use: self.is_used,
        };
        Ok((calibrated, in_use))
    }

    fn store_table(
        &self,
        store: &Store,
        content: RotaryContent,
    ) -> Result<(String, TableInUse), Failure> {
        let source = self.journal.path().file_name().unwrap_or_default();
        let head = RecordHead {
            created: utc_now(),
            source: source.to_string_lossy().into_owned(),
            instrument: plate_record(&self.run),
            ..self.subject.here.clone()
        };
        // Nothing is stored that cannot be applied.
        let compensation = self.subject.prepare(&content, "just made")?;
        let record = CalibrationRecord { head, content };
        let id = store.save(&record)?;
        if self.is_used {
            store.activate(self.subject.axis, &id)?;
        }
        let in_use = TableInUse::new(&id, &record, compensation)?;
        Ok((id, in_use))
    }
}

/// A plate that was not turned shows as soon as it was read twice, one that was turned otherwise than was asked for as
/// soon as two others were read.
fn doubt(
    axis: &str,
    run: &PlateRun,
    placed: &[Placed],
    journal: &mut PlateJournal,
) -> Result<(), Failure> {
    let axis = axis.to_owned();
    if let Some(Unturned {
        offset,
        like,
        scatter,
    }) = unturned(run, placed)
    {
        read_again(journal, offset)?;
        return Err(RotaryFailure::NotTurned {
            axis,
            offset,
            like,
            scatter,
        }
        .into());
    }
    if placed.len() < JUDGED_MIN {
        return Ok(());
    }
    let read = series(&axis, run.lines, placed)?;
    let Some(source) = rotary::misplaced(&read, &SolveOptions::default()) else {
        return Ok(());
    };
    read_again(journal, source.offset as f64)?;
    Err(RotaryFailure::Misplaced { axis, source }.into())
}

/// The placement at `offset` does not count: a run that is continued asks for it again.
fn read_again(journal: &mut PlateJournal, offset: f64) -> Result<(), Failure> {
    journal.write(PlateEntry::Misplaced { offset })?;
    Ok(journal.flush_to_disk()?)
}
