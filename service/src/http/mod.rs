//! The edge: HTTP and JSON on a Unix socket and on TCP. It can hang, be flooded or die; the machine's thread
//! never waits for it.
//!
//! One thread, one tokio runtime of its own. Errors are problems by RFC 9457, `/openapi.json` says what there is.
//! Absent: TLS and tokens, so TCP is bound to loopback addresses only.

mod door;
mod events;
mod guard;
mod metrics;
mod page;
mod routes;
mod state;

use core::fmt;
use core::pin::pin;
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::thread::{self, JoinHandle};

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::serve::Listener as _;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::timeout;
use tower_service::Service as _;

use crate::desk::Desk;
use door::{Connection, Door, Peer};
use state::{Closing, State};

/// Where the service is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Listen {
    /// A Unix socket, mode 0660.
    Unix(PathBuf),
    /// TCP on a loopback address.
    Tcp(SocketAddr),
}

/// A place that is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{seen}` is no place to listen; write unix:PATH or tcp:127.0.0.1:PORT (TCP on loopback only)"
)]
pub struct ListenError {
    seen: String,
}

impl FromStr for Listen {
    type Err = ListenError;

    fn from_str(text: &str) -> Result<Self, ListenError> {
        let wrong = || ListenError {
            seen: text.to_owned(),
        };
        match text.split_once(':').ok_or_else(wrong)? {
            ("unix", path) if !path.is_empty() => Ok(Self::Unix(path.into())),
            ("tcp", address) => {
                let address: SocketAddr = address.parse().map_err(|_| wrong())?;
                let is_loopback = address.ip().is_loopback();
                is_loopback.then_some(Self::Tcp(address)).ok_or_else(wrong)
            }
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
        }
    }
}

/// A place that cannot be listened at.
#[derive(Debug, thiserror::Error)]
#[error("{at}: {source}")]
pub struct EdgeError {
    /// Where.
    pub at: String,
    /// Why.
    pub source: io::Error,
}

/// The edge, until it is dropped.
#[derive(Debug)]
pub struct Edge {
    places: Vec<Listen>,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Edge {
    /// Serves what `desk` knows at each of `places`.
    ///
    /// # Errors
    /// When one of them cannot be listened at.
    pub fn open(desk: Desk, places: &[Listen]) -> Result<Self, EdgeError> {
        let failed = |at: &str| {
            let at = at.to_owned();
            move |source| EdgeError { at, source }
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()
            .map_err(failed("tokio"))?;
        let inside = runtime.enter();
        let doors = places.iter().map(|place| {
            let door = Door::open(place);
            door.map_err(failed(&place.to_string()))
        });
        let doors: Vec<_> = doors.collect::<Result<_, _>>()?;
        drop(inside);
        let places = doors.iter().map(Door::place).collect();
        let (end, ended) = oneshot::channel();
        let thread = thread::Builder::new().name("edge".into()).spawn(move || {
            runtime.block_on(serve_all(doors, desk, ended));
            // What has not ended by now does not keep it.
            runtime.shutdown_background();
        });
        Ok(Self {
            places,
            end: Some(end),
            thread: Some(thread.map_err(failed("the edge's thread"))?),
        })
    }

    /// Where it is found; ports that were chosen by the system are numbers here.
    pub fn places(&self) -> &[Listen] {
        &self.places
    }
}

impl Drop for Edge {
    fn drop(&mut self) {
        self.end.take();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        for place in &self.places {
            if let Listen::Unix(path) = place {
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// How long a client may take to say which request it has: also how long a connection that asks nothing is kept.
/// Whoever says half a request would keep one of the places for ever.
const SAYING_MAX: Duration = Duration::from_secs(10);

/// How long an edge that closes waits for what it still has to say.
const LAST_WORD: Duration = Duration::from_secs(1);

/// Until `ended`, and until everybody has been told the last of it.
async fn serve_all(doors: Vec<Door>, desk: Desk, ended: oneshot::Receiver<()>) {
    let (close, closing) = watch::channel(false);
    let (open, mut all_gone) = mpsc::channel(1);
    let closing = Closing(closing);
    let state = State::new(desk, closing.clone());
    for door in doors {
        let app = routes::router(state.clone(), door.is_tcp());
        tokio::spawn(serve(door, app, closing.clone(), open.clone()));
    }
    drop(open);
    // Whoever opened it has gone, or wants it to end.
    let _ = ended.await;
    close.send_replace(true);
    // Nothing is ever sent: there is an end when the last connection has dropped its copy.
    let _ = timeout(LAST_WORD, all_gone.recv()).await;
}

/// Held by whatever is not over yet.
type Open = mpsc::Sender<()>;

async fn serve(mut door: Door, app: Router, mut closing: Closing, open: Open) {
    loop {
        let (connection, peer) = tokio::select! {
            accepted = door.accept() => accepted,
            () = closing.begun() => return,
        };
        let answering = answer(connection, peer, app.clone(), closing.clone());
        let open = open.clone();
        tokio::spawn(async move {
            answering.await;
            drop(open);
        });
    }
}

/// The requests of one connection, until it is closed or says nothing more.
async fn answer(connection: Connection, peer: Peer, app: Router, mut closing: Closing) {
    let asked = service_fn(move |request: Request<Incoming>| {
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(ConnectInfo(peer.clone()));
        app.clone().call(request)
    });
    let mut server = http1::Builder::new();
    server
        .timer(TokioTimer::new())
        .header_read_timeout(SAYING_MAX);
    let mut served = pin!(server.serve_connection(TokioIo::new(connection), asked));
    // Whoever hangs up, or says what is no HTTP, is not waited for.
    tokio::select! {
        _ = served.as_mut() => return,
        () = closing.begun() => served.as_mut().graceful_shutdown(),
    }
    let _ = served.await;
}

/// What the interface is, as OpenAPI 3.1.
pub fn openapi() -> utoipa::openapi::OpenApi {
    routes::described().1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_listens_to_the_network() {
        for text in [
            "tcp:0.0.0.0:1",
            "tcp:192.168.0.1:80",
            "tcp:[::]:1",
            "tcp:1",
            "unix:",
            "http",
        ] {
            assert!(text.parse::<Listen>().is_err(), "{text}");
        }
        for text in [
            "tcp:127.0.0.1:8470",
            "tcp:[::1]:8470",
            "unix:/run/truestage.sock",
        ] {
            assert_eq!(text.parse::<Listen>().unwrap().to_string(), text);
        }
    }

    /// What is not in the description is not part of the interface.
    #[test]
    fn the_description_names_every_resource() {
        let value = serde_json::to_value(openapi()).unwrap();
        assert_eq!(value["openapi"], "3.1.0");
        let paths: Vec<_> = value["paths"].as_object().unwrap().keys().collect();
        for path in [
            "/healthz",
            "/metrics",
            "/v1/axes",
            "/v1/axes/{axis}",
            "/v1/events",
            "/v1/lease",
            "/v1/machine",
            "/v1/motions",
            "/v1/motions/{id}",
            "/v1/reset",
            "/v1/runs",
            "/v1/stop",
        ] {
            assert!(paths.iter().any(|it| *it == path), "{path}: {paths:?}");
        }
    }
}
