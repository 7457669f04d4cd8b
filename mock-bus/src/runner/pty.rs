//! A pseudo-terminal whose far end another program opens like a serial port.

use std::collections::VecDeque;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{FlushArg, SetArg, cfmakeraw, tcflush, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};

/// More unsent bytes than this are an overrun: they are lost.
const UNSENT_MAX: usize = 16 * 1024;
/// Nobody has read for so long: what waits is stale and is thrown away, as a real device's
/// output is lost while no program has its port open.
const STALE: Duration = Duration::from_millis(500);

pub(super) struct Pty {
    master: OwnedFd,
    /// Held open: a client that closes its end must not hang up the emulator's.
    slave: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    unsent: VecDeque<u8>,
    last_empty: Instant,
}

impl Pty {
    /// A raw pseudo-terminal, and a symbolic link to it where one is wanted.
    pub(super) fn open(link: Option<&Path>) -> io::Result<Self> {
        let pair = openpty(None, None)?;
        let mut settings = tcgetattr(&pair.slave)?;
        cfmakeraw(&mut settings);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &settings)?;
        let flags = OFlag::from_bits_retain(fcntl(&pair.master, FcntlArg::F_GETFL)?);
        fcntl(&pair.master, FcntlArg::F_SETFL(flags | OFlag::O_NONBLOCK))?;
        let path = ttyname(&pair.slave)?;
        if let Some(link) = link {
            replace_link(&path, link)?;
        }
        Ok(Self {
            master: pair.master,
            slave: pair.slave,
            path,
            link: link.map(Path::to_owned),
            unsent: VecDeque::new(),
            last_empty: Instant::now(),
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }

    pub(super) fn has_unsent(&self) -> bool {
        !self.unsent.is_empty()
    }

    /// What the client has written.
    pub(super) fn receive(&self) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 4096];
        match read(&self.master, &mut buffer) {
            Ok(length) => Ok(buffer[..length].to_vec()),
            Err(Errno::EAGAIN | Errno::EINTR) => Ok(Vec::new()),
            Err(errno) => Err(errno.into()),
        }
    }

    /// Sends now what fits, and the rest at the next [`Pty::flush`].
    pub(super) fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.drop_stale()?;
        self.unsent.extend(bytes);
        self.flush()
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        while !self.unsent.is_empty() {
            let (head, _) = self.unsent.as_slices();
            match write(&self.master, head) {
                Ok(sent) => drop(self.unsent.drain(..sent)),
                Err(Errno::EAGAIN) => break,
                Err(Errno::EINTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
        if self.unsent.len() > UNSENT_MAX {
            self.unsent.clear();
        }
        Ok(())
    }

    fn drop_stale(&mut self) -> io::Result<()> {
        let mut unread = [PollFd::new(self.slave.as_fd(), PollFlags::POLLIN)];
        let waiting = poll(&mut unread, PollTimeout::ZERO)? > 0;
        if !waiting && self.unsent.is_empty() {
            self.last_empty = Instant::now();
        } else if self.last_empty.elapsed() > STALE {
            self.unsent.clear();
            tcflush(&self.slave, FlushArg::TCIFLUSH)?;
            self.last_empty = Instant::now();
        }
        Ok(())
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // Only our own link is removed; another emulator may have taken the name over.
            if std::fs::read_link(link).is_ok_and(|target| target == self.path) {
                let _ = std::fs::remove_file(link);
            }
        }
    }
}

/// Points `link` at `target`; a file that is no link is left alone.
fn replace_link(target: &Path, link: &Path) -> io::Result<()> {
    if link.is_symlink() {
        std::fs::remove_file(link)?;
    }
    std::os::unix::fs::symlink(target, link)
}
