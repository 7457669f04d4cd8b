//! Taking part in the clock of an emulated machine, through its side channel.
//!
//! Source: conservative co-simulation (K. M. Chandy, J. Misra, "Distributed Simulation", 1979): the
//! time of a participant advances only when it is certain that nothing earlier can still reach it.
//! The lines are those of [`wire::lockstep`].
//!
//! When the emulator has ended, nothing supplies the time any more: the clock then continues in
//! real time, so that every deadline still comes, and the ports show what became of them.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use units::Time;
use wire::lockstep::{Entry, LINE_MAX, Reply, Request, Unintelligible, VERSION};
use wire::{Port, Ports};

/// Why the shared clock cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LockstepError {
    /// Nobody listens there.
    #[error(
        "emulated machine at {}: {source}; is `mock-bus` running with `--clock lockstep:{}`?",
        path.display(), path.display()
    )]
    NoClock {
        /// Of the side channel.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The emulator does not take what was said.
    #[error("lockstep clock: the emulated machine refused `{request}`: {why}")]
    Refused {
        /// What was said.
        request: String,
        /// Its reason.
        why: String,
    },
    /// Another answer than one that fits.
    #[error("lockstep clock: `{request}` was answered by `{reply}`")]
    Unexpected {
        /// What was said.
        request: String,
        /// What came back.
        reply: String,
    },
    /// The peer speaks something else.
    #[error("lockstep clock: {0}")]
    Unintelligible(#[from] Unintelligible),
    /// The emulator has ended.
    #[error("lockstep clock: the emulated machine has ended ({0}); its own messages say why")]
    Lost(#[from] std::io::Error),
}

/// Acts on the emulated machine whose socket is at `path`: does what `words` say, in those of
/// `mock-bus ctl`, and returns the answer.
///
/// # Errors
/// When nobody listens there, or the machine does not know how.
///
/// # Example
///
/// ```
/// use drivers::transport::lockstep::{LockstepError, lend_hand};
///
/// let nobody = std::env::temp_dir().join("no-such-machine");
/// let refused = lend_hand(&nobody, "turn-plate 73");
/// assert!(matches!(refused, Err(LockstepError::NoClock { .. })));
/// ```
pub fn lend_hand(path: &Path, words: &str) -> Result<String, LockstepError> {
    let request = Request::Do {
        words: words.to_owned(),
    };
    match Channel::open(path)?.ask(&request)? {
        Reply::Done(text) => Ok(text),
        reply => Err(unexpected(&request, &reply)),
    }
}

/// One who takes part in the clock of an emulated machine. Dropping it takes leave.
#[derive(Debug)]
pub struct Participant {
    path: PathBuf,
    channel: Mutex<Channel>,
    now: AtomicU64,
    /// Since when, on the wall, nobody tells the time.
    lost: OnceLock<Instant>,
}

#[derive(Debug)]
struct Channel {
    stream: BufReader<UnixStream>,
    line: String,
}

impl Channel {
    fn open(path: &Path) -> Result<Self, LockstepError> {
        let stream = UnixStream::connect(path).map_err(|source| LockstepError::NoClock {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self {
            stream: BufReader::new(stream),
            line: String::new(),
        })
    }

    fn say(&mut self, request: &Request) -> Result<(), LockstepError> {
        use core::fmt::Write as _;
        self.line.clear();
        // Writing to a text does not fail.
        let _ = writeln!(self.line, "{request}");
        self.stream.get_mut().write_all(self.line.as_bytes())?;
        Ok(())
    }

    fn hear(&mut self) -> Result<Reply, LockstepError> {
        self.line.clear();
        let limit = LINE_MAX as u64;
        (&mut self.stream).take(limit).read_line(&mut self.line)?;
        let Some(line) = self.line.strip_suffix('\n') else {
            return Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into());
        };
        Ok(Reply::parse(line)?)
    }

    fn ask(&mut self, request: &Request) -> Result<Reply, LockstepError> {
        self.say(request)?;
        match self.hear()? {
            Reply::Refused(why) => Err(LockstepError::Refused {
                request: request.to_string(),
                why,
            }),
            reply => Ok(reply),
        }
    }
}

fn unexpected(request: &Request, reply: &Reply) -> LockstepError {
    LockstepError::Unexpected {
        request: request.to_string(),
        reply: reply.to_string(),
    }
}

impl Participant {
    /// Takes part in the clock whose side channel is at `path`; messages call it `name`.
    ///
    /// # Errors
    /// When nobody listens there, or another version.
    pub fn join(path: &Path, name: &str) -> Result<Arc<Self>, LockstepError> {
        let mut channel = Channel::open(path)?;
        let request = Request::Hello {
            version: VERSION,
            pid: std::process::id(),
            name: name.to_owned(),
        };
        let now = match channel.ask(&request)? {
            Reply::Welcome(now) => now,
            reply => return Err(unexpected(&request, &reply)),
        };
        Ok(Arc::new(Self {
            path: path.to_owned(),
            channel: Mutex::new(channel),
            now: AtomicU64::new(now.nanos()),
            lost: OnceLock::new(),
        }))
    }

    /// Where the side channel is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The present time of the machine; by the wall since the emulator has ended.
    pub fn now(&self) -> Time {
        let now = Time(self.now.load(Ordering::Acquire));
        self.lost.get().map_or(now, |since| now + since.elapsed())
    }

    /// Whether the emulator has ended.
    pub fn is_lost(&self) -> bool {
        self.lost.get().is_some()
    }

    /// Has opened a port: the terminal's path, or the interface's name.
    pub(super) fn attach(&self, port: Port, endpoint: &str) -> Result<(), LockstepError> {
        let endpoint = endpoint.to_owned();
        let request = Request::Attach { port, endpoint };
        match self.ask(&request)? {
            Reply::Attached => Ok(()),
            reply => Err(unexpected(&request, &reply)),
        }
    }

    /// Has closed a port.
    pub(super) fn detach(&self, port: Port) {
        if !self.is_lost() {
            // The emulator may have ended just now; then nobody minds.
            let _ = self.channel().say(&Request::Detach { port });
        }
    }

    /// Has sent `sent` and waits, until `until` at the latest and whatever comes on `unhurried` ports;
    /// [`Participant::go`] tells what came of it.
    pub(super) fn idle(
        &self,
        until: Time,
        unhurried: Ports,
        sent: Vec<Entry>,
    ) -> Result<(), LockstepError> {
        let said = self.channel().say(&Request::Idle {
            until,
            unhurried,
            sent,
        });
        self.noted(said)
    }

    /// Computes on this processor from now on.
    pub(super) fn on(&self, cpu: Option<u32>) {
        // Only a wish: who does not hear it is noticed elsewhere.
        let _ = self.channel().say(&Request::On { cpu });
    }

    /// Whether an answer waits is seen here.
    pub(super) fn with_descriptor<R>(&self, look: impl FnOnce(BorrowedFd<'_>) -> R) -> R {
        look(self.channel().stream.get_ref().as_fd())
    }

    /// Waits until time has passed, and says what has come meanwhile.
    pub(super) fn go(&self) -> Result<Vec<Entry>, LockstepError> {
        let heard = self.channel().hear();
        match self.noted(heard)? {
            Reply::Go { now, sent } => {
                self.now.store(now.nanos(), Ordering::Release);
                Ok(sent)
            }
            reply => {
                self.lose();
                Err(LockstepError::Unexpected {
                    request: "idle".to_owned(),
                    reply: reply.to_string(),
                })
            }
        }
    }

    /// Goes on by the wall's clock.
    pub(super) fn lose(&self) {
        let _ = self.lost.set(Instant::now());
    }

    fn ask(&self, request: &Request) -> Result<Reply, LockstepError> {
        let reply = self.channel().ask(request);
        match reply {
            Err(LockstepError::Lost(_)) => self.noted(reply),
            reply => reply,
        }
    }

    fn noted<R>(&self, result: Result<R, LockstepError>) -> Result<R, LockstepError> {
        if result.is_err() {
            self.lose();
        }
        result
    }

    fn channel(&self) -> MutexGuard<'_, Channel> {
        self.channel.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        if !self.is_lost() {
            let _ = self.channel().say(&Request::Bye);
        }
    }
}
