//! The edge: HTTP and JSON on a Unix socket and on TCP. It can hang, be flooded or die; the machine's thread
//! waits for nothing of it.
//!
//! Each place has a thread and a tokio runtime of its own: what floods one keeps nobody waiting at another. Errors are
//! problems by RFC 9457, `/openapi.json` says what there is.

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
mod serving;
mod state;
mod tokens;

use std::io;

use axum::Router;

use crate::access::Access;
use crate::desk::Desk;
use guard::Guarded;
pub use place::{Listen, ListenError};
use serving::{Opened, Serving};
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
    serving: Vec<Serving>,
}

impl Edge {
    /// Serves what `desk` knows at each of `places` to whom `access` lets in.
    ///
    /// # Errors
    /// When one of them cannot be listened at, or is open to others than `access` can tell apart.
    pub fn open(desk: Desk, places: &[Listen], access: &Access) -> Result<Self, EdgeError> {
        // One of them looks after the file of tokens for all.
        let mut tokens = access.tokens.clone();
        Self::serve(places, access, |place, closing| {
            if let Some(known) = tokens.take() {
                let say = access.say.clone();
                tokio::spawn(tokens::watch(known, say, desk.clone(), closing.clone()));
            }
            let state = State::new(desk.clone(), closing);
            let guarded = Guarded::new(place, access, desk.stops());
            routes::router(state, guarded)
        })
    }

    /// The same with what `app` makes for each place, within its runtime.
    fn serve(
        places: &[Listen],
        access: &Access,
        mut app: impl FnMut(&Listen, Closing) -> Router,
    ) -> Result<Self, EdgeError> {
        let opened = places.iter().map(|place| {
            let at = place.to_string();
            Opened::at(place, access).map_err(|source| EdgeError { at, source })
        });
        // Nobody is served before all are open.
        let opened: Vec<_> = opened.collect::<Result<_, _>>()?;
        let mut edge = Self {
            places: opened.iter().map(|it| it.place().clone()).collect(),
            serving: Vec::new(),
        };
        for (opened, at) in opened.into_iter().zip(places) {
            let at = at.to_string();
            let begun = opened.serve(&mut app);
            let begun = begun.map_err(|source| EdgeError { at, source })?;
            edge.serving.push(begun);
        }
        Ok(edge)
    }

    /// Where it is found; ports that were chosen by the system are numbers here.
    pub fn places(&self) -> &[Listen] {
        &self.places
    }
}

impl Drop for Edge {
    fn drop(&mut self) {
        // All say their last word at the same time.
        self.serving.iter_mut().for_each(Serving::close);
        self.serving.clear();
        for place in &self.places {
            if let Listen::Unix(path) = place {
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// What the interface is, as OpenAPI 3.1.
pub fn openapi() -> utoipa::openapi::OpenApi {
    routes::described().1
}

#[cfg(test)]
mod tests {
    use core::time::Duration;
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::os::unix::net::UnixStream;
    use std::sync::{Arc, Barrier};

    use axum::routing::get;

    use super::*;

    /// What is answered in a moment is not answered any more after so long.
    const LATE: Duration = Duration::from_secs(60);
    const ASK: &[u8] = b"GET / HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n";

    /// A thread that does nothing else any more is the worst that a flood can make of it.
    #[test]
    fn whoever_asks_at_one_place_does_not_wait_for_what_keeps_another_busy() {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("socket");
        let places = [
            "tcp:127.0.0.1:0".parse().unwrap(),
            Listen::Unix(socket.clone()),
        ];
        let held = Arc::new(Barrier::new(2));
        let edge = Edge::serve(&places, &Access::default(), |place, _| {
            let held = matches!(place, Listen::Tcp(_)).then(|| Arc::clone(&held));
            Router::new().route(
                "/",
                get(async move || {
                    // Once when it is reached, and once when it may go on.
                    held.iter().for_each(|it| {
                        it.wait();
                        it.wait();
                    });
                    "answered"
                }),
            )
        });
        let edge = edge.unwrap();
        let Listen::Tcp(address) = edge.places()[0] else {
            panic!("it is TCP")
        };
        let mut strangers = TcpStream::connect(address).unwrap();
        strangers.write_all(ASK).unwrap();
        held.wait();
        let mut own = UnixStream::connect(&socket).unwrap();
        own.set_read_timeout(Some(LATE)).unwrap();
        own.write_all(ASK).unwrap();
        let mut said = String::new();
        let heard = own.read_to_string(&mut said);
        held.wait();
        assert!(heard.is_ok() && said.ends_with("answered"), "{said}");
        let mut said = String::new();
        strangers.read_to_string(&mut said).unwrap();
        assert!(said.ends_with("answered"), "{said}");
        drop(edge);
        assert!(!socket.exists());
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
