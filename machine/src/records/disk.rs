//! The thread that reads and writes a machine's records, so that the machine's own waits for no disk.
//!
//! Changes go to it through a bounded queue, in order. After one that failed, those that were given before the failure
//! was heard are left out: nothing is written that builds on what is missing. See docs/decisions/0075.

use core::fmt;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use super::StoreError;
use super::copy::RecordsCopy;
use super::disk_failure::DiskFailure;
use super::files::Files;

/// So many changes may wait. A point is measured in a tenth of a second at the fastest: minutes of a disk that hangs.
const QUEUE: usize = 1024;

type Change = Box<dyn FnOnce(&dyn Files) -> Result<(), StoreError> + Send>;
type Question = Box<dyn FnOnce() + Send>;

enum Order {
    /// Left out when one of its turn, or of an earlier one, has failed.
    Change { turn: u64, change: Change },
    /// Always done.
    Question(Question),
}

/// How time passes for who waits for the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiskPace {
    /// By itself: the machine lives on meanwhile.
    Wall,
    /// Not before all wait, as in lockstep with an emulated machine: each change is waited for, and one seed
    /// stays one log.
    Shared,
}

/// The disk of a machine's records. Copies share its thread, which ends with the last of them.
#[derive(Clone)]
pub(crate) struct Disk {
    orders: SyncSender<Order>,
    shared: Arc<Shared>,
}

/// What both threads know. Its locks are held for copying in memory, never over a call of the disk.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) files: Arc<dyn Files>,
    root: PathBuf,
    pace: DiskPace,
    copy: Mutex<RecordsCopy>,
    taken: AtomicU64,
    done: AtomicU64,
    turn: AtomicU64,
    has_failed: AtomicBool,
    failure: Mutex<Option<StoreError>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    pub(super) fn copy(&self) -> MutexGuard<'_, RecordsCopy> {
        lock(&self.copy)
    }

    fn waiting(&self) -> u64 {
        let taken = self.taken.load(Ordering::Acquire);
        taken.saturating_sub(self.done.load(Ordering::Acquire))
    }

    fn fail(&self, failure: StoreError) {
        lock(&self.failure).get_or_insert(failure);
        self.has_failed.store(true, Ordering::Release);
    }

    /// The first failure since the last one that was heard. What is given from now on is done again.
    fn hear_failure(&self) -> Option<StoreError> {
        if !self.has_failed.load(Ordering::Acquire) {
            return None;
        }
        self.turn.fetch_add(1, Ordering::AcqRel);
        self.has_failed.store(false, Ordering::Release);
        lock(&self.failure).take()
    }

    /// Takes the records from the disk again. Only for the disk's thread.
    fn read_anew(&self) {
        let copy = RecordsCopy::read(&*self.files, &self.root);
        *self.copy() = copy;
    }
}

impl Disk {
    /// Reads the records of the machine whose folder is `root`, and starts the thread.
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub(super) fn start(
        files: Arc<dyn Files>,
        root: &Path,
        pace: DiskPace,
    ) -> std::io::Result<Self> {
        let copy = RecordsCopy::read(&*files, root);
        let shared = Arc::new(Shared {
            files,
            root: root.to_owned(),
            pace,
            copy: Mutex::new(copy),
            taken: AtomicU64::new(0),
            done: AtomicU64::new(0),
            turn: AtomicU64::new(1),
            has_failed: AtomicBool::new(false),
            failure: Mutex::new(None),
        });
        let (orders, inbox) = sync_channel(QUEUE);
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new().name("records".into());
        thread.spawn(move || serve(&of_thread, &inbox))?;
        Ok(Self { orders, shared })
    }

    pub(super) const fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Whether who waits for an answer lives on meanwhile.
    pub(crate) fn lets_time_pass(&self) -> bool {
        self.shared.pace == DiskPace::Wall
    }

    /// How many orders are done.
    pub(crate) fn done(&self) -> u64 {
        self.shared.done.load(Ordering::Acquire)
    }

    /// How many orders wait.
    pub(super) fn waiting(&self) -> u64 {
        self.shared.waiting()
    }

    fn send(&self, order: Order) -> Result<(), DiskFailure> {
        self.shared.taken.fetch_add(1, Ordering::AcqRel);
        let sent = self.orders.try_send(order);
        sent.map_err(|_refused| {
            self.shared.done.fetch_add(1, Ordering::AcqRel);
            DiskFailure::Behind {
                waiting: self.shared.waiting(),
            }
        })
    }

    /// Orders `change`. Its failure is that of a later call, or of [`Disk::hear_failure`].
    pub(super) fn change(&self, change: Change) -> Result<(), StoreError> {
        if let Some(failure) = self.hear_failure() {
            return Err(failure);
        }
        let turn = self.shared.turn.load(Ordering::Acquire);
        if let Err(failure) = self.send(Order::Change { turn, change }) {
            // What comes behind it must not be written either.
            self.shared.turn.fetch_add(1, Ordering::AcqRel);
            return Err(failure.into());
        }
        match self.shared.pace {
            DiskPace::Wall => Ok(()),
            DiskPace::Shared => {
                self.ask(|| ())?.wait()?;
                self.hear_failure().map_or(Ok(()), Err)
            }
        }
    }

    /// Asks for what `question` returns, after all that was ordered before.
    pub(super) fn ask<R: Send + 'static>(
        &self,
        question: impl FnOnce() -> R + Send + 'static,
    ) -> Result<Answer<R>, DiskFailure> {
        let (answer, answers) = sync_channel(1);
        self.send(Order::Question(Box::new(move || {
            // The other end may have given up.
            let _ = answer.send(question());
        })))?;
        let progress = Progress::begin(self);
        Ok(Answer { answers, progress })
    }

    /// The first failure of a change since the last one that was heard.
    pub(super) fn hear_failure(&self) -> Option<StoreError> {
        let failure = self.shared.hear_failure()?;
        // The copy has what is not there.
        let shared = Arc::clone(&self.shared);
        let anew = Order::Question(Box::new(move || shared.read_anew()));
        // Where it is not taken the next start reads them.
        let _ = self.send(anew);
        Some(failure)
    }
}

impl fmt::Debug for Disk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Disk")
            .field("shared", &self.shared)
            .finish_non_exhaustive()
    }
}

/// The disk's thread.
fn serve(shared: &Shared, orders: &Receiver<Order>) {
    let mut failed = 0;
    for order in orders {
        match order {
            Order::Question(question) => question(),
            Order::Change { turn, change } if turn > failed => {
                if let Err(failure) = change(&*shared.files) {
                    failed = turn;
                    shared.fail(failure);
                }
            }
            Order::Change { .. } => {}
        }
        shared.done.fetch_add(1, Ordering::AcqRel);
    }
}

/// For so long a disk may do nothing: one that spins up or sits behind a network takes seconds.
const SILENT_MAX: Duration = Duration::from_secs(60);

/// Whether the disk still does something.
struct Progress {
    disk: Disk,
    done: u64,
    since: Instant,
}

impl Progress {
    fn begin(disk: &Disk) -> Self {
        Self {
            done: disk.done(),
            disk: disk.clone(),
            since: Instant::now(),
        }
    }

    fn look(&mut self) -> Result<(), DiskFailure> {
        let done = self.disk.done();
        if done != self.done {
            (self.done, self.since) = (done, Instant::now());
        }
        let waited = self.since.elapsed();
        match waited >= SILENT_MAX {
            true => Err(DiskFailure::Silent { waited }),
            false => Ok(()),
        }
    }
}

/// An answer that the disk's thread gives.
pub struct Answer<R> {
    answers: Receiver<R>,
    progress: Progress,
}

impl<R> Answer<R> {
    /// The answer, when it is there.
    ///
    /// # Errors
    /// When the disk has done nothing for too long.
    pub(crate) fn poll(&mut self) -> Result<Option<R>, DiskFailure> {
        match self.answers.try_recv() {
            Ok(answer) => Ok(Some(answer)),
            Err(TryRecvError::Empty) => self.progress.look().map(|()| None),
            Err(TryRecvError::Disconnected) => Err(DiskFailure::Silent {
                waited: self.progress.since.elapsed(),
            }),
        }
    }

    /// Waits for `span`, or until the answer is there.
    pub(crate) fn wait_for(&mut self, span: Duration) -> Result<Option<R>, DiskFailure> {
        match self.answers.recv_timeout(span) {
            Ok(answer) => Ok(Some(answer)),
            Err(_) => self.poll(),
        }
    }

    /// Waits for the answer. Not in the thread of a machine whose clock goes on.
    pub(super) fn wait(mut self) -> Result<R, DiskFailure> {
        loop {
            if let Some(answer) = self.wait_for(Duration::from_secs(1))? {
                return Ok(answer);
            }
        }
    }
}
