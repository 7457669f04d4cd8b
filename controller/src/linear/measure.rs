//! Measuring runs: every target approached from both sides, each point into the journal.

use core::time::Duration;

use compensator::error_table::{LinearSeries, Measurement};
use compensator::length_correction::EnvironmentWatch;
use drivers::device::Environment;
use units::{Approach, Metres};

use crate::assemble;
use crate::correction::Correction;
use crate::failure::Failure;
use crate::linear::PointEntry;
use crate::linear::cross_check::{CrossCheck, DatumReadings, Plausible, WholeRun, judge_scale};
use crate::linear::datum_in_use::Datum;
use crate::linear::run_plan::RunPlan;
use crate::linear::stage::LinearStage;
use crate::linear::{LinearEntry, LinearLog, SyncsEntry};
use crate::store::ClosureEntry;
use crate::store::{EnvironmentRecord, Journal};
use machine::{Stage, bus_figures};

/// How a series is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeasureOptions {
    /// For progress.
    pub stage: Stage,
    /// Whether the active calibration corrects the moves.
    pub compensated: bool,
}

/// The whole runs of a measurement that was interrupted; none for a new one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct EarlierRuns {
    pub(crate) points: Vec<PointEntry>,
    pub(crate) closures: Vec<ClosureEntry>,
}

/// A measured series.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Every point.
    pub points: Vec<PointEntry>,
    /// The same place, measured after a run minus before the first: the largest of all runs. `None` where no
    /// run was closed.
    pub closure: Option<Metres>,
    /// Mean environment of the points.
    pub environment: EnvironmentRecord,
}

impl Measured {
    /// The points as the mathematics takes them.
    ///
    /// # Errors
    /// When they make no series (which a whole run never does).
    pub fn series(&self) -> Result<LinearSeries, Failure> {
        series_of(&self.points)
    }
}

/// Journal points as a series.
///
/// # Errors
/// When they make none: a point is not finite, or measured twice.
pub(crate) fn series_of(points: &[PointEntry]) -> Result<LinearSeries, Failure> {
    let measurements = points
        .iter()
        .map(|point| Measurement {
            run: point.run,
            approach: point.side(),
            target: Metres(point.target_m),
            measured: Metres(point.measured_m),
        })
        .collect();
    Ok(LinearSeries::new(measurements)?)
}

impl EarlierRuns {
    /// The last of them; what its datum read in reverse was not kept.
    fn last(&self) -> Option<WholeRun> {
        let closure = self.closures.last()?;
        let begin = self.points.partition_point(|it| it.run < closure.run);
        Some(WholeRun {
            points: self.points[begin..].to_vec(),
            start: DatumReadings::forward(closure.start_m),
            end: DatumReadings::forward(closure.closure_m),
        })
    }
}

/// Where a run's points stand in the whole measurement, for progress.
struct Counter {
    stage: Stage,
    done: u64,
    total: u64,
}

/// The series being measured.
struct Session<'a> {
    axis: &'a str,
    plan: &'a RunPlan,
    correction: Correction,
    datum: Datum,
    journal: &'a mut Journal<LinearLog>,
    counter: Counter,
    check: CrossCheck,
    watch: Option<EnvironmentWatch>,
    /// What the first run was to be refused for, before the second one told whether its count slipped.
    held: Option<Failure>,
}

impl Session<'_> {
    /// Judges a run by the one before it and by its datum; one after which that has moved is worth
    /// nothing. The first run has none before it: where its datum has moved, it is compared with the second
    /// one, which tells a count that slipped from a drift, and refused then.
    fn close(
        &mut self,
        run: u32,
        before: Option<&WholeRun>,
        whole: &WholeRun,
    ) -> Result<ClosureEntry, Failure> {
        match before {
            Some(before) => self.check.compare(before, whole)?,
            None => self.check.judge_start(whole)?,
        }
        if let Some(failure) = self.held.take() {
            return Err(failure);
        }
        let closure = whole.closure(run);
        let seen = Metres(closure.closure_m);
        // A comparison with NaN is false, so that it is refused too.
        let is_closed = |limit| seen.abs() <= limit;
        if let Some(limit) = self.plan.closure_limit.filter(|it| !is_closed(*it)) {
            let failure = Failure::Closure {
                axis: self.axis.to_owned(),
                seen,
                limit,
            };
            if before.is_some() || run == self.plan.runs || !seen.is_finite() {
                return Err(failure);
            }
            self.held = Some(failure);
            return Ok(closure);
        }
        self.journal.write(&LinearEntry::Closed(closure))?;
        Ok(closure)
    }
}

/// Values that the instrument's sensors sent are never older than this.
const ENVIRONMENT_STALE: Duration = Duration::from_secs(60);
/// What a stage can do at most where the configuration says nothing.
const SLOPE_MAX: f64 = 0.01;
const SIZE_MAX: Metres = Metres(50e-6);

impl LinearStage<'_> {
    /// Measures `plan` on the axis; every point is in `journal` when it has been measured.
    /// The runs of an interrupted measurement are kept (`earlier`).
    ///
    /// The datum is the axis's zero, approached forward; the same place is measured again at
    /// the end of each run. Before it the axis goes to the far end, so that the first run has the
    /// same travel behind it as the later ones.
    ///
    /// # Errors
    /// Whatever stops the machine, a datum that drifted, and an instrument that disagrees
    /// with the encoder beyond reason.
    pub(crate) fn measure_runs(
        &mut self,
        plan: &RunPlan,
        options: MeasureOptions,
        journal: &mut Journal<LinearLog>,
        mut runs: EarlierRuns,
    ) -> Result<Measured, Failure> {
        let per_run = plan.targets.len() * 2;
        // A run that was whole but wrong ended the measurement that is continued here.
        for run in runs.points.chunk_by(|a, b| a.run == b.run) {
            judge_scale(self.axis, plan.scale_limit_ppm, run)?;
        }
        self.core.use_instrument(&plan.instrument)?;
        let plausible = self.plausible(plan)?;
        self.exercise(plan)?;
        let (datum, mut start) = self.set_datum(plan)?;
        self.memory.datum = Some((plan.clone(), datum));
        let counter = Counter {
            stage: options.stage,
            done: runs.points.len() as u64,
            total: per_run as u64 * u64::from(plan.runs),
        };
        let correction = if options.compensated {
            Correction::On
        } else {
            Correction::Off
        };
        let mut session = Session {
            axis: self.axis,
            plan,
            correction,
            datum,
            journal,
            counter,
            check: CrossCheck::new(self.axis, plausible),
            watch: self.environment_watch(plan),
            held: None,
        };
        let first = runs.points.last().map_or(1, |point| point.run + 1);
        let mut before = runs.last();
        for run in first..=plan.runs {
            let points = self.measure_run(&mut session, run)?;
            let end = self.read_datum(&mut session)?;
            let whole = WholeRun { points, start, end };
            let closure = session.close(run, before.as_ref(), &whole)?;
            start = whole.end;
            runs.points.extend(&whole.points);
            runs.closures.push(closure);
            before = Some(whole);
        }
        for it in SyncsEntry::of(bus_figures(self.core.machine)) {
            session.journal.write(&LinearEntry::Syncs(it))?;
        }
        session.journal.flush_to_disk()?;
        self.core.leave_instrument();
        let environment = mean_environment(&runs.points);
        Ok(Measured {
            closure: largest_closure(&runs.closures),
            points: runs.points,
            environment,
        })
    }

    fn measure_run(
        &mut self,
        session: &mut Session<'_>,
        run: u32,
    ) -> Result<Vec<PointEntry>, Failure> {
        let plan = session.plan;
        let mut points = Vec::new();
        let (first, last) = (plan.targets[0], plan.targets[plan.targets.len() - 1]);
        self.travel(first - plan.overrun, Correction::Off)?;
        for target in &plan.targets {
            points.push(self.measure_point(session, run, Approach::Forward, *target)?);
        }
        self.travel(last + plan.overrun, Correction::Off)?;
        for target in plan.targets.iter().rev() {
            points.push(self.measure_point(session, run, Approach::Reverse, *target)?);
        }
        judge_scale(session.axis, plan.scale_limit_ppm, &points)?;
        Ok(points)
    }

    fn measure_point(
        &mut self,
        session: &mut Session<'_>,
        run: u32,
        approach: Approach,
        target: Metres,
    ) -> Result<PointEntry, Failure> {
        let axis = session.axis;
        let set_point = self.arrive(target, session.correction)?;
        let reading = self.read_displacement(session.plan)?;
        let environment = self.watched_environment(session)?;
        let measured = self.correct(session.plan, &reading, &environment, &session.datum)?;
        let encoder = self
            .core
            .reading(axis)?
            .expect("an axis that moved has been read")
            .position;
        let point = PointEntry {
            run,
            approach: approach.symbol(),
            target_m: target.value(),
            set_point_m: set_point.value(),
            encoder_m: encoder.value(),
            measured_m: measured.value(),
            scatter_m: reading.standard_deviation.value(),
            at_s: reading.at.seconds(),
            environment: EnvironmentRecord::from(&environment),
        };
        session.check.take(&point)?;
        session.journal.write(&LinearEntry::Point(point))?;
        session.counter.done += 1;
        let Counter { stage, done, total } = session.counter;
        self.core.observer().progress(stage, axis, done, total);
        Ok(point)
    }

    /// What the datum's place reads at the end of a run.
    fn read_datum(&mut self, session: &mut Session<'_>) -> Result<DatumReadings, Failure> {
        let reverse_m = self.read_datum_in_reverse(session)?;
        self.go_to_datum(session.plan)?;
        let forward_m = self.read_at_datum(session)?;
        Ok(DatumReadings {
            forward_m,
            reverse_m,
        })
    }

    /// Nobody can tell from a single reading whether the count slipped beside it or the stage came to rest
    /// elsewhere; one that arrives badly from one side does not arrive in the same way from the other.
    fn read_datum_in_reverse(&mut self, session: &mut Session<'_>) -> Result<Option<f64>, Failure> {
        let is_there = self.go_to_datum_in_reverse(session.plan)?;
        is_there.then(|| self.read_at_datum(session)).transpose()
    }

    fn read_at_datum(&mut self, session: &mut Session<'_>) -> Result<f64, Failure> {
        let reading = self.read_calm(session.plan)?;
        let environment = self.watched_environment(session)?;
        let seen = self.correct(session.plan, &reading, &environment, &session.datum)?;
        Ok(seen.value())
    }

    /// What a stage like this can do from one point to the next.
    fn plausible(&self, plan: &RunPlan) -> Result<Plausible, Failure> {
        let limits = self.config.compensation.as_ref();
        Ok(Plausible {
            slope: limits.map_or(SLOPE_MAX, |it| it.slope_limit),
            step: limits.map_or(SIZE_MAX, |it| Metres::from_um(it.size_limit_um)),
            scale_limit_ppm: plan.scale_limit_ppm,
            count: self.core.config.instrument[&plan.instrument].count(),
        })
    }

    fn environment_watch(&self, plan: &RunPlan) -> Option<EnvironmentWatch> {
        let config = &self.core.config.instrument[&plan.instrument];
        let frozen = config.environment_frozen()?;
        Some(EnvironmentWatch::new(frozen, ENVIRONMENT_STALE))
    }

    /// The environment, as long as its sensors can be believed.
    fn watched_environment(&self, session: &mut Session<'_>) -> Result<Environment, Failure> {
        let instrument = &session.plan.instrument;
        let environment = self.core.environment_of(instrument)?;
        let Some(watch) = &mut session.watch else {
            return Ok(environment);
        };
        let reading = assemble::correction_environment(&environment);
        match watch.observe(self.core.now(), reading) {
            Ok(()) => Ok(environment),
            Err(source) => Err(Failure::Correction {
                instrument: instrument.clone(),
                source,
            }),
        }
    }
}

/// The closure of a measurement: that of the run which drifted most; `None` where no run was closed.
pub(crate) fn largest_closure(closures: &[ClosureEntry]) -> Option<Metres> {
    closures
        .iter()
        .map(|closure| Metres(closure.closure_m))
        .max_by(|a, b| a.abs().value().total_cmp(&b.abs().value()))
}

fn mean_environment(points: &[PointEntry]) -> EnvironmentRecord {
    let mean = |of: fn(&EnvironmentRecord) -> Option<f64>| {
        let values: Vec<f64> = points
            .iter()
            .filter_map(|point| of(&point.environment))
            .collect();
        compensator::uncertainty::mean(&values)
    };
    EnvironmentRecord {
        air_temperature_c: mean(|it| it.air_temperature_c),
        material_temperature_c: mean(|it| it.material_temperature_c),
        pressure_pa: mean(|it| it.pressure_pa),
        relative_humidity: mean(|it| it.relative_humidity),
    }
}
