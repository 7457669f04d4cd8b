//! Runs: planned, started, stopped; what they do is sequential code on the machine's thread.

mod kept;
mod paused;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use machine::{Machine, Stage};
use serde_json::json;
use truestage::Failure;
use truestage::runs::{Found, Planned};

use super::mechanics::Mechanics;
use super::seat::Task as SeatTask;
use super::setup::shown;
use super::stop::{cause_of, stopped_by};
use super::{Job, Keeper, Mode};
use crate::order::Judged;
use crate::problem::{Code, Problem};
use crate::request::{RunKind, RunRequest};
use crate::snapshot::CalibrationInUse;
use crate::view::{Cause, RunPlanView, RunState, RunView, Stopped, StoredView, ToldView};
use kept::Run;
pub(super) use kept::Runs;
pub(crate) use kept::Task;

/// What it gave.
fn show_found(view: &mut RunView, found: Found) {
    if let Some(journal) = found.figures["journal"].as_str() {
        view.journal = Some(journal.to_owned());
    }
    view.result = found.figures;
    view.told = found.told.map(ToldView::from);
    view.made_worse = found.bad.as_ref().is_some_and(Failure::tells_worse);
    view.out_of_tolerance = found.bad.as_ref().map(cause_of);
    let stored = found.stored.into_iter();
    view.stored = stored
        .map(|(of, calibration)| StoredView { of, calibration })
        .collect();
}

/// What is done along it.
fn plan_along(judged: &Judged) -> RunPlanView {
    match judged {
        Judged::Path { path, .. } => RunPlanView::of_path(path),
        Judged::Job { job, .. } => shown(job.planned.clone()),
        // Nothing moves, and nobody is asked.
        Judged::Files { .. } => shown(Planned::default()),
    }
}

impl Keeper {
    /// Plans the run `id`; nothing moves.
    pub(super) fn plan_run(
        &mut self,
        id: &str,
        by: &str,
        request: &RunRequest,
        judged: Option<Judged>,
    ) -> Result<(), Problem> {
        let at = self.group_of(request.axis.as_deref())?;
        let plan = self.plan_of(request.kind, request.warm_up_min, at)?;
        if request.verify {
            // What cannot be verified is refused before anything is measured.
            self.plan_of(RunKind::Verify, None, at)?;
        }
        let along = judged.as_ref().map(plan_along);
        let plan = RunPlanView {
            bus_load: plan.bus_load.clone(),
            ..along.unwrap_or(plan)
        };
        self.runs.make_room_for(judged.as_ref())?;
        let grouped = &self.groups[at];
        let (group, axes) = (Arc::clone(&grouped.group), grouped.axes.clone());
        let task = Task {
            id: id.into(),
            request: request.clone(),
            is_resumed: grouped.is_resumed(request.kind),
            group,
            resume: judged.as_ref().and_then(Judged::resume).cloned(),
            judged,
        };
        task.group.refuse(&task.of_procedure())?;
        let of = (task.group.name.as_str(), task.group.axes.clone());
        let view = RunView {
            can_resume: task.is_resumed,
            ..RunView::planned(id, by, request.kind, of, plan)
        };
        self.events.push("run", id, json!(view));
        self.runs.keep(Run::new(task, axes, view));
        Ok(())
    }

    /// Begins the run `id` that was planned for that; one that cannot begin has failed.
    pub(super) fn start_planned(&mut self, machine: &Machine, id: &str) -> Result<(), Problem> {
        self.start_run(machine, id).inspect_err(|problem| {
            let cause = Cause {
                code: problem.code,
                cause: problem.detail(),
                exit_code: problem.exit_code,
            };
            self.run_failed(id, &cause);
        })
    }

    /// Begins the planned run `id` as soon as this tick has ended.
    pub(super) fn start_run(&mut self, machine: &Machine, id: &str) -> Result<(), Problem> {
        self.require_running()?;
        if self.runs.find(id)?.view.state != RunState::Planned {
            let what = format!("run {id} was started before");
            return Err(Problem::new(Code::RunState, what, "plan another one"));
        }
        self.begin(machine, id)
    }

    /// Begins the run `id`, or goes on with it.
    fn begin(&mut self, machine: &Machine, id: &str) -> Result<(), Problem> {
        self.require_running()?;
        let run = self.runs.find(id)?;
        let (axes, kind) = (run.axes.clone(), run.view.kind);
        let needs_zero = kind != RunKind::Zero && !run.task.has_files();
        self.require_no_run()?;
        for at in &axes {
            self.require_free(*at)?;
            if needs_zero {
                let zeroed = machine.require_zeroed(&self.seats[*at].name);
                zeroed.map_err(truestage::Failure::from)?;
            }
        }
        for at in axes {
            self.seats[at].task = SeatTask::Run(id.into(), kind);
            self.seats[at].rests_at = None;
        }
        self.job = Some(Job::Run(id.into()));
        let run = self.runs.find(id)?;
        (run.is_pausing, run.is_over, run.stopped) = (false, false, None);
        let journal = run.task.resume.clone();
        self.change_run(id, |view| {
            view.state = RunState::Running;
            view.begun += 1;
            (view.stopped, view.cause) = (None, None);
        });
        if let Some(journal) = journal {
            self.give_up_others(id, &paused::text(&journal));
        }
        Ok(())
    }

    /// The run `id` goes on with `journal`: no other one does.
    fn give_up_others(&mut self, id: &str, journal: &str) {
        for other in self.runs.give_up_others(id, journal) {
            let stopped = stopped_by(format!("run {id}, which goes on with its journal"));
            self.change_run(&other, |view| {
                if view.state == RunState::Paused {
                    view.state = RunState::Stopped;
                    view.stopped = Some(stopped);
                }
            });
        }
    }

    /// Ends the run `id`.
    pub(super) fn abort_run(
        &mut self,
        machine: &mut Machine,
        id: &str,
        by: &str,
    ) -> Result<(), Problem> {
        let run = self.runs.find(id)?;
        let stopped = stopped_by(by);
        match run.view.state {
            RunState::Planned | RunState::Paused => self.end_planned(id, stopped),
            RunState::Running => self.stop_run(machine, &stopped),
            // A level: it stays.
            RunState::Stopping
            | RunState::Done
            | RunState::Stopped
            | RunState::Failed
            | RunState::TimedOut => {}
        }
        Ok(())
    }

    /// The run `id`, which is not under way, ends as stopped.
    pub(super) fn end_planned(&mut self, id: &str, stopped: Stopped) {
        self.change_run(id, |view| {
            view.state = RunState::Stopped;
            view.stopped = Some(stopped);
        });
    }

    /// The run that is under way is stopped.
    pub(super) fn stop_runs(&mut self, machine: &mut Machine, stopped: &Stopped) {
        self.stop_run(machine, stopped);
    }

    fn stop_run(&mut self, machine: &mut Machine, stopped: &Stopped) {
        if let Some(run) = self.runs.under_way() {
            run.stopped.get_or_insert_with(|| stopped.clone());
            self.slow_down_run(machine);
        }
    }

    /// The axes of the run under way slow down, and its procedure ends.
    fn slow_down_run(&mut self, machine: &mut Machine) {
        let is_waiting = matches!(self.job, Some(Job::Run(_)));
        let Some(run) = self.runs.under_way() else {
            return;
        };
        run.view.state = RunState::Stopping;
        run.view.question = None;
        // What has not begun is over.
        run.is_over |= is_waiting;
        let id = Arc::clone(&run.task.id);
        if is_waiting {
            self.job = None;
        }
        self.halt_axes_of(machine, &id);
    }

    /// The run under way is to end as stopped, without a word to its axes.
    pub(super) fn end_runs_as(&mut self, stopped: &Stopped) {
        if let Some(run) = self.runs.under_way() {
            run.stopped.get_or_insert_with(|| stopped.clone());
            run.view.state = RunState::Stopping;
            run.is_over = true;
        }
    }

    /// The run under way ends as it was to end.
    pub(super) fn finish_runs(&mut self) {
        if let Some(run) = self.runs.under_way() {
            let (id, stopped) = (Arc::clone(&run.task.id), run.stopped.clone());
            self.change_run(&id, |view| {
                view.state = RunState::Stopped;
                view.stopped = stopped;
            });
        }
    }

    /// Stopped and paused runs are so when their axes stand.
    pub(super) fn advance_runs(&mut self) {
        let Some(run) = self
            .runs
            .kept
            .iter()
            .find(|it| it.view.state == RunState::Stopping && it.is_over)
        else {
            return;
        };
        let (id, stopped) = (Arc::clone(&run.task.id), run.stopped.clone());
        if !self.is_stopping(run.axes.iter().copied()) {
            self.change_run(&id, |view| {
                view.state = match stopped {
                    Some(_) => RunState::Stopped,
                    None => RunState::Paused,
                };
                view.stopped = stopped;
            });
        }
    }

    /// What is to be done for the run `id`.
    pub(crate) fn begin_run(&mut self, id: &str) -> Option<Task> {
        let task = self.runs.find(id).ok()?.task.clone();
        self.mode = Mode::Procedure;
        Some(task)
    }

    /// The procedure of the run `id` has ended.
    pub(crate) fn end_procedure(&mut self, id: &str) {
        self.mode = Mode::Idle;
        self.take_reached();
        let said = self.take_said();
        if let Ok(run) = self.runs.find(id) {
            run.is_over = true;
            run.view.question = None;
            run.view.said = said;
        }
    }

    /// The procedure of the run `id` has ended before its result, because somebody stopped or paused it, or the person
    /// who was asked did: its axes stand soon, also those that were moved together.
    pub(crate) fn run_interrupted(&mut self, machine: &mut Machine, id: &str) {
        if let Ok(run) = self.runs.find(id) {
            run.is_pausing |= run.stopped.is_none();
        }
        self.slow_down_run(machine);
    }

    /// The run `id` has its result, and was stopped or paused while that was verified: it ends as stopped when its axes
    /// stand, since nothing of it is left to go on with.
    pub(crate) fn run_cut_short(&mut self, machine: &mut Machine, id: &str, found: Found) {
        if let Ok(run) = self.runs.find(id) {
            let by = match run.is_pausing {
                true => "whoever paused it",
                false => "whoever was asked",
            };
            run.stopped.get_or_insert_with(|| stopped_by(by));
        }
        self.change_run(id, |view| show_found(view, found));
        self.slow_down_run(machine);
    }

    /// The run `id` has its result.
    pub(crate) fn run_done(&mut self, id: &str, found: Found) {
        self.free_axes_of(id);
        self.change_run(id, |view| {
            view.state = RunState::Done;
            view.steps_done = view.steps;
            show_found(view, found);
        });
    }

    /// The run `id` has its result, and what ended its verification stops the machine: that ends it, too.
    pub(crate) fn run_found(&mut self, id: &str, found: Found) {
        self.change_run(id, |view| show_found(view, found));
    }

    /// The run `id` has no result, and its axes stand.
    pub(crate) fn run_failed(&mut self, id: &str, cause: &Cause) {
        for seat in &mut self.seats {
            if seat.is_of(id) {
                seat.last_cause = Some(Arc::new(cause.clone()));
            }
        }
        self.free_axes_of(id);
        self.change_run(id, |view| {
            view.state = match cause.is_overdue() {
                true => RunState::TimedOut,
                false => RunState::Failed,
            };
            view.question = None;
            view.cause = Some(cause.clone());
        });
    }

    /// What is under way fails.
    pub(super) fn fail_runs(&mut self, cause: &Cause) {
        if let Some(run) = self.runs.under_way() {
            run.is_over = true;
            let id = Arc::clone(&run.task.id);
            self.run_failed(&id, cause);
        }
    }

    fn free_axes_of(&mut self, id: &str) {
        for seat in &mut self.seats {
            if seat.is_of(id) {
                seat.task = SeatTask::Free;
            }
        }
    }

    pub(super) fn run_progress(&mut self, stage: Stage, done: u64, total: u64) {
        let Some(run) = self.runs.under_way() else {
            return;
        };
        (run.view.steps_done, run.view.steps) = (done, total);
        let id = Arc::clone(&run.task.id);
        let data = json!({"stage": stage.text(), "steps_done": done, "steps": total});
        self.events.push("run", &id, data);
    }

    pub(super) fn change_run(&mut self, id: &str, change: impl FnOnce(&mut RunView)) {
        let Ok(run) = self.runs.find(id) else {
            return;
        };
        change(&mut run.view);
        run.let_go();
        let data = run.view.changed();
        self.events.push("run", id, data);
    }

    /// What corrects the moves of the axis at `name` from now on.
    pub(crate) fn set_mechanics(
        &mut self,
        name: &str,
        mechanics: Mechanics,
        calibration: Option<CalibrationInUse>,
    ) {
        if let Some(seat) = self.seats.iter_mut().find(|it| *it.name == *name) {
            seat.mechanics = mechanics;
            seat.calibration = calibration.map(Arc::new);
        }
    }
}
