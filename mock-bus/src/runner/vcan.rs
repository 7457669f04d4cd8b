//! A SocketCAN interface: the devices appear on it as other nodes.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};

use drivers::wire::can::{BusError, CanFrame, CanId};
use socketcan::{CanErrorFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, StandardId};

pub(super) struct Vcan {
    socket: CanSocket,
}

impl Vcan {
    pub(super) fn open(interface: &str) -> io::Result<Self> {
        let socket = CanSocket::open(interface)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket })
    }

    pub(super) fn fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }

    /// The next frame of the host; `None` when there is none, or one that is no classic frame.
    pub(super) fn receive(&self) -> io::Result<Option<CanFrame>> {
        match self.socket.read_frame() {
            Ok(frame) => Ok(from_socket(&frame)),
            Err(error) if passes(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// A full transmit queue loses the frame, as a node that nobody acknowledges does.
    pub(super) fn send(&self, frame: &CanFrame) -> io::Result<()> {
        let Some(frame) = to_socket(frame) else {
            return Ok(());
        };
        lossy(self.socket.write_frame(&frame))
    }

    pub(super) fn send_error(&self, error: BusError) -> io::Result<()> {
        let (class, data) = error.emit();
        match CanErrorFrame::new_error(class, &data) {
            Ok(frame) => lossy(self.socket.write_frame(&frame)),
            Err(_) => Ok(()),
        }
    }
}

fn lossy(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if passes(&error) => Ok(()),
        other => other,
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
