//! Where connections come in: a Unix socket or TCP on loopback, no more of them than are served.

use core::fmt;
use core::pin::Pin;
use core::task::{Context, Poll};
use std::fs;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::Path;
use std::sync::Arc;

use axum::serve::Listener;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, UnixListener};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::Listen;

/// So many connections are served at once at each door; others wait in the system's queue.
const CONNECTIONS: usize = 64;
/// Who may connect to the Unix socket: its owner and its group.
const MODE: u32 = 0o660;

/// Who is at the other end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Peer {
    /// A user of this computer.
    User(Option<u32>),
    /// A program on this computer.
    Address(SocketAddr),
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::User(Some(uid)) => write!(f, "uid {uid}"),
            Self::User(None) => f.write_str("unknown user"),
            Self::Address(address) => write!(f, "{}", address.ip()),
        }
    }
}

enum Inner {
    Unix(UnixListener, Listen),
    Tcp(TcpListener, Listen),
}

/// Where connections come in.
pub(crate) struct Door {
    inner: Inner,
    free: Arc<Semaphore>,
}

impl Door {
    /// Must be called within a runtime.
    pub(crate) fn open(place: &Listen) -> io::Result<Self> {
        let inner = match place {
            Listen::Unix(path) => Inner::Unix(bind(path)?, place.clone()),
            Listen::Tcp(address) => {
                let listener = std::net::TcpListener::bind(address)?;
                listener.set_nonblocking(true)?;
                let place = Listen::Tcp(listener.local_addr()?);
                Inner::Tcp(TcpListener::from_std(listener)?, place)
            }
        };
        Ok(Self {
            inner,
            free: Arc::new(Semaphore::new(CONNECTIONS)),
        })
    }

    pub(crate) fn place(&self) -> Listen {
        match &self.inner {
            Inner::Unix(_, place) | Inner::Tcp(_, place) => place.clone(),
        }
    }

    pub(crate) const fn is_tcp(&self) -> bool {
        matches!(self.inner, Inner::Tcp(..))
    }
}

/// A socket that a service which ended badly left behind is replaced; one that answers is not.
fn bind(path: &Path) -> io::Result<UnixListener> {
    let is_socket = fs::symlink_metadata(path).is_ok_and(|it| it.file_type().is_socket());
    if is_socket {
        if std::os::unix::net::UnixStream::connect(path).is_ok() {
            let what = "another service listens here";
            return Err(io::Error::new(io::ErrorKind::AddrInUse, what));
        }
        fs::remove_file(path)?;
    }
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(MODE))?;
    Ok(listener)
}

trait Socket: AsyncRead + AsyncWrite + Send {}

impl<S: AsyncRead + AsyncWrite + Send> Socket for S {}

/// A connection, which gives its place back when it ends.
pub(crate) struct Connection {
    socket: Pin<Box<dyn Socket>>,
    _place: Option<OwnedSemaphorePermit>,
}

impl Listener for Door {
    type Io = Connection;
    type Addr = Peer;

    async fn accept(&mut self) -> (Connection, Peer) {
        // The semaphore is never closed.
        let place = Arc::clone(&self.free).acquire_owned().await.ok();
        let (socket, peer): (Pin<Box<dyn Socket>>, _) = match &mut self.inner {
            Inner::Unix(listener, _) => {
                let (stream, _) = Listener::accept(listener).await;
                let uid = stream.peer_cred().ok().map(|it| it.uid());
                (Box::pin(stream), Peer::User(uid))
            }
            Inner::Tcp(listener, _) => {
                let (stream, address) = Listener::accept(listener).await;
                // An answer that waits for more to say is late.
                let _ = stream.set_nodelay(true);
                (Box::pin(stream), Peer::Address(address))
            }
        };
        let connection = Connection {
            socket,
            _place: place,
        };
        (connection, peer)
    }

    fn local_addr(&self) -> io::Result<Peer> {
        Ok(Peer::User(None))
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.socket.as_mut().poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.socket.as_mut().poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.socket.as_mut().poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.socket.as_mut().poll_shutdown(context)
    }
}
