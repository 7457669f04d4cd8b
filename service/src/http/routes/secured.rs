//! What the description says of who is let in: tokens, and that any request may be refused for want of one.

use utoipa::openapi::content::ContentBuilder;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{OpenApi, Ref, RefOr, ResponseBuilder};

/// By which name each is known.
const BEARER: &str = "token";
const BASIC: &str = "password";
/// Any refusal.
const REFUSED: &str = "4XX";

/// Adds it.
pub(super) fn describe(description: &mut OpenApi) {
    let components = description.components.get_or_insert_default();
    let schemes = [
        (
            BEARER,
            HttpAuthScheme::Bearer,
            "A token of `truestage token`. Needed over the network, and on this computer where that was asked for. A viewer \
             looks and stops; an operator also moves, zeroes, verifies and resets; a commissioner may do everything.",
        ),
        (
            BASIC,
            HttpAuthScheme::Basic,
            "The same token as the password of any name, for browsers.",
        ),
    ];
    for (name, scheme, what) in schemes {
        let scheme = HttpBuilder::new().scheme(scheme).description(Some(what));
        components.add_security_scheme(name, SecurityScheme::Http(scheme.build()));
    }
    let none: [&str; 0] = [];
    description.security = Some(vec![
        // On a Unix socket and on loopback nobody is asked for one.
        SecurityRequirement::default(),
        SecurityRequirement::new(BEARER, none),
        SecurityRequirement::new(BASIC, none),
    ]);
    for item in description.paths.paths.values_mut() {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().flatten() {
            let responses = &mut operation.responses.responses;
            responses.entry(REFUSED.to_owned()).or_insert_with(refused);
        }
    }
}

fn refused() -> RefOr<utoipa::openapi::Response> {
    let problem = RefOr::Ref(Ref::from_schema_name("ProblemBody"));
    let content = ContentBuilder::new().schema(Some(problem)).build();
    let response = ResponseBuilder::new()
        .description("Not let in, or asked too often")
        .content("application/problem+json", content);
    RefOr::T(response.build())
}
