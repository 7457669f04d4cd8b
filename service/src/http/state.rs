//! What every handler has.

use std::sync::Arc;

use tokio::sync::{Semaphore, watch};

use crate::desk::Desk;

/// So many streams of events are open at once at each place.
pub(super) const STREAMS: usize = 16;

/// Where it asks, and what all connections of a place share.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) desk: Desk,
    /// Free streams of events.
    pub(super) streams: Arc<Semaphore>,
    pub(super) closing: Closing,
}

impl State {
    pub(super) fn new(desk: Desk, closing: Closing) -> Self {
        Self {
            desk,
            streams: Arc::new(Semaphore::new(STREAMS)),
            closing,
        }
    }
}

/// Whether the edge closes: what has no end comes to one, after its last word.
#[derive(Clone, Debug)]
pub(super) struct Closing(pub(super) watch::Receiver<bool>);

impl Closing {
    pub(super) fn is_now(&self) -> bool {
        *self.0.borrow()
    }

    /// When it closes.
    pub(super) async fn begun(&mut self) {
        // Whoever would tell has gone: it has closed.
        let _ = self.0.wait_for(|it| *it).await;
    }
}
