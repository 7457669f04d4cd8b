//! Times of a loop, counted in classes of fixed size: noting one asks for no memory.
//!
//! Eight classes to each doubling, so that a percentile is known to 12.5 %; below 1 µs one
//! class of 1 µs, above 16 s one for all.

use core::fmt;
use core::time::Duration;

/// Classes to a doubling.
const STEPS: u32 = 8;
/// Doublings above 8 µs.
const DOUBLINGS: u32 = 21;
const CLASSES: usize = (STEPS * (DOUBLINGS + 1)) as usize;

/// How often which time came up.
///
/// # Example
///
/// ```
/// use drivers::transport::Histogram;
/// use std::time::Duration;
///
/// let mut histogram = Histogram::default();
/// (1..=100).for_each(|micros| histogram.note(Duration::from_micros(micros)));
/// assert_eq!(histogram.percentile(0.5), Duration::from_micros(52), "the end of its class");
/// assert_eq!(histogram.percentile(1.0), Duration::from_micros(100));
/// assert!(histogram.to_string().starts_with("p50 52 us, p99 "));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Histogram {
    counts: [u64; CLASSES],
    total: u64,
    sum: Duration,
    greatest: Duration,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            counts: [0; CLASSES],
            total: 0,
            sum: Duration::ZERO,
            greatest: Duration::ZERO,
        }
    }
}

/// Class of so many microseconds: exact below 8, then three bits after the leading one.
fn class(micros: u32) -> usize {
    if micros < STEPS {
        return micros as usize;
    }
    let doubling = micros.ilog2() - 3;
    let step = (micros >> doubling) - STEPS;
    ((doubling + 1) * STEPS + step).min(CLASSES as u32 - 1) as usize
}

/// The first microsecond beyond a class.
fn end(class: usize) -> u64 {
    let class = class as u64;
    let steps = u64::from(STEPS);
    if class < steps {
        return class + 1;
    }
    (steps + class % steps + 1) << (class / steps - 1)
}

impl Histogram {
    /// Notes one time.
    pub fn note(&mut self, time: Duration) {
        let micros = u32::try_from(time.as_micros()).unwrap_or(u32::MAX);
        self.counts[class(micros)] += 1;
        self.total += 1;
        self.sum = self.sum.saturating_add(time);
        self.greatest = self.greatest.max(time);
    }

    /// Takes over what another one has noted.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.total += other.total;
        self.sum = self.sum.saturating_add(other.sum);
        self.greatest = self.greatest.max(other.greatest);
    }

    /// What was noted since `earlier`, an older state of the same one. Its greatest time is known to its class only.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let mut since = self.clone();
        for (count, before) in since.counts.iter_mut().zip(&earlier.counts) {
            *count = count.saturating_sub(*before);
        }
        since.total = self.total.saturating_sub(earlier.total);
        since.sum = self.sum.saturating_sub(earlier.sum);
        let last = since.counts.iter().rposition(|it| *it > 0);
        let greatest = last.map_or(Duration::ZERO, |it| Duration::from_micros(end(it)));
        since.greatest = greatest.min(self.greatest);
        since
    }

    /// How many were noted.
    pub const fn total(&self) -> u64 {
        self.total
    }

    /// All of them together.
    pub const fn sum(&self) -> Duration {
        self.sum
    }

    /// The greatest one.
    pub const fn greatest(&self) -> Duration {
        self.greatest
    }

    /// The time that a `share` of all (0 to 1) did not exceed, by its class's upper end; zero
    /// of none.
    pub fn percentile(&self, share: f64) -> Duration {
        let wanted = ((self.total as f64 * share).ceil() as u64).max(1);
        let mut seen = 0;
        for (class, count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                return Duration::from_micros(end(class)).min(self.greatest);
            }
        }
        self.greatest
    }
}

/// Half, 99 and 99.9 % of the times, and the greatest.
impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        write!(
            f,
            "p50 {:.0} us, p99 {:.0} us, p99.9 {:.0} us, max {:.0} us",
            us(self.percentile(0.5)),
            us(self.percentile(0.99)),
            us(self.percentile(0.999)),
            us(self.greatest)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_follow_each_other_without_gap_and_are_an_eighth_wide() {
        for micros in 0..200_000 {
            let class = class(micros);
            let begin = if class == 0 { 0 } else { end(class - 1) };
            let micros = u64::from(micros);
            assert!(begin <= micros && micros < end(class), "{micros} us");
            assert!(end(class) - begin <= 1 + begin / 8, "{micros} us");
        }
        assert_eq!(class(u32::MAX), CLASSES - 1);
    }

    #[test]
    fn percentiles_are_upper_ends_and_never_beyond_the_greatest() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.percentile(0.5), Duration::ZERO);
        for micros in 1..=100 {
            histogram.note(Duration::from_micros(micros));
        }
        assert_eq!(histogram.total(), 100);
        assert_eq!(histogram.percentile(0.5), Duration::from_micros(52));
        assert_eq!(histogram.percentile(1.0), Duration::from_micros(100));
        histogram.note(Duration::from_secs(3_600));
        assert_eq!(
            histogram.percentile(0.99),
            Duration::from_micros(100).max(histogram.percentile(0.98))
        );
        assert_eq!(histogram.greatest(), Duration::from_secs(3_600));
        let mut sum = Histogram::default();
        sum.note(Duration::from_micros(7));
        sum.add(&histogram);
        assert_eq!((sum.total(), sum.greatest()), (102, histogram.greatest()));
        let micros = 100 * 101 / 2 + 7;
        let expected = Duration::from_secs(3_600) + Duration::from_micros(micros);
        assert_eq!(sum.sum(), expected);
        assert_eq!(sum.percentile(0.07), Duration::from_micros(8));
        assert!(histogram.to_string().starts_with("p50 52 us, p99 "));
    }

    #[test]
    fn what_was_noted_since_is_as_if_nothing_had_been_before() {
        let (mut all, mut late) = (Histogram::default(), Histogram::default());
        all.note(Duration::from_secs(1));
        let earlier = all.clone();
        for micros in [3, 50, 50, 700] {
            all.note(Duration::from_micros(micros));
            late.note(Duration::from_micros(micros));
        }
        let since = all.since(&earlier);
        assert_eq!((since.total(), since.sum()), (4, late.sum()));
        for share in [0.25, 0.75] {
            assert_eq!(since.percentile(share), late.percentile(share));
        }
        assert_eq!(
            since.greatest(),
            Duration::from_micros(704),
            "the end of its class"
        );
        assert_eq!(all.since(&all), Histogram::default());
    }
}
