//! `truestage run JOB.toml`: a job of one axis.

use std::path::{Path, PathBuf};

use machine::records::{Store, short};
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::linear::job::JobDone;
use crate::linear::job::asked::GO_ON;
use crate::linear::job::kept::{Stop, goes_on_at};
use crate::linear::job::plan::PlannedPoint;
use crate::linear::{Job, JobOperator, JobPlan, Reached};
use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::answering::{Asked as AskedOf, entered};
use crate::program::data_text::{name_of, read};
use crate::program::exchange::plain;
use crate::program::json as to_json;
use crate::program::kept::or_by_its_service;
use crate::program::linear::{moved, uncertainty};
use crate::program::operator::Terminal;
use crate::program::output::{Ended, Output};
use crate::program::resume::{journal_to_resume, resumable};
use crate::program::session::Session;
use crate::{Failure, config};

/// What is asked of a job besides doing it.
#[derive(Clone, Debug)]
pub(crate) struct JobOptions {
    /// Judge it, and open nothing.
    pub(crate) dry_run: bool,
    /// Points beyond the calibrated range are gone to.
    pub(crate) beyond: bool,
    /// Nobody is waited for.
    pub(crate) yes: bool,
    /// Go on with this journal.
    pub(crate) resume: Option<PathBuf>,
}

/// A journal to go on with, and where.
struct GoesOn {
    journal: PathBuf,
    at: Stop,
}

impl GoesOn {
    fn of(
        resume: Option<&PathBuf>,
        store: &Store,
        job: &Job,
        plan: &JobPlan,
    ) -> Result<Option<Self>, Failure> {
        let Some(journal) = journal_to_resume(resume, store, VERB, &job.axis)? else {
            return Ok(None);
        };
        let at = goes_on_at(store, &journal, job, &plan.calibration)?;
        Ok(Some(Self { journal, at }))
    }

    fn text(&self, job: &Job) -> String {
        let (repetition, number) = self.at;
        match job.points.get(number - 1) {
            Some(point) if repetition <= job.repetitions => format!(
                "goes on at repetition {repetition}, point {number} ({}), after {}",
                point.name,
                self.journal.display()
            ),
            _ => format!(
                "every point is done, but not the end, after {}",
                self.journal.display()
            ),
        }
    }

    fn value(&self) -> Value {
        let (repetition, number) = self.at;
        json!({"repetition": repetition, "number": number, "journal": self.journal})
    }
}

const VERB: &str = "run";

pub(crate) fn run(args: &MachineArgs, file: &Path, options: &JobOptions, output: Output) -> Ended {
    let text = read(file)?;
    let loaded = config::load(&args.config)?;
    let job = Job::parse(&text, &name_of(file), &loaded.config)?;
    let store = loaded.config.machine.store();
    let plan = JobPlan::of(&job, &loaded, &store)?;
    plan.require(&job.axis, options.beyond)?;
    let goes_on = GoesOn::of(options.resume.as_ref(), &store, &job, &plan)?;
    if options.dry_run {
        let mut text = planned_text(&job, &plan);
        text += &goes_on
            .as_ref()
            .map_or(String::new(), |it| format!("\n  {}", it.text(&job)));
        let mut value = planned_value(&job, &plan);
        value["goes_on"] = json!(goes_on.as_ref().map(GoesOn::value));
        return output.result(&text, &value);
    }
    if let Some(it) = &goes_on {
        output.note(&format!("axis {}: {}", job.axis, it.text(&job)));
    }
    let asked = Asked {
        job: &job,
        goes_on: goes_on.as_ref().map(|it| it.journal.as_path()),
        is_alone: options.yes || !job.needs_operator(),
    };
    or_by_its_service(done(args, &asked, output), |service| {
        let request = json!({
            "axis": job.axis,
            "job": text,
            "beyond": options.beyond,
            "resume": asked.goes_on.and_then(|it| it.file_stem()).map(|it| it.to_string_lossy()),
        });
        let by = (asked.is_alone, args.hand());
        service.do_job(args, (&job.axis, request), by, output)
    })
}

/// A job that is to be done.
struct Asked<'a> {
    job: &'a Job,
    /// The journal that it goes on with.
    goes_on: Option<&'a Path>,
    /// Whether nobody is waited for.
    is_alone: bool,
}

/// Does the job here.
fn done(args: &MachineArgs, asked: &Asked<'_>, output: Output) -> Ended {
    let (job, journal) = (asked.job, asked.goes_on);
    let terminal = Terminal::new(asked.is_alone, args.hand(), output)?;
    let mut beside = Beside { terminal, output };
    let mut session = Session::open(args, VERB, Use::Motion, output)?;
    let store = session.store.clone();
    let (done, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        machine.linear(&job.axis)?.load_active(&store)?;
        machine.linear(&job.axis)?.zero(&store)?;
        let mut stage = machine.linear(&job.axis)?;
        let done = resumable(&store, VERB, &job.axis, journal, || match journal {
            None => stage.run_job(&store, job, &mut beside),
            Some(journal) => stage.resume_job(&store, job, journal, &mut beside),
        })?;
        machine.shut_down()?;
        Ok((done, to_json::counters(&machine.devices().counters())))
    })?;
    let mut value = done_value(job, &done);
    value["counters"] = counters;
    output.result(&done_text(job, &done), &value)
}

/// What a person is asked by a job that a service does.
pub(crate) static GO_ON_ASKED: AskedOf = AskedOf {
    what: GO_ON,
    ask: |terminal, text, task| {
        // It says itself what else is in the text.
        terminal.ask_to_go_on(&plain(task["text"].as_str().unwrap_or(text)))
    },
    answer: entered,
};

/// The operator, who also sees each point as it is reached.
struct Beside {
    terminal: Terminal,
    output: Output,
}

impl JobOperator for Beside {
    fn ask(&mut self, text: &str) -> Result<(), Failure> {
        self.terminal.ask_to_go_on(text)
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        self.terminal.has_entered()
    }

    fn reached(&mut self, it: &Reached) {
        self.output.note(&noted(&reached_text(it)));
    }
}

/// A point among what else is told meanwhile.
pub(crate) fn noted(reached: &str) -> String {
    format!("  {reached}")
}

fn interval_text(interval: Option<(Metres, Metres)>) -> String {
    interval.map_or("beyond the calibrated range".into(), |(from, to)| {
        format!("interval {} to {} mm", Short(from.mm()), Short(to.mm()))
    })
}

fn interval_value(interval: Option<(Metres, Metres)>) -> Value {
    interval.map_or(Value::Null, |(from, to)| json!([from.mm(), to.mm()]))
}

pub(crate) fn reached_text(it: &Reached) -> String {
    let (number, of) = it.number;
    let place = it.moved.place.unwrap_or(it.moved.encoder);
    let name = &it.name;
    format!(
        "repetition {}, point {number} of {of} ({name}): at {:.6} mm, {}",
        it.repetition,
        place.mm(),
        moved::uncertainty_of(&it.moved)
    )
}

fn planned_text(job: &Job, plan: &JobPlan) -> String {
    let head = format!(
        "axis {}: {} points, {} repetition(s), corrected by calibration {}; nothing was opened, so who the drive \
         is was not compared",
        job.axis,
        job.points.len(),
        job.repetitions,
        short(&plan.calibration)
    );
    let each = plan.points.iter().map(|it| {
        let u = it.uncertainty.as_ref();
        let u = u.map_or("U NOT STATED".into(), uncertainty::said);
        let warning = moved::warning_of(it.corrected, it.target);
        let warning = warning.map_or(String::new(), |it| format!("\n    {it}"));
        format!(
            "\n  {}: {:.6} mm, {}, approach {}, set-point {:.6} mm, {u}{warning}",
            it.name,
            it.target.mm(),
            interval_text(it.interval),
            it.approach.symbol(),
            it.set_point.mm(),
        )
    });
    head + &each.collect::<String>()
}

fn planned_value(job: &Job, plan: &JobPlan) -> Value {
    let point = |it: &PlannedPoint| {
        json!({
            "name": it.name,
            "target_mm": it.target.mm(),
            "interval_mm": interval_value(it.interval),
            "approach": it.approach.symbol().to_string(),
            "set_point_mm": it.set_point.mm(),
            "uncertainty": uncertainty::combined(it.uncertainty),
            "warning": moved::warning_of(it.corrected, it.target),
        })
    };
    json!({
        "axis": job.axis,
        "dry_run": true,
        "calibration": plan.calibration,
        "repetitions": job.repetitions,
        "points": plan.points.iter().map(point).collect::<Vec<_>>(),
    })
}

pub(crate) fn done_text(job: &Job, done: &JobDone) -> String {
    let stated = done.reached.iter().filter_map(|it| it.moved.uncertainty);
    let most =
        stated.clone().reduce(
            |a, b| match b.standard_uncertainty > a.standard_uncertainty {
                true => b,
                false => a,
            },
        );
    let unstated = done.reached.len() - stated.count();
    let mut text = format!(
        "axis {}: {} points reached in {} repetition(s), corrected by calibration {}",
        job.axis,
        done.reached.len(),
        job.repetitions,
        short(&done.calibration)
    );
    if done.before > 0 {
        text += &format!(
            ", after {} that were reached before the interruption",
            done.before
        );
    }
    if let Some(most) = most {
        text += &format!("\n  at most {}", uncertainty::said(&most));
    }
    if unstated > 0 {
        text += &format!("\n  at {unstated} of them the uncertainty is NOT STATED");
    }
    text + &format!("\n  each point in {}", done.journal.display())
}

pub(crate) fn reached_value(job: &Job, calibration: &str, it: &Reached) -> Value {
    let mut value = moved::value(&job.axis, &it.moved, Some(calibration));
    value["repetition"] = json!(it.repetition);
    value["number"] = json!(it.number.0);
    value["name"] = json!(it.name);
    value["approach"] = json!(it.moved.approach.symbol().to_string());
    value["interval_mm"] = interval_value(it.interval);
    value
}

pub(crate) fn done_value(job: &Job, done: &JobDone) -> Value {
    let point = |it: &Reached| reached_value(job, &done.calibration, it);
    json!({
        "axis": job.axis,
        "calibration": done.calibration,
        "repetitions": job.repetitions,
        "points_before": done.before,
        "points": done.reached.iter().map(point).collect::<Vec<_>>(),
        "journal": done.journal,
    })
}
