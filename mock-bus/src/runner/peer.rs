//! A program at the other end of the side channel of a lockstep clock.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use nix::sys::socket::{MsgFlags, recv};
use units::Time;
use wire::lockstep::{Entry, LINE_MAX, Passed, Reply, Request};
use wire::{Payload, Port, Ports};

const READ_MAX: usize = 4096;

/// Whether it has something left to do.
#[derive(Debug)]
pub(super) enum Doing {
    /// Only lends a hand now and then: time does not wait for it.
    Nothing,
    /// Time stands still for it.
    Working(Watch),
    /// It waits, also when something comes on the unhurried ports, and has sent this before.
    Idle {
        until: Time,
        unhurried: Ports,
        sent: Vec<Entry>,
    },
}

/// What it has sent already, but counts as sent at its time only.
#[derive(Debug)]
pub(super) struct Ahead {
    pub(super) at: Time,
    pub(super) place: usize,
    pub(super) port: Port,
    pub(super) sent: Vec<Payload>,
}

/// One program.
#[derive(Debug)]
pub(super) struct Peer {
    stream: UnixStream,
    /// What was read and is no whole line yet, or not taken.
    heard: Vec<u8>,
    buffer: Box<[u8; READ_MAX]>,
    /// What is said, in one piece.
    line: String,
    pub(super) name: String,
    pid: u32,
    pub(super) doing: Doing,
    /// Its numbers of the machine's ports, by their places.
    pub(super) ports: BTreeMap<usize, Port>,
    pub(super) ahead: Vec<Ahead>,
    /// What it is told with the next `go`.
    pub(super) passed: Vec<Entry>,
    /// Something of that ends its wait.
    pub(super) is_due: bool,
}

/// What came from a peer.
#[derive(Debug)]
pub(super) enum Heard {
    /// Nothing whole.
    Nothing,
    /// It says something.
    Said(Request),
    /// It says what means nothing.
    Nonsense(String),
    /// It has gone.
    Gone,
}

impl Peer {
    pub(super) fn new(stream: UnixStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            heard: Vec::new(),
            buffer: Box::new([0; READ_MAX]),
            line: String::new(),
            name: "a program".to_owned(),
            pid: 0,
            doing: Doing::Nothing,
            ports: BTreeMap::new(),
            ahead: Vec::new(),
            passed: Vec::new(),
            is_due: false,
        })
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }

    /// It takes part from now on.
    pub(super) fn join(&mut self, name: String, pid: u32) {
        self.name = name;
        self.pid = pid;
        self.set_working();
    }

    /// Time stands still for it from now on.
    pub(super) fn set_working(&mut self) {
        self.doing = Doing::Working(Watch::new(self.pid));
    }

    /// Who it is, for a person.
    pub(super) fn who(&self) -> String {
        match self.pid {
            0 => format!("`{}`", self.name),
            pid => format!("`{}` (process {pid})", self.name),
        }
    }

    /// Whether its end of the connection is closed, and nothing that it said before is left.
    pub(super) fn has_hung_up(&self) -> bool {
        let flags = MsgFlags::MSG_PEEK | MsgFlags::MSG_DONTWAIT;
        matches!(recv(self.stream.as_raw_fd(), &mut [0], flags), Ok(0))
    }

    /// Reads what has come, and takes the next line of it.
    pub(super) fn hear(&mut self) -> Heard {
        if let Some(heard) = self.next_line() {
            return heard;
        }
        match self.stream.read(&mut self.buffer[..]) {
            Ok(0) => return Heard::Gone,
            Ok(length) => self.heard.extend_from_slice(&self.buffer[..length]),
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => return Heard::Nothing,
                _ => return Heard::Gone,
            },
        }
        self.next_line().unwrap_or(Heard::Nothing)
    }

    fn next_line(&mut self) -> Option<Heard> {
        let Some(end) = self.heard.iter().position(|byte| *byte == b'\n') else {
            let endless = self.heard.len() > LINE_MAX;
            return endless.then(|| Heard::Nonsense("a line without an end".to_owned()));
        };
        let line = String::from_utf8_lossy(&self.heard[..end]);
        let heard = match Request::parse(&line) {
            Ok(request) => Heard::Said(request),
            Err(error) => Heard::Nonsense(error.to_string()),
        };
        self.heard.drain(..=end);
        Some(heard)
    }

    /// Whether something was read that nobody has taken yet.
    pub(super) fn has_unheard(&self) -> bool {
        !self.heard.is_empty()
    }

    /// Something comes to it at `now`: bytes on a line for which it has time do not end its wait.
    pub(super) fn hand(&mut self, now: Time, mut entry: Entry, joins: bool) {
        if let (Doing::Idle { unhurried, .. }, Passed::Units(units)) = (&self.doing, entry.passed)
            && unhurried.contains(entry.port)
        {
            let at = now;
            entry.passed = Passed::At { units, at };
        } else {
            self.is_due = true;
        }
        self.pass(entry, joins);
    }

    /// It goes on at `now`, and hears what has passed.
    pub(super) fn wake(&mut self, now: Time) {
        self.is_due = false;
        let sent = core::mem::take(&mut self.passed);
        self.set_working();
        self.say(&Reply::Go { now, sent });
    }

    /// Something has passed one of its ports; with `joins` it is one with what passed there just
    /// before.
    pub(super) fn pass(&mut self, entry: Entry, joins: bool) {
        if joins
            && let Passed::Units(more) = entry.passed
            && let Some(last) = self.passed.last_mut()
            && last.port == entry.port
            && let Passed::Units(units) = &mut last.passed
        {
            *units += more;
            return;
        }
        self.passed.push(entry);
    }

    /// Says something; one that does not listen any more is noticed when it is heard.
    pub(super) fn say(&mut self, reply: &Reply) {
        self.line.clear();
        // Writing to a text does not fail.
        let _ = writeln!(self.line, "{reply}");
        // A line is short and its reader waits for it: the socket has room.
        let _ = self.stream.write_all(self.line.as_bytes());
    }
}

/// Whether somebody for whom time stands still is still at work.
///
/// Patience is counted in the program's own processor time as far as it gets any, so that a
/// busy computer is not taken for a program that hangs.
#[derive(Debug)]
pub(super) struct Watch {
    pid: u32,
    /// When it was last seen to have worked, and its processor time then.
    seen: Option<(Instant, Duration)>,
    begun: Instant,
    worked: Duration,
}

impl Watch {
    fn new(pid: u32) -> Self {
        Self {
            pid,
            seen: None,
            begun: Instant::now(),
            worked: Duration::ZERO,
        }
    }

    /// What is wrong with it, if anything is.
    pub(super) fn complaint(&mut self, patience: Duration) -> Option<String> {
        if self.begun.elapsed() < patience {
            return None;
        }
        let limit = patience.as_secs_f64();
        let Some(used) = processor_time(self.pid) else {
            return Some(format!("has not answered for {limit} s"));
        };
        let (since, before) = *self.seen.get_or_insert_with(|| (Instant::now(), used));
        if used > before {
            self.worked += used - before;
            self.seen = Some((Instant::now(), used));
        }
        if self.worked >= patience {
            return Some(format!("has computed for more than {limit} s"));
        }
        (since.elapsed() >= patience)
            .then(|| format!("hangs: it has neither answered nor used the processor for {limit} s"))
    }
}

/// The processor time that a process has used; `None` where that cannot be known.
fn processor_time(pid: u32) -> Option<Duration> {
    // Source: proc_pid_stat(5). The name of the program may hold anything, also blanks.
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let (_, fields) = stat.rsplit_once(')')?;
    let mut times = fields.split_whitespace().skip(11);
    let user: u64 = times.next()?.parse().ok()?;
    let system: u64 = times.next()?.parse().ok()?;
    // USER_HZ is 100 on Linux, whatever the kernel's own rate.
    const TICK: Duration = Duration::from_millis(10);
    Some(TICK * u32::try_from(user + system).ok()?)
}
