//! Runs: planned, started, paused, awaited.

use core::time::Duration;
use std::thread;
use std::time::Instant;

use super::{Desk, LOOK_EVERY, Noted, key_reused, storage};
use crate::ledger::AskedRun;
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
        match self.prepare_run(caller, request, key)? {
            Prepared::Before(id) => Ok(id),
            Prepared::New(id, order) => {
                let planned = self.done(caller, *order);
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
        let id = match self.note_run(caller, request, key)? {
            Noted::Before(id) => return Ok(Prepared::Before(id)),
            Noted::New(id) => id,
        };
        match self.judge_run(request) {
            Ok(judged) => {
                let order = Self::plan_order(&id, request, judged);
                Ok(Prepared::New(id, Box::new(order)))
            }
            Err(problem) => self.settle_run(id, key, Err(problem)).map(Prepared::Before),
        }
    }

    /// Notes a request with a key that was not made before.
    fn note_run(
        &self,
        caller: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<Noted, Problem> {
        let mut ledger = self.ledger();
        let id = ledger.next_id('r');
        let Some(key) = key else {
            return Ok(Noted::New(id));
        };
        if let Some(before) = ledger.run_of_key(key) {
            return match before.is(request) {
                true => Ok(Noted::Before(before.id.clone())),
                false => Err(key_reused(&format!("run {}", before.id))),
            };
        }
        if let Some(motion) = ledger.of_key(key) {
            return Err(key_reused(&format!("motion {}", motion.id)));
        }
        let asked = AskedRun::now(&id, key, &caller.name, request);
        ledger.ask_run(asked).map_err(|it| storage(&it))?;
        Ok(Noted::New(id))
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

    /// The run `id`, also one with a key of before a restart.
    ///
    /// # Errors
    /// When there is none.
    pub fn run(&self, id: &str) -> Result<RunView, Problem> {
        let snapshot = self.snapshot();
        let found = snapshot.runs.iter().find(|it| it.id == *id);
        let found = found.map(|it| RunView::clone(it));
        found
            .or_else(|| self.ledger().run(id))
            .ok_or_else(|| Problem::new(Code::NoSuchRun, format!("there is no run {id}"), ""))
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
