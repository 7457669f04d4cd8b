//! Which program writes records and pages.

use std::sync::OnceLock;

static VERSION: OnceLock<&'static str> = OnceLock::new();

/// That this program is `version` of truestage: said once, when it begins.
#[cfg(feature = "program")]
pub(crate) fn this_is(version: &'static str) {
    // Whoever says it again says the same.
    let _ = VERSION.set(version);
}

/// The program's name and version, with its commit where that is known.
pub(crate) fn made_by() -> String {
    let version = VERSION.get().copied();
    format!("truestage {}", version.unwrap_or(env!("CARGO_PKG_VERSION")))
}
