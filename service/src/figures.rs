//! What a monitoring system asks for: how punctual SYNCs were and how full the buses over the last minute, and how warm
//! it is. Taken once a second of the machine's time.

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::Arc;

use drivers::transport::Histogram;
use machine::{BusFigures, Machine, Thermometer, bus_figures, temperatures};
use units::Time;

const EVERY: Duration = Duration::from_secs(1);
const WINDOW: Duration = Duration::from_secs(60);

/// What is known of the buses and of temperatures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// Of each bus, since the service began.
    pub buses: Vec<BusFigures>,
    /// The same of the last minute, in the same order.
    pub minute: Vec<Minute>,
    /// What thermometers said last.
    pub temperatures: Vec<Thermometer>,
}

/// The last minute on a bus.
#[derive(Clone, Debug, PartialEq)]
pub struct Minute {
    /// How late SYNCs were; `None` where no thread sends them.
    pub lateness: Option<Histogram>,
    /// The share of the time for which the bus was taken, 0 to 1.
    pub load: f64,
}

/// Takes figures, and knows those of a minute ago.
#[derive(Debug, Default)]
pub(crate) struct Book {
    taken: VecDeque<(Time, Vec<BusFigures>)>,
    newest: Arc<Figures>,
}

impl Book {
    /// The newest figures of `machine`.
    pub(crate) fn look(&mut self, machine: &Machine) -> Arc<Figures> {
        let now = machine.now();
        let is_due = self.taken.back().is_none_or(|it| now.since(it.0) >= EVERY);
        if is_due {
            self.take(now, bus_figures(machine));
            let newest = Figures {
                minute: self.minute(),
                buses: self.taken.back().map(|it| it.1.clone()).unwrap_or_default(),
                temperatures: temperatures(machine),
            };
            self.newest = Arc::new(newest);
        }
        Arc::clone(&self.newest)
    }

    fn take(&mut self, now: Time, buses: Vec<BusFigures>) {
        self.taken.push_back((now, buses));
        // The oldest that is kept is as old as the window.
        while self
            .taken
            .get(1)
            .is_some_and(|it| now.since(it.0) >= WINDOW)
        {
            self.taken.pop_front();
        }
    }

    fn minute(&self) -> Vec<Minute> {
        let (Some((then, before)), Some((now, after))) = (self.taken.front(), self.taken.back())
        else {
            return Vec::new();
        };
        let span = now.since(*then).as_secs_f64();
        let buses = after.iter().zip(before);
        let of = |(after, before): (&BusFigures, &BusFigures)| {
            let busy = after.busy.saturating_sub(before.busy).as_secs_f64();
            let lateness = after.sync.as_ref().map(|after| match &before.sync {
                Some(before) => after.lateness.since(&before.lateness),
                None => after.lateness.clone(),
            });
            Minute {
                lateness,
                load: if span > 0.0 { busy / span } else { 0.0 },
            }
        };
        buses.map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use drivers::transport::SyncStatistics;
    use machine::BusCounts;

    use super::*;

    fn bus(busy_ms: u64, lateness: &Histogram) -> Vec<BusFigures> {
        vec![BusFigures {
            name: "can0".into(),
            counts: BusCounts::default(),
            busy: Duration::from_millis(busy_ms),
            sync: Some(SyncStatistics {
                sent: lateness.total(),
                lateness: lateness.clone(),
                ..SyncStatistics::default()
            }),
        }]
    }

    #[test]
    fn a_minute_is_the_last_one_and_what_was_before_is_forgotten() {
        let (mut book, mut lateness) = (Book::default(), Histogram::default());
        // 20 % of the bus and a SYNC that is a second late, then 50 % and SYNCs that are 100 us late.
        lateness.note(EVERY);
        let mut busy_ms = 0;
        for second in 0..200 {
            busy_ms += if second <= 100 { 200 } else { 500 };
            lateness.note(Duration::from_micros(100));
            book.take(
                Time::from_seconds(f64::from(second)),
                bus(busy_ms, &lateness),
            );
        }
        let minute = &book.minute()[0];
        assert!((minute.load - 0.5).abs() < 1e-9, "{minute:?}");
        let lateness = minute.lateness.as_ref().unwrap();
        assert_eq!(lateness.total(), 60);
        assert!(
            lateness.greatest() < Duration::from_micros(113),
            "{lateness}"
        );
        assert!(book.taken.len() <= 61, "{}", book.taken.len());
    }
}
