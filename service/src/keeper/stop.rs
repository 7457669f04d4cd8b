//! Stops, and what an axis does between two tasks.

use core::mem;

use machine::{Driving, Failure, Machine};
use serde_json::json;

use super::seat::Task;
use super::{Job, Keeper, Mode, utc_now};
use crate::order::Answer;
use crate::problem::{Code, Problem, code_of};
use crate::request::StopMode;
use crate::view::{Cause, Stopped};

impl Keeper {
    /// Stops everything: whatever is under way ends as stopped by `by` when its axes stand.
    pub(super) fn stop(&mut self, machine: &mut Machine, mode: StopMode, by: &str) {
        let stopped = stopped_by(by);
        self.events
            .push("stop", "", json!({"by": by, "mode": mode}));
        self.stop_motions(machine, &stopped);
        self.stop_runs(machine, &stopped);
        // What is not supervised has been stopped already.
        let is_supervised = matches!(self.mode, Mode::Idle | Mode::Procedure);
        if mode == StopMode::Quick && is_supervised {
            for at in 0..self.seats.len() {
                self.quick_stop(machine, at);
            }
        }
    }

    fn quick_stop(&mut self, machine: &mut Machine, at: usize) {
        let seat = &mut self.seats[at];
        if let Ok(mut driving) = Driving::of(machine, &seat.name) {
            driving.quick_stop();
            let before = mem::replace(&mut seat.task, Task::Stopping);
            if let Task::Power(Some(reply)) = before {
                self.answers.push((reply, Err(stopped_problem())));
            }
        }
    }

    /// Slows the axis down; it is `Stopping` until it stands.
    pub(super) fn halt(&mut self, machine: &mut Machine, at: usize) {
        let seat = &mut self.seats[at];
        if let Ok(mut driving) = Driving::of(machine, &seat.name)
            && driving.halt()
        {
            seat.task = Task::Stopping;
        }
    }

    /// Slows down what the motion or run `id` has.
    pub(super) fn halt_axes_of(&mut self, machine: &mut Machine, id: &str) {
        for at in 0..self.seats.len() {
            if self.seats[at].is_of(id) {
                self.halt(machine, at);
            }
        }
    }

    /// Whether one of these axes still slows down.
    pub(super) fn is_stopping(&self, mut axes: impl Iterator<Item = usize>) -> bool {
        axes.any(|at| matches!(self.seats[at].task, Task::Stopping))
    }

    /// Takes the outcomes of stops and of changes of power.
    pub(super) fn advance_seats(&mut self, machine: &mut Machine) -> Result<(), Failure> {
        let answers = &mut self.answers;
        for seat in &mut self.seats {
            let (Task::Stopping | Task::Power(_)) = seat.task else {
                continue;
            };
            let Some(outcome) = Driving::of(machine, &seat.name)?.outcome() else {
                continue;
            };
            match mem::replace(&mut seat.task, Task::Free) {
                Task::Power(Some(reply)) => {
                    let answer = outcome.map(|()| Answer::Done);
                    let failed = |it| truestage::Failure::from(it).into();
                    answers.push((reply, answer.map_err(failed)));
                }
                // An axis that cannot be stopped stops the machine.
                _ => outcome?,
            }
        }
        Ok(())
    }

    /// The service ends for `by`: what is under way ends as stopped.
    pub(crate) fn stop_all_for(&mut self, by: &str) {
        self.events
            .push("stop", "", json!({"by": by, "mode": StopMode::Quick}));
        let stopped = stopped_by(by);
        self.end_motions_as(&stopped);
        self.end_runs_as(&stopped);
    }

    /// The axes stand: everything ends as it was to end.
    pub(crate) fn end_all(&mut self, machine: &Machine) {
        self.finish_motions(machine);
        self.finish_runs();
        self.free_all(&Cause {
            code: Code::Ending,
            cause: "the service ends".into(),
            exit_code: Code::Ending.exit_code(),
        });
        self.publish(machine);
        self.send_answers();
    }

    /// Something that a person should look after.
    pub(crate) fn warn(&mut self, text: &str) {
        self.events.push("warning", "", json!({"text": text}));
    }

    /// Nobody has an axis any more.
    pub(super) fn free_all(&mut self, cause: &Cause) {
        for seat in &mut self.seats {
            if let Task::Power(Some(reply)) = mem::replace(&mut seat.task, Task::Free) {
                let problem = Problem::new(cause.code, cause.cause.clone(), "");
                self.answers.push((reply, Err(problem)));
            }
        }
        if let Some(Job::Run(_) | Job::Move(_)) = self.job {
            self.job = None;
        }
    }
}

/// What a failure is for whoever asks afterwards.
pub(crate) fn cause_of(failure: &truestage::Failure) -> Cause {
    Cause {
        code: code_of(failure),
        cause: failure.to_string(),
        exit_code: failure.exit_code(),
    }
}

/// That `who` stopped something, now.
pub(crate) fn stopped_by(who: impl Into<String>) -> Stopped {
    Stopped {
        by: who.into(),
        at: utc_now(),
    }
}

/// That `stopped` voids an order.
pub(super) fn voided(stopped: &Stopped) -> Problem {
    let what = format!("stopped by {} before it began", stopped.by);
    Problem::new(Code::Stopped, what, "ask again where it is still wanted")
}

pub(super) fn stopped_problem() -> Problem {
    Problem::new(Code::Stopped, "stopped on request", "")
}
