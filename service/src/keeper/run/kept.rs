//! The runs that are kept, and what is published of them.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use truestage::runs::{self, Group};

use crate::order::Judged;
use crate::problem::{Code, Problem};
use crate::request::{RunKind, RunRequest};
use crate::view::{RunState, RunView, Stopped};

/// So many runs are kept in the snapshot.
const KEPT: usize = 64;
/// So many paths and jobs may wait.
const PATHS: usize = 4;

/// What the machine's thread is to do for a run.
#[derive(Clone, Debug)]
pub(crate) struct Task {
    pub(crate) id: Arc<str>,
    pub(crate) request: RunRequest,
    /// What it is for.
    pub(crate) group: Arc<Group>,
    /// Whether it goes on where it was left.
    pub(crate) is_resumed: bool,
    /// The journal that it goes on with.
    pub(crate) resume: Option<PathBuf>,
    /// The path that it follows, the job that it does, or the files that it takes.
    pub(super) judged: Option<Judged>,
}

impl Task {
    /// What its procedure is to do.
    pub(crate) fn of_procedure(&self) -> runs::Task {
        runs::Task {
            stage: self.request.kind.stage(),
            resume: self.resume.clone(),
            accept_drift: self.request.accept_drift,
            aside: self.request.aside,
            verify: self.request.verify,
            uncompensated: self.request.uncompensated,
            warm_up_min: self.request.warm_up_min,
            memory: self.request.kind.memory(),
            first_part: self.request.kind == RunKind::FirstPart,
            path: match &self.judged {
                Some(Judged::Path { path, .. }) => Some(path.clone()),
                _ => None,
            },
            job: match &self.judged {
                Some(Judged::Job { job, .. }) => Some(job.clone()),
                _ => None,
            },
            files: match &self.judged {
                Some(Judged::Files { files, .. }) => files.clone(),
                _ => Vec::new(),
            },
        }
    }

    /// Whether it is done by files, without any axis.
    pub(super) const fn has_files(&self) -> bool {
        matches!(self.judged, Some(Judged::Files { .. }))
    }
}

#[derive(Clone, Debug)]
pub(in crate::keeper) struct Run {
    pub(in crate::keeper) task: Task,
    pub(super) axes: Vec<usize>,
    pub(in crate::keeper) view: RunView,
    /// Its view as it was published last; `None` since it may have changed.
    published: Option<Arc<RunView>>,
    /// So many questions were asked.
    pub(in crate::keeper) asked: u32,
    /// Whether hands stay in the machine after the last one was answered.
    pub(in crate::keeper) has_hands: bool,
    /// The last that was answered, and how.
    pub(in crate::keeper) answered: Option<(u32, String)>,
    /// Somebody stopped it; it ends so when its procedure has ended and its axes stand.
    pub(super) stopped: Option<Stopped>,
    /// Somebody pauses it, likewise; a stop counts for more.
    pub(super) is_pausing: bool,
    /// Its procedure has ended.
    pub(super) is_over: bool,
}

impl Run {
    pub(super) const fn new(task: Task, axes: Vec<usize>, view: RunView) -> Self {
        Self {
            task,
            axes,
            view,
            published: None,
            asked: 0,
            has_hands: false,
            answered: None,
            stopped: None,
            is_pausing: false,
            is_over: false,
        }
    }

    /// Its view for a snapshot, the same one until it changes: what it found is large.
    fn publish(&mut self) -> Arc<RunView> {
        let view = &self.view;
        let shown = self.published.get_or_insert_with(|| Arc::new(view.clone()));
        Arc::clone(shown)
    }

    /// For whoever changes it.
    fn changing(&mut self) -> &mut Self {
        self.published = None;
        self
    }

    /// Whether it can be paused; of one that has ended, whether it can go on with what its journal has.
    pub(super) fn can_go_on(&self) -> bool {
        match self.view.state {
            RunState::Planned | RunState::Running | RunState::Stopping | RunState::Paused => {
                self.task.is_resumed
            }
            RunState::Done => false,
            RunState::Stopped | RunState::Failed | RunState::TimedOut => {
                self.task.is_resumed && self.has_left()
            }
        }
    }

    /// Whether it has left a journal that nobody else goes on with, and has no result.
    fn has_left(&self) -> bool {
        // What was measured elsewhere is in its request, which is not kept.
        let has_all = self.view.kind != RunKind::Job || self.task.judged.is_some();
        self.view.journal.is_some()
            && self.view.result.is_null()
            && has_all
            && !self.task.has_files()
    }

    /// Whether it keeps what it goes along.
    const fn holds(&self) -> bool {
        self.task.judged.is_some()
    }

    /// What it goes along is kept as long as it may be gone on with.
    pub(super) fn let_go(&mut self) {
        self.view.can_resume = self.can_go_on();
        if self.view.state.is_end() && !self.view.can_resume {
            // What was done by files is not gone on with by driving.
            self.task.is_resumed &= !self.task.has_files();
            self.task.judged = None;
        }
    }

    /// Another run goes on with its journal: nobody goes on with it twice.
    fn give_up(&mut self) {
        self.task.is_resumed = false;
        self.let_go();
    }

    /// Whether its procedure is to end before it is complete.
    const fn is_to_end(&self) -> bool {
        self.stopped.is_some() || self.is_pausing
    }
}

/// All runs.
#[derive(Debug, Default)]
pub(in crate::keeper) struct Runs {
    pub(super) kept: VecDeque<Run>,
    published: Option<Arc<Vec<Arc<RunView>>>>,
}

impl Runs {
    /// The list for a snapshot, the same one until something changes.
    pub(in crate::keeper) fn list(&mut self) -> Arc<Vec<Arc<RunView>>> {
        let kept = &mut self.kept;
        let list = self
            .published
            .get_or_insert_with(|| Arc::new(kept.iter_mut().map(Run::publish).collect()));
        Arc::clone(list)
    }

    /// Whether the procedure that runs has to end.
    pub(in crate::keeper) fn is_to_end(&self) -> bool {
        self.kept.iter().any(|it| it.is_to_end() && !it.is_over)
    }

    /// One more; the oldest that is over or was never begun makes room.
    pub(super) fn keep(&mut self, run: Run) {
        self.kept.push_back(run);
        if self.kept.len() > KEPT {
            let is_old = |it: &Run| it.view.state.is_end() || it.view.state == RunState::Planned;
            let old = self.kept.iter().position(is_old);
            old.map(|at| self.kept.remove(at));
        }
        self.published = None;
    }

    /// Paths are long, and wait in memory until they are followed; so do jobs and files. Jobs that have ended, and could go
    /// on, make room.
    pub(super) fn make_room_for(&mut self, judged: Option<&Judged>) -> Result<(), Problem> {
        let waiting = self.kept.iter().filter(|it| it.holds());
        if judged.is_none() || waiting.count() < PATHS {
            return Ok(());
        }
        let mut kept = self.kept.iter_mut();
        if let Some(ended) = kept.find(|it| it.holds() && it.view.state.is_end()) {
            ended.changing().give_up();
            self.published = None;
            return Ok(());
        }
        let what = format!("{PATHS} paths, jobs and files are planned or under way");
        Err(Problem::new(Code::Busy, what, "start them, or abort one"))
    }

    /// The run `id` goes on with `journal`: the others that have left it, which are returned, do not.
    pub(super) fn give_up_others(&mut self, id: &str, journal: &str) -> Vec<String> {
        let is_other = |it: &&mut Run| {
            *it.task.id != *id && it.view.journal.as_deref() == Some(journal) && it.can_go_on()
        };
        let mut others = Vec::new();
        for run in self.kept.iter_mut().filter(is_other) {
            run.changing().give_up();
            others.push(run.view.id.clone());
        }
        self.published = None;
        others
    }

    pub(in crate::keeper) fn find(&mut self, id: &str) -> Result<&mut Run, Problem> {
        self.published = None;
        let found = self.kept.iter_mut().find(|it| *it.task.id == *id);
        found
            .map(Run::changing)
            .ok_or_else(|| Problem::new(Code::NoSuchRun, format!("there is no run {id}"), ""))
    }

    /// The one that goes on, and is not to end, to look at.
    pub(in crate::keeper) fn running(&self) -> Option<&Run> {
        self.kept
            .iter()
            .find(|it| it.view.state == RunState::Running)
    }

    /// The same, to change it.
    pub(in crate::keeper) fn running_mut(&mut self) -> Option<&mut Run> {
        let run = self.under_way();
        run.filter(|it| it.view.state == RunState::Running)
    }

    /// The one that goes on or is to end, to change it.
    pub(in crate::keeper) fn under_way(&mut self) -> Option<&mut Run> {
        let mut kept = self.kept.iter_mut();
        let run =
            kept.find(|it| matches!(it.view.state, RunState::Running | RunState::Stopping))?;
        self.published = None;
        Some(run.changing())
    }
}
