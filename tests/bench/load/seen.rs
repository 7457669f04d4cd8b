//! What was seen in all turns of one kind.

use core::time::Duration;

use drivers::transport::{Histogram, Scheduling};
use serde_json::{Value, json};
use service::Desk;

use crate::lone::Lone;

/// What was seen.
#[derive(Default)]
pub(crate) struct Seen {
    name: &'static str,
    lateness: Histogram,
    lone: Histogram,
    p99: Vec<Duration>,
    skipped: u64,
    pub(crate) commands: Vec<Duration>,
}

/// What SYNC threads, and a thread by itself, have done until a moment.
pub(crate) struct Done {
    lateness: Histogram,
    lone: Histogram,
    skipped: u64,
}

impl Done {
    pub(crate) fn of(desk: &Desk, lone: &Lone) -> Self {
        let figures = desk.figures();
        let sync = figures.buses[0].sync.as_ref().expect("a SYNC thread");
        Self {
            lone: lone.lateness(),
            lateness: sync.lateness.clone(),
            skipped: sync.skipped,
        }
    }
}

/// Whether SYNCs come before everything ordinary.
pub(crate) fn is_real_time(desk: &Desk) -> bool {
    let figures = desk.figures();
    let sync = figures.buses[0].sync.as_ref();
    sync.is_some_and(|it| it.scheduling == Scheduling::RealTime)
}

impl Seen {
    pub(crate) fn of(name: &'static str) -> Self {
        Self {
            name,
            ..Self::default()
        }
    }

    /// A turn is over.
    pub(crate) fn add(&mut self, before: &Done, after: &Done) {
        let turn = after.lateness.since(&before.lateness);
        self.p99.push(turn.percentile(0.99));
        self.lateness.add(&turn);
        self.lone.add(&after.lone.since(&before.lone));
        self.skipped += after.skipped - before.skipped;
    }

    /// Its figures; ratios are those of each turn to the turn of `quiet` before it.
    pub(crate) fn judge(&mut self, quiet: &[Duration]) -> Value {
        let ratio = |(it, quiet): (&Duration, &Duration)| it.as_secs_f64() / quiet.as_secs_f64();
        let mut ratios: Vec<f64> = self.p99.iter().zip(quiet).map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        self.commands.sort();
        let us = |time: Duration| (time.as_secs_f64() * 1e6).round();
        let all = |share: f64| us(self.lateness.percentile(share));
        json!({
            "load": self.name,
            "sync_p50_us": all(0.5),
            "sync_p99_us": all(0.99),
            "sync_max_us": us(self.lateness.greatest()),
            "lone_p50_us": us(self.lone.percentile(0.5)),
            "lone_p99_us": us(self.lone.percentile(0.99)),
            "syncs": self.lateness.total(),
            "left_out": self.skipped,
            "p99_of_turns_us": self.p99.iter().map(|it| us(*it)).collect::<Vec<_>>(),
            "p99_to_nothing": {
                "median": ratios[ratios.len() / 2],
                "min": ratios[0],
                "max": ratios[ratios.len() - 1],
            },
            "command_to_frame_ms": self.commands_ms(),
        })
    }

    fn commands_ms(&self) -> Value {
        let Some(last) = self.commands.len().checked_sub(1) else {
            return Value::Null;
        };
        let of = |share: f64| {
            let at = (last as f64 * share).round() as usize;
            self.commands[at].as_secs_f64() * 1e3
        };
        json!({
            "count": self.commands.len(),
            "p50": of(0.5), "p90": of(0.9), "p99": of(0.99), "max": of(1.0),
        })
    }

    /// How long half of the commands took to the bus at most; they must have been judged.
    pub(crate) fn median_command(&self) -> Duration {
        self.commands[self.commands.len() / 2]
    }

    pub(crate) fn quiet(&self) -> Vec<Duration> {
        self.p99.clone()
    }
}
