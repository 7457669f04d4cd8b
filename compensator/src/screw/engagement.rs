//! Which flank of its thread the nut leans on: the play operator.
//!
//! Screw and nut touch on one flank at a time. Pushed forward, the nut follows the screw; when
//! the screw turns back, the nut stays where it is until the screw has crossed the play, which
//! is the lost motion. With `gap` = how far the nut is ahead of where a forward push would have
//! it, a travel d of the screw turns gap into gap − d, held between 0 (pushed forward) and the
//! lost motion (pushed in reverse). That does not depend on speed, nor on how one travel without
//! a reversal is divided.
//!
//! Source: the play operator of hysteresis theory (Krasnosel'skii and Pokrovskii 1983).
//!
//! After power was off nobody knows the gap; then it is an interval, which the same operator
//! narrows with every travel until the lost motion has been crossed.
//!
//! Absent: elastic wind-up, and a drive that overshoots its set-point by more than it should.

use units::Metres;

/// Gaps closer to an end than this are at the end: rounding of travels, metres.
pub(super) const SNAP: f64 = 1e-12;

/// How screw and nut stand to each other. Plain data, valid for any lost motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Engagement {
    /// Not known: power was off, or somebody pushed the stage.
    #[default]
    Unknown,
    /// Pushed forward: the whole play lies behind.
    Forward,
    /// Pushed in reverse.
    Reverse,
    /// In between: the gap lies within these bounds, which are equal when it is known.
    Between {
        /// The smallest gap possible.
        least: Metres,
        /// The largest gap possible.
        most: Metres,
    },
}

/// What must be remembered of a screw, also while power is off. Plain data.
///
/// # Example
///
/// ```
/// use compensator::screw::{Engagement, ScrewMemory};
/// use units::Metres;
///
/// let kept = ScrewMemory { set_point: Metres(0.01), engagement: Engagement::Forward };
/// let tolerance = Metres::from_um(1.0);
/// assert_eq!(kept.found_at(Metres(0.01), tolerance), kept);
/// let pushed = kept.found_at(Metres(0.012), tolerance);
/// assert_eq!(pushed.engagement, Engagement::Unknown);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScrewMemory {
    /// Where the screw was last commanded to.
    pub set_point: Metres,
    /// How the nut stood then.
    pub engagement: Engagement,
}

impl ScrewMemory {
    /// What is known when nothing is remembered and the screw stands at `position`.
    pub fn unknown_at(position: Metres) -> Self {
        Self {
            set_point: position,
            engagement: Engagement::Unknown,
        }
    }

    /// What is still known when the screw is found at `seen` after it was out of our hands: the
    /// engagement holds only if it stands where it was left, within `tolerance`.
    pub fn found_at(self, seen: Metres, tolerance: Metres) -> Self {
        if (seen - self.set_point).abs() <= tolerance {
            self
        } else {
            Self::unknown_at(seen)
        }
    }
}

/// The play between a screw and its nut, metres, zero or positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Play(pub(super) f64);

impl Play {
    /// The gaps possible, as (least, most).
    pub(super) fn gaps(self, engagement: Engagement) -> (f64, f64) {
        let held = |gap: Metres| gap.value().clamp(0.0, self.0);
        match engagement {
            Engagement::Unknown => (0.0, self.0),
            Engagement::Forward => (0.0, 0.0),
            Engagement::Reverse => (self.0, self.0),
            Engagement::Between { least, most } => (held(least), held(most).max(held(least))),
        }
    }

    /// The engagement after the screw has travelled by `travel` without turning round.
    pub(super) fn after(self, engagement: Engagement, travel: f64) -> Engagement {
        if travel == 0.0 {
            return engagement;
        }
        let (least, most) = self.gaps(engagement);
        let least = (least - travel).clamp(0.0, self.0);
        let most = (most - travel).clamp(0.0, self.0);
        let (at_zero, at_end) = (most <= SNAP, least >= self.0 - SNAP);
        match (at_zero, at_end, travel > 0.0) {
            // Without play the last travel decides, so that the state means something when the
            // lost motion is measured anew.
            (true, true, true) | (true, false, _) => Engagement::Forward,
            (true, true, false) | (false, true, _) => Engagement::Reverse,
            (false, false, _) if least <= 0.0 && most >= self.0 => Engagement::Unknown,
            (false, false, _) => Engagement::Between {
                least: Metres(least),
                most: Metres(most),
            },
        }
    }
}
