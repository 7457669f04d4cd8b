//! Notices when the computer keeps the program from looking at its buses in time, so that what
//! goes wrong shortly afterwards is not blamed on the machine alone.

use core::fmt;
use core::time::Duration;
use std::collections::VecDeque;

use units::Time;

use crate::failure::Failure;

/// A shorter pause is an ordinary computer's; the shortest supervision, three missed SYNC periods,
/// outlasts it.
const PAUSE_MIN: Duration = Duration::from_millis(20);
/// What went wrong later than this after a pause had another cause: every supervision has struck
/// by then.
const REMEMBERED: Duration = Duration::from_secs(3);
/// A procedure watches what moves for some seconds before it judges: pauses within them may have spoilt that.
const RECENT: Duration = Duration::from_secs(10);
/// Pauses that sum up to less are not worth a word beside another cause.
const LOST_MIN: Duration = Duration::from_millis(50);

/// When the program should have looked, and when it did.
#[derive(Clone, Debug, Default)]
pub(crate) struct HostWatch {
    due: Option<Time>,
    /// The recent pauses, the newest last: end and length, by the machine's clock.
    pauses: VecDeque<(Time, Duration)>,
    /// All pauses that there ever were, together.
    total: Duration,
}

/// How long the program was kept from its buses in the last seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LostTime {
    pauses: u32,
    total: Duration,
    longest: Duration,
}

impl fmt::Display for LostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "in the last {} s before what failed this program was kept from its buses for {:.3} s (pauses: {}, the \
             longest {:.3} s): the busy computer may be the cause, not the machine. Allow the program SCHED_FIFO \
             (`ulimit -r`) or give the computer less to do",
            RECENT.as_secs(),
            self.total.as_secs_f64(),
            self.pauses,
            self.longest.as_secs_f64()
        )
    }
}

impl HostWatch {
    /// The program waits from `now`, until `due` at the latest. What was due before is not late once more: the
    /// backlog of a pause is taken arrival by arrival.
    pub(crate) fn waits(&mut self, now: Time, due: Time) {
        self.due = Some(due.max(now));
    }

    /// The program looks at its buses.
    pub(crate) fn looks(&mut self, now: Time) {
        if let Some(due) = self.due.take()
            && now.since(due) >= PAUSE_MIN
        {
            self.total += now.since(due);
            self.pauses.push_back((now, now.since(due)));
            while self.pauses.front().is_some_and(|it| !is_recent(*it, now)) {
                self.pauses.pop_front();
            }
        }
    }

    /// The time that was ever lost.
    pub(crate) fn total(&self) -> Duration {
        self.total
    }

    /// The time that was lost recently, when it is worth a word.
    pub(crate) fn lost(&self, now: Time) -> Option<LostTime> {
        let mut lost = LostTime::default();
        for (_, pause) in self.pauses.iter().filter(|it| is_recent(**it, now)) {
            lost.pauses += 1;
            lost.total += *pause;
            lost.longest = lost.longest.max(*pause);
        }
        (lost.total >= LOST_MIN).then_some(lost)
    }

    /// The failure, or, when it may come from a pause shortly before, that.
    pub(crate) fn explain(&self, now: Time, failure: Failure) -> Failure {
        match self.pauses.back() {
            Some(&(end, pause)) if now.since(end) <= REMEMBERED && may_come_of(&failure) => {
                Failure::HeldUp {
                    pause,
                    ago: now.since(end),
                    failure: Box::new(failure),
                }
            }
            _ => failure,
        }
    }
}

fn is_recent((end, _): (Time, Duration), now: Time) -> bool {
    now.since(end) <= RECENT
}

/// Whether it can happen to a sound machine that was not served in time.
const fn may_come_of(failure: &Failure) -> bool {
    matches!(
        failure,
        Failure::Alarm { .. }
            | Failure::Device { .. }
            | Failure::Overdue { .. }
            | Failure::Send { .. }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn overdue() -> Failure {
        Failure::Overdue {
            device: "x".into(),
            step: "enable",
            waited: Duration::from_secs(1),
        }
    }

    fn after(late_ms: u64, failed_ms: u64, failure: Failure) -> String {
        let mut watch = HostWatch::default();
        watch.waits(Time(0), Time(100 * MS));
        watch.looks(Time((100 + late_ms) * MS));
        watch.explain(Time(failed_ms * MS), failure).to_string()
    }

    #[test]
    fn a_failure_shortly_after_a_pause_names_the_computer_and_keeps_what_failed() {
        let said = after(310, 500, overdue());
        for part in ["0.310 s", "enable did not end", "--clock lockstep"] {
            assert!(said.contains(part), "{said}");
        }
        let failure = Failure::HeldUp {
            pause: Duration::ZERO,
            ago: Duration::ZERO,
            failure: Box::new(overdue()),
        };
        assert_eq!(failure.exit_code(), overdue().exit_code());
    }

    #[test]
    fn pauses_of_the_last_seconds_are_summed_and_short_ones_are_not_worth_a_word() {
        let mut watch = HostWatch::default();
        let pause = |watch: &mut HostWatch, begin_ms: u64, length_ms: u64| {
            watch.waits(Time(0), Time(begin_ms * MS));
            watch.looks(Time((begin_ms + length_ms) * MS));
        };
        pause(&mut watch, 100, 400);
        pause(&mut watch, 11_000, 30);
        pause(&mut watch, 12_000, 19);
        assert_eq!(watch.lost(Time(13_000 * MS)), None);
        pause(&mut watch, 13_000, 70);
        let said = watch.lost(Time(14_000 * MS)).unwrap().to_string();
        for part in ["0.100 s", "pauses: 2", "longest 0.070 s"] {
            assert!(said.contains(part), "{said}");
        }
        assert_eq!(watch.lost(Time(24_000 * MS)), None);
        assert_eq!(
            watch.total(),
            Duration::from_millis(500),
            "nothing is forgotten"
        );
    }

    #[test]
    fn a_computer_in_time_is_not_named_nor_one_that_paused_long_ago_nor_for_what_it_cannot_cause() {
        assert_eq!(after(19, 200, overdue()), overdue().to_string());
        assert_eq!(after(310, 3_411, overdue()), overdue().to_string());
        let other = || Failure::NotZeroed { axis: "x".into() };
        assert_eq!(after(310, 500, other()), other().to_string());
    }
}
