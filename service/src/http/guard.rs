//! Who is let in, and what is taken from a request.

use core::convert::Infallible;
use core::time::Duration;
use std::sync::Arc;

use axum::Json;
use axum::body::{Bytes, HttpBody};
use axum::extract::{ConnectInfo, FromRequest, FromRequestParts, Path, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use serde::de::DeserializeOwned;
use tokio::time::timeout;
use utoipa::IntoParams;

use super::door::Peer;
use super::identity::{Admitted, Identities, STOP};
use super::needs::{enough, needed};
use super::place::Listen;
use super::places::Keeps;
use super::state::State as Shared;
use crate::access::Access;
use crate::keeper::stopped_by;
use crate::problem::{Code, Problem};
use crate::request::Caller;
use crate::stops::{Arrival, Stops};

/// So large a request may be, in bytes.
const BODY_MAX: usize = 64 << 10;
/// So large one with the rows of a path.
const PATH_MAX: usize = 1 << 20;
/// So much of a larger one is heard, so that its answer is heard, too.
const HEARD_MAX: usize = 2 << 20;
/// How long a body may take to come: its connection has one of the places meanwhile.
const BODY_TIME: Duration = Duration::from_secs(10);
/// How long a stop waits for its own.
const STOP_TIME: Duration = Duration::from_secs(1);
/// So long a name of a client may be.
pub(super) const NAME_MAX: usize = 64;
/// What whoever sent a wrong body is told.
const HELP: &str = "GET /openapi.json says what is expected";
/// Who a client says that it is, for people.
const CLIENT: &str = "truestage-client";
/// By which a request is known when it comes again, and how long that may be.
const KEY: &str = "idempotency-key";
const KEY_MAX: usize = 256;
/// What proves the lease.
const LEASE: &str = "truestage-lease";

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.code.status());
        let status = status.unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let kind = [(header::CONTENT_TYPE, "application/problem+json")];
        let more = match self.code {
            // A browser asks whoever looks at it for a name and a password: the token is the password.
            Code::Unauthorized => vec![
                (header::WWW_AUTHENTICATE, r#"Bearer realm="truestage""#),
                (
                    header::WWW_AUTHENTICATE,
                    r#"Basic realm="truestage: the token is the password""#,
                ),
            ],
            Code::TooMany => vec![(header::RETRY_AFTER, "1")],
            _ => Vec::new(),
        };
        let mut response = (status, kind, Json(self)).into_response();
        for (name, value) in more {
            let value = HeaderValue::from_static(value);
            response.headers_mut().append(name, value);
        }
        response
    }
}

/// How a page in a browser, which may come from anywhere, is kept out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pages {
    /// Nobody's page opens a Unix socket.
    None,
    /// Every page on this computer could ask: host and origin must be this computer's.
    OfThisComputer,
    /// Whoever asks has a certificate's name and a token: the origin must be the place itself.
    OfItsName,
}

/// Who is let in at a door.
#[derive(Clone)]
pub(super) struct Guarded {
    pages: Pages,
    identities: Identities,
    stops: Arc<Stops>,
}

impl Guarded {
    pub(super) fn new(place: &Listen, access: &Access, stops: &Arc<Stops>) -> Self {
        let (pages, is_beyond) = match place {
            Listen::Unix(_) => (Pages::None, false),
            Listen::Tcp(_) => (Pages::OfThisComputer, false),
            Listen::Tls(_) => (Pages::OfItsName, true),
        };
        Self {
            pages,
            identities: Identities::new(access, is_beyond),
            stops: Arc::clone(stops),
        }
    }

    fn admit(&self, request: &Request) -> Result<Admitted, Problem> {
        let (headers, uri) = (request.headers(), request.uri());
        check(self.pages, headers)?;
        let peer = request.extensions().get::<ConnectInfo<Peer>>();
        let peer = peer.map_or_else(|| "unknown".to_owned(), |it| it.0.to_string());
        let admitted = self.identities.admit(&peer, headers, uri.path())?;
        enough(admitted.role, needed(request.method(), uri.path()))?;
        Ok(admitted)
    }
}

/// Whoever asks is let in or told why not; what he says is heard as a whole first.
pub(super) async fn guard(
    State(guarded): State<Guarded>,
    request: Request,
    next: Next,
) -> Response {
    // What stops from here on is a stop of this request, however long its body takes.
    let arrival = guarded.stops.arrival();
    let admitted = guarded.admit(&request);
    let (mut parts, body) = request.into_parts();
    parts.extensions.insert(Arrived(arrival));
    // Who is answered before he has said all may never hear it.
    let most = match admitted.is_ok() && parts.uri.path() == "/v1/runs" {
        true => PATH_MAX,
        false => BODY_MAX,
    };
    let is_stop = parts.method == Method::POST && parts.uri.path() == STOP;
    if is_stop && let Ok(admitted) = &admitted {
        parts.extensions.insert(admitted.clone());
        guarded.stops.arrive(stopped_by(By::read(&parts).0.name));
    }
    let limit = if is_stop { STOP_TIME } else { BODY_TIME };
    let whole = timeout(limit, whole(body, most)).await;
    let mut whole = whole.unwrap_or_else(|_| {
        let what = format!("the request had not come as a whole after {limit:?}");
        Err(Problem::new(Code::BadRequest, what, "send it faster"))
    });
    if is_stop && let Err(problem) = whole {
        // It stops all the same, and says so.
        parts.extensions.insert(Unheard(problem));
        whole = Ok(Vec::new());
    }
    match admitted.and_then(|it| Ok((it, whole?))) {
        Ok((admitted, body)) => {
            // An order is carried out whoever else comes; whoever only waits for something makes room.
            let keeps = parts.extensions.get::<Keeps>();
            let _heard = keeps.filter(|_| !parts.method.is_safe()).map(Keeps::heard);
            parts.extensions.insert(admitted);
            next.run(Request::from_parts(parts, body.into())).await
        }
        Err(problem) => problem.into_response(),
    }
}

/// Why what a stop says was not heard.
#[derive(Clone, Debug)]
pub(super) struct Unheard(pub(super) Problem);

/// All of a body, also where nobody asks for it. One that says that it is far too large is not heard at all.
async fn whole(body: axum::body::Body, most: usize) -> Result<Vec<u8>, Problem> {
    if body.size_hint().lower() > HEARD_MAX as u64 {
        return Err(too_large(most));
    }
    let mut stream = body.into_data_stream();
    let (mut whole, mut length) = (Vec::new(), 0);
    while let Some(part) = stream.next().await {
        let part = part.map_err(|it| Problem::new(Code::BadRequest, it.to_string(), ""))?;
        length += part.len();
        if length > HEARD_MAX {
            break;
        }
        if length <= most {
            whole.extend_from_slice(&part);
        }
    }
    if length <= most {
        return Ok(whole);
    }
    Err(too_large(most))
}

fn too_large(most: usize) -> Problem {
    let what = format!("a request of more than {} kB", most >> 10);
    Problem::new(Code::TooLarge, what, "")
}

fn check(pages: Pages, headers: &HeaderMap) -> Result<(), Problem> {
    // Who judges another one than the next server is let in by one and meant by the other (RFC 9112, 3.2).
    for name in [header::HOST, header::ORIGIN] {
        let count = headers.get_all(&name).iter().count();
        if count > 1 {
            let what = format!("{count} headers `{name}` in one request");
            return Err(Problem::new(Code::BadRequest, what, "send one"));
        }
    }
    let scheme = match pages {
        Pages::None => return Ok(()),
        Pages::OfThisComputer => "http",
        Pages::OfItsName => "https",
    };
    let text = |name| headers.get(name).map(|it| it.to_str().unwrap_or_default());
    let host = text(header::HOST);
    if pages == Pages::OfThisComputer && !host.is_some_and(is_own_host) {
        let what = "the Host of this request is not this computer";
        return Err(Problem::new(
            Code::Forbidden,
            what,
            "ask for 127.0.0.1 or localhost",
        ));
    }
    let origin = text(header::ORIGIN);
    let own = host.map(|host| format!("{scheme}://{host}"));
    if origin.is_some() && origin != own.as_deref() {
        let what = "a page from elsewhere must not ask this service";
        return Err(Problem::new(Code::Forbidden, what, ""));
    }
    Ok(())
}

fn is_own_host(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|it| it.is_ascii_digit()) => name,
        _ => host,
    };
    matches!(name, "localhost" | "127.0.0.1" | "[::1]")
}

/// Who asks: the owner of the token, or by the header `Truestage-Client` with the user who is at the other end of a Unix
/// socket, or by the connection.
#[derive(Clone, Debug)]
pub(super) struct By(pub(super) Caller);

impl<S: Send + Sync> FromRequestParts<S> for By {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        Ok(Self::read(parts))
    }
}

impl By {
    fn read(parts: &Parts) -> Self {
        let text = |name: &str| {
            parts
                .headers
                .get(name)
                .and_then(|value| value.to_str().ok())
        };
        let said = text(CLIENT).unwrap_or_default();
        let name = Known::of(parts).called(said);
        let lease = text(LEASE).map(str::to_owned);
        Self(Caller { name, lease })
    }
}

/// When a request arrived, before its body was heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrived(pub(super) Arrival);

impl FromRequestParts<Shared> for Arrived {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &Shared) -> Result<Self, Infallible> {
        let known = parts.extensions.get::<Self>().copied();
        Ok(known.unwrap_or_else(|| Self(state.desk.stops().arrival())))
    }
}

/// What is known of who asks, whatever he calls himself.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// The owner of his token.
    owner: Option<String>,
    peer: Option<Peer>,
}

impl Known {
    fn of(parts: &Parts) -> Self {
        let admitted = parts.extensions.get::<Admitted>();
        let peer = parts.extensions.get::<ConnectInfo<Peer>>();
        Self {
            owner: admitted.and_then(|it| it.owner.clone()),
            peer: peer.map(|it| it.0.clone()),
        }
    }

    /// His name where he calls himself `said`. The owner of a token has its name; a name that anybody may have is followed
    /// by the user who has it, in characters that no name has.
    pub(super) fn called(&self, said: &str) -> String {
        if let Some(owner) = &self.owner {
            return owner.clone();
        }
        let said = plain(said);
        match &self.peer {
            Some(peer @ Peer::User(_)) if !said.is_empty() => format!("{said} ({peer})"),
            Some(_) | None if !said.is_empty() => said,
            Some(peer) => peer.to_string(),
            None => "unknown".to_owned(),
        }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Known {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        Ok(Self::of(parts))
    }
}

/// The same for the description.
#[derive(Debug, IntoParams)]
#[into_params(parameter_in = Header)]
#[expect(dead_code, reason = "the description alone reads it")]
pub(super) struct Asks {
    /// Who asks, for people: events and ends of motions say it, on a Unix socket followed by the user, as in `anna (uid
    /// 1000)`. Where the connection comes from when left out; the owner of the token where there is one.
    #[param(rename = "Truestage-Client")]
    client: Option<String>,
    /// The token of the lease; without it orders are refused while another client has the lease. One that has lapsed is refused,
    /// too.
    #[param(rename = "Truestage-Lease")]
    lease: Option<String>,
}

/// What a client that only waits may say of itself, for the description.
#[derive(Debug, IntoParams)]
#[into_params(parameter_in = Header)]
#[expect(dead_code, reason = "the description alone reads it")]
pub(super) struct Waits {
    /// The token of the lease, which does not lapse while its holder waits: each 5 s of the wait renew it.
    #[param(rename = "Truestage-Lease")]
    lease: Option<String>,
}

/// The name in a path, plain.
#[derive(Clone, Debug)]
pub(super) struct Named(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let named = Path::<String>::from_request_parts(parts, state).await;
        let named = named.map_err(|it| Problem::new(Code::BadRequest, it.body_text(), ""));
        named.map(|it| Self(plain(&it.0)))
    }
}

/// A name without anything that a terminal, a log or a page would obey.
pub(super) fn plain(text: &str) -> String {
    let is_plain = |it: &char| it.is_alphanumeric() || " .-_@:/".contains(*it);
    text.chars().filter(is_plain).take(NAME_MAX).collect()
}

/// Whether a request has an Idempotency-Key.
pub(super) fn has_key(headers: &HeaderMap) -> bool {
    headers.contains_key(KEY)
}

/// The Idempotency-Key of a request, when it has one.
///
/// # Errors
/// When that is none.
pub(super) fn key_of(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let Some(key) = headers.get(KEY) else {
        return Ok(None);
    };
    match key.to_str() {
        Ok(key) if (1..=KEY_MAX).contains(&key.len()) && is_visible(key) => {
            Ok(Some(key.to_owned()))
        }
        _ => Err(Problem::new(
            Code::BadRequest,
            format!("an Idempotency-Key has 1 to {KEY_MAX} visible characters of ASCII"),
            "a random number is a good one",
        )),
    }
}

fn is_visible(key: &str) -> bool {
    key.bytes().all(|it| it.is_ascii_graphic())
}

/// A body in JSON.
#[derive(Debug)]
pub(super) struct Body<T>(pub(super) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Body<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let bytes = Bytes::from_request(request, state).await;
        let bytes = bytes.map_err(|it| Problem::new(Code::BadRequest, it.body_text(), ""))?;
        // What may be left out may be left out as a whole.
        let bytes = if bytes.is_empty() { &b"{}"[..] } else { &bytes };
        // A list of the values in their order would be taken for an object, too.
        if bytes.trim_ascii_start().first() == Some(&b'[') {
            let what = "a list where an object is expected";
            return Err(Problem::new(Code::BadRequest, what, HELP));
        }
        let read = serde_json::from_slice(bytes);
        read.map(Self).map_err(|it| {
            let said = it.to_string();
            let code = match said.contains("with its unit") {
                true => Code::BadQuantity,
                false => Code::BadRequest,
            };
            Problem::new(code, said, HELP)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(pages: Pages, host: &str, origin: Option<&str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        check(pages, &headers).is_ok()
    }

    #[test]
    fn a_page_from_elsewhere_and_a_name_that_points_here_are_kept_out() {
        assert!(checked(Pages::OfThisComputer, "127.0.0.1:8470", None));
        assert!(checked(Pages::OfThisComputer, "localhost", None));
        assert!(checked(
            Pages::OfThisComputer,
            "[::1]:8470",
            Some("http://[::1]:8470")
        ));
        assert!(!checked(Pages::OfThisComputer, "evil.example", None));
        assert!(!checked(
            Pages::OfThisComputer,
            "127.0.0.1.evil.example:8470",
            None
        ));
        assert!(!checked(
            Pages::OfThisComputer,
            "127.0.0.1:8470",
            Some("http://evil.example")
        ));
        assert!(!checked(
            Pages::OfThisComputer,
            "127.0.0.1:8470",
            Some("http://127.0.0.1:80")
        ));
        assert!(!checked(
            Pages::OfThisComputer,
            "127.0.0.1:8470",
            Some("null")
        ));
        assert!(
            checked(Pages::None, "anything", None),
            "nobody's page opens a Unix socket"
        );
        let named = |origin| checked(Pages::OfItsName, "stage-7.lab:8470", origin);
        assert!(named(None) && named(Some("https://stage-7.lab:8470")));
        assert!(!named(Some("http://stage-7.lab:8470")));
        assert!(!named(Some("https://evil.example")));
    }

    #[test]
    fn a_name_is_followed_by_the_user_who_has_it() {
        let known = |owner: Option<&str>, peer| Known {
            owner: owner.map(str::to_owned),
            peer: Some(peer),
        };
        let user = || Peer::User(Some(1000));
        let anybody = known(None, user());
        assert_eq!(anybody.called("anna"), "anna (uid 1000)");
        assert_eq!(anybody.called("anna (uid 0)"), "anna uid 0 (uid 1000)");
        assert_eq!(anybody.called(""), "uid 1000");
        assert_eq!(known(Some("bert"), user()).called("anna"), "bert");
        let elsewhere = Peer::Address("127.0.0.1:80".parse().unwrap());
        assert_eq!(known(None, elsewhere).called("anna"), "anna");
    }

    #[test]
    fn two_hosts_or_origins_are_none_at_any_door() {
        for pages in [Pages::None, Pages::OfThisComputer, Pages::OfItsName] {
            for (host, origin) in [(2, 0), (1, 2)] {
                let mut headers = HeaderMap::new();
                let own = HeaderValue::from_static("localhost");
                for _ in 0..host {
                    headers.append(header::HOST, own.clone());
                }
                for _ in 0..origin {
                    let own = HeaderValue::from_static("http://localhost");
                    headers.append(header::ORIGIN, own);
                }
                let refused = check(pages, &headers).unwrap_err();
                assert_eq!(refused.code, Code::BadRequest, "{refused}");
            }
        }
    }

    #[test]
    fn a_name_carries_nothing_that_a_terminal_obeys() {
        assert_eq!(plain("anna\u{1b}[31m<b>"), "anna31mb");
        assert_eq!(plain(&"x".repeat(1000)).len(), NAME_MAX);
    }
}
