//! Runs: planned, started, paused, awaited.

use core::time::Duration;
use std::sync::Arc;

use super::{Desk, await_end};
use crate::ledger::{Asked, AskedRun, End, Noted};
use crate::order::{Judged, Order};
use crate::problem::{Code, Problem};
use crate::request::{AnswerRequest, Caller, RunRequest};
use crate::view::RunView;

/// What a request for a run comes to before the machine is asked.
pub(crate) enum Prepared {
    /// It was made before: the run that it became.
    Before(String),
    /// It is judged, on the disk under this name when it has a key, and may be ordered.
    New(String, Box<Order>),
}

/// Runs.
impl Desk {
    /// Plans a run, and starts it when the request says so; returns its name. With a `key`, the same request never makes
    /// two runs: it returns the one that it became the first time, even after a restart.
    ///
    /// # Errors
    /// When it is refused; nothing has moved then.
    pub fn plan_run(
        &self,
        caller: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let arrival = self.stops().arrival();
        match self.prepare_run(caller, request, key)? {
            Prepared::Before(id) => Ok(id),
            Prepared::New(id, order) => {
                let planned = self.done_since(arrival, caller, *order);
                self.settle_run(id, key, planned)
            }
        }
    }

    /// Looks whether a request was made before; one that was not is noted and judged.
    pub(crate) fn prepare_run(
        &self,
        caller: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<Prepared, Problem> {
        let (id, noted) = self.note_run(caller, request, key)?;
        if let Noted::Before(id) = noted {
            return Ok(Prepared::Before(id));
        }
        match self.judge_run(request) {
            Ok(judged) => {
                let order = Self::plan_order(&id, request, judged);
                Ok(Prepared::New(id, Box::new(order)))
            }
            Err(problem) => self.settle_run(id, key, Err(problem)).map(Prepared::Before),
        }
    }

    /// Looks whether a request with a key was made before, and notes it when it was not. Waits for the disk.
    fn note_run(
        &self,
        caller: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<(String, Noted), Problem> {
        let id = self.ledger().next_id('r');
        let Some(key) = key else {
            self.ledger().require_storage()?;
            return Ok((id, Noted::New));
        };
        let asked = AskedRun::now(&id, key, &caller.name, request);
        let noted = self.ledger().note(Asked::Run(asked))?;
        Ok((id, noted))
    }

    /// What became of the order of a run.
    pub(crate) fn settle_run(
        &self,
        id: String,
        key: Option<&str>,
        answered: Result<(), Problem>,
    ) -> Result<String, Problem> {
        match key {
            Some(_) => self.settle_motion(id, answered),
            None => answered.map(|()| id),
        }
    }

    /// The text of what was judged stays here.
    fn plan_order(id: &str, request: &RunRequest, judged: Option<Judged>) -> Order {
        let axis = match &judged {
            // It says itself which one does it.
            Some(Judged::Job { job, .. }) => Some(job.axis.clone()),
            Some(Judged::Path { group, .. }) => Some(group.clone()),
            Some(Judged::Files { .. }) | None => request.axis.clone(),
        };
        let request = RunRequest {
            axis,
            path: None,
            job: None,
            files: Vec::new(),
            ..request.clone()
        };
        Order::Plan {
            id: id.to_owned(),
            request: Box::new(request),
            judged,
        }
    }

    /// Begins the planned run `id`.
    ///
    /// # Errors
    /// When it is not planned any more, or an axis is in use.
    pub fn start_run(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        self.require_storage()?;
        let run = id.to_owned();
        self.done(caller, Order::Start { run })
    }

    /// Refuses what needs a disk.
    pub(crate) fn require_storage(&self) -> Result<(), Problem> {
        self.ledger().require_storage()
    }

    /// Ends the run `id`.
    ///
    /// # Errors
    /// When there is none.
    pub fn abort_run(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        let run = id.to_owned();
        self.done(caller, Order::Abort { run })
    }

    /// Lets the run `id` end where it is, so that it can go on; its axes are free meanwhile.
    ///
    /// # Errors
    /// When there is none, it is not under way, or it is a zero.
    pub fn pause_run(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        let run = id.to_owned();
        self.done(caller, Order::Pause { run })
    }

    /// The run `id`, which was paused or stopped, has failed or timed out, goes on with what its journal has.
    ///
    /// # Errors
    /// When there is none, it cannot go on, an axis is in use or has no zero.
    pub fn resume_run(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        self.require_storage()?;
        let run = id.to_owned();
        self.done(caller, Order::Resume { run })
    }

    /// Answers the question that the run `id` waits with.
    ///
    /// # Errors
    /// When it asks nothing, asks something else, or cannot be answered so.
    pub fn answer_run(
        &self,
        caller: &Caller,
        id: &str,
        answer: &AnswerRequest,
    ) -> Result<(), Problem> {
        let (run, answer) = (id.to_owned(), answer.clone());
        self.done(
            caller,
            Order::Answer {
                run,
                answer,
                text: Ok(()),
            },
        )
    }

    /// The run `id`, also one with a key of before a restart.
    ///
    /// # Errors
    /// When there is none.
    pub fn run(&self, id: &str) -> Result<RunView, Problem> {
        let id = &*self.ledger().whole_name(id);
        let snapshot = self.snapshot();
        let found = snapshot.runs.iter().find(|view| view.id == *id);
        let found = found.map(|view| self.run_with_kept(view));
        found
            .or_else(|| self.ledger().run(id))
            .ok_or_else(|| Problem::new(Code::NoSuchRun, format!("there is no run {id}"), ""))
    }

    /// The run `id` once it has ended, or after `limit`, whichever comes first.
    ///
    /// # Errors
    /// When there is none.
    pub fn wait_run(&self, id: &str, limit: Duration) -> Result<RunView, Problem> {
        await_end(limit, || self.run(id))
    }

    /// A run of a snapshot. Its end goes to the disk at once.
    fn run_with_kept(&self, view: &Arc<RunView>) -> RunView {
        let ended = view.state.is_end().then(|| End::Run(Arc::clone(view)));
        RunView {
            kept: ended.and_then(|end| self.ledger().end(end)),
            ..RunView::clone(view)
        }
    }

    /// The runs that are known.
    pub fn runs(&self) -> Vec<RunView> {
        let snapshot = self.snapshot();
        let runs = snapshot.runs.iter();
        runs.map(|view| self.run_with_kept(view)).collect()
    }
}
