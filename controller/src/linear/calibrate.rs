//! Calibrate: measure the deviations, fit the error table, store it with all it depends on.

use std::path::PathBuf;

use compensator::budget::AxisBudget;
use compensator::error_table::{self, Compensation, FitOptions, Fitted, uncertainty};
use compensator::iso230;
use units::Metres;

use crate::failure::Failure;
use crate::linear::LinearContent;
use crate::linear::LinearLog;
use crate::linear::measure::{EarlierRuns, MeasureOptions, Measured};
use crate::linear::memory::Untried;
use crate::linear::run_plan::{RunPlan, of_calibration};
use crate::linear::settings;
use crate::linear::stage::{LinearStage, Usable};
use crate::made_by::made_by;
use crate::run::{CalibrateOptions, is_used_by, missing, note_failure, settle, utc_now};
use crate::store::{CalibrationRecord, Journal, JournalHeader, RecordHead, SCHEMA_VERSION, Store};
use machine::{Stage, read_ahead};

/// A calibration that was made, stored and activated.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// Its name: the BLAKE3 of its file.
    pub id: String,
    /// Where it is.
    pub path: PathBuf,
    /// Where every point is.
    pub journal: PathBuf,
    /// What it says.
    pub record: CalibrationRecord<LinearContent>,
    /// How the fit went; the uncertainties of its table are those of the budget.
    pub fitted: Fitted,
    /// What was measured.
    pub measured: Measured,
    /// The smallest error of one position that would have been noticed by its neighbours.
    pub noticed: Option<Metres>,
    /// What makes the table uncertain.
    pub budget: AxisBudget,
    /// Whether it is used from now on.
    pub is_in_use: bool,
}

/// What was made of a measurement, before it is stored.
struct MadeCalibration {
    record: CalibrationRecord<LinearContent>,
    compensation: Compensation,
    fitted: Fitted,
    budget: AxisBudget,
    noticed: Option<Metres>,
}

impl LinearStage<'_> {
    /// Measures the axis with its instrument, fits the table, stores and activates it, and
    /// uses it from now on, unless it is to be kept aside.
    ///
    /// # Errors
    /// When the axis is not zeroed, anything stops the machine, the measurement drifted, or
    /// the table breaks a limit. The calibration in use before stays in use then.
    pub fn calibrate(
        &mut self,
        store: &Store,
        options: &CalibrateOptions,
    ) -> Result<Calibrated, Failure> {
        let config = self.config.calibrate.clone();
        let config = config.ok_or_else(|| missing(self.axis, "calibrate"))?;
        self.core.require_zeroed(self.axis)?;
        let plan = RunPlan {
            closure_limit: (!options.accept_drift)
                .then(|| Metres::from_um(config.closure_limit_um)),
            ..of_calibration(&config)
        };
        // Before the header, which says who measures.
        self.core.use_instrument(&plan.instrument)?;
        let header = self.journal_header("calibrate", &plan, None);
        let resume = options.resume.as_ref();
        let (mut journal, earlier) = self.open_journal(store, &header, resume)?;
        let measuring = MeasureOptions {
            stage: Stage::Calibrate,
            compensated: false,
        };
        let measured = self.measure_runs(&plan, measuring, &mut journal, earlier);
        let measured = measured.inspect_err(|failure| note_failure(&mut journal, failure))?;
        settle(&mut self.core, store)?;
        let made = self.make_calibration(&plan, &journal, &measured);
        let made = made.inspect_err(|failure| {
            // It is measured whole, and stays what it is: nothing is to be gone on with.
            note_failure(&mut journal, failure);
            drop(journal.complete());
        })?;
        let id = store.save(&made.record)?;
        // What is used was stored before.
        settle(&mut self.core, store)?;
        let stored = match options.aside {
            true => Ok(()),
            false => self.put_into_use(store, &id, &made, &measured),
        };
        let stored = stored.and_then(|()| {
            journal.complete()?;
            settle(&mut self.core, store)
        });
        stored.inspect_err(|failure| note_failure(&mut journal, failure))?;
        let MadeCalibration {
            record,
            fitted,
            budget,
            noticed,
            ..
        } = made;
        Ok(Calibrated {
            path: store.calibration_path(&id),
            journal: journal.path().to_owned(),
            id,
            record,
            fitted,
            measured,
            noticed,
            budget,
            is_in_use: !options.aside,
        })
    }

    fn make_calibration(
        &self,
        plan: &RunPlan,
        journal: &Journal<LinearLog>,
        measured: &Measured,
    ) -> Result<MadeCalibration, Failure> {
        let mut fitted = self.fit_table(plan, measured)?;
        let budget = self.budget_of(plan, measured, &fitted)?;
        let record = self.calibration_record(plan, journal, measured, &fitted, &budget);
        fitted.table = uncertainty::stated(&fitted.table, &budget);
        let harmless = settings::harmless(self.core.config, self.axis);
        Ok(MadeCalibration {
            compensation: self.prepare(fitted.table.clone())?,
            noticed: fitted.table.judge_neighbours(harmless).ok().flatten(),
            record,
            fitted,
            budget,
        })
    }

    /// Uses the calibration `id` from now on, now and after the next start.
    fn put_into_use(
        &mut self,
        store: &Store,
        id: &str,
        made: &MadeCalibration,
        measured: &Measured,
    ) -> Result<(), Failure> {
        let stored = store.activate(self.axis, id).map_err(Failure::from);
        let stored = stored.and_then(|()| settle(&mut self.core, store));
        if is_used_by(&stored) {
            self.use_calibration(Usable {
                compensation: made.compensation.clone(),
                budget: Some(made.budget.clone()),
                approach: self.approach_length(),
            });
            let figures = iso230::evaluate(&measured.series()?).ok();
            self.memory.untried = Some(Untried {
                id: id.to_owned(),
                as_found: figures.map(|figures| figures.accuracy.bidirectional),
            });
        }
        stored
    }

    /// A new journal, or one that is continued with its whole runs; it is on the disk when this returns.
    pub(super) fn open_journal(
        &mut self,
        store: &Store,
        header: &JournalHeader,
        resume: Option<&PathBuf>,
    ) -> Result<(Journal<LinearLog>, EarlierRuns), Failure> {
        let Some(path) = resume else {
            let journal = store.create_journal(header)?;
            settle(&mut self.core, store)?;
            return Ok((journal, EarlierRuns::default()));
        };
        read_ahead(&mut self.core, store, path.clone())?;
        let hash = self.core.config_hash;
        let (journal, read) = store.resume_journal::<LinearLog>(path, header, hash)?;
        settle(&mut self.core, store)?;
        let earlier = EarlierRuns {
            points: read.log.points,
            closures: read.log.closures,
        };
        Ok((journal, earlier))
    }

    /// Loads the calibration that `store` says is active for the axis, after checking that it
    /// belongs to this machine; returns its name, `None` when there is none.
    ///
    /// # Errors
    /// When it is damaged, belongs to another machine or set-up, or breaks a limit.
    pub fn load_active(&mut self, store: &Store) -> Result<Option<String>, Failure> {
        let Some(id) = store.active(self.axis)?.current else {
            return Ok(None);
        };
        let usable = self.usable(store, &id)?;
        self.use_calibration(usable);
        Ok(Some(id))
    }

    /// What `id` corrects, if it can be used here.
    pub(super) fn usable(&self, store: &Store, id: &str) -> Result<Usable, Failure> {
        let record = store.load::<LinearContent>(id)?;
        record.head.belongs_to(
            id,
            &self.core.this_machine(self.axis),
            self.core.config_hash,
        )?;
        Ok(Usable {
            compensation: self.prepare(record.content.table(id)?)?,
            budget: record.content.axis_budget(id)?,
            approach: record.content.approach_m.map(Metres),
        })
    }

    fn fit_table(&self, plan: &RunPlan, measured: &Measured) -> Result<Fitted, Failure> {
        let instrument = &self.core.config.instrument[&plan.instrument];
        let options = FitOptions {
            u_instrument: Metres(instrument.instrument_standard_uncertainty_nm * 1e-9),
            ..FitOptions::default()
        };
        error_table::analyse(&measured.series()?, &options).map_err(|source| Failure::Fit {
            axis: self.axis.to_owned(),
            source,
        })
    }

    /// Proves that a table can be applied within the limits of the configuration.
    pub(crate) fn prepare(&self, table: error_table::ErrorTable) -> Result<Compensation, Failure> {
        settings::compensation(self.core.config, self.axis, table)
    }

    fn calibration_record(
        &self,
        plan: &RunPlan,
        journal: &Journal<LinearLog>,
        measured: &Measured,
        fitted: &Fitted,
        budget: &AxisBudget,
    ) -> CalibrationRecord<LinearContent> {
        let head = RecordHead {
            created: utc_now(),
            source: journal
                .path()
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            instrument: self.core.instrument_record(&plan.instrument),
            environment: measured.environment,
            ..self.core.this_machine(self.axis)
        };
        let content = LinearContent::new(&fitted.table, plan.runs, measured.closure)
            .with_budget(budget)
            .with_approach(self.approach_length());
        CalibrationRecord { head, content }
    }

    pub(super) fn journal_header(
        &self,
        verb: &str,
        plan: &RunPlan,
        calibration: Option<String>,
    ) -> JournalHeader {
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: verb.to_owned(),
            machine: self.core.config.machine.name.clone(),
            stage_serial: self.core.config.machine.stage_serial.clone(),
            config_hash: self.core.config_hash.as_str().to_owned(),
            axis: self.axis.to_owned(),
            drive: self.core.drive_record(self.axis),
            instrument: self.core.instrument_record(&plan.instrument),
            started: utc_now(),
            program: Some(made_by()),
            calibration,
            targets_m: plan.targets.iter().map(|target| target.value()).collect(),
            runs: plan.runs,
            approach_m: self.approach_length().map(Metres::value),
        }
    }
}
