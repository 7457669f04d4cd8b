//! What every handler has.

use crate::desk::Desk;

/// Where it asks.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) desk: Desk,
}
