//! Runs: planned, started, paused, awaited.

use core::time::Duration;
use std::thread;
use std::time::Instant;

use super::{Desk, LOOK_EVERY};
use crate::order::{Judged, Order};
use crate::problem::{Code, Problem};
use crate::request::{AnswerRequest, Caller, RunRequest};
use crate::view::RunView;

/// Runs.
impl Desk {
    /// Plans a run, and starts it when the request says so; returns its name.
    ///
    /// # Errors
    /// When it is refused; nothing has moved then.
    pub fn plan_run(&self, caller: &Caller, request: &RunRequest) -> Result<String, Problem> {
        let id = self.next_run();
        let order = Self::plan_order(&id, request, self.judge_run(request)?);
        self.done(caller, order)?;
        Ok(id)
    }

    /// The text of what was judged stays here.
    pub(crate) fn plan_order(id: &str, request: &RunRequest, judged: Option<Judged>) -> Order {
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

    pub(crate) fn next_run(&self) -> String {
        self.ledger().next_id('r')
    }

    /// Begins the planned run `id`.
    ///
    /// # Errors
    /// When it is not planned any more, or an axis is in use.
    pub fn start_run(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        let run = id.to_owned();
        self.done(caller, Order::Start { run })
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

    /// The run `id`.
    ///
    /// # Errors
    /// When there is none.
    pub fn run(&self, id: &str) -> Result<RunView, Problem> {
        let found = self.runs().into_iter().find(|it| it.id == *id);
        found.ok_or_else(|| Problem::new(Code::NoSuchRun, format!("there is no run {id}"), ""))
    }

    /// The run `id` once it has ended, or after `limit`, whichever comes first.
    ///
    /// # Errors
    /// When there is none.
    pub fn wait_run(&self, id: &str, limit: Duration) -> Result<RunView, Problem> {
        let begun = Instant::now();
        loop {
            let view = self.run(id)?;
            if view.state.is_end() || begun.elapsed() >= limit {
                return Ok(view);
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    /// The runs that are known.
    pub fn runs(&self) -> Vec<RunView> {
        let snapshot = self.snapshot();
        snapshot.runs.iter().map(|it| RunView::clone(it)).collect()
    }
}
