//! Stops that have arrived. Each voids every order that arrived before it and has not begun.
//!
//! A stop counts when it arrives, and not when the machine's thread takes it: an order that waits for the disk, or behind
//! others, has begun nothing then, and must not begin afterwards.

use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};

use crate::view::Stopped;

/// So many stops had arrived when something did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub(crate) struct Arrival(u64);

/// Where stops arrive.
#[derive(Debug)]
pub(crate) struct Stops {
    count: AtomicU64,
    arrived: Sender<Stopped>,
}

/// What the machine's thread knows of them. It waits for nothing.
#[derive(Debug)]
pub(crate) struct StopWatch {
    stops: Arc<Stops>,
    arriving: Receiver<Stopped>,
    last: Option<Stopped>,
}

impl Stops {
    pub(crate) fn new() -> (Arc<Self>, StopWatch) {
        let (arrived, arriving) = mpsc::channel();
        let stops = Arc::new(Self {
            count: AtomicU64::new(0),
            arrived,
        });
        let watch = StopWatch {
            stops: Arc::clone(&stops),
            arriving,
            last: None,
        };
        (stops, watch)
    }

    /// What arrives now.
    pub(crate) fn arrival(&self) -> Arrival {
        Arrival(self.count.load(Ordering::SeqCst))
    }

    /// A stop arrives.
    pub(crate) fn arrive(&self, stopped: Stopped) {
        // Who it is must be known before it counts. Where no thread listens the machine's thread has ended.
        let _ = self.arrived.send(stopped);
        self.count.fetch_add(1, Ordering::SeqCst);
    }
}

impl StopWatch {
    /// The stop that voids what came at `arrival`.
    pub(crate) fn after(&mut self, arrival: Arrival) -> Option<Stopped> {
        if arrival >= self.stops.arrival() {
            return None;
        }
        if let Some(newest) = self.arriving.try_iter().last() {
            self.last = Some(newest);
        }
        self.last.clone()
    }

    /// Everything that has arrived is void from now on, as after a stop.
    pub(crate) fn void_all(&self, stopped: Stopped) {
        self.stops.arrive(stopped);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by(name: &str) -> Stopped {
        Stopped {
            by: name.to_owned(),
            at: String::new(),
        }
    }

    #[test]
    fn a_stop_voids_what_arrived_before_it() {
        let (stops, mut watch) = Stops::new();
        let first = stops.arrival();
        assert_eq!(watch.after(first), None);
        stops.arrive(by("anna"));
        let second = stops.arrival();
        stops.arrive(by("bert"));
        assert_eq!(watch.after(first), Some(by("bert")));
        assert_eq!(watch.after(second), Some(by("bert")));
        assert_eq!(watch.after(stops.arrival()), None);
    }
}
