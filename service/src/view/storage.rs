//! Disk of the ledger, as it is shown.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What is known of the disk that motions and runs are written to before they begin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct StorageView {
    /// Whether motions and runs are taken; stops and jogs always are.
    pub ok: bool,
    /// Why not.
    pub cause: Option<String>,
    /// Where a ledger is kept that could not be read: requests with a key are refused until a person accepts that.
    pub damaged: Option<String>,
}
