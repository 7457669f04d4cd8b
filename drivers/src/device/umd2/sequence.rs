//! Whether samples follow one another.

use wire::umd2::Sample;

/// How a sample stands to those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Continuity {
    /// It follows.
    Follows,
    /// It does not, but a damaged number is as likely as missing samples.
    Doubtful,
    /// This many are missing before it.
    Gap(u64),
    /// The firmware's sequence number started again.
    Restart,
}

/// Watches the sequence numbers.
///
/// A number out of step is believed only when the next one follows it: a single damaged
/// digit must not look like a restart, which would void the count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence {
    gap_max: u64,
    newest: Option<u32>,
    doubtful: Option<u32>,
}

impl Sequence {
    pub(super) const fn new(gap_max: u64) -> Self {
        Self {
            gap_max,
            newest: None,
            doubtful: None,
        }
    }

    /// Begins anew with the next sample.
    pub(super) const fn forget(&mut self) {
        self.newest = None;
        self.doubtful = None;
    }

    /// Takes a sample before which `garbage` damaged lines came.
    pub(super) fn take(&mut self, sample: &Sample, garbage: u64) -> Continuity {
        let Some(newest) = self.newest else {
            return self.accept(sample, Continuity::Follows);
        };
        let doubtful = self.doubtful.take();
        let unreadable = garbage + u64::from(doubtful.is_some());
        match sample.lost_since(newest) {
            0 => self.accept(sample, Continuity::Follows),
            missing if missing <= unreadable => self.accept(sample, Continuity::Gap(missing)),
            _ => match doubtful {
                Some(before) if sample.lost_since(before) == 0 => {
                    let missing = sample.lost_since(newest);
                    let continuity = if missing > self.gap_max {
                        Continuity::Restart
                    } else {
                        Continuity::Gap(missing)
                    };
                    self.accept(sample, continuity)
                }
                _ => {
                    self.doubtful = Some(sample.sequence);
                    Continuity::Doubtful
                }
            },
        }
    }

    const fn accept(&mut self, sample: &Sample, continuity: Continuity) -> Continuity {
        self.newest = Some(sample.sequence);
        self.doubtful = None;
        continuity
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::umd2::LowSpeed;

    fn sample(sequence: u32) -> Sample {
        Sample {
            reference_count: 1,
            measurement_count: 1,
            distance: 0,
            velocity: 0,
            phase: 0,
            sequence,
            low_speed: LowSpeed::None,
        }
    }

    #[track_caller]
    fn check(numbers: &[u32], expected: &[Continuity]) {
        let mut sequence = Sequence::new(1_000);
        let seen: Vec<_> = numbers
            .iter()
            .map(|number| sequence.take(&sample(*number), 0))
            .collect();
        assert_eq!(seen, expected, "{numbers:?}");
    }

    use Continuity::{Doubtful, Follows, Gap, Restart};

    #[test]
    fn a_gap_is_believed_when_the_next_sample_confirms_it() {
        check(&[1, 2, 10, 11], &[Follows, Follows, Doubtful, Gap(8)]);
        check(&[u32::MAX, 0, 1], &[Follows, Follows, Follows]);
    }

    #[test]
    fn a_restart_is_believed_when_the_next_sample_confirms_it() {
        check(&[5_000, 0, 1, 2], &[Follows, Doubtful, Restart, Follows]);
    }

    #[test]
    fn a_damaged_number_costs_its_own_sample() {
        check(
            &[7, 8, 3, 10, 11],
            &[Follows, Follows, Doubtful, Gap(1), Follows],
        );
        check(&[7, 8, 800, 10], &[Follows, Follows, Doubtful, Gap(1)]);
    }

    #[test]
    fn a_repeated_sample_is_left_out() {
        check(&[7, 7, 8], &[Follows, Doubtful, Follows]);
    }

    #[test]
    fn damaged_lines_explain_a_gap_of_as_many() {
        let mut sequence = Sequence::new(1_000);
        sequence.take(&sample(7), 0);
        assert_eq!(sequence.take(&sample(9), 1), Gap(1));
    }
}
