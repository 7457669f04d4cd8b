//! Which role each request needs.

use axum::http::Method;

use crate::access::Role;
use crate::problem::{Code, Problem};
use crate::request::RunKind;

/// What an operator may ask for; what is on no list is for those who may do everything.
const FOR_OPERATORS: [&str; 6] = ["motions", "jog", "runs", "axes", "lease", "reset"];

/// The role that a request for `path` needs. What a run needs depends on what it does: see [`of_run`].
pub(super) fn needed(method: &Method, path: &str) -> Role {
    let looks = [Method::GET, Method::HEAD, Method::OPTIONS].contains(method);
    // A stop is taken from anybody who is let in at all.
    if looks || path == "/v1/stop" {
        return Role::Viewer;
    }
    let resource = path.strip_prefix("/v1/").unwrap_or_default();
    let resource = resource.split('/').next().unwrap_or_default();
    match FOR_OPERATORS.contains(&resource) {
        true => Role::Operator,
        false => Role::Commissioner,
    }
}

/// What a run of this kind needs: those that change how positions are corrected are for commissioners.
pub(super) const fn of_run(kind: RunKind) -> Role {
    match kind {
        RunKind::Zero | RunKind::Verify | RunKind::Path | RunKind::Job => Role::Operator,
        // What a first part or a memory leaves is kept for all later parts.
        RunKind::Calibrate
        | RunKind::Reference
        | RunKind::FirstMemory
        | RunKind::SecondMemory
        | RunKind::FirstPart => Role::Commissioner,
    }
}

/// # Errors
/// When `role` is not enough for what needs `needed`.
pub(super) fn enough(role: Role, needed: Role) -> Result<(), Problem> {
    if role >= needed {
        return Ok(());
    }
    let article = match role {
        Role::Operator => "an",
        Role::Viewer | Role::Commissioner => "a",
    };
    Err(Problem::new(
        Code::Forbidden,
        format!("this needs the role {needed}, and your token is that of {article} {role}"),
        format!("ask who keeps the machine for one: `truestage token NAME --role {needed}`"),
    ))
}
