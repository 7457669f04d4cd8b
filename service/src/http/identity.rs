//! As whom somebody is let in: by a token, or as everybody who can reach the place.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

use super::rate::{Rate, Rates};
use crate::access::{Access, KnownTokens, Owner, Role};
use crate::problem::{Code, Problem};

/// Twenty clients of a hundred requests a second by one name; more of them keep others waiting.
const OF_EACH: Rate = Rate {
    a_second: 2000.0,
    at_once: 1000.0,
};
/// Of requests without a token that is known, from one address.
const OF_STRANGERS: Rate = Rate {
    a_second: 10.0,
    at_once: 20.0,
};

/// What whoever was let in may always ask for.
pub(super) const STOP: &str = "/v1/stop";

/// Who was let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Admitted {
    /// The owner of his token.
    pub(super) owner: Option<String>,
    pub(super) role: Role,
}

impl<S: Send + Sync> FromRequestParts<S> for Admitted {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Problem> {
        let admitted = parts.extensions.get::<Self>().cloned();
        admitted.ok_or_else(|| Problem::new(Code::Forbidden, "nobody let this request in", ""))
    }
}

/// Who is known at a door, and how often each has asked.
#[derive(Clone)]
pub(super) struct Identities {
    tokens: Option<Arc<KnownTokens>>,
    /// Whether nobody is let in without one.
    required: bool,
    of_each: Arc<Rates>,
    of_strangers: Arc<Rates>,
}

impl Identities {
    pub(super) fn new(access: &Access, is_beyond_this_computer: bool) -> Self {
        Self {
            tokens: access.tokens.clone(),
            required: access.everywhere || is_beyond_this_computer,
            of_each: Arc::new(Rates::new(OF_EACH)),
            of_strangers: Arc::new(Rates::new(OF_STRANGERS)),
        }
    }

    /// As whom `peer` is let in.
    ///
    /// # Errors
    /// When a token is missing or not known, or too much is asked.
    pub(super) fn admit(
        &self,
        peer: &str,
        headers: &HeaderMap,
        path: &str,
    ) -> Result<Admitted, Problem> {
        let now = Instant::now();
        let owner = self.owner(headers, path);
        let owner = owner.map_err(|problem| match self.of_strangers.take(peer, now) {
            Ok(()) => problem,
            Err(_) => too_many("without a token that is known"),
        })?;
        let caller = owner.as_ref().map_or(peer, |it| &it.name);
        // A stop is never one too many.
        if path != STOP && self.of_each.take(caller, now).is_err() {
            return Err(too_many(&format!("by {caller}")));
        }
        Ok(match owner {
            Some(Owner { name, role }) => Admitted {
                owner: Some(name),
                role,
            },
            None => Admitted {
                owner: None,
                role: Role::Commissioner,
            },
        })
    }

    fn owner(&self, headers: &HeaderMap, path: &str) -> Result<Option<Owner>, Problem> {
        // Without a file of tokens nobody needs one.
        let Some(tokens) = &self.tokens else {
            return Ok(None);
        };
        let said = headers.get(header::AUTHORIZATION);
        let Some(said) = said else {
            return match self.required {
                false => Ok(None),
                true => Err(unauthorized("a token is needed here, and none was sent")),
            };
        };
        let token = said.to_str().ok().and_then(token_in);
        let token = token.ok_or_else(|| unauthorized("the header Authorization has no token"))?;
        match tokens.owner(&token) {
            Ok(Some(owner)) => Ok(Some(owner)),
            Ok(None) => Err(unauthorized("this token is not known here")),
            Err(_) if path == STOP => match tokens.owner_before(&token) {
                Some(owner) => Ok(Some(Owner {
                    role: Role::Viewer,
                    ..owner
                })),
                None => Err(no_tokens()),
            },
            Err(_) => Err(no_tokens()),
        }
    }
}

/// `Bearer TOKEN` (RFC 6750), or, for browsers and `curl -u`, `Basic` with any name and the token as the password
/// (RFC 7617).
fn token_in(said: &str) -> Option<String> {
    let (scheme, rest) = said.split_once(' ')?;
    let rest = rest.trim();
    if scheme.eq_ignore_ascii_case("bearer") {
        return Some(rest.to_owned());
    }
    if !scheme.eq_ignore_ascii_case("basic") {
        return None;
    }
    let both = String::from_utf8(BASE64_STANDARD.decode(rest).ok()?).ok()?;
    Some(both.split_once(':')?.1.to_owned())
}

fn unauthorized(what: &str) -> Problem {
    let help = "send `Authorization: Bearer TOKEN`, or the token as the password of any name (`curl -u name`); \
                who keeps the machine makes one with `truestage token NAME --role viewer`";
    Problem::new(Code::Unauthorized, what, help)
}

fn no_tokens() -> Problem {
    Problem::new(
        Code::Storage,
        "the file of tokens was changed into one that cannot be used, so that tokens do no more than stop",
        "a `warning` among the events, and standard error of the service, say what is wrong with it",
    )
}

fn too_many(who: &str) -> Problem {
    Problem::new(
        Code::TooMany,
        format!("too many requests {who}"),
        "wait a second; /v1/events tells what happens without being asked again and again",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_comes_as_a_bearer_or_as_the_password_of_any_name() {
        let of = |said: &str| token_in(said);
        assert_eq!(of("Bearer 0a1b").as_deref(), Some("0a1b"));
        assert_eq!(of("bearer  0a1b ").as_deref(), Some("0a1b"));
        // printf 'anna:0a1b' | base64
        assert_eq!(of("Basic YW5uYTowYTFi").as_deref(), Some("0a1b"));
        for wrong in ["", "0a1b", "Digest 0a1b", "Basic 0a1b!", "Basic YW5uYQ=="] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
