//! Ledger: which request is which motion or run, over restarts and power cuts.
//!
//! Requests are noted in memory, under a lock that is never held over I/O, and wait for one thread that writes
//! ([`Writer`]). A request gives up after [`WRITE_LIMIT`]. The decision is
//! `docs/decisions/0074-one-thread-writes-the-ledger.md`.

mod asked;
mod file;
mod health;
mod lines;
mod memory;
#[cfg(test)]
mod tests;
mod writer;

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use jiff::Timestamp;

use crate::problem::{Code, Problem};
use crate::view::{MotionView, RunView, StorageView};
pub(crate) use asked::{Asked, AskedMotion, AskedRun, End};
use health::Health;
use lines::Line;
use memory::{Known, Memory};
pub(crate) use writer::Writer;

/// A write that takes longer has failed for its request.
pub(crate) const WRITE_LIMIT: Duration = Duration::from_secs(2);
/// How often a request looks whether another one with its key is on the disk.
const LOOK_EVERY: Duration = Duration::from_millis(1);
/// So many requests wait for the disk at once.
const NOTES_MAX: usize = 256;

/// The ledger cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}; what was asked for before a restart is kept there", path.display())]
pub struct LedgerError {
    /// The file or folder.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// What a request comes to before it is judged.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Noted {
    /// It was made before: the name of what it became.
    Before(String),
    /// It is on the disk, and may be ordered.
    New,
}

/// What a request comes to before it is written.
#[derive(Debug)]
enum Begun {
    Before(String),
    /// Another one with its key is being written.
    Beside,
    /// It is being written.
    Writing(Receiver<Result<(), Problem>>),
}

/// A line that waits for the disk.
#[derive(Debug)]
struct Item {
    text: String,
    of: ItemOf,
}

/// What a line is about.
#[derive(Debug)]
enum ItemOf {
    Note(Note),
    End(Arc<End>),
    Remark,
}

/// A request that waits for the disk.
#[derive(Debug)]
struct Note {
    /// Empty where it is about the ledger itself.
    id: String,
    answer: SyncSender<Result<(), Problem>>,
    /// Whether it waits until a power cut leaves it there.
    needs_sync: bool,
}

#[derive(Debug, Default)]
struct State {
    memory: Memory,
    pending: VecDeque<Item>,
}

/// The motions and runs that were asked for.
#[derive(Debug)]
pub(crate) struct Ledger {
    state: Mutex<State>,
    /// Something waits for the disk.
    news: Condvar,
    health: Health,
    boot: u64,
    /// Of this life of the service: a folder that is restored never gives a name twice.
    life: String,
    names: AtomicU64,
    /// What a person should hear of how the ledger was found.
    pub(crate) warnings: Vec<String>,
}

impl Ledger {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A name that nothing has had, for what kind of thing.
    pub(crate) fn next_id(&self, kind: char) -> String {
        let number = self.names.fetch_add(1, Ordering::Relaxed) + 1;
        format!("{kind}{}{}-{number}", self.boot, self.life)
    }

    /// The whole name where `id` is one of this start without its letters, as `m1-4` is of `m1kqhtz-4`. To look
    /// something up, not to command: a person who reads a name aloud leaves the letters out.
    pub(crate) fn whole_name(&self, id: &str) -> String {
        let short = format!("{}-", self.boot);
        let number = id.get(1..).and_then(|rest| rest.strip_prefix(&short));
        number.map_or_else(
            || id.to_owned(),
            |number| format!("{}{}{}-{number}", &id[..1], self.boot, self.life),
        )
    }

    /// Whether this service gave the name `id`.
    fn is_own(&self, id: &str) -> bool {
        let own = format!("{}{}-", self.boot, self.life);
        id.get(1..).is_some_and(|rest| rest.starts_with(&own))
    }

    /// What numbers of events count from in this life of the service: none is used twice, so that whoever goes on with one
    /// of an earlier life hears that he has missed some.
    pub(crate) const fn events_from(&self) -> u64 {
        // Four thousand million events for each life, and two million lives before numbers of JavaScript end.
        (self.boot - 1) << 32
    }

    /// Whether what is asked for can be written.
    ///
    /// # Errors
    /// When it cannot.
    pub(crate) fn require_storage(&self) -> Result<(), Problem> {
        self.health.check().map_err(|cause| storage(&cause))
    }

    /// What is known of the disk.
    pub(crate) fn storage(&self) -> StorageView {
        let cause = self.health.check().err();
        StorageView {
            ok: cause.is_none(),
            cause,
            damaged: self.state().memory.damaged.clone(),
        }
    }

    /// How many keys are remembered.
    pub(crate) fn keys(&self) -> usize {
        self.state().memory.keys()
    }

    /// Notes a request, and returns when it is on the disk. One without a key is there after a crash of this
    /// program, one with a key also after a power cut.
    ///
    /// # Errors
    /// When it cannot be written within [`WRITE_LIMIT`], or its key is that of another request.
    pub(crate) fn note(&self, asked: Asked) -> Result<Noted, Problem> {
        let begun = Instant::now();
        let asked = Arc::new(asked);
        loop {
            match self.begin_note(&asked)? {
                Begun::Before(id) => return Ok(Noted::Before(id)),
                Begun::Writing(answer) => {
                    return self.await_note(asked.id(), &answer).map(|()| Noted::New);
                }
                Begun::Beside if begun.elapsed() >= WRITE_LIMIT => {
                    return Err(self.too_slow());
                }
                Begun::Beside => thread::sleep(LOOK_EVERY),
            }
        }
    }

    fn begin_note(&self, asked: &Arc<Asked>) -> Result<Begun, Problem> {
        let mut state = self.state();
        if let Some(key) = asked.key() {
            if let Some(name) = &state.memory.damaged {
                return Err(damaged(name));
            }
            match state.memory.known(key, Timestamp::now()) {
                Known::New => {}
                Known::Full => return Err(keys_full()),
                Known::Before(entry) if !entry.asked.is_same_request(asked) => {
                    return Err(key_reused(&entry.asked.called()));
                }
                Known::Before(entry) if entry.is_noted => {
                    return Ok(Begun::Before(entry.asked.id().to_owned()));
                }
                Known::Before(_) => return Ok(Begun::Beside),
            }
        }
        self.require_storage()?;
        let line = Line::of_asked(asked);
        let answer = self.write_and_answer(&mut state, asked.id(), &line, asked.key().is_some())?;
        state.memory.ask(Arc::clone(asked), false);
        Ok(Begun::Writing(answer))
    }

    fn write_and_answer(
        &self,
        state: &mut State,
        id: &str,
        line: &Line,
        needs_sync: bool,
    ) -> Result<Receiver<Result<(), Problem>>, Problem> {
        if state.pending.len() >= NOTES_MAX {
            let what = "too many requests wait for the disk";
            return Err(Problem::new(Code::Busy, what, "ask again in a moment"));
        }
        let (answer, answered) = mpsc::sync_channel(1);
        let note = Note {
            id: id.to_owned(),
            answer,
            needs_sync,
        };
        self.push(state, line, ItemOf::Note(note));
        Ok(answered)
    }

    fn push(&self, state: &mut State, line: &Line, of: ItemOf) {
        let text = line.sealed();
        state.pending.push_back(Item { text, of });
        self.news.notify_one();
    }

    fn await_note(&self, id: &str, answer: &Receiver<Result<(), Problem>>) -> Result<(), Problem> {
        if let Ok(answered) = answer.recv_timeout(WRITE_LIMIT) {
            return answered;
        }
        // What the disk has of it by now is taken back.
        self.refuse(id);
        Err(self.too_slow())
    }

    fn too_slow(&self) -> Problem {
        let cause = self.health.check().err();
        let slow = || format!("a write to the ledger took longer than {WRITE_LIMIT:?}");
        storage(&cause.unwrap_or_else(slow))
    }

    /// The motion or run `id` was refused, and nothing moved: its key is free again.
    pub(crate) fn refuse(&self, id: &str) {
        let mut state = self.state();
        let before = state.pending.len();
        let is_it = |item: &Item| matches!(&item.of, ItemOf::Note(note) if note.id == id);
        state.pending.retain(|item| !is_it(item));
        let was_waiting = state.pending.len() < before;
        if state.memory.entry(id).is_some() && !was_waiting {
            let line = Line::Refused(id.to_owned());
            self.push(&mut state, &line, ItemOf::Remark);
        }
        state.memory.forget(id);
    }

    /// Notes an end. Whether it is on the disk; `None` where it is not kept over a restart.
    pub(crate) fn end(&self, end: End) -> Option<bool> {
        let mut state = self.state();
        let id = end.id().to_owned();
        if let Some(end) = state.memory.end(Arc::new(end)) {
            let line = Line::of_end(&end);
            self.push(&mut state, &line, ItemOf::End(end));
        }
        state.memory.entry(&id).map(|entry| entry.is_kept)
    }

    /// The motion `id`, as far as it is known here.
    pub(crate) fn motion(&self, id: &str) -> Option<MotionView> {
        let state = self.state();
        let (asked, entry) = state.memory.motion(id)?;
        Some(match entry.end.as_deref() {
            Some(End::Motion(view)) => MotionView {
                kept: Some(entry.is_kept),
                ..MotionView::clone(view)
            },
            Some(End::Run(_)) | None => asked.unended(self.is_own(id)),
        })
    }

    /// The run `id` that was asked for with a key, as far as it is known here.
    pub(crate) fn run(&self, id: &str) -> Option<RunView> {
        let state = self.state();
        let entry = state.memory.entry(id)?;
        match (&*entry.asked, entry.end.as_deref()) {
            (Asked::Run(_), Some(End::Run(view))) => Some(RunView {
                kept: Some(entry.is_kept),
                ..asked::lasting(view)
            }),
            (Asked::Run(asked), _) => Some(asked.unended(self.is_own(id))),
            (Asked::Motion(_), _) => None,
        }
    }

    /// A person, `by`, accepts that part of an earlier ledger is lost.
    ///
    /// # Errors
    /// When that cannot be written.
    pub(crate) fn accept_damage(&self, by: &str) -> Result<(), Problem> {
        self.require_storage()?;
        let answer = {
            let mut state = self.state();
            if state.memory.damaged.is_none() {
                return Ok(());
            }
            self.write_and_answer(&mut state, "", &Line::Accepted(by.to_owned()), true)?
        };
        self.await_note("", &answer)?;
        self.state().memory.damaged = None;
        Ok(())
    }

    /// Waits for something to write, at most for so long.
    pub(crate) fn await_news(&self, limit: Duration) {
        let state = self.state();
        let waited = self
            .news
            .wait_timeout_while(state, limit, |state| state.pending.is_empty());
        drop(waited);
    }
}

/// That an Idempotency-Key is that of `other`.
fn key_reused(other: &str) -> Problem {
    let what = format!("this Idempotency-Key was used for {other}, which is another one");
    Problem::new(Code::KeyReused, what, "give each request a key of its own")
}

fn keys_full() -> Problem {
    let what = format!(
        "{} Idempotency-Keys are kept for at least 7 days each, and there is no room for another",
        memory::KEYS_MAX
    );
    let help = "nothing was moved; use fewer keys, or ask without one";
    Problem::new(Code::KeysFull, what, help)
}

/// That a request cannot be written down.
fn storage(cause: &str) -> Problem {
    let help = "nothing was begun, and the request may stand as failed after a restart; free the disk or check it";
    Problem::new(Code::Storage, cause, help)
}

fn damaged(name: &str) -> Problem {
    let what = format!(
        "part of the ledger could not be read, and is kept as {name}: a request with a key could move again"
    );
    let help = "look what has moved, then accept it by POST /v1/ledger/accept; requests without a key are taken";
    Problem::new(Code::Storage, what, help)
}
