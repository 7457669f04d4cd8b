//! The time of day for records. Control never reads it.

use std::time::SystemTime;

use jiff::Timestamp;

/// The time of day by the clock of this computer. A clock that is set beyond all calendars is at their end: it is no
/// reason to leave axes alone.
pub(crate) fn time_of_day() -> Timestamp {
    of_clock(SystemTime::now())
}

fn of_clock(time: SystemTime) -> Timestamp {
    Timestamp::try_from(time).unwrap_or(Timestamp::MAX)
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::*;

    #[test]
    fn a_clock_beyond_all_calendars_is_at_their_end() {
        let year_12000 = SystemTime::UNIX_EPOCH + Duration::from_secs(316_516_464_000);
        let end = of_clock(year_12000);
        assert_eq!(end.strftime("%Y").to_string(), "9999");
        let epoch = of_clock(SystemTime::UNIX_EPOCH);
        assert_eq!(epoch, Timestamp::UNIX_EPOCH);
    }
}
