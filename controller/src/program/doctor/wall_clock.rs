//! The time of day by which records, certificates and events are dated: whether it was set, and whether it runs.

use std::time::{Duration, Instant};

use jiff::Timestamp;
use machine::records::Store;

use super::checked::Checked;
use super::host::Host;
use super::records::pointers;
use crate::config::MachineConfig;
use crate::time_of_day::time_of_day;

const SUBJECT: &str = "time of day";
/// No computer with this program has an earlier one (2026-01-01); one without a battery begins in 1970 or 2000.
const EARLIEST_S: i64 = 1_767_225_600;
/// What setting it smoothly does in seconds is less.
const JUMP_S: f64 = 0.25;
/// A record that was made just now on another computer.
const SLACK_S: i64 = 60;
const SET: &str = "sudo timedatectl set-ntp true, or sudo date --set 'YYYY-MM-DD hh:mm'; a computer without a network \
                   needs a clock with a battery";
/// Where the kernel's own clock says that somebody keeps it right (systemd-timesyncd).
const SYNCHRONISED: &str = "run/systemd/timesync/synchronized";

/// The time of day and a clock that only counts, read together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    day: Timestamp,
    counted: Instant,
}

impl Moment {
    pub(super) fn now() -> Self {
        Self {
            day: time_of_day(),
            counted: Instant::now(),
        }
    }
}

/// What is seen now, and of what passed since `before`.
pub(super) fn check(host: &Host, config: &MachineConfig, store: &Store, before: Moment) -> Checked {
    let now = Moment::now();
    let passed = now.counted.duration_since(before.counted);
    let newest = newest(config, store);
    judged(host, (before.day, now.day, passed), newest)
}

fn judged(
    host: &Host,
    (before, now, passed): (Timestamp, Timestamp, Duration),
    newest: Option<(String, Timestamp)>,
) -> Checked {
    let shown = now.strftime("%Y-%m-%dT%H:%M:%SZ");
    if now.as_second() < EARLIEST_S {
        let seen = format!(
            "{shown}: it was never set; records, certificates and events would be dated wrongly"
        );
        return Checked::bad(SUBJECT, seen, SET);
    }
    if let Some((of, made)) = newest.filter(|it| it.1.as_second() > now.as_second() + SLACK_S) {
        let made = made.strftime("%Y-%m-%dT%H:%M:%SZ");
        let seen = format!(
            "{shown}, and the calibration of {of} was made on {made}: it has been set back"
        );
        return Checked::bad(SUBJECT, seen, SET);
    }
    let jump = now.duration_since(before).as_secs_f64() - passed.as_secs_f64();
    if jump.abs() > JUMP_S {
        let seen = format!("{shown}: it jumped by {jump:+.1} s while this program looked");
        return Checked::doubtful(
            SUBJECT,
            seen,
            "somebody sets it: one program alone (`timedatectl timesync-status`, chronyc tracking), in small steps",
        );
    }
    let by = match host.has(SYNCHRONISED) {
        true => ", kept right over the network",
        false => "",
    };
    Checked::good(SUBJECT, format!("{shown}{by}"))
}

/// The newest calibration in use, and whose it is.
fn newest(config: &MachineConfig, store: &Store) -> Option<(String, Timestamp)> {
    let made = pointers(config).into_iter().filter_map(|pointer| {
        let id = store.active(&pointer).ok()?.current?;
        let created = store.glance(&id).ok()?.head.created;
        Some((pointer, created.parse().ok()?))
    });
    made.max_by_key(|it| it.1)
}

#[cfg(test)]
mod tests {
    use super::super::checked::Verdict;
    use super::super::checked::tests::expect;
    use super::super::host::tests::host;
    use super::*;

    #[track_caller]
    fn check(now: &str, passed_s: f64, newest: Option<&str>, verdict: Verdict, says: [&str; 2]) {
        let (_folder, host) = host(&[]);
        let before: Timestamp = "2026-11-26T12:00:00Z".parse().unwrap();
        let now: Timestamp = now.parse().unwrap();
        let newest = newest.map(|it| ("x".to_owned(), it.parse().unwrap()));
        let moments = (before, now, Duration::from_secs_f64(passed_s));
        expect(&[judged(&host, moments, newest)], SUBJECT, verdict, says);
    }

    #[test]
    fn a_clock_that_was_never_set_or_set_back_or_jumps_is_told() {
        let soon = "2026-11-26T12:00:02Z";
        check(soon, 2.0, None, Verdict::Good, ["2026-11-26T12:00:02Z", ""]);
        check(
            soon,
            2.0,
            Some("2026-11-26T11:00:00Z"),
            Verdict::Good,
            ["", ""],
        );
        check(
            "1970-01-01T00:03:00Z",
            2.0,
            None,
            Verdict::Bad,
            ["never set", "timedatectl"],
        );
        let later = Some("2026-11-27T12:00:00Z");
        check(
            soon,
            2.0,
            later,
            Verdict::Bad,
            ["calibration of x was made on 2026-11-27", "set-ntp"],
        );
        check(
            "2026-11-26T12:00:09Z",
            2.0,
            None,
            Verdict::Doubtful,
            ["jumped by +7.0 s", "one program"],
        );
        check(
            "2026-11-26T11:59:59Z",
            2.0,
            None,
            Verdict::Doubtful,
            ["jumped by -3.0 s", ""],
        );
    }
}
