//! Several devices on one line that only one may use at a time.
//!
//! A device that shares its line never begins by itself: it says that it wants the line, and
//! is asked to transmit ([`Device::poll_transmit`](super::Device::poll_transmit)) when its turn
//! has come. From then on it holds the line, until it has its answer or has waited long enough
//! for it. So at any time one exchange is on the line, whoever begins it, and no device needs to
//! know another.

use units::Time;

/// How much a device's next exchange matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Urgency {
    /// A look at how things are.
    Poll,
    /// A step of a command.
    Command,
    /// The start of a motion that others start with.
    Start,
    /// A stop.
    Stop,
}

/// What a device wants of its line.
///
/// # Example
///
/// ```
/// use drivers::device::{LineUse, Urgency};
/// use units::Time;
///
/// let poll = LineUse::Wants { urgency: Urgency::Poll, since: Time(1) };
/// let stop = LineUse::Wants { urgency: Urgency::Stop, since: Time(9) };
/// assert!(stop.may_speak([(poll, true)]), "more urgent, though later");
/// assert!(!poll.may_speak([(stop, false)]));
/// assert!(!stop.may_speak([(LineUse::Holds, false)]), "an exchange is under way");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineUse {
    /// The line is the device's own, or a bus that needs no turns.
    Unshared,
    /// Nothing to say.
    Idle,
    /// Waits for its turn.
    Wants {
        /// How much it matters.
        urgency: Urgency,
        /// Since when.
        since: Time,
    },
    /// In the middle of an exchange.
    Holds,
}

impl LineUse {
    /// Whether a device with this may be asked to transmit, given those of the others on its
    /// line, each with whether it stands before this one in the configuration.
    pub fn may_speak(self, others: impl IntoIterator<Item = (Self, bool)>) -> bool {
        match self {
            Self::Unshared | Self::Holds => true,
            Self::Idle => false,
            Self::Wants { urgency, since } => {
                others.into_iter().all(|(other, first)| match other {
                    Self::Unshared | Self::Idle => true,
                    Self::Holds => false,
                    Self::Wants {
                        urgency: its,
                        since: it_waits,
                    } => {
                        // The more urgent, then who has waited longer, then the order.
                        let older = it_waits < since || it_waits == since && first;
                        urgency > its || urgency == its && !older
                    }
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn wants(urgency: Urgency, since: u64) -> LineUse {
        LineUse::Wants {
            urgency,
            since: Time(since),
        }
    }

    /// Which of `uses`, on one line, may speak.
    fn speakers(uses: &[LineUse]) -> Vec<usize> {
        (0..uses.len())
            .filter(|at| {
                let others = uses.iter().enumerate().filter(|(other, _)| other != at);
                uses[*at].may_speak(others.map(|(other, it)| (*it, other < *at)))
            })
            .collect()
    }

    #[test]
    fn one_at_a_time_and_the_most_urgent_first() {
        use LineUse::{Holds, Idle};
        let poll = wants(Urgency::Poll, 1);
        let stop = wants(Urgency::Stop, 9);
        assert_eq!(speakers(&[poll, stop, poll]), [1]);
        assert_eq!(speakers(&[Idle, poll, Idle]), [1]);
        assert_eq!(speakers(&[stop, Holds, stop]), [1]);
        assert_eq!(speakers(&[Idle, Idle]), [0; 0]);
        let start = wants(Urgency::Start, 5);
        assert_eq!(speakers(&[start, start, poll]), [0]);
        assert_eq!(speakers(&[Idle, start, start]), [1]);
    }

    #[test]
    fn of_equal_claims_the_older_one_and_then_the_first_wins() {
        let claims = [7, 3, 3].map(|since| wants(Urgency::Poll, since));
        assert_eq!(speakers(&claims), [1]);
        let claims = [3, 7, 3].map(|since| wants(Urgency::Command, since));
        assert_eq!(speakers(&claims), [0]);
    }

    #[test]
    fn a_device_with_a_line_of_its_own_never_waits() {
        assert!(LineUse::Unshared.may_speak([(LineUse::Holds, true)]));
        assert!(wants(Urgency::Poll, 0).may_speak([(LineUse::Unshared, true)]));
    }
}
