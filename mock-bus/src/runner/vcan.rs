//! A SocketCAN interface: the devices appear on it as other nodes.
//!
//! An interface that is deleted takes the bus away, not the devices: they live on, and are
//! heard again when there is an interface of that name again.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use super::pty::await_readable;
use socketcan::{CanErrorFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, StandardId};
use wire::can::{BusError, CanFrame, CanId};

/// How often to look whether a deleted interface is back.
const LOOK_EVERY: Duration = Duration::from_millis(50);

pub(super) struct Vcan {
    interface: String,
    socket: Link,
}

enum Link {
    Open(CanSocket),
    Gone { look_at: Instant },
}

impl Link {
    fn gone() -> Self {
        Self::Gone {
            look_at: Instant::now() + LOOK_EVERY,
        }
    }
}

fn open(interface: &str) -> io::Result<CanSocket> {
    let socket = CanSocket::open(interface)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

impl Vcan {
    pub(super) fn open(interface: &str) -> io::Result<Self> {
        Ok(Self {
            interface: interface.to_owned(),
            socket: Link::Open(open(interface)?),
        })
    }

    pub(super) fn interface(&self) -> &str {
        &self.interface
    }

    /// Nothing to wait for while the interface is gone.
    pub(super) fn fd(&self) -> Option<BorrowedFd<'_>> {
        match &self.socket {
            Link::Open(socket) => Some(socket.as_fd()),
            Link::Gone { .. } => None,
        }
    }

    /// The next frame of the host; `None` when there is none, or one that is no classic frame.
    pub(super) fn receive(&mut self) -> io::Result<Option<CanFrame>> {
        self.look();
        let Link::Open(socket) = &self.socket else {
            return Ok(None);
        };
        match socket.read_frame() {
            Ok(frame) => Ok(from_socket(&frame)),
            Err(error) => self.pass(error).map(|()| None),
        }
    }

    /// Exactly the next frame of a host, which has sent it: the kernel may still have it on the
    /// way. `None` also when the host is not there any more and it does not come.
    pub(super) fn receive_one(
        &mut self,
        is_there: &impl Fn() -> bool,
    ) -> io::Result<Option<CanFrame>> {
        loop {
            let Link::Open(socket) = &self.socket else {
                return Ok(None);
            };
            match socket.read_frame() {
                Ok(frame) => return Ok(from_socket(&frame)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if !await_readable(socket.as_fd(), is_there)? {
                        return Ok(None);
                    }
                }
                Err(error) => return self.pass(error).map(|()| None),
            }
        }
    }

    /// A full transmit queue loses the frame, as a node that nobody acknowledges does.
    /// `false` then.
    pub(super) fn send(&mut self, frame: &CanFrame) -> io::Result<bool> {
        match to_socket(frame) {
            Some(frame) => self.write(&frame),
            None => Ok(false),
        }
    }

    pub(super) fn send_error(&mut self, error: BusError) -> io::Result<bool> {
        let (class, data) = error.emit();
        match CanErrorFrame::new_error(class, &data) {
            Ok(frame) => self.write(&frame.into()),
            Err(_) => Ok(false),
        }
    }

    fn write(&mut self, frame: &socketcan::CanFrame) -> io::Result<bool> {
        let Link::Open(socket) = &self.socket else {
            return Ok(false);
        };
        match socket.write_frame(frame) {
            Ok(()) => Ok(true),
            Err(error) => self.pass(error).map(|()| false),
        }
    }

    /// Lets an error be that is no failure of the emulator.
    fn pass(&mut self, error: io::Error) -> io::Result<()> {
        match error.raw_os_error() {
            _ if passes(&error) => Ok(()),
            Some(libc::ENODEV | libc::ENXIO) => {
                self.socket = Link::gone();
                Ok(())
            }
            _ => Err(error),
        }
    }

    fn look(&mut self) {
        let Link::Gone { look_at } = &self.socket else {
            return;
        };
        if Instant::now() >= *look_at {
            self.socket = open(&self.interface).map_or_else(|_| Link::gone(), Link::Open);
        }
    }
}

/// Nothing to read, no room to write, or an interface that is down for a while: the same
/// socket goes on when that has passed.
fn passes(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::WouldBlock
        || matches!(error.raw_os_error(), Some(libc::ENOBUFS | libc::ENETDOWN))
}

fn from_socket(frame: &socketcan::CanFrame) -> Option<CanFrame> {
    let id = match frame.id() {
        Id::Standard(id) => CanId::standard(id.as_raw())?,
        Id::Extended(id) => CanId::extended(id.as_raw())?,
    };
    match frame {
        socketcan::CanFrame::Data(frame) => CanFrame::new(id, frame.data()),
        socketcan::CanFrame::Remote(frame) => CanFrame::remote(id, frame.dlc() as u8),
        socketcan::CanFrame::Error(_) => None,
    }
}

fn to_socket(frame: &CanFrame) -> Option<socketcan::CanFrame> {
    let id = match frame.id() {
        CanId::Standard(id) => Id::Standard(StandardId::new(id)?),
        CanId::Extended(id) => Id::Extended(ExtendedId::new(id)?),
    };
    if frame.is_remote() {
        socketcan::CanFrame::new_remote(id, frame.len())
    } else {
        socketcan::CanFrame::new(id, frame.data())
    }
}
