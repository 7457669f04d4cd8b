//! The edge: HTTP and JSON on a Unix socket and on TCP. It can hang, be flooded or die; the machine's thread
//! never waits for it.
//!
//! One thread, one tokio runtime of its own. Errors are problems by RFC 9457, `/openapi.json` says what there is.

mod connection;
mod door;
mod events;
mod guard;
mod identity;
mod metrics;
mod needs;
mod page;
mod place;
mod places;
mod rate;
mod routes;
mod state;
mod tokens;

use core::pin::pin;
use core::time::Duration;
use std::io;
use std::thread::{self, JoinHandle};

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::timeout;
use tower_service::Service as _;

use crate::access::Access;
use crate::desk::Desk;
use connection::Connection;
use door::{Door, Peer, Socket};
use guard::Guarded;
pub use place::{Listen, ListenError};
use places::{Place, Places};
use state::{Closing, State};

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
    /// Serves what `desk` knows at each of `places` to whom `access` lets in.
    ///
    /// # Errors
    /// When one of them cannot be listened at, or is open to others than `access` can tell apart.
    pub fn open(desk: Desk, places: &[Listen], access: &Access) -> Result<Self, EdgeError> {
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
            let at = place.to_string();
            let open = |error| io::Error::new(io::ErrorKind::PermissionDenied, error);
            let settled = place.clone().settle(access).map_err(open);
            let door = settled.and_then(|it| Door::open(&it, access));
            door.map_err(failed(&at))
        });
        let doors: Vec<_> = doors.collect::<Result<_, _>>()?;
        drop(inside);
        let places = doors.iter().map(|it| it.place().clone()).collect();
        let access = access.clone();
        let (end, ended) = oneshot::channel();
        let thread = thread::Builder::new().name("edge".into()).spawn(move || {
            runtime.block_on(serve_all(doors, desk, access, ended));
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

/// So many connections are served at once at each door.
const CONNECTIONS: usize = 64;
/// So long all that is said before a body may be, in bytes.
const HEAD_MAX: usize = 32 << 10;

/// Until `ended`, and until everybody has been told the last of it.
async fn serve_all(doors: Vec<Door>, desk: Desk, access: Access, ended: oneshot::Receiver<()>) {
    let (close, closing) = watch::channel(false);
    let (open, mut all_gone) = mpsc::channel(1);
    let closing = Closing(closing);
    let state = State::new(desk, closing.clone());
    for door in doors {
        let guarded = Guarded::new(door.place(), &access);
        let app = routes::router(state.clone(), guarded);
        tokio::spawn(serve(door, app, closing.clone(), open.clone()));
    }
    if let Some(known) = access.tokens {
        tokio::spawn(tokens::watch(known, state.desk, closing));
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
    let places = Places::new(CONNECTIONS);
    loop {
        let ((socket, peer), place) = tokio::select! {
            accepted = async { (door.accept().await, places.take().await) } => accepted,
            () = closing.begun() => return,
        };
        let (app, closing, open) = (app.clone(), closing.clone(), open.clone());
        tokio::spawn(async move {
            tokio::select! {
                () = answer(socket, peer, &place, app, closing) => {}
                () = place.lost() => {}
            }
            drop(open);
        });
    }
}

/// The requests of one connection, until it is closed or says nothing more.
async fn answer(socket: Socket, peer: Peer, place: &Place, app: Router, mut closing: Closing) {
    // Whoever hangs up, or says what is no TLS or no HTTP, is not waited for.
    let Ok(connection) = Connection::of(socket).await else {
        return;
    };
    let keeps = place.keeps();
    let asked = service_fn(move |request: Request<Incoming>| {
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(ConnectInfo(peer.clone()));
        request.extensions_mut().insert(keeps.clone());
        app.clone().call(request)
    });
    let mut server = http1::Builder::new();
    server
        .timer(TokioTimer::new())
        .header_read_timeout(SAYING_MAX)
        .max_buf_size(HEAD_MAX);
    let mut served = pin!(server.serve_connection(TokioIo::new(connection), asked));
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
