//! SYNCs on the grid of a clock that only passes when it is told to: no thread, no lateness.

use core::time::Duration;
use std::collections::BTreeMap;

use units::Time;
use wire::Port;

#[derive(Clone, Copy, Debug)]
struct Producer {
    period: Duration,
    next: Time,
}

/// The SYNC producers of a transport whose time is virtual.
#[derive(Debug, Default)]
pub(super) struct SyncGrid(BTreeMap<Port, Producer>);

impl SyncGrid {
    pub(super) const fn new() -> Self {
        Self(BTreeMap::new())
    }

    /// Starts, changes or (with `None`) stops the producer of `port`; the first SYNC comes one
    /// period after `now`.
    pub(super) fn set(&mut self, now: Time, port: Port, period: Option<Duration>) {
        match period {
            None => drop(self.0.remove(&port)),
            Some(period) => {
                let next = now + period;
                self.0.insert(port, Producer { period, next });
            }
        }
    }

    /// When the next SYNC is due; [`Time::NEVER`] without producers.
    pub(super) fn next(&self) -> Time {
        let next = self.0.values().map(|it| it.next).min();
        next.unwrap_or(Time::NEVER)
    }

    /// Hands each SYNC that is due at `now` to `send`, with its moment; those that a held-up
    /// host has missed are left out.
    pub(super) fn send_due(&mut self, now: Time, mut send: impl FnMut(Port, Time)) {
        for (port, producer) in &mut self.0 {
            while producer.next <= now {
                if now.since(producer.next) < producer.period {
                    send(*port, producer.next);
                }
                producer.next += producer.period;
            }
        }
    }
}
