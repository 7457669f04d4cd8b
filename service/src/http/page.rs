//! The page: one machine in a browser, by the interface that every client has.
//!
//! It asks nothing from anywhere else, and a browser that obeys its policy would not let it. Nothing is built: the
//! files are served as they are.

use axum::Router;
use axum::http::{HeaderName, StatusCode, header};
use axum::routing::get;

use super::state::State;

/// Where each file is, what it is, and what it says.
const FILES: [(&str, &str, &str); 8] = [
    (
        "/",
        "text/html; charset=utf-8",
        include_str!("page/index.html"),
    ),
    (
        "/page.css",
        "text/css; charset=utf-8",
        include_str!("page/page.css"),
    ),
    (
        "/page.js",
        "text/javascript; charset=utf-8",
        include_str!("page/page.js"),
    ),
    (
        "/curve.js",
        "text/javascript; charset=utf-8",
        include_str!("page/curve.js"),
    ),
    (
        "/feed.js",
        "text/javascript; charset=utf-8",
        include_str!("page/feed.js"),
    ),
    (
        "/stream.js",
        "text/javascript; charset=utf-8",
        include_str!("page/stream.js"),
    ),
    (
        "/link.js",
        "text/javascript; charset=utf-8",
        include_str!("page/link.js"),
    ),
    (
        "/stop.js",
        "text/javascript; charset=utf-8",
        include_str!("page/stop.js"),
    ),
];

/// Nothing from elsewhere, and nobody else's page around it: a click on STOP must be meant.
const POLICY: &str =
    "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const fn headers(kind: &'static str) -> [(HeaderName, &'static str); 4] {
    [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        // Another version of the service has another page.
        (header::CACHE_CONTROL, "no-cache"),
    ]
}

/// The page's files.
pub(super) fn page() -> Router<State> {
    FILES
        .into_iter()
        .fold(without_icon(), |router, (path, kind, text)| {
            router.route(path, get(async move || (headers(kind), text)))
        })
}

/// Every browser asks for one.
fn without_icon() -> Router<State> {
    Router::new().route("/favicon.ico", get(async || StatusCode::NO_CONTENT))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_small_and_names_nobody_else() {
        let whole: usize = FILES.iter().map(|it| it.2.len()).sum();
        assert!(whole <= 150_000, "{whole} bytes");
        for (path, _, text) in FILES {
            assert!(!text.contains("://"), "{path} names another place");
        }
    }

    /// What comes from outside, a name of a client for one, must stay text.
    #[test]
    fn the_page_sets_text_and_never_markup() {
        for way in [
            "innerHTML",
            "outerHTML",
            "insertAdjacent",
            "document.write",
            "eval(",
        ] {
            for (path, _, text) in FILES {
                assert!(!text.contains(way), "{way} in {path}");
            }
        }
        let (_, _, markup) = FILES[0];
        // The policy would refuse them in silence.
        assert!(!markup.contains("style=") && !markup.contains("onclick"));
    }
}
