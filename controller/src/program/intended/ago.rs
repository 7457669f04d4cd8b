//! How long ago something was, in the unit that a person would use.

use jiff::Timestamp;
use units::Several;

use crate::time_of_day::time_of_day;

const MINUTE_S: i64 = 60;
const HOUR_S: i64 = 60 * MINUTE_S;
const DAY_S: i64 = 24 * HOUR_S;

/// `6 days ago`; `None` for what is no time, or has not been yet.
pub(crate) fn since(then: &str) -> Option<String> {
    between(then.parse().ok()?, time_of_day())
}

fn between(then: Timestamp, now: Timestamp) -> Option<String> {
    let seconds = now.as_second() - then.as_second();
    // Two of the next unit at least: "1 day" may be nearly two.
    let units = [(DAY_S, "day"), (HOUR_S, "hour"), (MINUTE_S, "minute")];
    let unit = units.iter().find(|(length, _)| seconds >= 2 * length);
    match unit {
        _ if seconds < 0 => None,
        Some((length, name)) => Some(format!("{} ago", Several(seconds / length, name))),
        None => Some("just now".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_in_the_unit_that_a_person_would_use() {
        let now: Timestamp = "2026-03-10T12:00:00Z".parse().unwrap();
        for (then, expected) in [
            ("2026-03-10T11:59:30Z", Some("just now")),
            ("2026-03-10T11:58:30Z", Some("just now")),
            ("2026-03-10T10:01:00Z", Some("119 minutes ago")),
            ("2026-03-10T09:00:00Z", Some("3 hours ago")),
            ("2026-03-08T12:00:01Z", Some("47 hours ago")),
            ("2026-03-08T12:00:00Z", Some("2 days ago")),
            ("2025-03-10T12:00:00Z", Some("365 days ago")),
            ("2026-03-10T12:00:01Z", None),
        ] {
            let told = between(then.parse().unwrap(), now);
            assert_eq!(told.as_deref(), expected, "{then}");
        }
        assert_eq!(since("yesterday"), None);
    }
}
