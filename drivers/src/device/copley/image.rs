//! The newest state read from an amplifier, and whether it is plausible.

use std::collections::VecDeque;

use units::{Counts, Time};
use wire::copley::{EventStatus, Parameter, TrajectoryStatus};

use super::watch::SAMPLED_EARLIER;
use crate::device::plausible::{Judgement, Plausible};

/// Positions in counts of the amplifier.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) events: EventStatus,
    pub(super) trajectory: TrajectoryStatus,
    position: Option<(Time, Counts)>,
    pub(super) following_error: Option<Counts>,
    pub(super) plausible: Plausible,
}

impl Image {
    pub(super) const fn new(plausible: Plausible) -> Self {
        Self {
            events: EventStatus::empty(),
            trajectory: TrajectoryStatus::empty(),
            position: None,
            following_error: None,
            plausible,
        }
    }

    pub(super) const fn position(&self) -> Option<(Time, Counts)> {
        self.position
    }

    /// Nothing before compares with what comes.
    pub(super) const fn forget_position(&mut self) {
        self.position = None;
        self.following_error = None;
        self.plausible.forget();
    }

    pub(super) fn take_position(&mut self, at: Time, position: Counts) -> Judgement {
        let old = self.position;
        let old = old.map(|(before, old)| (old, at.since(before) + SAMPLED_EARLIER));
        let judgement = self.plausible.take(position, old);
        if judgement != Judgement::Doubted {
            self.position = Some((at, position));
        }
        judgement
    }
}

/// What is asked for in turn, when nothing else is.
#[derive(Debug)]
pub(super) struct Look {
    /// Whether anything is asked for.
    pub(super) active: bool,
    /// What is left of this look.
    pub(super) round: VecDeque<Parameter>,
    /// When the next look is due.
    pub(super) due: Time,
    /// When the amplifier is asked how long it has been on.
    pub(super) uptime_due: Time,
    /// Its last answer to that.
    pub(super) uptime: Option<(Time, i64)>,
    /// An answer to that which cannot be, unless it restarted.
    pub(super) uptime_doubted: bool,
    /// The latched faults are wanted, too.
    pub(super) faults: bool,
    pub(super) heard: Time,
}

impl Look {
    pub(super) const fn new() -> Self {
        Self {
            active: false,
            round: VecDeque::new(),
            due: Time::NEVER,
            uptime_due: Time::NEVER,
            uptime: None,
            uptime_doubted: false,
            faults: false,
            heard: Time::ZERO,
        }
    }
}
