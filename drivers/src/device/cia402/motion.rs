//! Profile position moves (CiA 402, 10).
//!
//! The set-point handshake is by levels, so that a repeated or late frame cannot hurt:
//! acknowledge seen low, new set-point high, acknowledge high, new set-point low, acknowledge
//! low. Only after that does "target reached" count, and only with the position within the
//! window: the bit may still be set from the move before.
//!
//! The target is on its way one SYNC before its edge: some drives take the edge first and the
//! target of the same frame after that. A halted drive takes the new target under HALT, and HALT
//! goes after that: without it, the drive would go on to the target before.

use core::time::Duration;
use units::{Coordinate, Counts, Time};
use wire::cia402::{Controlword, OperationMode, Statusword};

use super::convert::{acceleration_counts, out_of_range, position_counts, velocity_counts};
use super::start::{MODE, PROFILE_ACCELERATION, PROFILE_VELOCITY, TARGET_POSITION, profile_steps};
use super::trial::Trial;
use super::{Activity, Cia402Drive};
use crate::device::envelope::Profile;
use crate::device::{DeviceError, Seen};
use crate::protocol::script::Step;

/// "Target reached" must be seen so often in a row.
const REACHED_SAMPLES: u8 = 2;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MovePhase {
    /// SDO: velocity, acceleration, mode.
    Preparing,
    AwaitingMode,
    /// The acknowledge of an older set-point must go.
    Releasing,
    /// The target is on its way, without its edge.
    Announcing,
    Raising,
    Lowering,
    Running,
}

/// A move under way, or one that only has to be started.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    pub(super) target: i64,
    /// Where the drive is sent now: the target, or a point on a long way round to it.
    pub(super) set_point: i64,
    /// Ends where only the edge of the set-point bit is missing.
    only_prepared: bool,
    pub(super) profile: (u32, u32),
    /// The first part of the way is a trial of the drive's units, after which this is the profile.
    pub(super) trial: Option<(Trial, (u32, u32))>,
    phase: MovePhase,
    since: Time,
    deadline: Time,
    reached: u8,
}

impl Move {
    pub(super) const fn deadline(&self) -> Time {
        self.deadline
    }

    pub(super) const fn target(&self) -> Counts {
        Counts(self.target)
    }

    /// Whether its target is on the bus.
    pub(super) const fn has_announced(&self) -> bool {
        match self.phase {
            MovePhase::Preparing | MovePhase::AwaitingMode | MovePhase::Releasing => false,
            MovePhase::Announcing
            | MovePhase::Raising
            | MovePhase::Lowering
            | MovePhase::Running => true,
        }
    }

    const fn awaited(&self) -> &'static str {
        match self.phase {
            MovePhase::Preparing => "the move's parameters",
            MovePhase::AwaitingMode => "the mode profile position",
            MovePhase::Releasing => "an older set-point to be released",
            MovePhase::Announcing => "the target to be on its way",
            MovePhase::Raising => "the set-point to be acknowledged",
            MovePhase::Lowering => "the set-point to be released",
            MovePhase::Running => "the target to be reached",
        }
    }
}

impl<Q: Coordinate> Cia402Drive<Q> {
    /// Up to its end, or `only_prepared`.
    pub(super) fn begin_move(
        &mut self,
        now: Time,
        wanted: (Q, Q::Speed, Q::Acceleration),
        only_prepared: bool,
    ) {
        self.started_at = None;
        match self.plan_move(now, wanted, only_prepared) {
            Err(error) => self.finish(Err(error)),
            Ok(planned) if self.is_there(planned.target) => {
                self.finish(Ok(()));
                self.prepared = only_prepared.then_some(planned);
            }
            Ok(mut planned) => {
                if !only_prepared {
                    self.begin_cautiously(&mut planned);
                }
                let mut steps = Vec::new();
                if self.profile != Some(planned.profile) {
                    let (velocity, acceleration) = planned.profile;
                    steps.extend(profile_steps(velocity, acceleration));
                }
                // The display may lag behind: what was written last counts as well.
                let profile_position = Some(OperationMode::ProfilePosition);
                if self.mode() != profile_position || self.commanded_mode != profile_position {
                    steps.push(Step::write(
                        MODE,
                        OperationMode::ProfilePosition.raw(),
                        "choosing profile position",
                    ));
                }
                self.reached = None;
                if self.control.contains(Controlword::MODE_4) {
                    // Of a superseded move or homing: without a low level there is no new edge.
                    self.release_set_point(now);
                }
                self.activity = Activity::Move(planned);
                if steps.is_empty() {
                    self.move_prepared(now);
                } else {
                    // Until all is written the drive's values are neither old nor new.
                    self.profile = None;
                    self.commanded_mode = None;
                    self.node.run(now, steps);
                    self.pump(now);
                }
            }
        }
    }

    fn plan_move(
        &self,
        now: Time,
        (target, speed, acceleration): (Q, Q::Speed, Q::Acceleration),
        only_prepared: bool,
    ) -> Result<Move, DeviceError> {
        let settings = &self.settings;
        let object = TARGET_POSITION.object;
        let counts = position_counts(settings, object, "target", target)?;
        if self.on_the_wire(counts).is_none() {
            let beyond_the_last = counts > self.image.wrapped_away();
            let limit = settings
                .scale
                .to_coordinate(self.register_end(beyond_the_last));
            let range = (target.value(), limit.value());
            return Err(out_of_range(settings, object, "target", range, Q::UNIT));
        }
        self.check_armed_speed(speed)?;
        if let Some((low, high)) = settings.soft_limits {
            let limit = if target < low { low } else { high };
            if target < low || target > high {
                let range = (target.value(), limit.value());
                return Err(out_of_range(settings, object, "target", range, Q::UNIT));
            }
        }
        let profile = (
            velocity_counts(settings, PROFILE_VELOCITY, speed)?,
            acceleration_counts(settings, PROFILE_ACCELERATION, acceleration)?,
        );
        Ok(Move {
            target: counts,
            set_point: self.way_point(counts),
            only_prepared,
            profile,
            trial: None,
            phase: MovePhase::Preparing,
            since: now,
            // SDO has time-outs of its own.
            deadline: Time::NEVER,
            reached: 0,
        })
    }

    /// Where to send the drive now for it to come to `target` in the end. One that wraps takes
    /// the shortest way, so it must never have half a turn to go.
    pub(super) fn way_point(&self, target: i64) -> i64 {
        let (Some(turn), Some(sample)) = (self.settings.wraps_at(), self.image.sample()) else {
            return target;
        };
        let reach = turn * 2 / 5;
        sample.position.0 + (target - sample.position.0).clamp(-reach, reach)
    }

    /// Whether the drive comes near to a point that is not the target: it must not begin to
    /// slow down there.
    fn nears_way_point(&self, target: i64, set_point: i64) -> bool {
        let (Some(turn), Some(sample)) = (self.settings.wraps_at(), self.image.sample()) else {
            return false;
        };
        set_point != target && (set_point - sample.position.0).abs() < turn / 5
    }

    /// Some drives ignore a target they stand at: there is nothing to do then.
    fn is_there(&self, target: i64) -> bool {
        self.reached == Some(target) && self.arrived_at(target)
    }

    fn arrived_at(&self, target: i64) -> bool {
        self.image.sample().is_some_and(|sample| {
            let away = (sample.position.0 - target).abs();
            sample.status.contains(Statusword::TARGET_REACHED)
                && away <= self.settings.tolerance_counts()
        })
    }

    fn enter(&mut self, now: Time, phase: MovePhase, patience: Duration) {
        if let Activity::Move(moving) = &mut self.activity {
            moving.phase = phase;
            moving.since = now;
            moving.deadline = now + patience;
        }
    }

    pub(super) fn move_prepared(&mut self, now: Time) {
        let Activity::Move(moving) = &self.activity else {
            return;
        };
        self.profile = Some(moving.profile);
        self.commanded_mode = Some(OperationMode::ProfilePosition);
        self.enter(now, MovePhase::AwaitingMode, self.settings.timeouts.mode);
        self.advance_move(now);
    }

    pub(super) fn advance_move(&mut self, now: Time) {
        let Some(sample) = self.image.sample().copied() else {
            return;
        };
        let Activity::Move(moving) = &self.activity else {
            return;
        };
        let (phase, set_point) = (moving.phase, moving.set_point);
        let target = moving.target;
        let patience = self.settings.timeouts.set_point;
        let acknowledged = sample.status.contains(Statusword::MODE_12);
        let in_mode = sample.mode == OperationMode::ProfilePosition;
        match phase {
            MovePhase::Preparing => {}
            MovePhase::AwaitingMode => {
                if in_mode {
                    self.enter(now, MovePhase::Releasing, patience);
                    self.advance_move(now);
                }
            }
            // A mode that comes late: its bits 4 and 12 mean something else.
            MovePhase::Releasing
            | MovePhase::Announcing
            | MovePhase::Raising
            | MovePhase::Lowering
                if !in_mode =>
            {
                self.release_set_point(now);
                self.enter(now, MovePhase::AwaitingMode, self.settings.timeouts.mode);
            }
            MovePhase::Releasing if acknowledged || !self.low_level_was_seen(now) => {
                if self.repeat_at == Time::NEVER {
                    self.release_set_point(now);
                }
            }
            MovePhase::Releasing => {
                self.enter(now, MovePhase::Announcing, patience);
                self.announce(now, set_point);
                self.advance_move(now);
            }
            MovePhase::Announcing => {
                if self.target_was_seen(now) {
                    self.end_announcing(now);
                }
            }
            MovePhase::Raising => {
                if acknowledged {
                    self.started_at = Some(now);
                    self.enter(now, MovePhase::Lowering, patience);
                    self.release_set_point(now);
                }
            }
            MovePhase::Lowering => {
                if !acknowledged {
                    self.set_off(now, set_point);
                }
            }
            MovePhase::Running if moving.trial.is_some() => {
                self.follow_tried_move(now);
                self.watch_arrival(target, acknowledged);
            }
            MovePhase::Running if self.nears_way_point(target, set_point) => {
                self.go_on(now, target);
            }
            MovePhase::Running => self.watch_arrival(target, acknowledged),
        }
    }

    /// Goes on with another profile, on the fly.
    pub(super) fn go_on_as(&mut self, now: Time, mut planned: Move) {
        let (velocity, acceleration) = planned.profile;
        self.profile = None;
        (planned.phase, planned.since) = (MovePhase::Preparing, now);
        planned.deadline = Time::NEVER;
        self.activity = Activity::Move(planned);
        self.node.run(now, profile_steps(velocity, acceleration));
        self.pump(now);
    }

    /// The next set-point on a long way, on the fly.
    fn go_on(&mut self, now: Time, target: i64) {
        let set_point = self.way_point(target);
        if let Activity::Move(moving) = &mut self.activity {
            moving.set_point = set_point;
        }
        self.enter(now, MovePhase::Releasing, self.settings.timeouts.set_point);
        self.advance_move(now);
    }

    /// Begins what was prepared: only the edge is missing.
    pub(super) fn begin_prepared(&mut self, now: Time, prepared: Move) {
        if self.is_there(prepared.target) {
            self.finish(Ok(()));
            return;
        }
        let ready = self.image.sample().is_some_and(|sample| {
            sample.mode == OperationMode::ProfilePosition
                && !sample.status.contains(Statusword::MODE_12)
        });
        let target = self.on_the_wire(prepared.set_point);
        if !ready || target != Some(self.target) || self.sent_target != target {
            self.refuse(
                "starting",
                "a drive whose mode and set-point have not changed since the move was prepared",
            );
            return;
        }
        self.reached = None;
        self.activity = Activity::Move(Move {
            only_prepared: false,
            ..prepared
        });
        self.raise_set_point(now);
    }

    /// Sends `set_point` without its edge: nothing moves.
    pub(super) fn announce(&mut self, now: Time, set_point: i64) {
        let target = self.on_the_wire(set_point).unwrap_or(self.target);
        if self.target != target || self.sent_target != Some(target) {
            self.target = target;
            self.release_set_point(now);
        }
    }

    /// A drive that looks at its frames once a cycle must have the target before the edge.
    pub(super) fn target_was_seen(&self, now: Time) -> bool {
        now.since(self.target_at) >= self.settings.common.sync_period
    }

    fn end_announcing(&mut self, now: Time) {
        let Activity::Move(moving) = &self.activity else {
            return;
        };
        if !moving.only_prepared {
            self.raise_set_point(now);
            return;
        }
        let prepared = *moving;
        self.finish(Ok(()));
        self.prepared = Some(prepared);
    }

    fn raise_set_point(&mut self, now: Time) {
        let Activity::Move(moving) = &mut self.activity else {
            return;
        };
        let (target, profile) = (moving.target, moving.profile);
        if let Some(here) = self.image.here() {
            let mut profile = Profile::written(profile.0, profile.1);
            if let Some((trial, _)) = &mut moving.trial {
                trial.begin(here);
                profile = trial.profile();
            }
            self.envelope.begin_motion(here, target, profile);
        }
        self.open_target = true;
        let patience = self.settings.timeouts.set_point;
        self.enter(now, MovePhase::Raising, patience);
        self.send_edge(now);
    }

    /// The edge of a new set-point. Under HALT the drive only takes the target.
    pub(super) fn send_edge(&mut self, now: Time) {
        let held = self.control & Controlword::HALT;
        let new = Controlword::MODE_4 | Controlword::MODE_5;
        self.send_control(now, Controlword::ENABLE_COMMAND | held | new);
    }

    /// Takes the set-point bit back. Halt stays: an older target must not be resumed.
    pub(super) fn release_set_point(&mut self, now: Time) {
        let held = self.control & Controlword::HALT;
        self.send_control(now, Controlword::ENABLE_COMMAND | held);
    }

    /// The drive has its new target: HALT goes, if there was one.
    fn set_off(&mut self, now: Time, set_point: i64) {
        let time = self.travel_time(set_point);
        self.enter(now, MovePhase::Running, time);
        self.repeat_at = Time::NEVER;
        if self.control.contains(Controlword::HALT) {
            self.started_at = Some(now);
            self.send_control(now, Controlword::ENABLE_COMMAND);
            self.repeat_at = Time::NEVER;
        }
    }

    /// A drive that looks at the controlword once a cycle must have seen the bit low.
    pub(super) fn low_level_was_seen(&self, now: Time) -> bool {
        now.since(self.lowered_at) >= self.settings.common.sync_period * 2
    }

    fn watch_arrival(&mut self, target: i64, acknowledged: bool) {
        let there = !acknowledged && self.arrived_at(target);
        let Activity::Move(moving) = &mut self.activity else {
            return;
        };
        moving.reached = if there { moving.reached + 1 } else { 0 };
        if moving.reached >= REACHED_SAMPLES {
            self.arrive(target);
        }
    }

    /// Half as much again as a trapezoidal profile takes, and the settling.
    fn travel_time(&self, set_point: i64) -> Duration {
        let Activity::Move(moving) = &self.activity else {
            return Duration::ZERO;
        };
        let from = self.image.sample().map_or(0, |sample| sample.position.0);
        let way = (set_point - from).unsigned_abs() as f64;
        let (velocity, acceleration) = moving.profile;
        let (velocity, acceleration) = (f64::from(velocity), f64::from(acceleration));
        // A superseded move may first have to come back from the other direction.
        let profile_s = way / velocity + 3.0 * velocity / acceleration;
        let profile = Duration::try_from_secs_f64(profile_s * 1.5).unwrap_or(Duration::MAX);
        profile.saturating_add(self.settings.timeouts.settling)
    }

    pub(super) fn move_timeout(&mut self, now: Time) {
        let Activity::Move(moving) = &self.activity else {
            return;
        };
        if now < moving.deadline {
            return;
        }
        let (phase, target) = (moving.phase, moving.target);
        let (since, awaited) = (moving.since, moving.awaited());
        if phase == MovePhase::Raising {
            self.send_control(now, Controlword::ENABLE_COMMAND);
            if self.arrived_at(target) {
                self.arrive(target);
                return;
            }
        }
        let seen = match (phase, self.image.sample()) {
            (MovePhase::Running, Some(sample)) => {
                Seen::Position(self.settings.scale.to_coordinate(sample.position).into())
            }
            (MovePhase::AwaitingMode, Some(sample)) => Seen::Mode(sample.mode.raw()),
            (
                MovePhase::Preparing
                | MovePhase::AwaitingMode
                | MovePhase::Releasing
                | MovePhase::Announcing
                | MovePhase::Raising
                | MovePhase::Lowering
                | MovePhase::Running,
                _,
            ) => self.seen_status(),
        };
        if self.open_target {
            self.hold_back(now);
        }
        self.time_out(now, since, awaited, seen);
    }

    /// The axis is at its target: nothing is left to go to.
    fn arrive(&mut self, target: i64) {
        self.reached = Some(target);
        self.open_target = false;
        self.envelope.hold(target);
        self.finish(Ok(()));
    }
}
