//! The roll of one slide watched: reference, memories and feed put together, as [`AxisMonitor`](super::AxisMonitor)
//! does for displacements.
//!
//! What is given out is what is to be compensated: the roll beyond its reference less what the memories keep. What the
//! slide's detectors sit on is the whole roll beyond the reference, also what is kept and what is left as it is: their
//! lever needs that.
//!
//! Source: CN1214003A, seventh aspect with the second and third: the roll is part of the state that is kept.

use core::time::Duration;

use units::{Metres, Radians, Time};

use super::{Feed, FeedStatus, Memories, Trouble};
use crate::volumetric::Axis;
use crate::volumetric::function::Function;

/// The roll of one slide.
#[derive(Clone, Debug)]
pub struct RollMonitor {
    axis: Axis,
    reference: Function<Radians>,
    /// To be compensated.
    feed: Feed<Radians, 1>,
    /// The same, also while it is left as it is.
    seen: Feed<Radians, 1>,
    kept: Radians,
    roll: Option<Radians>,
}

impl RollMonitor {
    /// Watches the slide of `axis`; `feed` keeps what is given out from jumping.
    pub fn new(axis: Axis, reference: Function<Radians>, feed: Feed<Radians, 1>) -> Self {
        Self {
            axis,
            reference,
            seen: feed.clone(),
            feed,
            kept: Radians(0.0),
            roll: None,
        }
    }

    /// Takes what the detectors `read` at the axis's `position`, and gives out what is to be compensated.
    pub fn advance(
        &mut self,
        now: Time,
        position: Metres,
        read: Result<Radians, Trouble>,
        memories: &Memories,
    ) -> Radians {
        let beyond = read.map(|it| it - self.reference.at(position));
        self.roll = beyond.ok();
        self.kept = memories.kept_roll(self.axis, position);
        let error = beyond.map(|it| [it - self.kept]);
        self.seen.advance(now, error);
        self.feed.advance(now, error)[0]
    }

    /// The whole roll beyond the reference, as steady as what is given out: on it sit the slide's detectors. Of
    /// detectors in trouble what is kept remains.
    pub fn whole(&self) -> Radians {
        self.seen.values()[0] + self.kept
    }

    /// The roll beyond the reference less what was given out last, to be compensated: what the machine is left with.
    pub fn uncompensated(&self) -> Option<Radians> {
        Some(self.roll? - self.feed.values()[0])
    }

    /// What stands behind the value given out last.
    pub fn status(&self) -> FeedStatus {
        self.feed.status()
    }

    /// How far the value given out last still is from what is wanted.
    pub fn left(&self) -> Radians {
        self.feed.left()
    }

    /// Leaves the roll as it is from `now` on.
    pub fn leave(&mut self, now: Time) {
        self.feed.disable(now, Duration::ZERO);
    }

    /// Goes on with what `before`, which watched the same slide, has seen; another reference or other memories are
    /// blended to.
    pub fn take_over(&mut self, before: &Self) {
        self.feed.take_over(&before.feed);
        self.seen.take_over(&before.seen);
    }
}
