//! Notices when the computer keeps the program from looking at its buses in time, so that what
//! goes wrong shortly afterwards is not blamed on the machine alone.

use core::time::Duration;

use units::Time;

use crate::failure::Failure;

/// A shorter pause is an ordinary computer's; the shortest supervision, three missed SYNC periods,
/// outlasts it.
const PAUSE_MIN: Duration = Duration::from_millis(20);
/// What went wrong later than this after a pause had another cause: every supervision has struck
/// by then.
const REMEMBERED: Duration = Duration::from_secs(3);

/// When the program should have looked, and when it did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HostWatch {
    due: Option<Time>,
    /// The last pause: its end and its length, by the machine's clock.
    pause: Option<(Time, Duration)>,
}

impl HostWatch {
    /// The program waits now, until `due` at the latest.
    pub(crate) const fn waits(&mut self, due: Time) {
        self.due = Some(due);
    }

    /// The program looks at its buses.
    pub(crate) fn looks(&mut self, now: Time) {
        if let Some(due) = self.due.take()
            && now.since(due) >= PAUSE_MIN
        {
            self.pause = Some((now, now.since(due)));
        }
    }

    /// The failure, or, when it may come from a pause shortly before, that.
    pub(crate) fn explain(&self, now: Time, failure: Failure) -> Failure {
        match self.pause {
            Some((end, pause)) if now.since(end) <= REMEMBERED && may_come_of(&failure) => {
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
        watch.waits(Time(100 * MS));
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
    fn a_computer_in_time_is_not_named_nor_one_that_paused_long_ago_nor_for_what_it_cannot_cause() {
        assert_eq!(after(19, 200, overdue()), overdue().to_string());
        assert_eq!(after(310, 3_411, overdue()), overdue().to_string());
        let other = || Failure::NotZeroed { axis: "x".into() };
        assert_eq!(after(310, 500, other()), other().to_string());
    }
}
