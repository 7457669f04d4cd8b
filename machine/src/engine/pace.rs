//! When SYNCs are due, and how punctual they were.

use core::fmt;
use core::time::Duration;

use units::Time;

use super::{EngineFailure, Histogram};
use crate::failure::Failure;

/// For so many periods after SYNCs were missed, trouble of a drive is put down to that.
const AFTERMATH: u32 = 5;

/// How punctual a loop was.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    /// How late each SYNC left after its deadline.
    pub lateness: Histogram,
    /// How far the time from SYNC to SYNC was from the period.
    pub jitter: Histogram,
    /// From SYNC to the last answer.
    pub answers: Histogram,
    /// From the last answer to the last set-point sent.
    pub work: Histogram,
    /// Positions that came after half of their period: too late for its decision.
    pub late_answers: u64,
    /// SYNCs that left more than a period late.
    pub overruns: u64,
    /// SYNCs left out because of that.
    pub skipped: u64,
    /// How often the grid of SYNCs was shifted, because one was sent more than half a period late.
    pub shifted: u64,
    /// What the system granted; empty when nothing was asked for.
    pub scheduling: String,
}

impl Timing {
    /// Takes over what another loop has noted.
    pub fn add(&mut self, other: &Self) {
        self.lateness.add(&other.lateness);
        self.jitter.add(&other.jitter);
        self.answers.add(&other.answers);
        self.work.add(&other.work);
        self.late_answers += other.late_answers;
        self.overruns += other.overruns;
        self.skipped += other.skipped;
        self.shifted += other.shifted;
        self.scheduling.clone_from(&other.scheduling);
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "lateness  {}", self.lateness)?;
        writeln!(f, "jitter    {}", self.jitter)?;
        writeln!(f, "answers   {}", self.answers)?;
        writeln!(f, "work      {}", self.work)?;
        write!(
            f,
            "overruns  {}, SYNCs left out {}, put off {}",
            self.overruns, self.skipped, self.shifted
        )?;
        if !self.scheduling.is_empty() {
            write!(f, "\nthread    {}", self.scheduling)?;
        }
        Ok(())
    }
}

/// The grid of SYNCs.
pub(super) struct Pace {
    pub(super) deadline: Time,
    pub(super) synced: Option<Time>,
    /// The last time that SYNCs were missed, and how many.
    pub(super) held_up: Option<(Time, u32)>,
}

impl Pace {
    /// How many SYNCs were missed lately: in this period, or in one shortly before.
    fn missed(&self, now: Time, period: Duration) -> Option<u32> {
        let since = self
            .synced
            .map_or(Duration::ZERO, |synced| now.since(synced));
        if since >= period {
            let periods = since.as_nanos() / period.as_nanos().max(1);
            return Some(u32::try_from(periods).unwrap_or(u32::MAX));
        }
        let (at, periods) = self.held_up?;
        (now <= at + period * AFTERMATH).then_some(periods)
    }

    /// What comes right after the computer was held up, came of that: drives that had no SYNC
    /// fault, or say nothing.
    pub(super) fn explain(&self, now: Time, period: Duration, failure: Failure) -> Failure {
        let consequence = matches!(
            failure,
            Failure::Alarm { .. }
                | Failure::Engine(
                    EngineFailure::Missing { .. }
                        | EngineFailure::Deviates { .. }
                        | EngineFailure::NotCyclic { .. }
                )
        );
        match self.missed(now, period) {
            Some(periods) if consequence => {
                let then = failure.to_string();
                EngineFailure::HeldUp { periods, then }.into()
            }
            Some(_) | None => failure,
        }
    }
}
