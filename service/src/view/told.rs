//! What runs and motions gave.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What something gave, as the command line prints it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ToldView {
    /// For people.
    pub text: String,
    /// For programs: what `--json` prints.
    #[schema(value_type = Object)]
    pub value: serde_json::Value,
}

impl From<truestage::runs::Told> for ToldView {
    fn from(told: truestage::runs::Told) -> Self {
        let truestage::runs::Told { text, value } = told;
        Self { text, value }
    }
}

/// A calibration that a run stored.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StoredView {
    /// What the store calls it: an axis, or what is kept of several together.
    pub of: String,
    /// Its name.
    pub calibration: String,
}
