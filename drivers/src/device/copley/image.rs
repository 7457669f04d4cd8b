//! The newest state read from an amplifier, and whether it is plausible.

use core::time::Duration;
use std::collections::VecDeque;

use units::{Counts, Time};
use wire::copley::{EventStatus, Parameter, TrajectoryStatus};

/// An axis stands when so many looks in a row lie within the tolerance.
const STANDING_LOOKS: u8 = 3;

/// What a position is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judgement {
    Believed,
    /// Too far from where the axis can be: not taken.
    Doubted,
    /// Doubted twice running: the position did jump. Taken, but to be told.
    Jumped {
        by: Counts,
        limit: Counts,
    },
}

/// Positions in counts of the amplifier.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) events: EventStatus,
    pub(super) trajectory: TrajectoryStatus,
    position: Option<(Time, Counts)>,
    pub(super) following_error: Option<Counts>,
    speed_max: f64,
    margin: i64,
    tolerance: i64,
    rest: Counts,
    standing: u8,
    doubted: bool,
    /// While homing the coordinates may change.
    jumps_allowed: bool,
    rejected: u64,
}

impl Image {
    /// `speed_max` in counts per second, `margin` and `tolerance` in counts.
    pub(super) const fn new(speed_max: f64, margin: i64, tolerance: i64) -> Self {
        Self {
            events: EventStatus::empty(),
            trajectory: TrajectoryStatus::empty(),
            position: None,
            following_error: None,
            speed_max,
            margin,
            tolerance,
            rest: Counts(0),
            standing: 0,
            doubted: false,
            jumps_allowed: false,
            rejected: 0,
        }
    }

    pub(super) const fn position(&self) -> Option<(Time, Counts)> {
        self.position
    }

    pub(super) const fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whether the last looks lie together.
    pub(super) const fn stands(&self) -> bool {
        self.standing >= STANDING_LOOKS
    }

    pub(super) const fn watch_rest(&mut self) {
        self.standing = 0;
    }

    pub(super) const fn allow_jumps(&mut self, allowed: bool) {
        self.jumps_allowed = allowed;
        self.doubted = false;
    }

    /// Nothing before compares with what comes.
    pub(super) const fn forget_position(&mut self) {
        self.position = None;
        self.following_error = None;
        self.doubted = false;
        self.standing = 0;
    }

    pub(super) fn take_position(&mut self, at: Time, position: Counts) -> Judgement {
        let judgement = self.judge(at, position);
        if judgement == Judgement::Doubted {
            self.rejected += 1;
            self.doubted = true;
            return judgement;
        }
        self.doubted = false;
        if (position - self.rest).0.abs() <= self.tolerance {
            self.standing = self.standing.saturating_add(1);
        } else {
            self.rest = position;
            self.standing = 0;
        }
        self.position = Some((at, position));
        judgement
    }

    fn judge(&self, at: Time, position: Counts) -> Judgement {
        let Some((before, old)) = self.position.filter(|_| !self.jumps_allowed) else {
            return Judgement::Believed;
        };
        // An amplifier samples when it is asked, not when its answer arrives.
        const SAMPLED_EARLIER: Duration = Duration::from_millis(20);
        let apart = at.since(before) + SAMPLED_EARLIER;
        let limit = (self.speed_max * 1.2 * apart.as_secs_f64()) as i64 + self.margin;
        let by = position - old;
        if by.0.abs() <= limit {
            Judgement::Believed
        } else if self.doubted {
            let limit = Counts(limit);
            Judgement::Jumped { by, limit }
        } else {
            Judgement::Doubted
        }
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
