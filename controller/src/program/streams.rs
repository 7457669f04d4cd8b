//! Standard output and standard error, each with a thread that writes to it and to nothing else.
//!
//! A reader that is late (Ctrl-S, a full pipe) makes that thread wait, and no other. What is given waits in a bounded
//! queue. Signs of progress are left out when it fills, and what was left out is counted. Absent: the picture of
//! `monitor`, which owns no machine.

mod account;
mod display;

use core::time::Duration;
use std::io::{self, ErrorKind, IsTerminal as _, Write as _, stderr, stdout};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel,
};
use std::sync::{Arc, LazyLock, OnceLock};
use std::thread;
use std::time::Instant;

pub(super) use account::Sign;
pub(super) use display::Display;

use crate::Failure;

/// So many things may wait for a writer.
const WAITING_MAX: usize = 1024;
/// Signs of progress leave the rest of that to lines, which are said once.
const SIGNS_WAITING_MAX: usize = 64;
/// How long a program that owns a machine waits at its end for a reader, or for a disk.
pub(super) const END_LIMIT: Duration = Duration::from_secs(1);
/// A reader that takes nothing for so long is named once it takes something again.
const BLOCKED_MIN: Duration = Duration::from_secs(1);

static OUT: LazyLock<Stream> = LazyLock::new(|| {
    let write = |bytes: &[u8]| {
        let mut out = stdout().lock();
        out.write_all(bytes).and_then(|()| out.flush())
    };
    // Results are waited for, so none is lost.
    Stream::to("stdout", Arc::new(write), |_| None)
});
static ERR: LazyLock<Stream> = LazyLock::new(|| {
    let write = |bytes: &[u8]| stderr().lock().write_all(bytes);
    Stream::to("stderr", Arc::new(write), Blocked::named)
});

/// Signals no longer end the program: a wait for a reader would outlast them.
static ARE_WAITS_LIMITED: AtomicBool = AtomicBool::new(false);

/// The one who reads what is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reader {
    Listens,
    /// It closed the pipe (`| head`), which is its right and no failure of the machine.
    Left,
}

/// Limits the waits for readers from now on.
pub(super) fn limit_waits() {
    ARE_WAITS_LIMITED.store(true, Ordering::Relaxed);
}

pub(super) fn is_out_terminal() -> bool {
    stdout().is_terminal()
}

pub(super) fn is_err_terminal() -> bool {
    stderr().is_terminal()
}

/// Prints a result after all that was said before it. A reader that takes nothing for the time of a wait counts as one
/// that has taken it.
///
/// # Errors
/// When not all of it can be written: the disk is full.
pub(super) fn print(bytes: Vec<u8>) -> Result<Reader, Failure> {
    ERR.give(Given::Pause);
    ERR.settle();
    OUT.give(Given::Text(bytes));
    OUT.settle();
    OUT.reader()
}

/// Prints what the next picture or line replaces. No caller waits for that, and a late reader misses some.
///
/// # Errors
/// When something that was printed before could not be written.
pub(super) fn show(bytes: Vec<u8>) -> Result<Reader, Failure> {
    if OUT.state.waiting.load(Ordering::Relaxed) < SIGNS_WAITING_MAX {
        OUT.give(Given::Text(bytes));
    }
    OUT.reader()
}

/// Says a line on standard error.
pub(super) fn say(line: &str) {
    ERR.give(Given::Text(format!("{line}\n").into_bytes()));
}

/// Shows a sign of progress there, where there is room for it.
pub(super) fn note(sign: Sign) {
    match ERR.state.waiting.load(Ordering::Relaxed) {
        0..SIGNS_WAITING_MAX => ERR.give(Given::Sign(sign)),
        _ => drop(ERR.state.lost.fetch_add(1, Ordering::Relaxed)),
    }
}

/// Shows progress in this way from now on.
pub(super) fn display(display: Display) {
    ERR.give(Given::Display(display));
}

/// Ends the output of the program.
///
/// # Errors
/// When a result is not whole.
pub(super) fn finish() -> Result<(), Failure> {
    display(Display::Nothing);
    ERR.settle();
    OUT.settle();
    OUT.reader().map(drop)
}

/// Writes and flushes: at the end of a program no error is looked at any more.
type Write = Arc<dyn Fn(&[u8]) -> io::Result<()> + Send + Sync>;

/// What a writer is given.
enum Given {
    Text(Vec<u8>),
    Sign(Sign),
    Display(Display),
    /// A bar is cleared until the next sign.
    Pause,
    /// All before this is written.
    Awaited(Sender<()>),
}

/// A reader that took nothing for a time.
struct Blocked {
    span: Duration,
    lost: usize,
}

impl Blocked {
    /// The cause of a silent screen is not in the machine.
    fn named(&self) -> Option<String> {
        // Without a machine a reader may take all the time (`| less`).
        let owns_machine = ARE_WAITS_LIMITED.load(Ordering::Relaxed);
        let is_worth_a_word = owns_machine && (self.span >= BLOCKED_MIN || self.lost > 0);
        is_worth_a_word.then(|| {
            format!(
                "warning: output was blocked for {:.1} s (Ctrl-S, or a reader that does not read): {} lines of it are \
                 missing; the machine went on meanwhile\n",
                self.span.as_secs_f64(),
                self.lost
            )
        })
    }
}

/// What both ends of a queue know.
#[derive(Default)]
struct State {
    waiting: AtomicUsize,
    /// What found no room.
    lost: AtomicUsize,
    /// The first failure of a write.
    failure: OnceLock<io::Error>,
    /// A wait was in vain: there is no other.
    is_blocked: AtomicBool,
}

/// A stream and its writer.
struct Stream {
    given: SyncSender<Given>,
    state: Arc<State>,
    write: Write,
}

impl Stream {
    fn to(name: &str, write: Write, name_wait: fn(&Blocked) -> Option<String>) -> Self {
        let (given, taken) = sync_channel(WAITING_MAX);
        let state = Arc::<State>::default();
        let mut writer = Writer {
            write: Arc::clone(&write),
            name_wait,
            display: Display::Nothing,
            state: Arc::clone(&state),
        };
        let thread = thread::Builder::new().name(name.into());
        // Without memory for a thread each line is written where it is given.
        let _ = thread.spawn(move || writer.write_all(&taken));
        Self {
            given,
            state,
            write,
        }
    }

    /// Gives something to the writer without ever waiting.
    fn give(&self, given: Given) {
        let State { waiting, lost, .. } = &*self.state;
        waiting.fetch_add(1, Ordering::Relaxed);
        match self.given.try_send(given) {
            Ok(()) => return,
            Err(TrySendError::Full(_)) => drop(lost.fetch_add(1, Ordering::Relaxed)),
            Err(TrySendError::Disconnected(Given::Text(text))) => {
                self.state.note_failure((self.write)(&text));
            }
            Err(TrySendError::Disconnected(_)) => {}
        }
        waiting.fetch_sub(1, Ordering::Relaxed);
    }

    /// Waits until all is written that was given before.
    fn settle(&self) {
        if self.state.is_blocked.load(Ordering::Relaxed) {
            return;
        }
        let limit = if ARE_WAITS_LIMITED.load(Ordering::Relaxed) {
            END_LIMIT
        } else {
            Duration::MAX
        };
        let begun = Instant::now();
        let (reached, awaited) = channel();
        let is_written = self.give_within(limit, Given::Awaited(reached)) && {
            let left = limit.saturating_sub(begun.elapsed());
            awaited.recv_timeout(left) != Err(RecvTimeoutError::Timeout)
        };
        if !is_written {
            self.state.is_blocked.store(true, Ordering::Relaxed);
        }
    }

    /// Gives something to the writer as soon as its queue has room; whether it had. A writer that is gone takes nothing.
    fn give_within(&self, limit: Duration, mut given: Given) -> bool {
        const LOOK_EVERY: Duration = Duration::from_millis(1);
        let begun = Instant::now();
        self.state.waiting.fetch_add(1, Ordering::Relaxed);
        loop {
            let is_full = match self.given.try_send(given) {
                Ok(()) => return true,
                Err(TrySendError::Full(refused)) if begun.elapsed() < limit => {
                    given = refused;
                    thread::sleep(LOOK_EVERY);
                    continue;
                }
                Err(error) => matches!(error, TrySendError::Full(_)),
            };
            self.state.waiting.fetch_sub(1, Ordering::Relaxed);
            return !is_full;
        }
    }

    fn reader(&self) -> Result<Reader, Failure> {
        match self.state.failure.get() {
            None => Ok(Reader::Listens),
            Some(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Reader::Left),
            Some(error) => Err(unprinted(error)),
        }
    }
}

impl State {
    fn note_failure(&self, written: io::Result<()>) {
        if let Err(error) = written {
            // The first one says why.
            let _ = self.failure.set(error);
        }
    }
}

/// What the thread of a stream does.
struct Writer {
    write: Write,
    name_wait: fn(&Blocked) -> Option<String>,
    display: Display,
    state: Arc<State>,
}

impl Writer {
    fn write_all(&mut self, taken: &Receiver<Given>) {
        for given in taken {
            let begun = Instant::now();
            self.take(given);
            self.state.waiting.fetch_sub(1, Ordering::Relaxed);
            let blocked = Blocked {
                span: begun.elapsed(),
                lost: self.state.lost.swap(0, Ordering::Relaxed),
            };
            if let Some(text) = (self.name_wait)(&blocked) {
                self.put(text.as_bytes());
            }
        }
    }

    fn take(&mut self, given: Given) {
        match given {
            Given::Text(text) => {
                let cleared = self.display.clear();
                self.put(&[cleared.as_bytes(), &text].concat());
            }
            Given::Sign(sign) => {
                let shown = self.display.take(sign);
                self.put(shown.as_bytes());
            }
            Given::Display(display) => {
                let cleared = self.display.clear();
                self.put(cleared.as_bytes());
                self.display = display;
            }
            Given::Pause => {
                let cleared = self.display.clear();
                self.put(cleared.as_bytes());
            }
            // The caller may have given up.
            Given::Awaited(reached) => drop(reached.send(())),
        }
    }

    fn put(&self, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.state.note_failure((self.write)(bytes));
        }
    }
}

/// That what was printed is not whole, and why.
fn unprinted(why: &io::Error) -> Failure {
    Failure::Usage {
        what: format!("standard output cannot be written: {why}"),
        help: "what is there is not whole: give it another place; what was measured or stored is kept all the same"
            .into(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    fn failing(kind: ErrorKind) -> Stream {
        let write = move |_: &[u8]| Err(io::Error::from(kind));
        Stream::to("test", Arc::new(write), |_| None)
    }

    #[test]
    fn a_closed_pipe_is_no_failure_and_a_full_disk_is_one() {
        let printed = |kind| {
            let stream = failing(kind);
            stream.give(Given::Text(b"a,b\n".to_vec()));
            stream.settle();
            stream.reader()
        };
        assert_eq!(printed(ErrorKind::BrokenPipe).unwrap(), Reader::Left);
        let failure = printed(ErrorKind::StorageFull).unwrap_err();
        assert_eq!(failure.exit_code(), 2);
        let said = failure.to_string();
        assert!(
            said.contains("standard output cannot be written: no storage space"),
            "{said}"
        );
    }

    #[test]
    fn a_blocked_reader_holds_no_caller_up() {
        let gate = Arc::new(Mutex::new(Vec::new()));
        let screen = Arc::clone(&gate);
        let write = move |bytes: &[u8]| {
            screen.lock().expect("no panic").extend_from_slice(bytes);
            Ok(())
        };
        let name = |blocked: &Blocked| (blocked.lost > 0).then(|| format!("{} lost", blocked.lost));
        let stream = Stream::to("test", Arc::new(write), name);
        let blocked = gate.lock().expect("no panic");
        // One more may be in the writer's hands.
        for _ in 0..WAITING_MAX + 11 {
            stream.give(Given::Text(b"a".to_vec()));
        }
        drop(blocked);
        stream.settle();
        stream.settle();
        let shown = String::from_utf8(gate.lock().expect("no panic").clone()).expect("text");
        let lines = shown.matches('a').count();
        assert!((WAITING_MAX..=WAITING_MAX + 1).contains(&lines), "{lines}");
        let lost = WAITING_MAX + 11 - lines;
        assert!(shown.contains(&format!("{lost} lost")), "{shown}");
    }
}
