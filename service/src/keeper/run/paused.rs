//! Runs that are paused or have ended before their result, and those that an earlier service left: they go on with what was
//! measured.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use machine::Machine;
use machine::records::InterruptedRun;
use serde_json::json;

use super::super::Keeper;
use super::{Run, Task};
use crate::problem::{Code, Problem};
use crate::request::{RunKind, RunRequest};
use crate::view::{RunState, RunView};

/// Who left a run that is found at the start.
const EARLIER: &str = "an earlier service or program";

impl Keeper {
    /// Lets the run `id` end where it is, so that it can go on later; a level: a run that is paused stays so.
    pub(in super::super) fn pause_run(
        &mut self,
        machine: &mut Machine,
        id: &str,
    ) -> Result<(), Problem> {
        let run = self.runs.find(id)?;
        match run.view.state {
            RunState::Running if run.task.is_resumed => {
                run.is_pausing = true;
                self.slow_down_run(machine);
                Ok(())
            }
            RunState::Paused => Ok(()),
            RunState::Running => Err(Problem::new(
                Code::RunState,
                format!("run {id} cannot go on where it was left"),
                "abort it, and start it again",
            )),
            _ => Err(Problem::new(
                Code::RunState,
                format!("run {id} is not under way"),
                "only a run that is under way can be paused",
            )),
        }
    }

    /// The run `id` goes on as soon as this tick has ended.
    pub(in super::super) fn resume_run(
        &mut self,
        machine: &Machine,
        id: &str,
    ) -> Result<(), Problem> {
        let run = self.runs.find(id)?;
        let has_ended = run.view.state.is_end();
        let why = match run.view.state {
            RunState::Planned => "was not begun yet",
            RunState::Running | RunState::Stopping => "is under way",
            RunState::Done => "has its result",
            _ if run.can_go_on() => return self.begin(machine, id),
            _ => "has left nothing that it could go on with",
        };
        let what = format!("run {id} {why}");
        let help = match has_ended {
            true => "plan another one",
            false => "look what it does",
        };
        Err(Problem::new(Code::RunState, what, help))
    }

    /// The procedure of the run `id` has ended early; what it measured is in `journal`.
    pub(crate) fn run_left(&mut self, id: &str, journal: Option<PathBuf>) {
        if let Ok(run) = self.runs.find(id) {
            run.view.journal = journal.as_deref().map(text);
            run.task.resume = journal;
        }
    }

    /// A run of `kind` that was interrupted before this service began is offered as a paused one. One that the
    /// configuration does not know any more is not.
    pub(crate) fn offer_run(&mut self, kind: RunKind, found: &InterruptedRun) {
        let journals = &found.header.axis;
        let mut groups = self.groups.iter();
        let Some(at) = groups.position(|it| it.group.journals() == journals) else {
            return;
        };
        let grouped = &self.groups[at];
        let warm_up_min = grouped.group.warm_up_min(&found.journal);
        let Ok(plan) = self.plan_of(kind, warm_up_min, at) else {
            return;
        };
        let (group, axes) = (Arc::clone(&grouped.group), grouped.axes.clone());
        let id = found.journal.file_stem().unwrap_or_default();
        let id = id.to_string_lossy().into_owned();
        let request = RunRequest {
            uncompensated: kind == RunKind::Verify && found.header.calibration.is_none(),
            warm_up_min,
            start: false,
            ..RunRequest::of(kind, Some(&group.name))
        };
        let view = RunView {
            state: RunState::Paused,
            can_resume: true,
            journal: Some(text(&found.journal)),
            ..RunView::planned(&id, EARLIER, kind, (&group.name, group.axes.clone()), plan)
        };
        self.events.push("run", &id, json!(view));
        let task = Task {
            id: id.into(),
            request,
            group,
            is_resumed: true,
            resume: Some(found.journal.clone()),
            judged: None,
        };
        self.runs.keep(Run::new(task, axes, view));
    }
}

pub(super) fn text(path: &Path) -> String {
    path.display().to_string()
}
