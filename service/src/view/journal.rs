//! Journals of runs, as a service shows them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A journal of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct JournalView {
    /// Its name.
    pub name: String,
    /// `zero`, `calibrate`, `verify`, …; null when it cannot be read.
    pub verb: Option<String>,
    /// Of which axis.
    pub axis: Option<String>,
    /// When it was begun, UTC, RFC 3339.
    pub started: Option<String>,
    /// Whether its run came to its end.
    pub complete: bool,
}
