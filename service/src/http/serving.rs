//! One place, served by a thread of its own with a tokio runtime of its own.

use core::convert::Infallible;
use core::pin::pin;
use core::time::Duration;
use std::io;
use std::thread::{self, JoinHandle};

use axum::Router;
use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse as _, Response};
use futures_util::FutureExt as _;
use futures_util::future::Either;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::runtime::{self, Runtime};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::timeout;
use tower_service::Service as _;

use super::connection::Connection;
use super::door::{Door, Peer, Socket};
use super::place::Listen;
use super::places::{Place, Places};
use super::state::Closing;
use crate::access::Access;

/// How long a client may take to say which request it has: also how long a connection that asks nothing is kept.
/// Whoever says half a request would keep one of the places for ever.
const SAYING_MAX: Duration = Duration::from_secs(10);

/// How long an edge that closes waits for what it still has to say.
const LAST_WORD: Duration = Duration::from_secs(1);

/// So many connections are served at once at each door.
const CONNECTIONS: usize = 64;
/// So long all that is said before a body may be, in bytes.
const HEAD_MAX: usize = 32 << 10;

/// A place that is listened at; nobody is served yet.
pub(super) struct Opened {
    runtime: Runtime,
    door: Door,
}

/// A place that is served, until this is dropped.
#[derive(Debug)]
pub(super) struct Serving {
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Opened {
    /// # Errors
    /// When `place` cannot be listened at, or is open to others than `access` can tell apart.
    pub(super) fn at(place: &Listen, access: &Access) -> io::Result<Self> {
        let mut builder = runtime::Builder::new_current_thread();
        let runtime = builder.enable_io().enable_time().build()?;
        let open = |error| io::Error::new(io::ErrorKind::PermissionDenied, error);
        let settled = place.clone().settle(access).map_err(open)?;
        let inside = runtime.enter();
        let door = Door::open(&settled, access)?;
        drop(inside);
        Ok(Self { runtime, door })
    }

    /// A port that was chosen by the system is a number here.
    pub(super) const fn place(&self) -> &Listen {
        self.door.place()
    }

    /// Serves what `app` makes within the runtime.
    ///
    /// # Errors
    /// When there is no thread for it.
    pub(super) fn serve(self, app: impl FnOnce(&Listen, Closing) -> Router) -> io::Result<Serving> {
        let Self { runtime, door } = self;
        let (close, closing) = watch::channel(false);
        let closing = Closing(closing);
        let inside = runtime.enter();
        let app = app(door.place(), closing.clone());
        drop(inside);
        let (end, ended) = oneshot::channel();
        let name = format!("edge {}", door.place().word());
        let thread = thread::Builder::new().name(name).spawn(move || {
            runtime.block_on(async {
                let (open, mut all_gone) = mpsc::channel(1);
                tokio::spawn(serve(door, app, closing, open));
                // Whoever opened it has gone, or wants it to end.
                let _ = ended.await;
                close.send_replace(true);
                // Nothing is ever sent: there is an end when the last connection has dropped its copy.
                let _ = timeout(LAST_WORD, all_gone.recv()).await;
            });
            // What has not ended by now does not keep it.
            runtime.shutdown_background();
        });
        Ok(Serving {
            end: Some(end),
            thread: Some(thread?),
        })
    }
}

impl Serving {
    /// Nobody else is let in, and everybody is told the last of it.
    pub(super) fn close(&mut self) {
        self.end.take();
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
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

/// An order is carried out also for whoever closes his end at once: what is awaited for him is let go of then, and a stop
/// must not be.
fn carried_out(
    answering: impl Future<Output = Result<Response, Infallible>> + Send + 'static,
) -> impl Future<Output = Result<Response, Infallible>> {
    let answering = tokio::spawn(answering);
    let failed = |_| Ok(StatusCode::INTERNAL_SERVER_ERROR.into_response());
    answering.map(move |it| it.unwrap_or_else(failed))
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
        let is_order = request.method() != Method::GET;
        let answering = app.clone().call(request);
        match is_order {
            true => Either::Left(carried_out(answering)),
            false => Either::Right(answering),
        }
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
