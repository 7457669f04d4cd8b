//! A figure and its goal, in lines for people.

use core::time::Duration;

use crate::SYNC;
use crate::measured::{Load, Measured};
use crate::seen::Seen;

/// SYNCs may be so much later with somebody asking.
const LATER_MAX: f64 = 1.10;

/// What one run is for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Figure {
    Clients,
    Flood,
    Frame,
    Second,
}

impl Figure {
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "clients" => Self::Clients,
            "flood" => Self::Flood,
            "frame" => Self::Frame,
            "second" => Self::Second,
            _ => return None,
        })
    }

    /// Who must ask meanwhile. What the second motion takes, too, is seen between turns of others.
    pub(crate) const fn loads(self) -> &'static [Load] {
        match self {
            Self::Clients | Self::Second => &[Load::Clients],
            Self::Flood => &[Load::Flood, Load::Elsewhere],
            Self::Frame => &[Load::Clients, Load::Flood],
        }
    }

    pub(crate) fn told(self, measured: &Measured) -> Vec<String> {
        let mut told = match self {
            Self::Clients => vec![
                lateness(measured, Load::Clients, "goal"),
                by_itself(&measured.quiet),
            ],
            Self::Flood => vec![
                lateness(measured, Load::Flood, "goal"),
                lateness(
                    measured,
                    Load::Elsewhere,
                    "for comparison, goal of the others",
                ),
                by_itself(&measured.quiet),
                frame(&measured.quiet),
                frame(measured.of(Load::Flood)),
                frame(measured.of(Load::Elsewhere)),
            ],
            Self::Frame => [&measured.quiet]
                .into_iter()
                .chain(&measured.loaded)
                .map(frame)
                .collect(),
            Self::Second => vec![second(measured)],
        };
        if !measured.is_real_time {
            told.push(
                "SYNCs have no SCHED_FIFO here (see `ulimit -r`): all of this is without".into(),
            );
        }
        told
    }
}

fn met(is_met: bool) -> &'static str {
    if is_met { "met" } else { "NOT MET" }
}

fn lateness(measured: &Measured, load: Load, goal: &str) -> String {
    let (seen, quiet) = (measured.of(load), &measured.quiet);
    let (least, median, most) = seen.against();
    let (with, without) = (seen.p99_us(), quiet.p99_us());
    format!(
        "SYNC lateness p99, {} against nothing: {median:.2} (median of {} turns, {least:.2} to {most:.2}; all together \
         {with:.0} against {without:.0} us: {:.2}; SYNCs left out {} of {}, without {} of {}); {goal}: at most {LATER_MAX:.2}: {}",
        seen.name,
        seen.turns(),
        with / without,
        seen.skipped,
        seen.syncs(),
        quiet.skipped,
        quiet.syncs(),
        met(median <= LATER_MAX),
    )
}

/// How far that figure can be trusted.
fn by_itself(quiet: &Seen) -> String {
    let (least, median, most) = quiet.against();
    format!("nothing against the turn of nothing before: {median:.2} ({least:.2} to {most:.2})")
}

fn frame(seen: &Seen) -> String {
    let limit = SYNC + Duration::from_millis(1);
    let ms = |share| seen.command(share).as_secs_f64() * 1e3;
    format!(
        "command to first frame on the wire, {}: p50 {:.2}, p99 {:.2}, max {:.2} ms of {}; goal: p99 at most {:.1} ms \
         (one SYNC period and 1 ms): {}, {:.1} % within it",
        seen.name,
        ms(0.5),
        ms(0.99),
        ms(1.0),
        seen.commands.len(),
        limit.as_secs_f64() * 1e3,
        met(seen.command(0.99) <= limit),
        seen.within(limit) * 100.0,
    )
}

/// Nothing says how much sooner it must be.
fn second(measured: &Measured) -> String {
    let service = measured.quiet.command(0.5).as_secs_f64();
    let today = measured.today_s.as_deref().unwrap_or_default();
    let Some(median) = today.get(today.len() / 2) else {
        return "the command line did not move, or was not named: `load second 8 2 TRUESTAGE`"
            .into();
    };
    let all: Vec<String> = today.iter().map(|it| format!("{it:.1}")).collect();
    format!(
        "a further motion, request to first frame: {:.2} ms (median of {}) with a service; without one, from the start of \
         `truestage move`: {} s; {:.0} times as long",
        service * 1e3,
        measured.quiet.commands.len(),
        all.join(", "),
        median / service,
    )
}
