//! Whether positions that a drive tells can be where its axis is, and whether the axis stands.

use core::time::Duration;

use units::Counts;

/// An axis stands when so many positions in a row lie within the tolerance.
const STANDING: u8 = 3;
/// So many leave no doubt, whatever the drive says.
const STANDING_LONG: u8 = 20;
/// How much faster than it may go an axis can be for a moment.
const OVERSHOOT: f64 = 1.2;

/// What a position is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Judgement {
    Believed,
    /// Too far from where the axis can be: not taken.
    Doubted,
    /// Doubted twice running: the position did jump. Taken, but to be told.
    Jumped {
        by: Counts,
        limit: Counts,
    },
    /// Twice too far in one direction: the axis moves at `seen` counts per second, `limit` at most
    /// is possible.
    TooFast {
        seen: f64,
        limit: f64,
    },
}

/// What of earlier positions is remembered for that.
#[derive(Debug)]
pub(super) struct Plausible {
    speed_max: f64,
    margin: i64,
    tolerance: i64,
    /// Where the axis was when it last seemed to come to rest.
    rest: Counts,
    standing: u8,
    /// How far the last position was off, when that was too far.
    doubted: Option<Counts>,
    /// While homing the coordinates may change.
    jumps_allowed: bool,
    rejected: u64,
}

impl Plausible {
    /// `speed_max` in counts per second, `margin` and `tolerance` in counts.
    pub(super) const fn new(speed_max: f64, margin: i64, tolerance: i64) -> Self {
        Self {
            speed_max,
            margin,
            tolerance,
            rest: Counts(0),
            standing: 0,
            doubted: None,
            jumps_allowed: false,
            rejected: 0,
        }
    }

    /// How far two honest positions of one moment may be apart.
    pub(super) const fn margin(&self) -> i64 {
        self.margin
    }

    pub(super) const fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whether the last positions lie together.
    pub(super) const fn stands(&self) -> bool {
        self.standing >= STANDING
    }

    /// Whether they have lain together for long.
    pub(super) const fn stands_long(&self) -> bool {
        self.standing >= STANDING_LONG
    }

    /// From now on positions begin a new count of standing still.
    pub(super) const fn watch_rest(&mut self) {
        self.standing = 0;
    }

    pub(super) const fn allow_jumps(&mut self, allowed: bool) {
        self.jumps_allowed = allowed;
        self.doubted = None;
    }

    /// Nothing before compares with what comes.
    pub(super) const fn forget(&mut self) {
        self.standing = 0;
        self.doubted = None;
    }

    /// Judges `position`, up to `apart` after the position `old`, if there is one. What is not
    /// doubted is taken.
    pub(super) fn take(&mut self, position: Counts, old: Option<(Counts, Duration)>) -> Judgement {
        let judgement = self.judge(position, old);
        self.doubted = match (judgement, old) {
            (Judgement::Doubted, Some((old, _))) => Some(position - old),
            _ => None,
        };
        if self.doubted.is_some() {
            self.rejected += 1;
            return judgement;
        }
        if (position - self.rest).0.abs() <= self.tolerance {
            self.standing = self.standing.saturating_add(1);
        } else {
            self.rest = position;
            self.standing = 0;
        }
        judgement
    }

    fn judge(&self, position: Counts, old: Option<(Counts, Duration)>) -> Judgement {
        let Some((old, apart)) = old.filter(|_| !self.jumps_allowed) else {
            return Judgement::Believed;
        };
        let seconds = apart.as_secs_f64();
        let limit = (self.speed_max * OVERSHOOT * seconds) as i64 + self.margin;
        let by = position - old;
        if by.0.abs() <= limit {
            return Judgement::Believed;
        }
        let Some(before) = self.doubted else {
            return Judgement::Doubted;
        };
        // A position that jumped stays; an axis that is too fast goes on.
        let went_on = (by - before).0;
        if went_on.signum() == before.0.signum() && went_on.abs() > before.0.abs() / 2 {
            let seen = by.0.abs() as f64 / seconds;
            let limit = self.speed_max;
            return Judgement::TooFast { seen, limit };
        }
        let limit = Counts(limit);
        Judgement::Jumped { by, limit }
    }
}
