//! The trajectory generator: moves, aborts, homing.

use units::Time;
use wire::copley::{ErrorCode, HomingMethod, Parameter, Trajectory, TrajectoryStatus};

use super::{Amp, Stage};
use crate::node::profile::{MotionLimits, Profile};
use crate::plant::Plant;

/// Farther than any axis, in counts.
const FAR: f64 = 1e12;

/// Why the demand is what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::node::copley_amp) enum Motion {
    Standing,
    Move,
    /// It slows down, for an abort, a limit or a failed homing.
    Abort,
    /// Towards a limit switch: -1 the negative one, +1 the positive one.
    Homing(f64, HomingStep),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::node::copley_amp) enum HomingStep {
    /// Until the switch is pressed.
    Seek { to_index: bool },
    /// Slowing down on the switch.
    Stop { to_index: bool },
    /// Until it is released: that is home, or where the index pulse is searched.
    BackOff { to_index: bool },
    /// Until the next index pulse after this one (by number): that is home.
    Index { after: u64 },
    /// To the place of the edge.
    Return,
}

impl Amp {
    /// A trajectory command. Without power at the motor it is taken and has no effect: `ok` says
    /// only that the command was understood (p. 14).
    pub(super) fn obey(
        &mut self,
        now: Time,
        trajectory: Trajectory,
        plant: &mut Plant,
    ) -> Result<(), ErrorCode> {
        match trajectory {
            Trajectory::Abort => {
                if self.motion != Motion::Standing {
                    self.abort(now);
                }
                Ok(())
            }
            Trajectory::Move => self.begin_move(now),
            Trajectory::Home => self.begin_homing(now, plant),
        }
    }

    fn limits(&self, speed: Parameter) -> Result<MotionLimits, ErrorCode> {
        let limits = MotionLimits {
            velocity: self.ram(speed) as f64 / 10.0,
            acceleration: self.ram(Parameter::ACCELERATION) as f64 * 10.0,
            deceleration: self.ram(Parameter::DECELERATION) as f64 * 10.0,
        };
        let positive = |value: f64, code| if value > 0.0 { Ok(()) } else { Err(code) };
        positive(limits.velocity, ErrorCode::SpeedLimit)?;
        positive(limits.acceleration, ErrorCode::AccelerationLimit)?;
        positive(limits.deceleration, ErrorCode::DecelerationLimit)?;
        Ok(limits)
    }

    fn begin_move(&mut self, now: Time) -> Result<(), ErrorCode> {
        if let Motion::Homing(..) = self.motion {
            return Err(ErrorCode::MovingAlready);
        }
        let limits = self.limits(Parameter::SPEED)?;
        if self.stage != Stage::On || self.config.quirks.moves_not_begun {
            return Ok(());
        }
        let from = self.demand(now);
        let command = self.ram(Parameter::POSITION_COMMAND) as f64;
        let relative = self.ram(Parameter::PROFILE_TYPE) == 256;
        let target = if relative {
            from.position + command
        } else {
            command
        };
        self.profile = Profile::to_target(now, from, target, limits);
        self.motion = Motion::Move;
        self.trajectory.remove(TrajectoryStatus::ABORTED);
        self.trajectory.insert(TrajectoryStatus::RUNNING);
        self.settling = true;
        self.settled_since = None;
        self.moved_at = Some(now);
        Ok(())
    }

    /// Slows down with parameter 0xcf.
    pub(super) fn abort(&mut self, now: Time) {
        let deceleration = (self.ram(Parameter::ABORT_DECELERATION) as f64 * 10.0).max(1.0);
        if let Motion::Homing(..) = self.motion {
            self.trajectory.remove(TrajectoryStatus::HOMING);
            self.trajectory.insert(TrajectoryStatus::HOMING_ERROR);
        }
        self.profile = Profile::stopping(now, self.demand(now), deceleration);
        self.motion = Motion::Abort;
        self.trajectory.insert(TrajectoryStatus::ABORTED);
        self.look_now();
    }

    fn begin_homing(&mut self, now: Time, plant: &Plant) -> Result<(), ErrorCode> {
        if self.motion != Motion::Standing {
            return Err(ErrorCode::MovingAlready);
        }
        if self.stage != Stage::On {
            return Ok(());
        }
        self.trajectory
            .remove(TrajectoryStatus::REFERENCED | TrajectoryStatus::HOMING_ERROR);
        match HomingMethod::from_raw(self.ram(Parameter::HOMING_METHOD)) {
            HomingMethod::Here => self.set_home(now, self.position(plant)),
            HomingMethod::NegativeLimit => self.seek(now, -1.0, false, plant),
            HomingMethod::PositiveLimit => self.seek(now, 1.0, false, plant),
            HomingMethod::NegativeLimitToIndex => self.seek(now, -1.0, true, plant),
            HomingMethod::PositiveLimitToIndex => self.seek(now, 1.0, true, plant),
            HomingMethod::Unknown(_) => return Err(ErrorCode::OutOfRange),
        }
        Ok(())
    }

    fn seek(&mut self, now: Time, side: f64, to_index: bool, plant: &Plant) {
        self.trajectory.insert(TrajectoryStatus::HOMING);
        self.moved_at = Some(now);
        let step = if self.pressed(side, plant) {
            HomingStep::BackOff { to_index }
        } else {
            HomingStep::Seek { to_index }
        };
        self.enter(now, side, step);
    }

    /// Plans the motion of a step.
    fn enter(&mut self, now: Time, side: f64, step: HomingStep) {
        let from = self.demand(now);
        let acceleration = (self.ram(Parameter::HOMING_ACCELERATION) as f64 * 10.0).max(1.0);
        let towards = |target: f64, speed: i64| {
            let limits = MotionLimits {
                velocity: (speed as f64 / 10.0).max(1.0),
                acceleration,
                deceleration: acceleration,
            };
            Profile::to_target(now, from, target, limits)
        };
        let (fast, slow) = (
            self.ram(Parameter::HOMING_SPEED_FAST),
            self.ram(Parameter::HOMING_SPEED_SLOW),
        );
        self.profile = match step {
            HomingStep::Seek { .. } => towards(from.position + side * FAR, fast),
            HomingStep::BackOff { .. } | HomingStep::Index { .. } => {
                towards(from.position - side * FAR, slow)
            }
            HomingStep::Stop { .. } => Profile::stopping(now, from, acceleration),
            HomingStep::Return => towards(0.0, slow),
        };
        self.motion = Motion::Homing(side, step);
        self.trajectory.insert(TrajectoryStatus::RUNNING);
        self.settling = true;
        self.settled_since = None;
        self.look_now();
    }

    fn pressed(&self, side: f64, plant: &Plant) -> bool {
        let (negative, positive) = plant.limit_switches(self.config.axis);
        if side < 0.0 { negative } else { positive }
    }

    /// The coordinates move so that `position` becomes 0.
    fn set_home(&mut self, now: Time, position: i64) {
        self.offset -= position;
        self.profile = self.profile.clone().shifted(-(position as f64));
        self.trajectory.insert(TrajectoryStatus::REFERENCED);
        assert!(self.demand(now).position.is_finite());
    }

    /// What the demand's profile was for may be over.
    pub(super) fn proceed(&mut self, now: Time, plant: &mut Plant) {
        match self.motion {
            Motion::Standing => {}
            Motion::Move | Motion::Abort => {
                if self.motion == Motion::Move && self.is_limited(now, plant) {
                    self.abort(now);
                }
                if self.profile.is_done(now) {
                    self.stand(plant);
                }
            }
            Motion::Homing(side, step) => self.home_on(now, side, step, plant),
        }
    }

    fn stand(&mut self, plant: &mut Plant) {
        self.motion = Motion::Standing;
        self.trajectory.remove(TrajectoryStatus::RUNNING);
        if self.stage == Stage::Stopping {
            self.switch_off(plant);
        }
    }

    fn home_on(&mut self, now: Time, side: f64, step: HomingStep, plant: &mut Plant) {
        let pressed = self.pressed(side, plant);
        let opposite = self.pressed(-side, plant);
        match step {
            HomingStep::Seek { to_index } if pressed => {
                self.enter(now, side, HomingStep::Stop { to_index });
            }
            HomingStep::Stop { to_index } if self.profile.is_done(now) => {
                self.enter(now, side, HomingStep::BackOff { to_index });
            }
            HomingStep::BackOff { to_index: true } if !pressed => {
                let pulse = plant.index_pulse(self.config.axis);
                let after = pulse.map_or(0, |pulse| pulse.number);
                self.enter(now, side, HomingStep::Index { after });
            }
            HomingStep::BackOff { to_index: false } if !pressed => {
                self.found_home(now, side, self.position(plant));
            }
            HomingStep::Index { after } if !opposite => {
                let pulse = plant.index_pulse(self.config.axis);
                if let Some(pulse) = pulse.filter(|pulse| pulse.number > after) {
                    self.found_home(now, side, pulse.count + self.offset);
                }
            }
            HomingStep::Return if self.profile.is_done(now) => {
                self.trajectory.remove(TrajectoryStatus::HOMING);
                self.trajectory.insert(TrajectoryStatus::REFERENCED);
                self.stand(plant);
            }
            HomingStep::Seek { .. } | HomingStep::Index { .. } if opposite => self.abort(now),
            HomingStep::Seek { .. }
            | HomingStep::Stop { .. }
            | HomingStep::BackOff { .. }
            | HomingStep::Index { .. }
            | HomingStep::Return => {}
        }
    }

    fn found_home(&mut self, now: Time, side: f64, position: i64) {
        self.set_home(now, position);
        // Referenced, but not home before it stands there.
        self.trajectory.remove(TrajectoryStatus::REFERENCED);
        self.enter(now, side, HomingStep::Return);
    }

    /// Whether the motion would go on into a switch, or beyond a software limit.
    fn is_limited(&self, now: Time, plant: &Plant) -> bool {
        let velocity = self.demand(now).velocity;
        let (negative, positive) = self.soft_limits_hit(now, plant);
        (velocity < 0.0 && (self.pressed(-1.0, plant) || negative))
            || (velocity > 0.0 && (self.pressed(1.0, plant) || positive))
    }
}
