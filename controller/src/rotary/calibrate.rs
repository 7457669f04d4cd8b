//! Calibrate a rotary table: the plate in every placement, one table error, stored and activated.

use std::path::PathBuf;

use compensator::rotary::{self, Solution, SolveOptions};
use units::Radians;

use crate::config::ConfigHash;
use crate::failure::Failure;
use crate::rotary::estimate::{evaluate, series};
use crate::rotary::failure::RotaryFailure;
use crate::rotary::in_use::TableInUse;
use crate::rotary::operator::Operator;
use crate::rotary::placement::{Placed, PlateRun, largest_closure};
use crate::rotary::table::RotaryTable;
use crate::rotary::{PlateEntry, PlateLog};
use crate::rotary::{PlatePlanEntry, RotaryContent};
use crate::run::{CalibrateOptions, note_failure, utc_now};
use crate::store::{
    CalibrationRecord, InstrumentRecord, Journal, JournalHeader, ReadJournal, RecordHead,
    SCHEMA_VERSION, Store, first_difference, not_resumable,
};

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
}

impl RotaryTable<'_> {
    /// Reads the plate in every placement, which `operator` brings about, evaluates the table's
    /// error, stores and activates it, and uses it from now on.
    ///
    /// # Errors
    /// Not zeroed; whatever stops the machine; a plate that slipped or lies elsewhere; readings
    /// that scatter too much or determine nothing; a table beyond the limits. The calibration in
    /// use before stays in use then.
    pub fn calibrate(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
        operator: &mut dyn Operator,
    ) -> Result<RotaryCalibrated, Failure> {
        let (mut run, config) = self.plate_run()?;
        if options.accept_drift {
            run.closure_limit = None;
        }
        self.core.require_zeroed(self.axis)?;
        let offsets: Vec<f64> = config
            .design()?
            .offsets()
            .iter()
            .map(|it| *it as f64)
            .collect();
        let header = self.header("calibrate", &run, None);
        let plan = run.plan(offsets.clone());
        let (mut journal, kept) = open(
            store,
            &header,
            &plan,
            options.resume.as_ref(),
            self.core.config_hash,
        )?;
        let limit = config.amplification_limit;
        let evaluated = self
            .read_placements(&run, &offsets, kept, &mut journal, operator)
            .and_then(|placed| Ok((evaluate(self.axis, &run, limit, &placed)?, placed)));
        let (solution, placed) = evaluated.inspect_err(|it| {
            note_failure(&mut journal, it);
            // Offsets of a run without a calibration mean nothing to a verification.
            self.memory.plate_at = None;
        })?;
        let content = RotaryContent {
            plate_phase_rad: placed.first().map(|it| it.phase.value()),
            ..RotaryContent::new(&solution)
        };
        let stored = self.store_table(store, &run, &journal, content.clone());
        let id = stored.inspect_err(|it| note_failure(&mut journal, it))?;
        journal.complete()?;
        Ok(RotaryCalibrated {
            path: store.calibration_path(&id),
            journal: journal.path().to_owned(),
            id,
            solution,
            closure: largest_closure(placed.iter().map(|it| it.closure)),
            scatter: placed
                .iter()
                .filter_map(|it| it.scatter)
                .reduce(Radians::max),
            content,
        })
    }

    fn read_placements(
        &mut self,
        run: &PlateRun,
        offsets: &[f64],
        mut placed: Vec<Placed>,
        journal: &mut Journal<PlateLog>,
        operator: &mut dyn Operator,
    ) -> Result<Vec<Placed>, Failure> {
        // A run that was continued may have been killed between a placement and its judgement.
        doubt(self.axis, run, &placed, journal)?;
        let total = run.sweeps() * offsets.len() as u32;
        for (number, offset) in (1..).zip(offsets) {
            if placed.iter().any(|it| it.offset == *offset) {
                continue;
            }
            let step = (number, offsets.len());
            let known = placed.last().map(|it| it.offset);
            self.place_plate(run, *offset, step, known, operator)?;
            let done = (run.sweeps() * placed.len() as u32, total);
            let phase = placed.first().map(|it| it.phase);
            placed.push(self.read_placement(run, (*offset, phase), done, journal)?);
            doubt(self.axis, run, &placed, journal)?;
        }
        placed.sort_by(|a, b| a.offset.total_cmp(&b.offset));
        Ok(placed)
    }

    fn store_table(
        &mut self,
        store: &Store,
        run: &PlateRun,
        journal: &Journal<PlateLog>,
        content: RotaryContent,
    ) -> Result<String, Failure> {
        let source = journal.path().file_name().unwrap_or_default();
        let head = RecordHead {
            created: utc_now(),
            source: source.to_string_lossy().into_owned(),
            instrument: plate_record(run),
            ..self.core.this_machine(self.axis)
        };
        // Nothing is stored that cannot be applied.
        let compensation = self.prepare(&content, "just made")?;
        let record = CalibrationRecord { head, content };
        let id = store.save(&record)?;
        store.activate(self.axis, &id)?;
        let in_use = TableInUse::new(&id, &record, compensation)?;
        self.memory.calibration = Some(in_use);
        Ok(id)
    }

    pub(super) fn header(
        &self,
        verb: &str,
        run: &PlateRun,
        calibration: Option<String>,
    ) -> JournalHeader {
        let machine = self.core.this_machine(self.axis);
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: verb.to_owned(),
            machine: machine.machine,
            stage_serial: machine.stage_serial,
            config_hash: machine.config_hash,
            axis: self.axis.to_owned(),
            drive: machine.drive,
            instrument: plate_record(run),
            started: utc_now(),
            calibration,
            targets_m: Vec::new(),
            runs: run.passes,
            approach_m: None,
        }
    }
}

/// The plate is what measures.
fn plate_record(run: &PlateRun) -> InstrumentRecord {
    InstrumentRecord {
        name: run.plate.clone(),
        identity: format!("plate with {} lines", run.lines),
        ..InstrumentRecord::default()
    }
}

/// A plate that was turned otherwise than was asked for shows as soon as two others were read.
fn doubt(
    axis: &str,
    run: &PlateRun,
    placed: &[Placed],
    journal: &mut Journal<PlateLog>,
) -> Result<(), Failure> {
    if placed.len() < JUDGED_MIN {
        return Ok(());
    }
    let read = series(axis, run.lines, placed)?;
    let Some(source) = rotary::misplaced(&read, &SolveOptions::default()) else {
        return Ok(());
    };
    let offset = source.offset as f64;
    journal.write(&PlateEntry::Misplaced { offset })?;
    journal.flush_to_disk()?;
    let axis = axis.to_owned();
    Err(RotaryFailure::Misplaced { axis, source }.into())
}

/// A new journal, or one that is continued with its whole placements.
fn open(
    store: &Store,
    header: &JournalHeader,
    plan: &PlatePlanEntry,
    resume: Option<&PathBuf>,
    hash: &ConfigHash,
) -> Result<(Journal<PlateLog>, Vec<Placed>), Failure> {
    let Some(path) = resume else {
        let mut journal = Journal::create(&store.runs(), header)?;
        journal.write(&PlateEntry::PlatePlan(plan.clone()))?;
        journal.flush_to_disk()?;
        return Ok((journal, Vec::new()));
    };
    let (mut journal, read) = Journal::<PlateLog>::resume(path, header, hash)?;
    match &read.log.plan {
        // Killed before its second line: nothing was read yet.
        None => journal.write(&PlateEntry::PlatePlan(plan.clone()))?,
        Some(before) => {
            if let Some(it) = first_difference(before, plan) {
                return Err(not_resumable(path, "how the plate is read", it).into());
            }
        }
    }
    Ok((journal, placed_of(&read, plan.passes)))
}

fn placed_of(read: &ReadJournal<PlateLog>, passes: u32) -> Vec<Placed> {
    let placements = read.log.placements.iter();
    placements
        .map(|it| Placed::of(it, &read.log.sweeps, passes))
        .collect()
}
