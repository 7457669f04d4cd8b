//! Receive time stamps of other clocks, turned into moments of the transport's clock.
//!
//! The kernel stamps frames by CLOCK_REALTIME, which NTP and people step; an SLCAN adapter
//! stamps them by a millisecond counter of its own. Neither is trusted further than it can
//! be checked: a stamp may move an arrival back from the moment it was read, never to
//! before the previous arrival, never into the future.

use core::time::Duration;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, clock_gettime};
use units::Time;
use wire::slcan::TIMESTAMP_PERIOD_MS;

use super::clock::Clock;

/// The offset of the two clocks is measured anew after this; a step of the wall clock by
/// more (NTP slews what is less than 128 ms) shows in the stamp itself.
const OFFSET_LIFE: Duration = Duration::from_millis(100);
/// Reading two clocks one after the other takes no longer than this, or seldom.
const READING_TIME: Duration = Duration::from_millis(1);
/// An older frame than this never waits in a receive queue that is being read.
const AGE_MAX: Duration = Duration::from_secs(2);

/// Kernel receive times (`SO_TIMESTAMPNS`).
#[derive(Debug)]
pub(super) struct KernelStamps {
    clock: Clock,
    /// CLOCK_REALTIME and wall time since the clock's start, at one moment.
    pair: Option<(i128, Duration)>,
    last: Time,
    distrusted: u64,
}

impl KernelStamps {
    pub(super) const fn new(clock: Clock) -> Self {
        Self {
            clock,
            pair: None,
            last: Time::ZERO,
            distrusted: 0,
        }
    }

    /// How many stamps were not used because a clock was stepped.
    pub(super) const fn distrusted(&self) -> u64 {
        self.distrusted
    }

    /// When the frame arrived that was read just now. Reads the clocks only now and then.
    pub(super) fn arrival(&mut self, stamp: Option<TimeSpec>) -> Time {
        // On a shared clock nothing has waited: the kernel's time is another one.
        let stamp = stamp.filter(|_| self.clock.participant().is_none());
        let wall = stamp.and_then(|stamp| self.wall(nanos(stamp)));
        let wall = wall.unwrap_or_else(|| self.clock.wall_elapsed());
        self.last = self.last.max(self.clock.at_wall(wall));
        self.last
    }

    /// The stamp as wall time since the clock's start; `None` when it cannot be believed.
    fn wall(&mut self, stamp: i128) -> Option<Duration> {
        if let Some((real, wall)) = self.pair
            && (0..OFFSET_LIFE.as_nanos() as i128).contains(&(stamp - real))
        {
            return Some(wall + Duration::from_nanos((stamp - real) as u64));
        }
        let (real, wall) = self.measure()?;
        let believed = age_up_to(AGE_MAX, real - stamp);
        self.distrusted += u64::from(believed.is_none());
        Some(wall.saturating_sub(believed?))
    }

    fn measure(&mut self) -> Option<(i128, Duration)> {
        let real = nanos(clock_gettime(ClockId::CLOCK_REALTIME).ok()?);
        self.pair = Some((real, self.clock.wall_elapsed()));
        self.pair
    }
}

/// An age of up to `limit`; a frame slightly in the future came while the clock was read.
fn age_up_to(limit: Duration, age_ns: i128) -> Option<Duration> {
    let just_now = -(READING_TIME.as_nanos() as i128);
    if age_ns < just_now || age_ns > limit.as_nanos() as i128 {
        return None;
    }
    Some(Duration::from_nanos(age_ns.max(0) as u64))
}

fn nanos(time: TimeSpec) -> i128 {
    i128::from(time.tv_sec()) * 1_000_000_000 + i128::from(time.tv_nsec())
}

/// Millisecond stamps of an SLCAN adapter (`Z1`).
///
/// The smallest delay ever seen between a stamp and its reading is taken for none; the
/// difference to it is how late a frame was read. That is finer than the host's own time
/// only when the serial line delays by more than the stamp's resolution.
#[derive(Debug, Default)]
pub(super) struct AdapterStamps {
    /// The adapter's time, wraps undone, and the host's when it was read.
    previous: Option<(u64, Time)>,
    /// Smallest difference of host and adapter time, in nanoseconds.
    offset: i128,
    last: Time,
}

impl AdapterStamps {
    /// A crystal may run away by this much; so does the smallest delay grow again.
    const DRIFT_PPM: i128 = 200;
    /// Stamps are whole milliseconds: a smaller delay says nothing.
    const RESOLUTION_NS: i128 = 2_000_000;
    const DELAY_MAX_NS: i128 = 100_000_000;

    /// When the frame with `stamp_ms` arrived that was read at `now`.
    pub(super) fn arrival(&mut self, now: Time, stamp_ms: Option<u16>) -> Time {
        let delay = stamp_ms
            .filter(|stamp| *stamp < TIMESTAMP_PERIOD_MS)
            .map_or(0, |stamp| self.delay(now, stamp));
        let at = Time(now.nanos().saturating_sub(delay));
        self.last = self.last.max(at);
        self.last
    }

    fn delay(&mut self, now: Time, stamp: u16) -> u64 {
        let adapter = self.unwrap(now, stamp);
        let host = i128::from(now.nanos());
        let difference = host - i128::from(adapter) * 1_000_000;
        match self.previous {
            None => self.offset = difference,
            Some((_, before)) => {
                let drift = i128::from(now.since(before).as_nanos() as u64) * Self::DRIFT_PPM;
                self.offset = difference.min(self.offset + drift / 1_000_000);
            }
        }
        self.previous = Some((adapter, now));
        match difference - self.offset {
            delay if (Self::RESOLUTION_NS..=Self::DELAY_MAX_NS).contains(&delay) => delay as u64,
            _ => 0,
        }
    }

    /// Undoes the wraps of the adapter's minute, also those that passed in silence.
    fn unwrap(&self, now: Time, stamp: u16) -> u64 {
        let Some((previous, before)) = self.previous else {
            return u64::from(stamp);
        };
        let period = u64::from(TIMESTAMP_PERIOD_MS);
        let expected = previous + now.since(before).as_millis() as u64;
        let base = expected - expected % period + u64::from(stamp);
        [base.saturating_sub(period), base, base + period]
            .into_iter()
            .min_by_key(|candidate| candidate.abs_diff(expected))
            .unwrap_or(base)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn realtime() -> TimeSpec {
        clock_gettime(ClockId::CLOCK_REALTIME).unwrap()
    }

    fn shifted(stamp: TimeSpec, seconds: i64) -> TimeSpec {
        TimeSpec::new(stamp.tv_sec() + seconds, stamp.tv_nsec())
    }

    #[test]
    fn a_kernel_stamp_moves_an_arrival_back_to_when_it_was_taken() {
        let clock = Clock::real();
        let mut stamps = KernelStamps::new(clock.clone());
        let before = clock.now();
        let stamp = realtime();
        let after = clock.now();
        while clock.now().since(after) < Duration::from_millis(2) {}
        let at = stamps.arrival(Some(stamp));
        // The two clocks are read one after the other, hence the margin.
        let margin = Duration::from_millis(1);
        assert!(at + margin >= before && at <= clock.now());
    }

    #[test]
    fn a_stepped_clock_is_not_believed() {
        let clock = Clock::real();
        for step_s in [3_600, -3_600] {
            let mut stamps = KernelStamps::new(clock.clone());
            let before = clock.now();
            let at = stamps.arrival(Some(shifted(realtime(), step_s)));
            assert!(at >= before && at <= clock.now(), "{step_s}");
            assert_eq!(stamps.distrusted(), 1);
        }
    }

    #[test]
    fn a_step_between_two_frames_is_not_believed_either() {
        let clock = Clock::real();
        for step_s in [3_600, -3_600] {
            let mut stamps = KernelStamps::new(clock.clone());
            stamps.arrival(Some(realtime()));
            let before = clock.now();
            let at = stamps.arrival(Some(shifted(realtime(), step_s)));
            assert!(at >= before && at <= clock.now(), "{step_s}");
        }
    }

    #[test]
    fn arrivals_never_run_backwards() {
        let clock = Clock::real();
        let mut stamps = KernelStamps::new(clock.clone());
        let first = stamps.arrival(None);
        let stamp = shifted(realtime(), -1);
        assert!(stamps.arrival(Some(stamp)) >= first);
    }

    const MS: u64 = 1_000_000;

    #[test]
    fn frames_that_a_usb_line_held_back_get_their_own_time() {
        let mut stamps = AdapterStamps::default();
        stamps.arrival(Time(100 * MS), Some(10));
        // Three frames of 20, 24 and 28 ms come together, 16 ms after the first.
        let read = Time(126 * MS);
        let at = [20, 24, 28].map(|ms| stamps.arrival(read, Some(ms)));
        assert_eq!(at[0].nanos() / MS, 110);
        assert_eq!(at[1].nanos() / MS, 114);
        assert_eq!(at[2].nanos() / MS, 118);
    }

    #[test]
    fn the_adapters_minute_wraps_unnoticed() {
        let mut stamps = AdapterStamps::default();
        stamps.arrival(Time(1_000 * MS), Some(59_990));
        assert_eq!(stamps.arrival(Time(1_020 * MS), Some(10)), Time(1_020 * MS));
        let later = Time(181_020 * MS);
        assert_eq!(stamps.arrival(later, Some(10)), later);
    }

    #[test]
    fn a_stamp_beyond_the_minute_is_ignored() {
        let mut stamps = AdapterStamps::default();
        assert_eq!(stamps.arrival(Time(5), Some(60_001)), Time(5));
        assert_eq!(stamps.arrival(Time(9), None), Time(9));
    }
}
