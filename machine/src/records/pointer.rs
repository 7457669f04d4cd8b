//! Which calibration is in use.

use serde::{Deserialize, Serialize};

/// Which calibration an axis uses, and which it used before (oldest first).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActivePointer {
    /// Of this struct.
    pub schema_version: u32,
    /// The calibration in use.
    pub current: Option<String>,
    /// Those in use before.
    pub history: Vec<String>,
}
