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

use super::clock::Clock;
use crate::wire::slcan::TIMESTAMP_PERIOD_MS;

/// The offset of the two clocks is measured anew after this.
const OFFSET_LIFE: Duration = Duration::from_millis(100);
/// A younger stamp is taken with the offset at hand; an older one may be a clock step.
const PLAUSIBLE_AGE: Duration = Duration::from_millis(20);
/// An older frame than this never waits in a receive queue that is being read.
const AGE_MAX: Duration = Duration::from_secs(2);

/// Kernel receive times (`SO_TIMESTAMPNS`).
#[derive(Debug)]
pub(super) struct KernelStamps {
    clock: Clock,
    /// CLOCK_REALTIME minus wall time since the clock's start, and when it was measured.
    offset: Option<(i128, Duration)>,
    last: Time,
    distrusted: u64,
}

impl KernelStamps {
    pub(super) const fn new(clock: Clock) -> Self {
        Self {
            clock,
            offset: None,
            last: Time::ZERO,
            distrusted: 0,
        }
    }

    /// How many stamps were not used because a clock was stepped.
    pub(super) const fn distrusted(&self) -> u64 {
        self.distrusted
    }

    /// When the frame arrived that was read just now.
    pub(super) fn arrival(&mut self, stamp: Option<TimeSpec>) -> Time {
        let wall = self.clock.wall_elapsed();
        let age = stamp.and_then(|stamp| self.age(wall, nanos(stamp)));
        let at = self
            .clock
            .at_wall(wall.saturating_sub(age.unwrap_or_default()));
        self.last = self.last.max(at);
        self.last
    }

    /// How long ago the stamp was taken; `None` when that cannot be believed.
    fn age(&mut self, wall: Duration, stamp: i128) -> Option<Duration> {
        let offset = match self.offset {
            Some((offset, measured)) if wall.saturating_sub(measured) < OFFSET_LIFE => offset,
            _ => self.measure()?,
        };
        let age = |offset: i128| wall.as_nanos() as i128 - (stamp - offset);
        if (0..PLAUSIBLE_AGE.as_nanos() as i128).contains(&age(offset)) {
            return Some(Duration::from_nanos(age(offset) as u64));
        }
        let age = age(self.measure()?);
        if (0..AGE_MAX.as_nanos() as i128).contains(&age) {
            return Some(Duration::from_nanos(age as u64));
        }
        self.distrusted += 1;
        None
    }

    fn measure(&mut self) -> Option<i128> {
        let real = nanos(clock_gettime(ClockId::CLOCK_REALTIME).ok()?);
        let wall = self.clock.wall_elapsed();
        let offset = real - wall.as_nanos() as i128;
        self.offset = Some((offset, wall));
        Some(offset)
    }
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
            delay if delay < Self::RESOLUTION_NS || delay > Self::DELAY_MAX_NS => 0,
            delay => delay as u64,
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
        let mut stamps = KernelStamps::new(clock);
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
            let mut stamps = KernelStamps::new(clock);
            let before = clock.now();
            let at = stamps.arrival(Some(shifted(realtime(), step_s)));
            assert!(at >= before && at <= clock.now(), "{step_s}");
            assert_eq!(stamps.distrusted(), 1);
        }
    }

    #[test]
    fn arrivals_never_run_backwards() {
        let clock = Clock::real();
        let mut stamps = KernelStamps::new(clock);
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
