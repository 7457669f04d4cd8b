//! What was seen in all turns of one kind.

use core::time::Duration;

use drivers::transport::{Histogram, Scheduling};
use serde_json::{Value, json};
use service::Desk;

use crate::lone::Lone;

/// What was seen.
#[derive(Default)]
pub(crate) struct Seen {
    pub(crate) name: &'static str,
    lateness: Histogram,
    lone: Histogram,
    /// Of each turn, µs.
    p99_us: Vec<f64>,
    /// Each turn against those of nothing beside it.
    against: Vec<f64>,
    /// SYNCs left out.
    pub(crate) skipped: u64,
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

    /// A turn is over; the 99th percentile of SYNC lateness in it, µs.
    pub(crate) fn add(&mut self, before: &Done, after: &Done) -> f64 {
        let turn = after.lateness.since(&before.lateness);
        let p99_us = interpolated_us(&turn, 0.99);
        self.p99_us.push(p99_us);
        self.lateness.add(&turn);
        self.lone.add(&after.lone.since(&before.lone));
        self.skipped += after.skipped - before.skipped;
        p99_us
    }

    /// A turn had `during` where others beside it had `others`.
    pub(crate) fn compare(&mut self, during: f64, others: f64) {
        self.against.push(during / others);
    }

    /// The least ratio of a turn to those beside it, the median, the greatest.
    pub(crate) fn against(&self) -> (f64, f64, f64) {
        let mut ratios = self.against.clone();
        ratios.sort_by(f64::total_cmp);
        let of = |at: usize| ratios.get(at).copied().unwrap_or(f64::NAN);
        let (half, last) = (ratios.len() / 2, ratios.len().saturating_sub(1));
        let median = f64::midpoint(of(half), of(last - half.min(last)));
        (of(0), median, of(last))
    }

    /// Of all turns together.
    pub(crate) fn p99_us(&self) -> f64 {
        interpolated_us(&self.lateness, 0.99)
    }

    pub(crate) const fn turns(&self) -> usize {
        self.p99_us.len()
    }

    pub(crate) const fn syncs(&self) -> u64 {
        self.lateness.total()
    }

    /// Within which time so large a share of the commands was on the bus; zero without any.
    pub(crate) fn command(&self, share: f64) -> Duration {
        let mut commands = self.commands.clone();
        commands.sort();
        let last = commands.len().saturating_sub(1);
        let at = (last as f64 * share).round() as usize;
        commands.get(at).copied().unwrap_or_default()
    }

    /// The share of commands whose first frame came within `limit`.
    pub(crate) fn within(&self, limit: Duration) -> f64 {
        let within = self.commands.iter().filter(|it| **it <= limit).count();
        within as f64 / self.commands.len().max(1) as f64
    }

    pub(crate) fn json(&self) -> Value {
        let us = |time: Duration| (time.as_secs_f64() * 1e6).round();
        let (least, median, most) = self.against();
        let ms = |share| self.command(share).as_secs_f64() * 1e3;
        json!({
            "load": self.name,
            "sync_p50_us": interpolated_us(&self.lateness, 0.5),
            "sync_p99_us": self.p99_us(),
            "sync_max_us": us(self.lateness.greatest()),
            "lone_p50_us": interpolated_us(&self.lone, 0.5),
            "lone_p99_us": interpolated_us(&self.lone, 0.99),
            "syncs": self.syncs(),
            "left_out": self.skipped,
            "p99_of_turns_us": self.p99_us,
            "p99_to_nothing": {"median": median, "min": least, "max": most},
            "command_to_frame_ms": {
                "count": self.commands.len(),
                "p50": ms(0.5), "p90": ms(0.9), "p99": ms(0.99), "max": ms(1.0),
            },
        })
    }
}

/// A percentile between the classes that were seen, which are an eighth wide: of two of them the ratio would be rounded to
/// more than what is asked of it.
fn interpolated_us(histogram: &Histogram, share: f64) -> f64 {
    let total = histogram.total();
    let at = |rank: u64| histogram.percentile(rank as f64 / total.max(1) as f64);
    let wanted = ((total as f64 * share).ceil() as u64).max(1);
    let end = at(wanted);
    let first = (1..=wanted).rev().take_while(|it| at(*it) == end).last();
    let last = (wanted..=total).take_while(|it| at(*it) == end).last();
    let (first, last) = (first.unwrap_or(wanted), last.unwrap_or(wanted));
    let begin = if first > 1 { at(first - 1) } else { end };
    let into = (wanted - first + 1) as f64 / (last - first + 1) as f64;
    let (begin, end) = (begin.as_secs_f64(), end.as_secs_f64());
    (into * (end - begin) + begin) * 1e6
}
