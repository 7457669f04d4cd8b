//! Profile position mode: the set-point handshake and its buffer of one (CiA 402-2, 10.1).

use units::Time;
use wire::cia402::Controlword;

use super::Drive;
use super::mechanism::Mechanism;
use super::motion::{Activity, After};
use crate::node::profile::{MotionLimits, Profile};

/// One target with the motion parameters that were in force when it was given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SetPoint {
    target: f64,
    limits: MotionLimits,
    clipped: bool,
}

/// What the handshake has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Positioning {
    /// Bit 4 is still 1 after a set-point was taken.
    acknowledged: bool,
    /// The set-point after the present one; full, it keeps bit 12 at 1.
    buffer: Option<SetPoint>,
    /// The set-point being executed, also while halted.
    current: Option<SetPoint>,
    /// What relative targets count from.
    last_target: f64,
    /// The target was given up: a limit switch, a halt in another mode.
    pub(super) missed: bool,
}

impl Positioning {
    /// Nothing to do at `position`.
    pub(super) fn at(position: f64) -> Self {
        Self {
            last_target: position,
            ..Self::default()
        }
    }

    /// Begins anew with nothing to do at `position`.
    pub(super) fn begin_at(&mut self, position: f64) {
        *self = Self::at(position);
    }

    /// Forgets what was to be done.
    pub(super) fn abandon(&mut self) {
        *self = Self::at(self.last_target);
    }

    /// The drive stopped short of its target.
    pub(super) fn miss(&mut self) {
        self.abandon();
        self.missed = true;
    }

    /// Statusword bit 12.
    pub(super) const fn bit_12(&self) -> bool {
        self.acknowledged || self.buffer.is_some()
    }
}

impl Drive {
    /// A new controlword in operation enabled.
    pub(super) fn control_positioning(
        &mut self,
        now: Time,
        old: Controlword,
        new: Controlword,
        m: &mut impl Mechanism,
    ) {
        let rose = |bit| new.contains(bit) && !old.contains(bit);
        let fell = |bit| !new.contains(bit) && old.contains(bit);
        if rose(Controlword::HALT) {
            self.halt(now);
        }
        if fell(Controlword::MODE_4) {
            self.positioning.acknowledged = false;
        }
        let taken = rose(Controlword::MODE_4) && self.take_set_point(now, new, m);
        if fell(Controlword::HALT) && !taken {
            self.resume(now, m);
        }
    }

    /// 0x605D: 1 slows down on the profile's ramp, 2 on the quick stop's.
    pub(super) fn halt(&mut self, now: Time) {
        if self.is_moving_itself() {
            let option = self.get(0x605D);
            let deceleration = self.acceleration(if option == 2 { 0x6085 } else { 0x6084 });
            self.ramp(now, deceleration, After::Stay);
        }
    }

    fn resume(&mut self, now: Time, m: &mut impl Mechanism) {
        if let Some(set_point) = self.positioning.current {
            self.start(now, set_point, m);
        }
    }

    /// A rising edge of bit 4; `false` when the set-point is not taken.
    fn take_set_point(&mut self, now: Time, new: Controlword, m: &mut impl Mechanism) -> bool {
        if self.is_blocked_by_halt(new) {
            return false;
        }
        let immediately = new.contains(Controlword::MODE_5);
        let busy = self.positioning.current.is_some() && self.is_moving_itself();
        if busy && !immediately && self.positioning.buffer.is_some() {
            return false;
        }
        let set_point = self.set_point(new.contains(Controlword::MODE_6), m);
        let identical = set_point.target == self.positioning.last_target;
        if identical && self.config.quirks.identical_target_ignored {
            self.server.count_delivery("identical_target_ignored");
            return false;
        }
        self.positioning.last_target = set_point.target;
        self.positioning.acknowledged = true;
        if new.contains(Controlword::HALT) {
            self.positioning.current = Some(set_point);
        } else if busy && !immediately {
            self.positioning.buffer = Some(set_point);
        } else {
            self.positioning.buffer = None;
            self.start(now, set_point, m);
        }
        true
    }

    fn set_point(&mut self, relative: bool, m: &impl Mechanism) -> SetPoint {
        let raw = self.target_at_edge();
        let wanted = if relative {
            self.positioning.last_target + raw as f64
        } else {
            self.unwrapped(raw, m)
        };
        let target = self.within_soft_limits(wanted);
        let velocity = self.speed(0x6081, 0).min(self.speed(0x607F, 0));
        SetPoint {
            target,
            clipped: target != wanted,
            limits: MotionLimits {
                velocity,
                acceleration: self.acceleration(0x6083),
                deceleration: self.acceleration(0x6084),
            },
        }
    }

    /// Re-plans from wherever the demand is. Towards a pressed limit switch nothing moves.
    fn start(&mut self, now: Time, set_point: SetPoint, m: &mut impl Mechanism) {
        let from = self.demand(now);
        self.in_window_since = None;
        self.internal_limit = set_point.clipped;
        self.positioning.missed = false;
        if self.is_limited(set_point.target - from.position, m) {
            self.internal_limit = true;
            self.positioning.missed = true;
            return;
        }
        self.positioning.current = Some(set_point);
        self.profile = Profile::to_target(now, from, set_point.target, set_point.limits);
        self.activity = Activity::Positioning;
        self.moved_at = Some(now);
        self.count_units();
        self.look_now();
        self.proceed(now, m);
    }

    /// The profile is at its end: the buffered set-point's turn.
    pub(super) fn next_set_point(&mut self, now: Time, m: &mut impl Mechanism) {
        self.activity = Activity::Standing;
        self.positioning.current = None;
        if let Some(next) = self.positioning.buffer.take() {
            self.start(now, next, m);
        }
    }
}
