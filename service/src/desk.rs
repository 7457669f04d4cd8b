//! Where clients come: orders go to the machine's thread, and what it publishes is read.

mod along;
mod calibrations;
mod config_file;
mod journals;
mod runs;

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use machine::records::Store;
use tokio::sync::oneshot;
use truestage::Failure;

use crate::figures::Figures;
use crate::keeper::utc_now;
use crate::ledger::{Asked, Ledger, LedgerError};
use crate::order::{Answer, Answered, Letter, Order, Reply, Unanswered};
use crate::problem::{Code, Problem};
use crate::request::{Caller, JogRequest, LeaseRequest, MoveRequest, StopMode};
use crate::snapshot::{Beat, Board, Fixed, Snapshot};
use crate::view::{AxisView, Cause, Event, Leased, MachineView, MotionState, MotionView};
pub(crate) use along::Judges;
pub(crate) use runs::Prepared;

/// How often whoever waits looks.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// Takes orders to a machine, and reads what is known of it; copies share both.
#[derive(Clone, Debug)]
pub struct Desk {
    letters: SyncSender<Letter>,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    board: Board,
    fixed: Arc<Fixed>,
    /// What the numbers of events count from.
    events_from: u64,
    ledger: Mutex<Ledger>,
    store: Store,
    /// Who makes a page of a journal.
    page: Option<Page>,
    /// Who judges paths and jobs.
    judges: Judges,
    unanswered: Unanswered,
}

/// Makes a page of a journal.
pub(crate) type Page = fn(&Path) -> Result<String, Failure>;

/// An answer that will come.
#[derive(Debug)]
pub(crate) struct Pending(oneshot::Receiver<Answered>);

impl Pending {
    /// Waits for it.
    pub(crate) async fn answer(self) -> Answered {
        self.0.await.unwrap_or_else(|_| Err(ended()))
    }

    /// Waits for it, and lets the thread do nothing else.
    fn wait(self) -> Answered {
        self.0.blocking_recv().unwrap_or_else(|_| Err(ended()))
    }
}

fn ended() -> Problem {
    Problem::new(Code::Ending, "the service has ended", "start it again")
}

impl Desk {
    pub(crate) fn new(
        letters: SyncSender<Letter>,
        board: Board,
        fixed: Arc<Fixed>,
        ledger: Ledger,
        store: Store,
        (page, judges): (Option<Page>, Judges),
    ) -> Self {
        let shared = Shared {
            board,
            fixed,
            events_from: ledger.events_from(),
            ledger: Mutex::new(ledger),
            store,
            page,
            judges,
            unanswered: Arc::default(),
        };
        Self {
            letters,
            shared: Arc::new(shared),
        }
    }

    /// Gives an order; never waits.
    pub(crate) fn give(&self, caller: &Caller, order: Order) -> Result<Pending, Problem> {
        let (reply, answer) = Reply::new(&self.shared.unanswered);
        let letter = Letter {
            order,
            caller: caller.clone(),
            reply,
        };
        let sent = self.letters.try_send(letter);
        self.shared.unanswered.fetch_add(1, Ordering::SeqCst);
        match sent {
            Ok(()) => Ok(Pending(answer)),
            Err(TrySendError::Full(_)) => Err(Problem::new(
                Code::Busy,
                "too many orders are waiting",
                "ask again in a moment",
            )),
            Err(TrySendError::Disconnected(_)) => Err(ended()),
        }
    }

    /// How many orders were given and have no answer yet.
    pub fn unanswered(&self) -> usize {
        let count = self.shared.unanswered.load(Ordering::SeqCst);
        usize::try_from(count).unwrap_or(0)
    }

    fn done(&self, caller: &Caller, order: Order) -> Result<(), Problem> {
        self.give(caller, order)?.wait().map(|_| ())
    }

    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        let ledger = &self.shared.ledger;
        ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn fixed(&self) -> &Fixed {
        &self.shared.fixed
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.shared.board.newest()
    }
}

/// What a request for a motion or a run comes to before it is judged.
pub(crate) enum Noted {
    /// It was made before: what it became.
    Before(String),
    /// It is on the disk under this name, and may be ordered.
    New(String),
}

/// Motions.
impl Desk {
    /// Asks for a motion; returns its name, and does not wait for its end. With a `key`, the same request never
    /// moves twice: it returns the motion that it became the first time, even after a restart.
    ///
    /// # Errors
    /// When the request is refused; nothing has moved then.
    pub fn begin_motion(
        &self,
        caller: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let id = match self.note_motion(caller, request, key)? {
            Noted::Before(id) => return Ok(id),
            Noted::New(id) => id,
        };
        let order = Order::Move {
            id: id.clone(),
            request: request.clone(),
        };
        let answered = self.done(caller, order);
        self.settle_motion(id, answered)
    }

    /// Looks whether a request was made before, and notes it when it was not.
    pub(crate) fn note_motion(
        &self,
        caller: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<Noted, Problem> {
        let mut ledger = self.ledger();
        if let Some(before) = key.and_then(|key| ledger.of_key(key)) {
            if before.request == *request {
                return Ok(Noted::Before(before.id.clone()));
            }
            return Err(key_reused(&format!("motion {}", before.id)));
        }
        if let Some(run) = key.and_then(|key| ledger.run_of_key(key)) {
            return Err(key_reused(&format!("run {}", run.id)));
        }
        let id = ledger.next_id('m');
        let asked = Asked {
            id: id.clone(),
            key: key.map(str::to_owned),
            by: caller.name.clone(),
            at: utc_now(),
            request: request.clone(),
        };
        ledger.ask(asked).map_err(|it| storage(&it))?;
        Ok(Noted::New(id))
    }

    /// What became of the order of a motion, or of a run with a key.
    pub(crate) fn settle_motion(
        &self,
        id: String,
        answered: Result<(), Problem>,
    ) -> Result<String, Problem> {
        match answered {
            Ok(()) => Ok(id),
            Err(problem) => {
                // That nothing moved is said whatever becomes of the note.
                let _ = self.ledger().refuse(&id);
                Err(problem)
            }
        }
    }

    /// The motion `id`, also one of before a restart.
    ///
    /// # Errors
    /// When there is none.
    pub fn motion(&self, id: &str) -> Result<MotionView, Problem> {
        let snapshot = self.snapshot();
        let mut motions = snapshot.motions.iter();
        if let Some(view) = motions.find(|it| it.id == *id) {
            return Ok(MotionView::clone(view));
        }
        let ledger = self.ledger();
        if let Some(view) = ledger.end_of(id) {
            return Ok(view.clone());
        }
        let asked = ledger.of_id(id).ok_or_else(|| {
            Problem::new(Code::NoSuchMotion, format!("there is no motion {id}"), "")
        })?;
        Ok(unended(asked, ledger.is_of_earlier_boot(asked)))
    }

    /// The motion `id` once it has ended, or after `limit`, whichever comes first.
    ///
    /// # Errors
    /// When there is none.
    pub fn wait_motion(&self, id: &str, limit: Duration) -> Result<MotionView, Problem> {
        let begun = Instant::now();
        loop {
            let view = self.motion(id)?;
            if view.state.is_end() || begun.elapsed() >= limit {
                return Ok(view);
            }
            thread::sleep(LOOK_EVERY);
        }
    }

    /// The motions that are known: those under way, and the last that ended.
    pub fn motions(&self) -> Vec<MotionView> {
        let snapshot = self.snapshot();
        snapshot
            .motions
            .iter()
            .map(|it| MotionView::clone(it))
            .collect()
    }

    /// Begins a jog, renews it, or (at a speed of 0) ends it; returns the name of the motion that it is. It stops
    /// 200 ms after it was renewed last, and at the soft limit.
    ///
    /// # Errors
    /// When the axis is in use by anything else, switched off or not zeroed; nothing has moved then.
    pub fn jog(&self, caller: &Caller, request: &JogRequest) -> Result<String, Problem> {
        let order = self.jog_order(request);
        named(self.give(caller, order)?.wait()?)
    }

    /// Not in the ledger: what is renewed many times a second is not written to a disk.
    pub(crate) fn jog_order(&self, request: &JogRequest) -> Order {
        Order::Jog {
            id: self.ledger().next_id('j'),
            request: request.clone(),
        }
    }

    /// The dead-man of motion `id` still holds.
    ///
    /// # Errors
    /// When it is not under way.
    pub fn renew(&self, caller: &Caller, id: &str) -> Result<(), Problem> {
        let motion = id.to_owned();
        self.done(caller, Order::Renew { motion })
    }

    /// Writes down how motions, and runs with a key, ended, for after a restart. Whoever serves calls it now and then.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_ends(&self) -> Result<(), Problem> {
        let snapshot = self.snapshot();
        let mut ledger = self.ledger();
        let ended = snapshot.motions.iter().filter(|it| it.state.is_end());
        for view in ended {
            ledger.end(view).map_err(|it| storage(&it))?;
        }
        let ended = snapshot.runs.iter().filter(|it| it.state.is_end());
        for view in ended {
            ledger.end_run(view).map_err(|it| storage(&it))?;
        }
        Ok(())
    }
}

/// A motion that the machine's thread does not know: asked for this moment, or before a restart.
fn unended(asked: &Asked, is_of_earlier_boot: bool) -> MotionView {
    let cause = Cause {
        code: Code::ServiceRestarted,
        cause: "the service ended before the end of this motion was written down".into(),
        exit_code: Code::ServiceRestarted.exit_code(),
    };
    let (state, cause) = match is_of_earlier_boot {
        true => (MotionState::Failed, Some(cause)),
        false => (MotionState::Queued, None),
    };
    MotionView {
        id: asked.id.clone(),
        by: asked.by.clone(),
        accepted: asked.at.clone(),
        state,
        stopped: None,
        cause,
        axes: std::collections::BTreeMap::new(),
        told: None,
    }
}

/// That an Idempotency-Key is that of `other`.
fn key_reused(other: &str) -> Problem {
    let what = format!("this Idempotency-Key was used for {other}, which is another one");
    Problem::new(Code::KeyReused, what, "give each request a key of its own")
}

fn storage(error: &LedgerError) -> Problem {
    Problem::new(
        Code::Storage,
        error.to_string(),
        "nothing was moved; free the disk",
    )
}

/// The machine as a whole.
impl Desk {
    /// Stops everything; taken from anybody, whoever has the lease. Returns when it is under way.
    ///
    /// # Errors
    /// When the service has ended, or too many orders wait.
    pub fn stop(&self, caller: &Caller, mode: StopMode) -> Result<(), Problem> {
        self.done(caller, Order::Stop { mode })
    }

    /// Starts the machine anew after a failure, and acknowledges each fault once.
    ///
    /// # Errors
    /// When a cause is still there, or something is under way.
    pub fn reset(&self, caller: &Caller) -> Result<(), Problem> {
        self.done(caller, Order::Reset)
    }

    /// Switches `axis` on.
    ///
    /// # Errors
    /// When it is in use, or its drive refuses.
    pub fn enable(&self, caller: &Caller, axis: &str) -> Result<(), Problem> {
        let axis = axis.to_owned();
        self.done(caller, Order::Power { axis, on: true })
    }

    /// Switches `axis` off.
    ///
    /// # Errors
    /// When it is in use, or its drive refuses.
    pub fn disable(&self, caller: &Caller, axis: &str) -> Result<(), Problem> {
        let axis = axis.to_owned();
        self.done(caller, Order::Power { axis, on: false })
    }

    /// Ends the service: every drive is stopped and switched off.
    ///
    /// # Errors
    /// When it has ended.
    pub fn end(&self, caller: &Caller) -> Result<(), Problem> {
        self.done(caller, Order::End)
    }

    /// Asks for the lease, or renews it: only its holder may command then.
    ///
    /// # Errors
    /// When somebody else has it and it is not taken by force.
    pub fn lease(&self, caller: &Caller, request: &LeaseRequest) -> Result<Leased, Problem> {
        let order = Self::lease_order(request)?;
        match self.give(caller, order)?.wait()? {
            Answer::Leased(leased) => Ok(leased),
            Answer::Done | Answer::Named(_) | Answer::Chosen(..) => Err(ended()),
        }
    }

    /// Gives the lease back.
    ///
    /// # Errors
    /// When somebody else has it.
    pub fn release(&self, caller: &Caller) -> Result<(), Problem> {
        self.done(caller, Order::Release)
    }

    pub(crate) fn lease_order(request: &LeaseRequest) -> Result<Order, Problem> {
        let mut bytes = [0; 16];
        let read = File::open("/dev/urandom").and_then(|mut it| it.read_exact(&mut bytes));
        read.map_err(|it| Problem::new(Code::Storage, format!("/dev/urandom: {it}"), ""))?;
        Ok(Order::Lease {
            request: request.clone(),
            token: bytes.iter().map(|it| format!("{it:02x}")).collect(),
        })
    }

    /// The machine.
    pub fn machine(&self) -> MachineView {
        MachineView {
            newest_event: self.newest_event(),
            ..self.snapshot().machine_of(&self.shared.fixed)
        }
    }

    /// The newest sign of life of the machine's thread.
    pub(crate) fn beat(&self) -> Beat {
        let snapshot = self.snapshot();
        Beat {
            ticks: snapshot.ticks,
            clock_s: snapshot.now.seconds(),
        }
    }

    /// Its axes.
    pub fn axes(&self) -> Vec<AxisView> {
        self.snapshot().axes_of(&self.shared.fixed)
    }

    /// The axis `name`.
    ///
    /// # Errors
    /// When there is none.
    pub fn axis(&self, name: &str) -> Result<AxisView, Problem> {
        let found = self.axes().into_iter().find(|it| it.name == *name);
        found
            .ok_or_else(|| Problem::new(Code::NoSuchAxis, format!("there is no axis `{name}`"), ""))
    }

    /// The events after number `after`, as far as they are kept.
    pub fn events(&self, after: u64) -> Vec<Event> {
        let snapshot = self.snapshot();
        let from = self.shared.events_from;
        let newer = snapshot.events.iter().filter(|it| from + it.id > after);
        let numbered = newer.map(|it| Event {
            id: from + it.id,
            ..Event::clone(it)
        });
        numbered.collect()
    }

    /// The number of the newest event.
    pub(crate) fn newest_event(&self) -> u64 {
        self.shared.events_from + self.snapshot().newest_event()
    }

    /// How punctual SYNCs are, how full the buses, how warm it is; at most a second old.
    pub fn figures(&self) -> Arc<Figures> {
        self.snapshot().figures
    }

    /// What the devices counted: device, what, how often.
    pub fn counters(&self) -> Vec<(String, &'static str, u64)> {
        Vec::clone(&self.snapshot().counters)
    }
}

/// What an answer is about.
pub(crate) fn named(answer: Answer) -> Result<String, Problem> {
    match answer {
        Answer::Named(name) => Ok(name),
        Answer::Done | Answer::Leased(_) | Answer::Chosen(..) => Err(ended()),
    }
}
