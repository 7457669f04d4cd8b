//! Halt, and the end of the target that the drive was halted on (CiA 402, 8.4.4 and 10).
//!
//! A halted drive holds its old target, and goes on to that as soon as HALT falls. So the axis'
//! own place becomes the new target under HALT, and HALT falls once the drive has acknowledged
//! that. A drive that acknowledges nothing under HALT keeps HALT, until it is switched off and on.
//! A drive that was enabled settles likewise.

use core::time::Duration;

use units::{Coordinate, Time};
use wire::cia402::{Controlword, OperationMode, Statusword};

use super::{Activity, Cia402Drive};
use crate::device::DeviceError;

/// So long a drive may take to acknowledge a target under HALT; the axis stands meanwhile.
const ACKNOWLEDGED_WITHIN: Duration = Duration::from_millis(200);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HaltPhase {
    /// Until the axis stands.
    Slowing,
    /// Its place is on its way as the target, without its edge.
    Announcing,
    Raising,
    Lowering,
    /// HALT is gone; the drive settles where it stands.
    Settling,
}

/// A halt under way.
#[derive(Debug)]
pub(super) struct Halt {
    phase: HaltPhase,
    since: Time,
    deadline: Time,
}

impl Halt {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }

    /// Whether its target is on the bus.
    pub(super) const fn has_announced(&self) -> bool {
        !matches!(self.phase, HaltPhase::Slowing)
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    pub(super) fn begin_halt(&mut self, now: Time) {
        self.reached = None;
        self.image.plausible.watch_rest();
        self.activity = Activity::Halt(Halt {
            phase: HaltPhase::Slowing,
            since: now,
            deadline: now + self.settings.timeouts.standing,
        });
        self.hold_back(now);
    }

    /// Sends HALT: whatever moves the axis ends. The set-point bit goes with that.
    pub(super) fn hold_back(&mut self, now: Time) {
        if let Some(here) = self.image.here() {
            self.envelope.begin_stop(here);
        }
        self.send_control(now, Controlword::ENABLE_COMMAND | Controlword::HALT);
    }

    fn enter_halt(&mut self, now: Time, phase: HaltPhase, patience: Duration) {
        self.activity = Activity::Halt(Halt {
            phase,
            since: now,
            deadline: now + patience,
        });
    }

    pub(super) fn advance_halt(&mut self, now: Time) {
        let (Activity::Halt(halt), Some(sample)) = (&self.activity, self.image.sample()) else {
            return;
        };
        let (phase, since) = (halt.phase, halt.since);
        let (mode, status) = (sample.mode, sample.status);
        let acknowledged = status.contains(Statusword::MODE_12);
        let reached = status.contains(Statusword::TARGET_REACHED);
        let stands = self.image.plausible.stands();
        // Not every drive says so of a halt.
        let reached = reached || self.image.plausible.stands_long();
        match phase {
            HaltPhase::Slowing => {
                // A sample from before the halt says nothing yet.
                let fresh = now.since(since) >= self.settings.common.sync_period * 2;
                if fresh && reached && stands {
                    self.end_slowing(now, mode);
                }
            }
            HaltPhase::Announcing => {
                let ready = self.target_was_seen(now) && self.low_level_was_seen(now);
                if ready && !acknowledged {
                    self.enter_halt(now, HaltPhase::Raising, ACKNOWLEDGED_WITHIN);
                    self.send_edge(now);
                }
            }
            HaltPhase::Raising => {
                if acknowledged {
                    self.enter_halt(now, HaltPhase::Lowering, ACKNOWLEDGED_WITHIN);
                    self.release_set_point(now);
                }
            }
            HaltPhase::Lowering => {
                if !acknowledged {
                    self.open_target = false;
                    self.end_halting(now);
                }
            }
            HaltPhase::Settling => {
                let fresh = now.since(since) >= self.settings.common.sync_period * 2;
                if fresh && reached && stands {
                    self.stand();
                }
            }
        }
    }

    /// The axis stands. In another mode than profile position the drive has no target.
    fn end_slowing(&mut self, now: Time, mode: OperationMode) {
        if mode == OperationMode::CyclicSynchronousPosition {
            self.stand();
        } else if mode == OperationMode::ProfilePosition && self.open_target {
            self.enter_halt(now, HaltPhase::Announcing, ACKNOWLEDGED_WITHIN);
            if let Some(here) = self.image.here() {
                self.envelope.hold(here.position);
                self.announce(now, here.position);
            }
        } else {
            self.end_halting(now);
        }
    }

    fn end_halting(&mut self, now: Time) {
        self.settle(now);
        self.send_control(now, Controlword::ENABLE_COMMAND);
        self.repeat_at = Time::NEVER;
    }

    /// Ends the command under way once the enabled axis stands.
    pub(super) fn settle(&mut self, now: Time) {
        self.repeat_at = Time::NEVER;
        self.enter_halt(now, HaltPhase::Settling, ACKNOWLEDGED_WITHIN);
    }

    fn stand(&mut self) {
        if let Some(here) = self.image.here() {
            self.envelope.hold(here.position);
        }
        self.finish(Ok(()));
    }

    pub(super) fn halt_timeout(&mut self, now: Time) {
        let Activity::Halt(halt) = &self.activity else {
            return;
        };
        if now < halt.deadline {
            return;
        }
        let (phase, since) = (halt.phase, halt.since);
        match phase {
            HaltPhase::Slowing => {
                let seen = self.seen_status();
                self.time_out(now, since, "the axis to stand still after a halt", seen);
            }
            // The axis stands, and HALT keeps the old target from counting.
            HaltPhase::Announcing | HaltPhase::Raising | HaltPhase::Lowering => {
                self.release_set_point(now);
                self.repeat_at = Time::NEVER;
                self.stand();
            }
            HaltPhase::Settling => self.stand(),
        }
    }

    /// Whether the drive waits under HALT to go on to an old target.
    pub(super) const fn waits_to_go_on(&self) -> bool {
        self.open_target && self.control.contains(Controlword::HALT)
    }

    /// Gives up a motion under way: the drive halts, and the command has failed.
    pub(super) fn fail_motion(&mut self, now: Time, error: DeviceError) {
        if self.open_target {
            self.hold_back(now);
        }
        self.finish(Err(error));
    }
}
