//! The socket beside the buses, and the programs that come to it.

use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use nix::poll::{PollFd, PollFlags};
use wire::lockstep::{Reply, Request};

use super::hand::Hands;
use super::peer::{Heard, Peer};
use crate::simulation::Simulation;

/// The side channel's socket; its file goes with it.
pub(super) struct Door {
    listener: UnixListener,
    path: PathBuf,
}

impl Door {
    /// Makes the socket; one that nobody listens at any more is replaced.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let listener = match UnixListener::bind(path) {
            Err(error) if error.kind() == io::ErrorKind::AddrInUse && is_deserted(path) => {
                std::fs::remove_file(path)?;
                UnixListener::bind(path)?
            }
            listener => listener?,
        };
        listener.set_nonblocking(true)?;
        Ok(Self {
            listener,
            path: path.to_owned(),
        })
    }

    /// Whoever has come since the last look.
    fn visitors(&self) -> io::Result<Vec<Peer>> {
        let mut peers = Vec::new();
        loop {
            match self.listener.accept() {
                Ok((stream, _)) => peers.push(Peer::new(stream)?),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(peers),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        // Somebody may have tidied it away.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// A socket's file outlives a program that was killed.
fn is_deserted(path: &Path) -> bool {
    let refused = UnixStream::connect(path);
    refused.is_err_and(|error| error.kind() == io::ErrorKind::ConnectionRefused)
}

/// Whoever has come to the socket, if there is one.
pub(super) struct Visitors {
    door: Option<Door>,
    pub(super) peers: Vec<Peer>,
    pub(super) hands: Hands,
}

impl Visitors {
    pub(super) fn new(door: Option<Door>) -> Self {
        Self {
            door,
            peers: Vec::new(),
            hands: Hands::default(),
        }
    }

    /// What to wait for.
    pub(super) fn fds(&self) -> Vec<PollFd<'_>> {
        let door = self.door.iter().map(|door| door.listener.as_fd());
        let peers = self.peers.iter().map(Peer::fd);
        let fds = door.chain(peers);
        fds.map(|fd| PollFd::new(fd, PollFlags::POLLIN)).collect()
    }

    /// Lets in whoever has come since the last look.
    pub(super) fn let_in(&mut self) -> io::Result<()> {
        if let Some(door) = &self.door {
            self.peers.extend(door.visitors()?);
        }
        Ok(())
    }

    /// Lets hands do their work where nobody shares a clock. Whether anything was done.
    pub(super) fn lend_hands(&mut self, machine: &mut Simulation) -> io::Result<bool> {
        self.let_in()?;
        let mut any = false;
        self.peers.retain_mut(|peer| {
            loop {
                let reply = match peer.hear() {
                    Heard::Nothing => return true,
                    Heard::Gone | Heard::Said(Request::Bye) => return false,
                    Heard::Said(Request::Do { words }) => {
                        any = true;
                        let done = self.hands.do_words(&words, machine);
                        done.map_or_else(Reply::Refused, Reply::Done)
                    }
                    Heard::Said(_) => Reply::Refused(
                        "this machine runs in real time; start it with --clock lockstep:PATH to \
                         share a clock"
                            .to_owned(),
                    ),
                    Heard::Nonsense(what) => Reply::Refused(what),
                };
                peer.say(&reply);
            }
        });
        Ok(any)
    }
}
