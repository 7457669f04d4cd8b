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

    /// The ports whose SYNC is due at `at`, their next one. They are sent then: the grid goes on.
    #[cfg(feature = "live")]
    pub(super) fn take(&mut self, at: Time) -> Vec<Port> {
        let due = self.0.iter_mut().filter(|(_, it)| it.next == at);
        due.map(|(port, producer)| {
            producer.next += producer.period;
            *port
        })
        .collect()
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

#[cfg(all(test, feature = "live"))]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_ahead_is_not_due_once_more() {
        let (fast, slow) = (Duration::from_millis(5), Duration::from_millis(10));
        let mut grid = SyncGrid::new();
        grid.set(Time::ZERO, Port(0), Some(fast));
        grid.set(Time::ZERO, Port(1), Some(slow));
        assert_eq!(grid.take(Time(5_000_000)), [Port(0)]);
        assert_eq!(grid.take(Time(5_000_000)), []);
        assert_eq!(grid.next(), Time(10_000_000));
        assert_eq!(grid.take(Time(10_000_000)), [Port(0), Port(1)]);
        let mut sent = Vec::new();
        grid.send_due(Time(15_000_000), |port, at| sent.push((port, at)));
        assert_eq!(sent, [(Port(0), Time(15_000_000))]);
    }
}
