//! Where clients come: orders go to the machine's thread, and what it publishes is read.

mod along;
mod calibrations;
mod config_file;
mod journals;
mod runs;

use core::sync::atomic::Ordering;
use core::time::Duration;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::thread;
use std::time::Instant;

use machine::records::Store;
use tokio::sync::oneshot;
use truestage::Failure;

use crate::figures::Figures;
use crate::keeper::stopped_by;
use crate::ledger::{Asked, AskedMotion, End, Ledger, Noted, WRITE_LIMIT};
use crate::order::{Answer, Answered, Letter, Order, Reply, Unanswered};
use crate::problem::{Code, Problem};
use crate::random::{draw_bytes, write_hex};
use crate::request::{Caller, JogRequest, LeaseRequest, MoveRequest, StopMode};
use crate::snapshot::{Beat, Board, Fixed, Snapshot};
use crate::stops::{Arrival, Stops};
use crate::view::{AxisView, Ending, Event, Leased, MachineView, MotionView, StorageView};
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
    ledger: Arc<Ledger>,
    stops: Arc<Stops>,
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
        (letters, stops): (SyncSender<Letter>, Arc<Stops>),
        board: Board,
        fixed: Arc<Fixed>,
        ledger: Arc<Ledger>,
        store: Store,
        (page, judges): (Option<Page>, Judges),
    ) -> Self {
        let shared = Shared {
            board,
            fixed,
            events_from: ledger.events_from(),
            ledger,
            stops,
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

    /// Gives an order that has just arrived; never waits.
    pub(crate) fn give(&self, caller: &Caller, order: Order) -> Result<Pending, Problem> {
        self.give_since(self.stops().arrival(), caller, order)
    }

    /// Gives an order that arrived then: a stop that arrived since voids it.
    pub(crate) fn give_since(
        &self,
        arrival: Arrival,
        caller: &Caller,
        order: Order,
    ) -> Result<Pending, Problem> {
        let (reply, answer) = Reply::new(&self.shared.unanswered);
        let letter = Letter {
            order,
            caller: caller.clone(),
            arrival,
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

    fn done_since(&self, arrival: Arrival, caller: &Caller, order: Order) -> Result<(), Problem> {
        let given = self.give_since(arrival, caller, order)?;
        given.wait().map(|_| ())
    }

    fn ledger(&self) -> &Ledger {
        &self.shared.ledger
    }

    /// Where stops arrive.
    pub(crate) fn stops(&self) -> &Arc<Stops> {
        &self.shared.stops
    }

    /// Says among the events what a person should look after.
    pub(crate) fn warn(&self, texts: Vec<String>) {
        for text in texts {
            // A machine that has ended hears nothing.
            let _ = self.give(&Caller::default(), Order::Warn { text });
        }
    }

    pub(crate) fn fixed(&self) -> &Fixed {
        &self.shared.fixed
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.shared.board.newest()
    }
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
        let arrival = self.stops().arrival();
        let (id, noted) = self.note_motion(caller, request, key)?;
        if let Noted::Before(id) = noted {
            return Ok(id);
        }
        let order = Order::Move {
            id: id.clone(),
            request: request.clone(),
        };
        let answered = self.done_since(arrival, caller, order);
        self.settle_motion(id, answered)
    }

    /// Looks whether a request was made before, and notes it under a new name when it was not. Waits for the disk.
    pub(crate) fn note_motion(
        &self,
        caller: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<(String, Noted), Problem> {
        let id = self.ledger().next_id('m');
        let asked = AskedMotion::now(id.clone(), key, &caller.name, request);
        let noted = self.ledger().note(Asked::Motion(asked))?;
        Ok((id, noted))
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
                self.ledger().refuse(&id);
                Err(problem)
            }
        }
    }

    /// The motion `id`, also one of before a restart.
    ///
    /// # Errors
    /// When there is none.
    pub fn motion(&self, id: &str) -> Result<MotionView, Problem> {
        let id = &*self.ledger().whole_name(id);
        let snapshot = self.snapshot();
        let mut motions = snapshot.motions.iter();
        if let Some(view) = motions.find(|view| view.id == *id) {
            return Ok(self.with_kept(view));
        }
        let known = self.ledger().motion(id);
        known
            .ok_or_else(|| Problem::new(Code::NoSuchMotion, format!("there is no motion {id}"), ""))
    }

    /// A motion of a snapshot. Its end goes to the disk at once.
    fn with_kept(&self, view: &Arc<MotionView>) -> MotionView {
        let ended = view.state.is_end().then(|| End::Motion(Arc::clone(view)));
        MotionView {
            kept: ended.and_then(|end| self.ledger().end(end)),
            ..MotionView::clone(view)
        }
    }

    /// The motion `id` once it has ended, or after `limit`, whichever comes first.
    ///
    /// # Errors
    /// When there is none.
    pub fn wait_motion(&self, id: &str, limit: Duration) -> Result<MotionView, Problem> {
        await_end(limit, || self.motion(id))
    }

    /// The motions that are known: those under way, and the last that ended.
    pub fn motions(&self) -> Vec<MotionView> {
        let snapshot = self.snapshot();
        let motions = snapshot.motions.iter();
        motions.map(|view| self.with_kept(view)).collect()
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

    /// Notes how motions, and runs with a key, ended, for after a restart; nothing is written here.
    pub(crate) fn note_ends(&self) {
        let snapshot = self.snapshot();
        let ended = snapshot.motions.iter().filter(|view| view.state.is_end());
        for view in ended {
            self.ledger().end(End::Motion(Arc::clone(view)));
        }
        let ended = snapshot.runs.iter().filter(|view| view.state.is_end());
        for view in ended {
            self.ledger().end(End::Run(Arc::clone(view)));
        }
    }

    /// What is known of the disk that motions and runs are written to.
    pub fn storage(&self) -> StorageView {
        self.ledger().storage()
    }

    /// How many Idempotency-Keys are remembered.
    pub(crate) fn keys(&self) -> usize {
        self.ledger().keys()
    }

    /// Accepts for `caller` that part of an earlier ledger is lost: requests with a key are taken again.
    ///
    /// # Errors
    /// When that cannot be written.
    pub fn accept_damaged_ledger(&self, caller: &Caller) -> Result<(), Problem> {
        self.ledger().accept_damage(&caller.name)
    }
}

/// Asks until the end is on the disk, or `limit` is over; once it has ended, no longer than a write may take.
fn await_end<T: Ending>(
    limit: Duration,
    ask: impl Fn() -> Result<T, Problem>,
) -> Result<T, Problem> {
    let begun = Instant::now();
    let mut ended = None;
    loop {
        let asked = ask()?;
        let is_over = asked.has_ended() && {
            let since = ended.get_or_insert_with(Instant::now);
            !asked.waits_for_disk() || since.elapsed() >= WRITE_LIMIT
        };
        if is_over || begun.elapsed() >= limit {
            return Ok(asked);
        }
        thread::sleep(LOOK_EVERY);
    }
}

/// The machine as a whole.
impl Desk {
    /// Stops everything; taken from anybody, whoever has the lease. Returns when it is under way.
    ///
    /// # Errors
    /// When the service has ended, or too many orders wait.
    pub fn stop(&self, caller: &Caller, mode: StopMode) -> Result<(), Problem> {
        self.stops().arrive(stopped_by(caller.name.as_str()));
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
        let bytes = draw_bytes::<16>();
        let bytes = bytes.map_err(|error| Problem::new(Code::Storage, error.to_string(), ""))?;
        Ok(Order::Lease {
            request: request.clone(),
            token: write_hex(&bytes),
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
