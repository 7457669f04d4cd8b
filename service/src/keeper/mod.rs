//! The machine's thread: what is done after every tick.

mod events;
mod groups;
mod lease;
mod mechanics;
mod motion;
mod orders;
mod publish;
mod question;
mod rest;
mod run;
mod seat;
mod setup;
mod stop;

use core::mem;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use machine::{Attendant, Failure, Machine, Observer, Stage};
use serde_json::json;
use triple_buffer::Input;
use truestage::runs::{Choice, Teller};

use crate::figures::Book;
use crate::order::{Answered, Letter, Reply};
use crate::snapshot::Snapshot;
use crate::stops::StopWatch;
use crate::view::Cause;
use events::Events;
pub(crate) use events::utc_now;
use groups::Grouped;
use lease::Lease;
pub(crate) use mechanics::Mechanics;
use motion::Motions;
use question::Talk;
use run::Runs;
pub(crate) use run::Task as RunTask;
pub(crate) use seat::Seat;
pub(crate) use setup::{fixed, seats};
pub(crate) use stop::{cause_of, stopped_by};

/// So many orders are taken after one tick: the others wait for the next.
const ORDERS_A_TICK: usize = 16;

/// What the thread does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// It starts the devices.
    Starting,
    /// It only ticks.
    Idle,
    /// A procedure waits in its ticks.
    Procedure,
    /// Everything is stopped because something failed, or was.
    Safe,
    /// The service ends.
    Ending,
}

/// What the thread is to do when its tick has ended.
#[derive(Debug)]
pub(crate) enum Job {
    /// A run, under its name.
    Run(Arc<str>),
    /// A motion of axes that move as one, under its name.
    Move(Arc<str>),
    /// Another calibration, for somebody who waits.
    Choose(Choice, String, Reply),
    /// A reset, for somebody who waits.
    Reset(Reply),
    /// The end.
    End(Reply),
}

/// What an observer was told since the last tick.
#[derive(Debug)]
enum Note {
    Progress(Stage, u64, u64),
    Warning(String),
    Waiting(String),
}

type Notes = Rc<RefCell<Vec<Note>>>;

/// Takes down what procedures tell.
pub(crate) struct NoteTaker(Notes);

impl Observer for NoteTaker {
    fn progress(&mut self, stage: Stage, _axis: &str, done: u64, total: u64) {
        self.0.borrow_mut().push(Note::Progress(stage, done, total));
    }

    fn warning(&mut self, text: &str) {
        self.0.borrow_mut().push(Note::Warning(text.to_owned()));
    }

    fn waiting(&mut self, text: &str) {
        self.0.borrow_mut().push(Note::Waiting(text.to_owned()));
    }
}

/// Everything that the service knows, on the machine's thread.
pub(crate) struct Keeper {
    inbox: Receiver<Letter>,
    stops: StopWatch,
    seats: Vec<Seat>,
    groups: Vec<Grouped>,
    motions: Motions,
    runs: Runs,
    events: Events,
    lease: Option<Lease>,
    notes: Notes,
    talk: Rc<RefCell<Talk>>,
    fault: Option<Arc<Cause>>,
    mode: Mode,
    job: Option<Job>,
    /// Answers whose snapshot is not out yet.
    answers: Vec<(Reply, Answered)>,
    output: Input<Snapshot>,
    ticks: u64,
    figures: Book,
    /// What the devices counted, some ticks ago.
    counters: Arc<Vec<(String, &'static str, u64)>>,
    /// Who says what motions gave.
    teller: Option<Teller>,
}

impl Keeper {
    pub(crate) fn new(
        inbox: Receiver<Letter>,
        stops: StopWatch,
        output: Input<Snapshot>,
        seats: Vec<Seat>,
        teller: Option<Teller>,
    ) -> Self {
        Self {
            inbox,
            stops,
            seats,
            groups: Vec::new(),
            motions: Motions::default(),
            runs: Runs::default(),
            events: Events::default(),
            lease: None,
            notes: Notes::default(),
            talk: Rc::default(),
            fault: None,
            mode: Mode::Starting,
            job: None,
            answers: Vec::new(),
            output,
            ticks: 0,
            figures: Book::default(),
            counters: Arc::default(),
            teller,
        }
    }

    /// Who takes down what procedures tell.
    pub(crate) fn note_taker(&self) -> NoteTaker {
        NoteTaker(Rc::clone(&self.notes))
    }

    /// What is to be done now.
    pub(crate) const fn take_job(&mut self) -> Option<Job> {
        self.job.take()
    }

    pub(crate) const fn mode(&self) -> Mode {
        self.mode
    }

    pub(crate) fn set_mode(&mut self, mode: Mode) {
        if self.mode != mode {
            self.mode = mode;
            let state = self.machine_state();
            self.events.push("machine", "", json!({"state": state}));
        }
    }

    /// What is done after every tick, whatever ticks.
    fn attend(&mut self, machine: &mut Machine) -> Result<(), Failure> {
        self.ticks += 1;
        self.events.set_now(machine.now());
        self.take_notes();
        self.take_reached();
        self.show_said();
        let asked = self.take_question(machine);
        for _ in 0..ORDERS_A_TICK {
            let Ok(letter) = self.inbox.try_recv() else {
                break;
            };
            self.obey(machine, letter);
        }
        let carried_on = match self.mode {
            Mode::Idle | Mode::Procedure => self.carry_on(machine),
            Mode::Starting | Mode::Safe | Mode::Ending => Ok(()),
        };
        self.publish(machine);
        self.send_answers();
        asked.and(carried_on)?;
        let is_to_end = self.runs.is_to_end() || self.motions.is_to_end();
        if self.mode == Mode::Procedure && is_to_end {
            return Err(Failure::Interrupted);
        }
        Ok(())
    }

    fn carry_on(&mut self, machine: &mut Machine) -> Result<(), Failure> {
        for seat in &mut self.seats {
            seat.watch_rest(machine);
        }
        self.advance_seats(machine)?;
        self.advance_motions(machine)?;
        self.advance_runs();
        Ok(())
    }

    fn take_notes(&mut self) {
        let notes = mem::take(&mut *self.notes.borrow_mut());
        for note in notes {
            match note {
                Note::Progress(stage, done, total) => self.run_progress(stage, done, total),
                Note::Warning(text) => {
                    self.events.push("warning", "", json!({"text": text}));
                }
                Note::Waiting(text) => {
                    self.events.push("machine", "", json!({"waiting": text}));
                }
            }
        }
    }

    /// Everything that was under way fails with `cause` when the machine has been made safe.
    pub(crate) fn begin_fault(&mut self, failure: &truestage::Failure) {
        let cause = Arc::new(cause_of(failure));
        self.motions.begin_fault(match failure {
            truestage::Failure::Machine(failure) => failure.device(),
            _ => None,
        });
        self.fault = Some(Arc::clone(&cause));
        self.set_mode(Mode::Safe);
        self.events.push("machine", "", json!({"cause": &*cause}));
        for seat in &mut self.seats {
            seat.last_cause = Some(Arc::clone(&cause));
        }
    }

    /// What failed had a cause that showed while everything was stopped.
    pub(crate) fn explain_fault(&mut self, failure: &truestage::Failure) {
        let known = self.fault.as_deref().map(|cause| cause.cause.as_str());
        if known != Some(cause_of(failure).cause.as_str()) {
            self.begin_fault(failure);
        }
    }

    /// Every drive has been stopped: what was under way ends.
    pub(crate) fn end_fault(&mut self, machine: &Machine) {
        let Some(cause) = self.fault.clone() else {
            return;
        };
        self.fail_motions(machine, &cause);
        self.fail_runs(&cause);
        self.free_all(&cause);
        self.publish(machine);
        self.send_answers();
    }

    /// After a reset: nothing is known of where things are.
    pub(crate) fn recovered(&mut self, machine: &Machine) {
        if self.fault.take().is_some() {
            // What was asked for before the failure does not begin after it.
            self.stops.void_all(stopped_by("a reset"));
        }
        for seat in &mut self.seats {
            seat.task = seat::Task::Free;
            seat.standing_since = None;
            seat.target = None;
            seat.set_point = None;
            seat.standard_uncertainty = None;
            seat.rests_at = None;
        }
        self.set_mode(Mode::Idle);
        self.publish(machine);
    }
}

/// The keeper as a machine knows it.
pub(crate) struct Attending(pub(crate) Rc<RefCell<Keeper>>);

impl Attendant for Attending {
    fn attend(&mut self, machine: &mut Machine) -> Result<(), Failure> {
        self.0.borrow_mut().attend(machine)
    }
}
