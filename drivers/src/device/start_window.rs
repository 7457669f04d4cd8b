//! When axes on CAN may be told to start together.
//!
//! Drives whose RPDO 1 is synchronous start at the SYNC after their start frame. The frames of a
//! group leave one after the other, while SYNC keeps its own time: a SYNC between two of them
//! would start one axis a period before the next. So they are sent right behind a SYNC: when
//! every drive of the group has just answered it.

use core::time::Duration;
use units::Time;

/// Whether start frames that are sent now all come before the next SYNC: each of `samples`, the
/// newest arrivals of the group's process data, is younger than half a `period`. What the bus
/// still has to carry until then fits into the other half, or the configuration would not have
/// been accepted.
pub fn may_start_together(
    samples: impl IntoIterator<Item = Time>,
    now: Time,
    period: Duration,
) -> bool {
    samples
        .into_iter()
        .all(|sample| now.since(sample) * 2 < period)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_micros(2000);

    #[track_caller]
    fn check(samples_us: [u64; 3], now_us: u64, expected: bool) {
        let samples = samples_us.map(|us| Time(us * 1000));
        let may = may_start_together(samples, Time(now_us * 1000), PERIOD);
        assert_eq!(may, expected);
    }

    /// SYNC at 10 000 and 12 000 µs.
    #[test]
    fn right_behind_a_sync_that_all_have_answered_and_not_later() {
        check([10_150, 10_300, 10_450], 10_460, true);
        check([10_150, 10_300, 10_450], 11_140, true);
        check([10_150, 10_300, 10_450], 11_160, false);
        // The last one's answer to this SYNC has not come.
        check([12_150, 12_300, 10_450], 12_310, false);
    }

    #[test]
    fn axes_without_sync_need_no_window() {
        assert!(may_start_together([], Time(1), PERIOD));
    }
}
