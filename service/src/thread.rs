//! The machine's thread: it makes the machine, ticks for ever, and runs procedures between two ticks.

mod runs;
mod together;

use core::time::Duration;
use std::any::Any;
use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};

use machine::attend;
use machine::records::Store;
use machine::records::files::{Files, os_files};
use triple_buffer::Input;
use truestage::runs::{Choice, Group, Teller};
use truestage::{Failure, Machine, groups};
use wire::cia402::PowerState;

use crate::desk::{Desk, Judges, Page};
use crate::keeper::{Attending, Job, Keeper, Mechanics, Mode, fixed, seats};
use crate::ledger::{Ledger, LedgerError};
use crate::manager::{Manager, Watch};
use crate::order::{Answer, Letter, Reply};
use crate::problem::Problem;
use crate::scribe::Scribe;
use crate::snapshot::{Board, CalibrationInUse, Fixed, Snapshot};
use crate::stops::{StopWatch, Stops};

/// So many orders may wait for the next tick.
const QUEUE: usize = 64;
/// How long a tick lasts at most while nothing arrives: orders wait for its end.
const IDLE: Duration = Duration::from_millis(2);
/// How long nothing is tried while a bus is gone.
const GONE: Duration = Duration::from_millis(20);

/// A machine that is connected, and what must live as long as it does.
pub struct Opened {
    /// The machine; nothing has been sent yet.
    pub machine: Machine,
    /// Where its records are.
    pub store: Store,
    /// Its lease among programs, and whatever else; dropped when the service has ended.
    pub held: Box<dyn Any>,
    /// Says what runs and motions gave as the command line does; without one they have only the service's own
    /// figures.
    pub teller: Option<Teller>,
}

/// A service that could not begin.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The machine.
    #[error(transparent)]
    Machine(#[from] Failure),
    /// What was asked for earlier cannot be read.
    #[error(transparent)]
    Ledger(#[from] LedgerError),
    /// No thread.
    #[error("the machine's thread: {0}")]
    Thread(#[from] io::Error),
    /// The thread ended without a word.
    #[error("the machine's thread ended before the machine was there")]
    Gone,
}

/// One process keeps a machine.
pub struct Service {
    desk: Desk,
    scribe: Scribe,
    watch: Option<Watch>,
    thread: JoinHandle<Result<(), Failure>>,
}

impl Service {
    /// Makes a machine on a thread of its own by `open`, starts its devices, and keeps it. Returns when it
    /// is there.
    ///
    /// # Errors
    /// When the machine cannot be made or started, or its ledger cannot be read.
    pub fn start(
        open: impl FnOnce() -> Result<Opened, Failure> + Send + 'static,
    ) -> Result<Self, StartError> {
        Self::start_with(os_files(), open)
    }

    /// [`Service::start`] with the disk `files` for what was asked for.
    ///
    /// # Errors
    /// Those of [`Service::start`].
    pub fn start_with(
        files: Arc<dyn Files>,
        open: impl FnOnce() -> Result<Opened, Failure> + Send + 'static,
    ) -> Result<Self, StartError> {
        let (stops, watch) = Stops::new();
        let (letters, inbox) = mpsc::sync_channel(QUEUE);
        let (input, output) = triple_buffer::triple_buffer(&Snapshot::before());
        let (told, ready) = mpsc::channel();
        let thread = thread::Builder::new()
            .name("machine".into())
            .spawn(move || keep(open, (inbox, watch), input, &told))?;
        match ready.recv() {
            Ok((fixed, store, of_desk)) => {
                let folder = store.root().join("service");
                let (ledger, writer) = Ledger::open(files, &folder)?;
                let warnings = ledger.warnings.clone();
                let board = Board::new(output);
                let desk = Desk::new((letters, stops), board, fixed, ledger, store, of_desk);
                desk.warn(warnings);
                Ok(Self {
                    scribe: Scribe::start(desk.clone(), writer, folder)?,
                    desk,
                    watch: None,
                    thread,
                })
            }
            // It has ended: nobody else holds the other end.
            Err(_) => Err(match thread.join() {
                Ok(Err(failure)) => failure.into(),
                Ok(Ok(())) | Err(_) => StartError::Gone,
            }),
        }
    }

    /// Takes orders, from any thread.
    pub fn desk(&self) -> Desk {
        self.desk.clone()
    }

    /// Tells `manager` that the service is ready, and from now on that its machine's thread ticks and that it
    /// ends.
    ///
    /// # Errors
    /// When the manager cannot be told: nothing is told later either, and the service goes on.
    pub fn report_to(&mut self, manager: Manager) -> io::Result<()> {
        self.watch = Some(manager.watch(self.desk())?);
        Ok(())
    }

    /// Waits for the end of the service: asked for, by a signal, or because its thread failed.
    ///
    /// # Errors
    /// What ended it, when that was not asked for.
    pub fn wait(self) -> Result<(), Failure> {
        let ended = self.thread.join();
        if let Some(watch) = self.watch {
            watch.finish();
        }
        self.scribe.finish();
        ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    /// Whether its thread has ended.
    pub fn is_over(&self) -> bool {
        self.thread.is_finished()
    }
}

type Told = Sender<(Arc<Fixed>, Store, (Option<Page>, Judges))>;

/// All that the machine's thread does.
fn keep(
    open: impl FnOnce() -> Result<Opened, Failure>,
    (inbox, stops): (Receiver<Letter>, StopWatch),
    input: Input<Snapshot>,
    told: &Told,
) -> Result<(), Failure> {
    let Opened {
        mut machine,
        store,
        held,
        teller,
    } = open()?;
    let groups = groups(machine.config());
    let fixed = Arc::new(fixed(&mut machine, &groups)?);
    let seats = seats(&mut machine, &groups)?;
    let judges = Judges::collect(&mut machine, &groups)?;
    let mut keeper = Keeper::new(inbox, stops, input, seats, teller.clone());
    keeper.add_groups(&mut machine, groups);
    machine.observe(Box::new(keeper.note_taker()));
    let keeper = Rc::new(RefCell::new(keeper));
    attend(&mut machine, Box::new(Attending(Rc::clone(&keeper))));
    let mut kept = Kept {
        machine,
        store,
        keeper,
        teller,
    };
    kept.machine.guarded(Machine::start)?;
    kept.load_courses();
    if let Err(failure) = kept.offer_runs() {
        kept.failed(failure);
    }
    let mut keeper = kept.keeper.borrow_mut();
    keeper.set_mode(Mode::Idle);
    // Whoever is told that the machine is there sees it so.
    keeper.publish_now(&kept.machine);
    drop(keeper);
    // Whoever started it may have gone.
    let _ = told.send((
        fixed,
        kept.store.direct(),
        (kept.teller.as_ref().map(|it| it.page), judges),
    ));
    let ended = kept.live();
    kept.keeper.borrow_mut().dismiss();
    drop(held);
    ended
}

/// A machine that is kept.
struct Kept {
    machine: Machine,
    store: Store,
    keeper: Rc<RefCell<Keeper>>,
    teller: Option<Teller>,
}

impl Kept {
    /// Ticks until the end.
    fn live(&mut self) -> Result<(), Failure> {
        loop {
            let until = self.machine.now() + IDLE;
            let ticked = self.machine.tick(until);
            if self.machine.stop_request().is_requested() {
                return self.end("a signal");
            }
            if let Err(failure) = ticked {
                self.failed(failure.into());
            }
            let job = self.keeper.borrow_mut().take_job();
            match job {
                None => {}
                Some(Job::Run(id)) => self.run(&id),
                Some(Job::Move(id)) => self.move_as_one(&id),
                Some(Job::Choose(choice, by, reply)) => {
                    let chosen = self.choose(&choice, &by);
                    reply.send(chosen);
                }
                Some(Job::Reset(reply)) => {
                    let reset = self.reset();
                    reply.send(reset);
                }
                Some(Job::End(reply)) => return self.end_for(reply),
            }
        }
    }

    /// Something failed: every drive is stopped, and what was under way ends with the cause.
    fn failed(&mut self, failure: Failure) {
        if self.keeper.borrow().mode() == Mode::Safe {
            // It is safe already: a bus that is gone says so again and again. This thread still lives.
            self.keeper.borrow_mut().publish_now(&self.machine);
            thread::sleep(GONE);
            return;
        }
        let failure = self.machine.explain(failure);
        self.keeper.borrow_mut().begin_fault(&failure);
        self.machine.make_safe();
        let failure = machine::diagnose(&mut self.machine, failure);
        self.keeper.borrow_mut().explain_fault(&failure);
        self.keeper.borrow_mut().end_fault(&self.machine);
        machine::watch_stopped(&mut self.machine);
    }

    fn end_for(&mut self, reply: Reply) -> Result<(), Failure> {
        let ended = self.end("whoever ended the service");
        reply.send(Ok(Answer::Done));
        ended
    }

    /// Every drive is stopped and switched off.
    fn end(&mut self, by: &str) -> Result<(), Failure> {
        let mut keeper = self.keeper.borrow_mut();
        keeper.stop_all_for(by);
        keeper.set_mode(Mode::Ending);
        drop(keeper);
        self.machine.make_safe();
        self.keeper.borrow_mut().end_all(&self.machine);
        Ok(())
    }

    fn reset(&mut self) -> Result<Answer, Problem> {
        let was_safe = self.keeper.borrow().mode() == Mode::Safe;
        self.keeper.borrow_mut().set_mode(Mode::Starting);
        let result = match was_safe {
            true => self.machine.start().and_then(|()| self.reset_drives()),
            false => self.reset_drives(),
        };
        match result {
            Ok(()) => {
                self.load_courses();
                self.keeper.borrow_mut().recovered(&self.machine);
                Ok(Answer::Done)
            }
            Err(failure) => {
                let problem = Problem::from(&failure);
                self.failed(failure);
                Err(problem)
            }
        }
    }

    /// Acknowledges each fault once.
    fn reset_drives(&mut self) -> Result<(), Failure> {
        let devices = self.machine.devices();
        let names: Vec<_> = [devices.axis_names(), devices.rotary_names()].concat();
        for axis in names {
            if self.machine.power_state(&axis)? == Some(PowerState::Fault) {
                self.machine.reset_fault(&axis)?;
            }
        }
        Ok(())
    }

    /// Another calibration is used from now on; nothing moves.
    fn choose(&mut self, choice: &Choice, by: &str) -> Result<Answer, Problem> {
        let groups = groups(self.machine.config());
        let group = Group::chosen(&groups, &self.store, choice)?;
        self.keeper.borrow().require_all_free(group)?;
        let changes = group.choose(&mut self.machine, &self.store, choice)?;
        let warning = self.load_group(group);
        let mut keeper = self.keeper.borrow_mut();
        keeper.plan_anew(&mut self.machine);
        keeper.chosen(&self.machine, group, &changes, by);
        Ok(Answer::Chosen(changes, group.axes.clone(), warning))
    }

    /// Uses the active calibration of each axis, and says where one cannot be used; what runs would do depends on
    /// that, too.
    fn load_courses(&mut self) {
        let groups = self.keeper.borrow().groups();
        for group in groups {
            drop(self.load_group(&group));
        }
        self.keeper.borrow_mut().plan_anew(&mut self.machine);
    }

    /// Uses what is in use of `group`; says why that cannot be used, where it cannot.
    fn load_group(&mut self, group: &Group) -> Option<String> {
        if !group.parts.is_empty() {
            let judge = group.judge(&mut self.machine, &self.store);
            let mut keeper = self.keeper.borrow_mut();
            keeper.set_judge(&group.name, judge.map_err(Problem::from));
        }
        let (in_use, warning) = match group.load(&mut self.machine, &self.store) {
            Ok(in_use) => (in_use, None),
            Err(failure) => (Vec::new(), Some(failure)),
        };
        for axis in &group.axes {
            let id = in_use.iter().find(|it| it.0 == *axis);
            let id = id.and_then(|it| it.1.as_deref());
            self.set_mechanics(axis, id);
        }
        let failure = warning?;
        let what = format!("{}: its calibration is not used: {failure}", called(group));
        self.keeper.borrow_mut().warn(&what);
        Some(what)
    }

    fn set_mechanics(&mut self, axis: &str, id: Option<&str>) {
        if let Ok(mechanics) = Mechanics::of(&mut self.machine, axis) {
            let in_use = in_use(&self.store, id);
            let mut keeper = self.keeper.borrow_mut();
            keeper.set_mechanics(axis, mechanics, in_use);
        }
    }
}

/// How people call a group.
fn called(group: &Group) -> String {
    match group.axes.as_slice() {
        [only] => format!("axis {only}"),
        _ => group.name.clone(),
    }
}

fn in_use(store: &Store, id: Option<&str>) -> Option<CalibrationInUse> {
    let id = id?.to_owned();
    // It has just been read.
    let created = store.glance(&id).map(|it| it.head.created);
    Some(CalibrationInUse {
        id,
        created: created.unwrap_or_default(),
    })
}
