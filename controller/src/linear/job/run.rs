//! Doing a job: from point to point, each written down with its uncertainty before the next one is wanted.

use core::time::Duration;
use std::path::{Path, PathBuf};

use units::{Metres, Time, Volts};

use crate::failure::Failure;
use crate::linear::job::kept::{Stop, entry_of, goes_on_at};
use crate::linear::job::plan::{interval, uncalibrated};
use crate::linear::job::{GoOn, Job, JobInput, JobOperator, JobPoint, Reached};
use crate::linear::stage::LinearStage;
use crate::linear::{LinearEntry, LinearLog, ReachedEntry, WentOnEntry};
use crate::made_by::made_by;
use crate::run::{note_failure, settle, utc_now};
use crate::store::{InstrumentRecord, Journal, JournalHeader, SCHEMA_VERSION, Store};
use machine::{Stage, read_ahead};

/// How long the machine lives between two looks at the operator or at an input.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// A job that was done to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct JobDone {
    /// The calibration that corrected it.
    pub calibration: String,
    /// How many stops had been made before it was interrupted.
    pub before: u64,
    /// Each point as often as it was reached since, in order.
    pub reached: Vec<Reached>,
    /// Where all of it is written down.
    pub journal: PathBuf,
}

/// What made the job go on.
struct WentOn {
    by: &'static str,
    seen: Option<Volts>,
}

impl LinearStage<'_> {
    /// Goes to the points of `job`, corrected by the calibration that `store` says is in use, and waits at each
    /// until the next one is wanted. Every point is in the journal when it was reached.
    ///
    /// # Errors
    /// Before anything moves: not zeroed; no calibration that is in use and belongs to this machine; a place that
    /// cannot be gone to. Later: whatever stops the machine, an operator who is gone, an input that does not come.
    /// The axis is stopped by [`guarded`](machine::Machine::guarded) then; what was reached stays in the journal.
    pub fn run_job(
        &mut self,
        store: &Store,
        job: &Job,
        operator: &mut dyn JobOperator,
    ) -> Result<JobDone, Failure> {
        let calibration = self.calibration_of_jobs(store)?;
        let header = self.job_header(job, &calibration);
        let mut journal = store.create_journal(&header)?;
        journal.write(&LinearEntry::Job(entry_of(job)))?;
        settle(&mut self.core, store)?;
        let done = self.do_job((job, (1, 1)), calibration, operator, journal)?;
        settle(&mut self.core, store)?;
        Ok(done)
    }

    /// Goes on with a job whose journal ends before it: at the point after the last one that it went on from.
    /// Without `approach_mm` of the compensation the first point is arrived at from the axis's zero, as at the
    /// beginning of a job.
    ///
    /// # Errors
    /// As [`Self::run_job`]; before anything moves, when the journal is complete or that of another job, machine or
    /// calibration: what differs is named.
    pub fn resume_job(
        &mut self,
        store: &Store,
        job: &Job,
        journal: &Path,
        operator: &mut dyn JobOperator,
    ) -> Result<JobDone, Failure> {
        let calibration = self.calibration_of_jobs(store)?;
        read_ahead(&mut self.core, store, journal.to_owned())?;
        let stop = goes_on_at(store, journal, job, &calibration)?;
        let header = self.job_header(job, &calibration);
        let (journal, _) = store.resume_journal(journal, &header, self.core.config_hash)?;
        settle(&mut self.core, store)?;
        let done = self.do_job((job, stop), calibration, operator, journal)?;
        settle(&mut self.core, store)?;
        Ok(done)
    }

    fn calibration_of_jobs(&mut self, store: &Store) -> Result<String, Failure> {
        self.core.require_zeroed(self.axis)?;
        let id = self.load_active(store)?;
        id.ok_or_else(|| uncalibrated(self.axis))
    }

    fn do_job(
        &mut self,
        (job, from): (&Job, Stop),
        calibration: String,
        operator: &mut dyn JobOperator,
        mut journal: Journal<LinearLog>,
    ) -> Result<JobDone, Failure> {
        let reached = self
            .go_through((job, from), operator, &mut journal)
            .inspect_err(|failure| note_failure(&mut journal, failure))?;
        journal.complete()?;
        Ok(JobDone {
            calibration,
            before: job.stops_before(from),
            reached,
            journal: journal.path().to_owned(),
        })
    }

    fn job_header(&self, job: &Job, calibration: &str) -> JournalHeader {
        let machine = self.core.this_machine(self.axis);
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: "run".to_owned(),
            machine: machine.machine,
            stage_serial: machine.stage_serial,
            config_hash: machine.config_hash,
            axis: self.axis.to_owned(),
            drive: machine.drive,
            instrument: InstrumentRecord::default(),
            started: utc_now(),
            program: Some(made_by()),
            calibration: Some(calibration.to_owned()),
            targets_m: job.points.iter().map(|it| it.target.value()).collect(),
            runs: job.repetitions,
            approach_m: self.approach_length().map(Metres::value),
        }
    }

    fn go_through(
        &mut self,
        (job, from): (&Job, Stop),
        operator: &mut dyn JobOperator,
        journal: &mut Journal<LinearLog>,
    ) -> Result<Vec<Reached>, Failure> {
        let mut all = Vec::new();
        for repetition in from.0..=job.repetitions {
            let begin = if repetition == from.0 { from.1 } else { 1 };
            for (number, point) in (1..).zip(&job.points).skip(begin - 1) {
                let moved = self.move_and_settle(point.target, job.settle)?;
                let table = self.compensation().map(|it| it.table());
                let reached = Reached {
                    repetition,
                    number: (number, job.points.len()),
                    name: point.name.clone(),
                    interval: table.and_then(|it| interval(it, point.target)),
                    moved,
                };
                let at = self.core.now();
                journal.write(&LinearEntry::Reached(reached.entry(at)))?;
                operator.reached(&reached);
                all.push(reached);
                let done = job.stops_before(from) + all.len() as u64;
                let axis = self.axis;
                self.core
                    .observer()
                    .progress(Stage::Job, axis, done, job.stops());
                self.wait_at(repetition, (number, point), operator, journal)?;
            }
        }
        if let Some(end) = job.end {
            self.move_to(end)?;
        }
        Ok(all)
    }

    /// Until the next point is wanted; when that was is written down.
    fn wait_at(
        &mut self,
        repetition: u32,
        (number, point): (usize, &JobPoint),
        operator: &mut dyn JobOperator,
        journal: &mut Journal<LinearLog>,
    ) -> Result<(), Failure> {
        let since = self.core.now();
        let WentOn { by, seen } = self.wait_for(point, operator, since)?;
        let now = self.core.now();
        journal.write(&LinearEntry::WentOn(WentOnEntry {
            repetition,
            number,
            by: by.to_owned(),
            waited_s: now.since(since).as_secs_f64(),
            seen_v: seen.map(Volts::value),
            at_s: now.seconds(),
        }))?;
        Ok(())
    }

    fn wait_for(
        &mut self,
        point: &JobPoint,
        operator: &mut dyn JobOperator,
        since: Time,
    ) -> Result<WentOn, Failure> {
        match &point.go_on {
            GoOn::After(span) => {
                self.core.run_until(since + *span)?;
                let (by, seen) = ("time", None);
                Ok(WentOn { by, seen })
            }
            GoOn::Operator(text) => {
                operator.ask(&format!("{}: {text}", point.name))?;
                while !operator.is_done()? {
                    let next = self.core.now() + LOOK_EVERY;
                    self.core.run_until(next)?;
                }
                let (by, seen) = ("operator", None);
                Ok(WentOn { by, seen })
            }
            GoOn::Input(input) => {
                let seen = self.wait_for_input(&point.name, input, since)?;
                let (by, seen) = ("input", Some(seen));
                Ok(WentOn { by, seen })
            }
        }
    }

    /// Only what is sampled after the axis came to the point counts, and nothing at an end of the converter's range.
    fn wait_for_input(
        &mut self,
        point: &str,
        input: &JobInput,
        since: Time,
    ) -> Result<Volts, Failure> {
        let last = since + input.within;
        let mut newest = None;
        loop {
            let module = self.core.devices().analog(&input.module)?;
            let reading = module.reading().filter(|it| it.at > since);
            let place = input.place;
            newest = reading
                .and_then(|it| it.volts.get(place).copied())
                .or(newest);
            let is_sound = reading.is_some_and(|it| it.saturated.get(place) == Some(&false));
            if let Some(seen) = newest.filter(|it| is_sound && input.is_met(*it)) {
                return Ok(seen);
            }
            if self.core.now() >= last {
                return Err(Failure::InputNotSeen {
                    axis: self.axis.to_owned(),
                    point: point.to_owned(),
                    wanted: input.text(),
                    seen: newest,
                    within: input.within,
                });
            }
            let next = (self.core.now() + LOOK_EVERY).min(last);
            self.core.run_until(next)?;
        }
    }
}

impl Reached {
    /// For the journal, at that time.
    fn entry(&self, at: Time) -> ReachedEntry {
        let moved = &self.moved;
        let u = moved.uncertainty;
        ReachedEntry {
            repetition: self.repetition,
            number: self.number.0,
            approach: moved.approach.symbol(),
            target_m: moved.target.value(),
            interval_m: self.interval.map(|(from, to)| [from.value(), to.value()]),
            set_point_m: moved.set_point.value(),
            encoder_m: moved.encoder.value(),
            place_m: moved.place.map(Metres::value),
            u_m: u.map(|it| it.standard_uncertainty.value()),
            expanded_u_m: u.map(|it| it.expanded().value()),
            at_s: at.seconds(),
        }
    }
}
