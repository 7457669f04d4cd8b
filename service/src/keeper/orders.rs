//! Orders: taken, refused, carried out.

use std::sync::Arc;

use machine::{Driving, Machine};
use truestage::runs::{Change, Choice, Group};

use super::seat::Task;
use super::stop::{stopped_problem, voided};
use super::{Job, Keeper, Mode};
use crate::order::{Answer, Answered, Letter, Order, Reply};
use crate::problem::{Code, Problem};
use crate::view::Stopped;

impl Keeper {
    /// Carries an order out, or begins to.
    pub(super) fn obey(&mut self, machine: &mut Machine, letter: Letter) {
        let Letter {
            order,
            caller,
            arrival,
            reply,
        } = letter;
        self.keep_lease(machine.now(), &caller);
        let allowed = match order.needs_lease() {
            true => self.check_lease(machine.now(), &caller),
            false => Ok(()),
        };
        if let Err(problem) = allowed {
            self.answer_later(reply, Err(problem));
            return;
        }
        let by = caller.name.as_str();
        if order.is_voided_by_stop()
            && let Some(stopped) = self.stops.after(arrival)
        {
            let answered = self.void(machine, order, by, stopped);
            self.answer_later(reply, answered);
            return;
        }
        let answered = match order {
            Order::Stop { mode } => {
                self.stop(machine, mode, by);
                Ok(Answer::Done)
            }
            Order::Lease { request, token } => self
                .give_lease(machine.now(), &caller, &request, token)
                .map(Answer::Leased),
            Order::Warn { text } => {
                self.warn(&text);
                Ok(Answer::Done)
            }
            Order::KeepLease => Ok(Answer::Done),
            Order::Release => self.release(machine.now(), &caller).map(|()| Answer::Done),
            Order::Move { id, request } => self
                .accept_motion(machine, &id, by, &request)
                .map(|()| Answer::Done),
            Order::Jog { id, request } => self.jog(machine, &id, by, &request).map(Answer::Named),
            Order::Renew { motion } => self.renew(machine.now(), &motion).map(|()| Answer::Done),
            Order::Plan {
                id,
                request,
                judged,
            } => {
                let planned = self.plan_run(&id, by, &request, judged);
                let started = planned.and_then(|()| match request.start {
                    true => self.start_planned(machine, &id),
                    false => Ok(()),
                });
                started.map(|()| Answer::Done)
            }
            Order::Start { run } => self.start_run(machine, &run).map(|()| Answer::Done),
            Order::Abort { run } => self.abort_run(machine, &run, by).map(|()| Answer::Done),
            Order::Pause { run } => self.pause_run(machine, &run).map(|()| Answer::Done),
            Order::Resume { run } => self.resume_run(machine, &run).map(|()| Answer::Done),
            Order::Answer { run, answer, text } => self
                .answer_run(&run, by, &answer, text)
                .map(|()| Answer::Done),
            Order::Power { axis, on } => return self.power(machine, &axis, on, reply),
            Order::Calibration(choice) => return self.take_choice(choice, by, reply),
            Order::Reset => return self.take_reset(reply),
            Order::End => return self.take_end(machine, by, reply),
        };
        self.answer_later(reply, answered);
    }

    /// What became of an order that arrived before a stop: a motion or run that has a name ends as stopped, and all else
    /// is refused.
    fn void(&mut self, machine: &Machine, order: Order, by: &str, stopped: Stopped) -> Answered {
        match order {
            Order::Move { id, request } => {
                self.void_motion(machine, (&id, by), &request, stopped)?
            }
            Order::Plan {
                id,
                request,
                judged,
            } => {
                self.plan_run(&id, by, &request, judged)?;
                self.end_planned(&id, stopped);
            }
            _ => return Err(voided(&stopped)),
        }
        Ok(Answer::Done)
    }

    /// The number of the axis `name`.
    pub(super) fn place(&self, name: &str) -> Result<usize, Problem> {
        let found = self.seats.iter().position(|it| *it.name == *name);
        found.ok_or_else(|| {
            let known: Vec<_> = self.seats.iter().map(|it| &*it.name).collect();
            Problem::new(
                Code::NoSuchAxis,
                format!("there is no axis `{name}`"),
                format!("known: {}", known.join(", ")),
            )
        })
    }

    /// Refuses what needs a machine that runs.
    pub(super) fn require_running(&self) -> Result<(), Problem> {
        match (self.mode, &self.fault) {
            (Mode::Idle | Mode::Procedure, _) => Ok(()),
            (Mode::Safe, Some(cause)) => Err(Problem::new(
                Code::ErrorStop,
                format!("the machine was stopped: {}", cause.cause),
                "remove the cause, then reset; what has lost its zero must be zeroed again",
            )),
            (Mode::Starting | Mode::Safe, _) => Err(Problem::new(
                Code::Busy,
                "the devices are being started",
                "try again in a second",
            )),
            (Mode::Ending, _) => Err(Problem::new(Code::Ending, "the service ends", "")),
        }
    }

    /// Refuses what needs the machine's thread for itself.
    pub(super) fn require_no_run(&self) -> Result<(), Problem> {
        if self.mode != Mode::Procedure && self.job.is_none() {
            return Ok(());
        }
        let what = "another run, or a motion of axes that move as one, is under way";
        let help = "wait for its end or abort it";
        Err(Problem::new(Code::AxisBusy, what, help))
    }

    /// Refuses an axis that somebody has.
    pub(super) fn require_free(&self, at: usize) -> Result<(), Problem> {
        let seat = &self.seats[at];
        if seat.is_free() {
            return Ok(());
        }
        Err(Problem::new(
            Code::AxisBusy,
            format!("axis {}: in use by {}", seat.name, seat.user()),
            "wait for its end or stop it; a motion can be asked for with if_moving queue or supersede",
        ))
    }

    fn power(&mut self, machine: &mut Machine, axis: &str, on: bool, reply: Reply) {
        match self.begin_power(machine, axis, on) {
            Ok(at) => self.seats[at].task = Task::Power(Some(reply)),
            Err(problem) => self.answer_later(reply, Err(problem)),
        }
    }

    fn begin_power(
        &mut self,
        machine: &mut Machine,
        axis: &str,
        on: bool,
    ) -> Result<usize, Problem> {
        self.require_running()?;
        if on {
            self.require_no_hands()?;
        }
        let at = self.place(axis)?;
        self.require_free(at)?;
        let failed = |it: machine::Failure| Problem::from(truestage::Failure::from(it));
        let mut driving = Driving::of(machine, axis).map_err(failed)?;
        if on {
            driving.enable().map_err(failed)?;
        } else {
            driving.disable();
        }
        Ok(at)
    }

    fn take_reset(&mut self, reply: Reply) {
        let is_free = self.job.is_none() && self.seats.iter().all(|it| it.is_free());
        match self.mode {
            Mode::Safe | Mode::Idle if is_free => self.job = Some(Job::Reset(reply)),
            Mode::Ending => self.answer_later(reply, Err(stopped_problem())),
            Mode::Starting | Mode::Idle | Mode::Procedure | Mode::Safe => {
                let what = "an axis is in use, or a reset is under way";
                let help = "stop the machine first";
                self.answer_later(reply, Err(Problem::new(Code::AxisBusy, what, help)));
            }
        }
    }

    fn take_choice(&mut self, choice: Choice, by: &str, reply: Reply) {
        let allowed = self.require_running();
        match allowed.and_then(|()| self.require_no_run()) {
            Ok(()) => self.job = Some(Job::Choose(choice, by.to_owned(), reply)),
            Err(problem) => self.answer_later(reply, Err(problem)),
        }
    }

    /// Refuses axes of which somebody has one.
    pub(crate) fn require_all_free(&self, group: &Group) -> Result<(), Problem> {
        let mut axes = group.axes.iter();
        axes.try_for_each(|it| self.require_free(self.place(it)?))
    }

    /// The axes of `group` are corrected otherwise from now on.
    pub(crate) fn chosen(
        &mut self,
        machine: &Machine,
        group: &Group,
        changes: &[Change],
        by: &str,
    ) {
        for change in changes {
            let data = serde_json::json!({"id": change.id, "by": by});
            self.events.push("calibration", &change.pointer, data);
        }
        for axis in &group.axes {
            if let Ok(at) = self.place(axis) {
                // They were those of a stop by the calibration before.
                self.seats[at].standard_uncertainty = None;
                self.seats[at].rests_at = None;
            }
        }
        self.publish(machine);
    }

    fn take_end(&mut self, machine: &mut Machine, by: &str, reply: Reply) {
        self.stop(machine, crate::request::StopMode::Controlled, by);
        self.job = Some(Job::End(reply));
    }

    /// Nothing more is taken: who still waits is told so.
    pub(crate) fn dismiss(&mut self) {
        while let Ok(letter) = self.inbox.try_recv() {
            let problem = Problem::new(Code::Ending, "the service ends", "");
            letter.reply.send(Err(problem));
        }
    }

    /// Answers once the snapshot has what the answer is about.
    pub(super) fn answer_later(&mut self, reply: Reply, answered: Answered) {
        self.answers.push((reply, answered));
    }

    /// Sends the answers whose snapshot is out.
    pub(super) fn send_answers(&mut self) {
        for (reply, answered) in self.answers.drain(..) {
            reply.send(answered);
        }
    }

    /// The name of a seat's axis.
    pub(super) fn name(&self, at: usize) -> &Arc<str> {
        &self.seats[at].name
    }
}
