//! Calibrations, and what is chosen of them.

use serde::{Deserialize, Serialize};
use truestage::runs::Change;
use utoipa::ToSchema;

use super::AxisView;

/// A calibration that is stored.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationView {
    /// Its name: the BLAKE3 of what it says.
    pub id: String,
    /// Of which axis.
    pub axis: String,
    /// What it is: `linear`, `rotary`, …
    pub kind: String,
    /// When it was made, UTC, RFC 3339.
    pub created: String,
    /// The journal that it was made from.
    pub source: String,
    /// What it says, in a line.
    pub summary: String,
    /// Whether it is in use.
    pub active: bool,
}

/// What is used from now on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChosenView {
    /// What was chosen, and what goes with it.
    pub changes: Vec<ChangeView>,
    /// The axes that are corrected by it.
    pub axes: Vec<AxisView>,
    /// Why they are not, where they are not.
    pub warning: Option<String>,
}

/// What one of the calibrations in use is from now on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ChangeView {
    /// Of which axis; of three axes `volume`, `volume-references`, `volume-first-memory` or `volume-second-memory`.
    pub of: String,
    /// Its name; null: none is in use.
    pub id: Option<String>,
    /// Whether it is the one that was used before.
    pub is_earlier: bool,
}

impl From<Change> for ChangeView {
    fn from(change: Change) -> Self {
        let Change {
            pointer,
            id,
            is_earlier,
        } = change;
        Self {
            of: pointer,
            id,
            is_earlier,
        }
    }
}
