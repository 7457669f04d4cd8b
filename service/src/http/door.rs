//! Where connections come in: a Unix socket, TCP on loopback, or TCP with TLS.

use core::fmt;
use std::fs;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::Path;
use std::sync::Arc;

use axum::serve::Listener;
use tokio::net::{TcpListener, TcpSocket, TcpStream, UnixListener, UnixStream};

use super::place::Listen;
use crate::access::{Access, Tls};

/// Who may connect to the Unix socket: its owner and its group.
const MODE: u32 = 0o660;

/// So much may come by a TCP connection before it is heard, in bytes. The system's own choice grows to megabytes, which it
/// copies in one go while its processor does nothing else, whatever waits there: a flood is to fill little.
const UNHEARD_MAX: u32 = 64 << 10;

/// So many TCP connections wait for one of the places; the system lets others try again.
const WAITING_MAX: u32 = 1024;

/// Who is at the other end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Peer {
    /// A user of this computer.
    User(Option<u32>),
    /// A program somewhere.
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
    Unix(UnixListener),
    Tcp(TcpListener),
    Tls(TcpListener, Arc<Tls>),
}

/// What has come in, and nothing was said yet.
pub(crate) enum Socket {
    Unix(UnixStream),
    Tcp(TcpStream),
    Tls(TcpStream, Arc<Tls>),
}

/// Where connections come in.
pub(crate) struct Door {
    inner: Inner,
    place: Listen,
}

impl Door {
    /// Must be called within a runtime, with a place that was settled with `access`.
    pub(crate) fn open(place: &Listen, access: &Access) -> io::Result<Self> {
        let (inner, place) = match place {
            Listen::Unix(path) => (Inner::Unix(bind(path)?), place.clone()),
            Listen::Tcp(address) => {
                let (listener, address) = listen(*address)?;
                (Inner::Tcp(listener), Listen::Tcp(address))
            }
            Listen::Tls(address) => {
                let without =
                    || io::Error::new(io::ErrorKind::InvalidInput, "there is no certificate");
                let tls = access.tls.clone().ok_or_else(without)?;
                let (listener, address) = listen(*address)?;
                (Inner::Tls(listener, tls), Listen::Tls(address))
            }
        };
        Ok(Self { inner, place })
    }

    pub(crate) const fn place(&self) -> &Listen {
        &self.place
    }

    pub(crate) async fn accept(&mut self) -> (Socket, Peer) {
        match &mut self.inner {
            Inner::Unix(listener) => {
                let (stream, _) = Listener::accept(listener).await;
                let uid = stream.peer_cred().ok().map(|it| it.uid());
                (Socket::Unix(stream), Peer::User(uid))
            }
            Inner::Tcp(listener) => {
                let (stream, peer) = accept_tcp(listener).await;
                (Socket::Tcp(stream), peer)
            }
            Inner::Tls(listener, tls) => {
                let (stream, peer) = accept_tcp(listener).await;
                (Socket::Tls(stream, Arc::clone(tls)), peer)
            }
        }
    }
}

fn listen(address: SocketAddr) -> io::Result<(TcpListener, SocketAddr)> {
    let socket = match address {
        SocketAddr::V4(_) => TcpSocket::new_v4()?,
        SocketAddr::V6(_) => TcpSocket::new_v6()?,
    };
    // A service that is started again listens where the one before has just done so.
    socket.set_reuseaddr(true)?;
    // Connections inherit it.
    socket.set_recv_buffer_size(UNHEARD_MAX)?;
    socket.bind(address)?;
    let listener = socket.listen(WAITING_MAX)?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

async fn accept_tcp(listener: &mut TcpListener) -> (TcpStream, Peer) {
    let (stream, address) = Listener::accept(listener).await;
    // An answer that waits for more to say is late.
    let _ = stream.set_nodelay(true);
    (stream, Peer::Address(address))
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
