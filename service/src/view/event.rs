//! What happened, as it is told.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Event {
    /// Its number; the next one has the next.
    pub id: u64,
    /// When, UTC, RFC 3339.
    pub at: String,
    /// When by the machine's clock, in seconds.
    pub clock_s: f64,
    /// What: `machine`, `axis`, `position`, `motion`, `run`, `stop`, `lease`,
    /// `calibration`, `question`, `point`, `warning`.
    pub kind: String,
    /// Of which axis, motion or run; empty for the machine.
    pub of: String,
    /// What is to be said of it.
    #[schema(value_type = Object)]
    pub data: serde_json::Value,
}

impl Event {
    /// What it can be.
    pub const KINDS: [&str; 11] = [
        "machine",
        "axis",
        "position",
        "motion",
        "run",
        "stop",
        "lease",
        "calibration",
        "question",
        "point",
        "warning",
    ];
}
