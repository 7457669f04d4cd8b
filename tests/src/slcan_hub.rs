//! A CAN bus of two SLCAN adapters on pseudo-terminals, for two programs that both expect to
//! be the host of one: what one transmits, the other receives.
//!
//! Source: Lawicel AB, CAN232 manual version 3, by way of [`wire::slcan`]. The bus has
//! no time and no arbitration. What a host does not read in time is lost, as in a real adapter.

use std::fs::File;
use std::io::{ErrorKind, PipeReader, PipeWriter, Read, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use wire::can::CanFrame;
use wire::slcan::{Command, LineBuffer, Reply, StatusFlags};

/// Two adapters on one bus, until it is dropped.
pub struct SlcanHub {
    paths: [PathBuf; 2],
    /// Its end wakes the thread.
    stop: Option<PipeWriter>,
    thread: Option<JoinHandle<()>>,
}

impl SlcanHub {
    /// Two closed adapters.
    ///
    /// # Panics
    /// When the operating system refuses a pseudo-terminal, a pipe or a thread.
    pub fn new() -> Self {
        let adapters = [Adapter::new(), Adapter::new()];
        let paths = adapters.each_ref().map(|adapter| adapter.path.clone());
        let (stopped, stop) = std::io::pipe().expect("a pipe can be made");
        let thread = std::thread::spawn(move || run(adapters, &stopped));
        Self {
            paths,
            stop: Some(stop),
            thread: Some(thread),
        }
    }

    /// The two terminals.
    pub fn paths(&self) -> [&Path; 2] {
        self.paths.each_ref().map(PathBuf::as_path)
    }
}

impl Default for SlcanHub {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for SlcanHub {
    fn drop(&mut self) {
        drop(self.stop.take());
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(
            std::thread::panicking() || !matches!(ended, Some(Err(_))),
            "the hub panicked"
        );
    }
}

fn run(mut adapters: [Adapter; 2], stopped: &PipeReader) {
    while wait(&adapters, stopped) {
        for at in 0..adapters.len() {
            let frames = adapters[at].read();
            for frame in frames {
                adapters[1 - at].receive(frame);
            }
        }
    }
}

/// Until an adapter has something to read; `false` when it is time to stop.
fn wait(adapters: &[Adapter; 2], stopped: &PipeReader) -> bool {
    let mut fds = [
        stopped.as_fd(),
        adapters[0].master.as_fd(),
        adapters[1].master.as_fd(),
    ]
    .map(|fd| PollFd::new(fd, PollFlags::POLLIN));
    // A signal ends the wait early; then nothing is readable.
    let _ = poll(&mut fds, PollTimeout::NONE);
    fds[0].any() != Some(true)
}

struct Adapter {
    master: File,
    /// Held open: a host that closes its end must not hang up this one.
    _slave: File,
    path: PathBuf,
    lines: LineBuffer,
    has_bitrate: bool,
    is_open: bool,
}

impl Adapter {
    fn new() -> Self {
        let pair = openpty(None, None).expect("a pseudo-terminal can be made");
        let mut raw = tcgetattr(&pair.slave).expect("a terminal has settings");
        cfmakeraw(&mut raw);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &raw).expect("a terminal can be raw");
        let flags = fcntl(&pair.master, FcntlArg::F_GETFL).expect("a descriptor has flags");
        let flags = OFlag::from_bits_retain(flags) | OFlag::O_NONBLOCK;
        fcntl(&pair.master, FcntlArg::F_SETFL(flags)).expect("its flags can be set");
        let path = ttyname(&pair.slave).expect("a terminal has a name");
        Self {
            master: File::from(pair.master),
            _slave: File::from(pair.slave),
            path,
            lines: LineBuffer::default(),
            has_bitrate: false,
            is_open: false,
        }
    }

    /// Obeys the host; returns what it transmits.
    fn read(&mut self) -> Vec<CanFrame> {
        let mut buffer = [0; 4096];
        let length = match self.master.read(&mut buffer) {
            Ok(length) => length,
            Err(error)
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
            {
                0
            }
            Err(error) => panic!("{}: {error}", self.path.display()),
        };
        let mut frames = Vec::new();
        for byte in &buffer[..length] {
            let line = self.lines.push(*byte);
            if let Some(command) = line.and_then(|line| Command::parse(&line)) {
                let reply = self.obey(command, &mut frames);
                self.write(&reply.emit());
            }
        }
        frames
    }

    fn obey(&mut self, command: Command, frames: &mut Vec<CanFrame>) -> Reply {
        match command {
            Command::Bitrate(_) if !self.is_open => self.has_bitrate = true,
            Command::Timestamps(false) if !self.is_open => {}
            Command::Open if !self.is_open && self.has_bitrate => self.is_open = true,
            Command::Close if self.is_open => self.is_open = false,
            Command::Transmit(frame) if self.is_open => {
                frames.push(frame);
                return Reply::Queued;
            }
            Command::ReadStatus if self.is_open => return Reply::Status(StatusFlags::empty()),
            Command::ReadVersion => return Reply::Version(*b"1013"),
            Command::ReadSerial => return Reply::Serial(*b"HUB1"),
            _ => return Reply::Refused,
        }
        Reply::Done
    }

    fn receive(&mut self, frame: CanFrame) {
        if self.is_open {
            self.write(
                &Reply::Received {
                    frame,
                    timestamp_ms: None,
                }
                .emit(),
            );
        }
    }

    fn write(&mut self, line: &[u8]) {
        match self.master.write_all(line) {
            Err(error) if error.kind() != ErrorKind::WouldBlock => {
                panic!("{}: {error}", self.path.display())
            }
            _ => {}
        }
    }
}
