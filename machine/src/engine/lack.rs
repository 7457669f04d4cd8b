//! What a correction does without, and why: names for an operator that a loop can pass on without
//! asking for memory.

use core::fmt;

use compensator::volumetric::Axis;
use compensator::volumetric::online::FeedStatus;

/// Something that a correction is computed from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The detector on the slide of this axis.
    Slide(Axis),
    /// The detector at the end of travel, which watches this axis's beam itself.
    EndOfTravel(Axis),
    /// The roll detectors of this axis's slide.
    Roll(Axis),
    /// This thermometer, in the order of the configuration, from 0.
    Thermometer(usize),
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slide(axis) => write!(f, "axis {axis}: the detector on its slide"),
            Self::EndOfTravel(axis) => {
                write!(f, "axis {axis}: the detector at the end of its beam")
            }
            Self::Roll(axis) => write!(f, "axis {axis}: the roll detectors of its slide"),
            Self::Thermometer(number) => write!(
                f,
                "thermometer {number} ([[volumetric.temperature]], counted from 0)"
            ),
        }
    }
}

/// A source whose value is not accepted at the moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lack {
    /// Which.
    pub source: Source,
    /// What stands in its place, and what is wrong.
    pub status: FeedStatus,
}

impl Lack {
    /// Of `sources`, the one that matters most; `None` when all are good.
    pub fn worst(sources: impl Iterator<Item = (Source, FeedStatus)>) -> Option<Self> {
        let each = sources.map(|(source, status)| Self { source, status });
        let lacking = each.filter(|it| it.weight() > 0);
        lacking.reduce(|worst, it| worst.worse_of(Some(it)))
    }

    /// Of two, the one that matters more; this one when they are alike.
    pub fn worse_of(self, other: Option<Self>) -> Self {
        other
            .filter(|it| it.weight() > self.weight())
            .unwrap_or(self)
    }

    const fn weight(&self) -> u8 {
        match self.status {
            FeedStatus::Good | FeedStatus::Off => 0,
            FeedStatus::Tolerated(_) => 1,
            FeedStatus::Held(_) | FeedStatus::Faded(_) => 2,
            FeedStatus::Waiting(_) => 3,
            FeedStatus::Stop(_) => 4,
        }
    }

    /// Whether the machine's configuration says how to go on without it, and that is done.
    pub const fn is_made_up_for(&self) -> bool {
        matches!(
            self.status,
            FeedStatus::Tolerated(_) | FeedStatus::Held(_) | FeedStatus::Faded(_)
        )
    }
}

impl fmt::Display for Lack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.source, self.status)
    }
}

#[cfg(test)]
mod tests {
    use compensator::volumetric::online::Trouble;
    use units::Volts;

    use super::*;

    #[test]
    fn the_worst_is_named_with_its_cause() {
        let blocked = Trouble::Blocked {
            seen: Volts(0.1),
            limit: Volts(2.0),
        };
        let all = [
            (Source::Slide(Axis::X), FeedStatus::Good),
            (Source::Thermometer(3), FeedStatus::Held(blocked)),
            (Source::EndOfTravel(Axis::Y), FeedStatus::Stop(blocked)),
            (Source::Roll(Axis::X), FeedStatus::Waiting(None)),
        ];
        let worst = Lack::worst(all.into_iter()).unwrap();
        let text = worst.to_string();
        assert_eq!(worst.source, Source::EndOfTravel(Axis::Y), "{text}");
        assert!(
            text.contains("axis y") && text.contains("blocked"),
            "{text}"
        );
        let held = Lack::worst(all[..2].iter().copied()).unwrap();
        assert!(held.is_made_up_for() && held.to_string().contains("thermometer 3"));
        assert_eq!(Lack::worst(all[..1].iter().copied()), None);
    }
}
